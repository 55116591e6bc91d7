"""What a person types and sees, and what a machine reads."""

import gc
import hashlib
import itertools
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from assets.formats import usd_check, usd_package, usd_read
from assets.tables.pack import to_array
from pipelines.collection import ASSETS
from pipelines.commands import dance_report
from pipelines.commands.dance_songs import dance_songs
from pipelines.freshness import ON_DEMAND, nodes
from pipelines.resources import NoProgress
from pipelines.studio.files import StudioError
from schemas.catalog import TABLES


def odori(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "pipelines.cli", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        **options,
    )


def dance(root, *songs, fps=None, out=None):
    return dance_songs(root, songs or ["beat"], method="graph", frame_rate_hz=fps, out=out, progress=NoProgress)


def test_dance_of_the_small_studio(built):
    folder = built / "dances" / "beat"
    assert {p.name for p in folder.iterdir()} == {"graph.json", "graph.usdc", "graph.usdz", "song.wav"}
    report = json.loads((folder / "graph.json").read_text())
    quality = report["quality"]
    assert quality["beat_lag_ms"] <= 500 / 30
    assert quality["beat_f_ratio"] > 0.8
    assert quality["beat_p_probability"] < 0.01
    assert quality["warp_easy_ratio"] >= 0.95
    assert quality["penetration_cm"] <= 1.0
    assert {c["licence"] for c in report["provenance"]["clips"]} == {"CC0-1.0"}
    digest = hashlib.sha256((built / "songs" / "beat.wav").read_bytes()).hexdigest()
    assert report["provenance"]["song"] == {"path": "songs/beat.wav", "sha256": digest}


def test_a_copy_to_where_the_stage_is_already_leaves_it(built, tmp_path):
    """By another spelling, or another name of the same file: where capitals do not count both are one."""
    stage = tmp_path / "graph.usdz"
    stage.write_bytes((built / "dances" / "beat" / "graph.usdz").read_bytes())
    before = stage.stat().st_ino
    other = tmp_path / "Other.usdz"
    other.hardlink_to(stage)
    dance_report.copy_out({"usdz": str(stage)}, other)
    assert (stage.stat().st_ino, other.stat().st_ino) == (before, before)
    dance_report.copy_out({"usdz": str(stage)}, tmp_path / "new.usdz")
    assert (tmp_path / "new.usdz").read_bytes() == stage.read_bytes()


def test_stage_holds_the_dance_of_the_lake(built):
    clip = usd_read.read_animation(built / "dances" / "beat" / "graph.usdz")
    pose = pq.read_table(built / "lake" / "dance_pose" / "beat|graph.parquet")
    assert clip.n_frames == pose.num_rows
    np.testing.assert_allclose(clip.root_xyz_m, to_array(pose["root_xyz_m"]), atol=1e-6)
    same = np.abs(np.sum(clip.rotation_wxyz * to_array(pose["rotation_wxyz"]), axis=-1))
    np.testing.assert_allclose(same, 1.0, atol=1e-6)


def test_whole_song_is_danced_and_every_frame_accounted_for(built):
    song = pq.read_table(built / "lake" / "song" / "beat.parquet").to_pylist()[0]
    line = pq.read_table(built / "lake" / "frame_lineage" / "beat|graph.parquet")
    assert line.num_rows == int(song["duration_s"] * 30 + 1e-6) + 1
    steps = pq.read_table(built / "lake" / "choreography" / "beat|graph.parquet").to_pylist()
    assert steps[0]["song_start_s"] == 0
    assert steps[-1]["song_end_s"] == pytest.approx(song["duration_s"])
    for before, after in itertools.pairwise(steps):
        continues = before["clip_id"] == after["clip_id"] and before["clip_end_s"] == pytest.approx(
            after["clip_start_s"]
        )
        assert after["has_seam"] == (not continues)
    assert set(line["clip_id"].to_pylist()) <= {s["clip_id"] for s in steps}


def test_every_table_is_stored_but_those_of_what_nobody_asked_for(matched):
    unused = {n.name for n in nodes(ASSETS).values() if n.group in ON_DEMAND or n.only_for == "hmm"}
    assert {"motion_index", "basic_motion"} <= unused
    assert {p.name for p in (matched / "lake").iterdir() if p.is_dir()} - {"request"} == set(TABLES) - unused


def test_dancing_again_changes_no_byte(studio):
    before = {p.name: p.read_bytes() for p in (studio / "dances" / "beat").iterdir()}
    for name in ("choreography", "dance_pose", "frame_lineage", "dance_quality", "usd_animation"):
        (studio / "lake" / name / "beat|graph.parquet").unlink()
    assert dance(studio).status == 0
    assert {p.name: p.read_bytes() for p in (studio / "dances" / "beat").iterdir()} == before


