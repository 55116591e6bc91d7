"""Every clip with its state, and which methods can dance it or why not."""

import json
import subprocess
import sys

import pytest

from pipelines.commands.list_clips import ClipFilter, list_clips
from pipelines.studio.files import StudioError


def listed(root, song=None, **wanted):
    found = list_clips(root, song, ClipFilter(**wanted))
    return {clip["clip_id"]: clip for clip in found.facts["clips"]}, found


def cut_off(root, *rows):
    """Say in clips.csv of ayame's folder what is cut off."""
    table = root / "clips" / "ayame" / "clips.csv"
    head, *said = table.read_text().splitlines()
    ends = dict(rows)
    lines = [f"{head},start_s,end_s", *(f"{line},{ends.get(line.partition('.')[0], ',')}" for line in said)]
    table.write_text("\n".join(lines))


def test_a_machine_reads_every_clip_with_what_it_can_be_danced_by(built):
    done = subprocess.run(
        [sys.executable, "-m", "pipelines.cli", "clips", "--json"],
        capture_output=True,
        text=True,
        check=False,
        env={"ODORI_STUDIO": str(built), "PATH": "/usr/bin:/bin"},
    )
    assert done.returncode == 0, done.stderr
    clips = json.loads(done.stdout)["clips"]
    assert [clip["clip_id"] for clip in clips] == [
        "ayame-step", "ayame-twist", "ayame-wave", "kaede-kick", "kaede-rock",
    ]  # fmt: skip
    assert {(clip["label"], clip["style"], clip["state"]) for clip in clips} == {
        (clip["clip_id"].partition("-")[2], "made up", "read") for clip in clips
    }
    assert all(clip["danceable"]["graph"] and clip["danceable"]["matching"] for clip in clips)
    assert all("--method hmm" in clip["why_not"]["hmm"] for clip in clips)
    assert all(clip["faults"] == [] and clip["reason"] is None for clip in clips)


def test_before_the_first_build_nothing_can_be_danced_and_it_is_said_why(fresh_studio):
    clips, found = listed(fresh_studio)
    assert {clip["state"] for clip in clips.values()} == {"new"}
    assert all(set(clip["why_not"]) == {"graph", "matching", "hmm"} for clip in clips.values())
    for name in ("graph", "matching", "hmm"):
        told = f"not by {name}, none of them: the catalogue is not built with it; run 'odori build'"
        assert found.report.count(told) == 1


def test_what_is_cut_off_is_listed_and_the_rest_is_danced(studio, build):
    cut_off(studio, ("wave", "1.0,"), ("twist", ",0.02"))
    (studio / "clips" / "kaede" / "broken.bvh").write_text("HIERARCHY nonsense")
    assert build(studio).status == 1
    clips, found = listed(studio)
    assert found.status == 1
    assert {f["fault_kind"] for f in clips["ayame-wave"]["faults"]} == {"trimmed"}
    assert clips["ayame-wave"]["faults"][0]["start_s"] == 0.0
    assert clips["ayame-wave"]["faults"][0]["end_s"] == pytest.approx(1.0, abs=0.04)
    assert 0 < clips["ayame-wave"]["danceability_ratio"] < 1
    assert clips["ayame-twist"]["state"] == "refused"
    assert "start_s and end_s leave nothing" in clips["ayame-twist"]["reason"]
    assert clips["kaede-broken"]["why_not"]["matching"].startswith("it was refused: line 1")
    assert set(listed(studio, state=["fenced"])[0]) == {"ayame-wave"}
    assert set(listed(studio, state=["refused"])[0]) == {"ayame-twist", "kaede-broken"}
    assert "fenced: trimmed at 0.00 s: cut off by clips.csv" in found.report


def test_filters_add_up(built):
    assert set(listed(built, label=["step", "kick"])[0]) == {"ayame-step", "kaede-kick"}
    assert set(listed(built, label=["step", "kick"], method="hmm")[0]) == set()
    assert set(listed(built, label=["step"], not_method="hmm")[0]) == {"ayame-step"}
    assert listed(built, style=["calm"])[0] == {}


def test_for_a_song_its_licences_and_its_tempo_count(studio):
    (studio / "songs" / "beat.brief.toml").write_text('allow = ["CC-BY-4.0"]\n')
    clips, found = listed(studio, song="beat.wav")
    assert found.facts["song"] == "beat"
    assert set(clips["kaede-kick"]["why_not"]) == {"graph", "matching", "hmm"}
    assert clips["kaede-kick"]["why_not"]["graph"] == ("its licence, CC0-1.0, is none that the brief of beat allows")


def test_a_state_or_a_method_that_is_none_is_named(built):
    with pytest.raises(StudioError, match=r"--state: want one of read, .*fenced.*, got 'broken'"):
        ClipFilter(state=["broken"])
    with pytest.raises(StudioError, match="--not-method: want one of graph, matching, hmm, got 'magic'"):
        ClipFilter(not_method="magic")
    with pytest.raises(StudioError, match="beet: want a song of this studio"):
        listed(built, song="beet")