def test_frame_rate_and_copy(studio, tmp_path):
    out = tmp_path / "elsewhere" / "waltz.usdz"
    outcome = dance(studio, "beat.wav", fps=60.0, out=out)
    assert outcome.status == 0
    assert usd_read.read_animation(out).frame_rate_hz == 60.0
    assert out.read_bytes() == (studio / "dances" / "beat" / "graph.usdz").read_bytes()
    loose = tmp_path / "elsewhere" / "waltz.usdc"
    assert dance(studio, fps=60.0, out=loose).status == 0
    assert usd_read.read_animation(loose).frame_rate_hz == 60.0
    assert dance(studio).status == 0
    assert usd_read.read_animation(studio / "dances" / "beat" / "graph.usdz").frame_rate_hz == 30.0


def test_copies_share_a_folder_and_leave_what_is_the_users(studio, tmp_path):
    mine = tmp_path / "song.wav"
    mine.write_bytes(b"mine")
    song = (studio / "dances" / "beat" / "song.wav").read_bytes()
    for name in ("first", "second"):
        assert dance(studio, out=tmp_path / f"{name}.usdc").status == 0
        assert usd_check.check(tmp_path / f"{name}.usdc") == []
        assert usd_package.song_name(tmp_path / f"{name}.usdc") == f"{name}.wav"
        assert (tmp_path / f"{name}.wav").read_bytes() == song
    assert mine.read_bytes() == b"mine"
    assert dance(studio, out=tmp_path / "first.usdc").status == 0
    with pytest.raises(StudioError, match=r"got another file .*song\.wav; move it"):
        dance(studio, out=tmp_path / "song.usdc")
    assert sorted(p.name for p in tmp_path.iterdir() if p.is_file()) == [
        *("first.usdc", "first.wav", "second.usdc", "second.wav", "song.wav"),
    ]


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning", "error::ResourceWarning")
def test_a_copy_leaves_no_file_open(studio, tmp_path):
    for name in ("a.usdz", "b.usdc"):
        dance_report.copy_out(
            {"usdz": studio / "dances/beat/graph.usdz", "stage": studio / "dances/beat/graph.usdc"}, tmp_path / name
        )
    gc.collect()


@pytest.mark.parametrize("name", ["beat", "beat.wav", "songs/beat.wav"])
def test_a_song_goes_by_key_file_and_path(studio, name):
    assert dance(studio, name).facts["song"] == "beat"


def test_json_is_one_object_and_may_stand_last(built):
    done = odori("dance", "beat", "--studio", built, "--json")
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert set(facts) >= {"stage", "usdz", "quality", "pins"}
    assert Path(facts["usdz"]).is_file()
    assert facts["pins"] == []


def test_check_of_a_good_a_damaged_and_a_missing_stage(built, tmp_path):
    good = built / "dances" / "beat" / "graph.usdz"
    assert odori("check", good).returncode == 0
    half = tmp_path / "half.usdc"
    half.write_bytes((built / "dances" / "beat" / "graph.usdc").read_bytes()[:2000])
    done = odori("check", half, "--json")
    assert done.returncode == 1
    facts = json.loads(done.stdout)
    assert not facts["is_valid"]
    assert {"severity", "rule", "prim", "sentence"} == set(facts["findings"][0])
    for nothing in (tmp_path / "nowhere.usdz", tmp_path):
        done = odori("check", nothing)
        assert done.returncode == 2
        assert f"{nothing}: want a stage, got no such file" in done.stderr


@pytest.mark.parametrize("command", [[], ["build"], ["dance"], ["check"], ["status"], ["ui"], ["demo"]])
def test_help_has_an_example(command):
    done = odori(*command, "--help")
    assert done.returncode == 0
    assert not command or "odori " + command[0] in done.stdout


@pytest.mark.parametrize(
    "wrong",
    [["dance"], ["dnace"], ["dance", "x", "--fps", "0"], ["dance", "x", "--fps", "many"], ["build", "--nonsense"]],
)
def test_usage_errors_end_with_two(wrong):
    assert odori(*wrong).returncode == 2


def test_wrong_method_and_wrong_suffix(built):
    done = odori("dance", "beat", "--method", "ballet", "--studio", built)
    assert done.returncode == 2
    assert "want one of graph, matching, hmm, got 'ballet'" in done.stderr
    done = odori("dance", "beat", "--out", "x.fbx", "--studio", built)
    assert done.returncode == 2
    assert ".usdz or .usdc" in done.stderr


def test_plain_report_goes_to_standard_output_only(built):
    done = odori("build", "--studio", built)
    assert "5 clips and 1 songs read" in done.stdout
    assert done.stderr == ""
