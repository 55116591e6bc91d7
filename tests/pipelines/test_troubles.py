"""What goes wrong stays where it is: kills between files, one bad partition, edits during a run, lost files."""

import json
import os
import shutil

import pyarrow.parquet as pq
import pytest

from assets.formats import bvh
from kernels.synthetic.dancer import take
from pipelines import build as building
from pipelines.collection import freshness
from pipelines.commands.dance_songs import dance_songs
from pipelines.commands.status import studio_status
from pipelines.definitions import build_definitions
from pipelines.resources import NoProgress
from pipelines.studio.files import LakeError, StudioError
from pipelines.studio.folder import StudioFolder


def states(root):
    return {f.state for f in freshness(StudioFolder(root)).findings(["capture", "motion", "music", "catalog"])}


def test_kill_between_the_tables_of_a_capture(studio, build):
    """Poses of the new file stored, skeleton and clip of the old one: the clip is read again, not carried."""
    lake = studio / "lake"
    old = {name: (lake / name / "ayame.parquet").read_bytes() for name in ("clip", "skeleton")}
    changed = take("step", n_beats=6, interval_s=0.5)
    (studio / "clips" / "ayame" / "step.bvh").write_bytes(bvh.format(changed.clip))
    assert build(studio).status == 0
    for name, data in old.items():
        (lake / name / "ayame.parquet").write_bytes(data)
    assert build(studio).status == 0
    row = next(r for r in pq.read_table(lake / "clip" / "ayame.parquet").to_pylist() if r["clip_id"] == "ayame-step")
    poses = pq.read_table(lake / "pose" / "ayame.parquet", columns=["clip_id"]).to_pydict()["clip_id"]
    assert row["frame_count"] == changed.clip.n_frames == poses.count("ayame-step")
    assert states(studio) == {"fresh"}


@pytest.fixture
def failing_session(monkeypatch):
    """Make the motion beats of one session fail."""
    from assets import motion

    real = motion.session_beats

    def plot(table, clips):
        if "kaede" in clips["session"].to_pylist():
            raise RuntimeError("the plotter broke")
        return real(table, clips)

    monkeypatch.setattr(motion, "session_beats", plot)


def test_one_failing_session_stops_no_other(fresh_studio, build, failing_session):
    outcome = build(fresh_studio)
    assert outcome.status == 1
    assert [t for t in outcome.troubles if "[kaede]" in t and "the plotter broke" in t]
    state = freshness(StudioFolder(fresh_studio))
    assert state.state("motion_beat", "kaede").state == "missing"
    assert state.state("motion_beat", "ayame").state == "fresh"
    assert state.state("music_beat", "beat").state == "fresh"
    assert pq.read_table(fresh_studio / "lake" / "motion_graph_node" / "all.parquet").num_rows > 0
    failed = [a for a in studio_status(fresh_studio).facts["assets"] if a["state"] == "failed"]
    assert ("motion_beat", "kaede") in {(a["asset"], a["partition"]) for a in failed}
    assert any("the plotter broke" in a["why"] for a in failed)
    danced = dance_songs(fresh_studio, ["beat"], method="graph", frame_rate_hz=None, out=None, progress=NoProgress)
    assert danced.facts["usdz"]


@pytest.mark.parametrize("line", ["octave = 3.7", "nudge_ms = nan"])
def test_a_brief_that_cannot_be_is_the_songs_own_trouble(studio, build, line):
    (studio / "songs" / "beat.brief.toml").write_text(f"[beats]\n{line}\n")
    outcome = build(studio)
    assert outcome.status == 1
    assert [t for t in outcome.troubles if t.startswith("refused: songs/beat.wav")]
    assert not outcome.facts["failed"]


def test_settings_edited_during_a_run_count_next_time(studio, monkeypatch):
    """The run computes with what it began with and says so; the next build makes it anew."""
    from assets import motion

    settings = studio / "odori.toml"
    settings.write_text("[motion_beat]\nmethod = 'fft'\ncomponent = 2\n")
    real = motion.motion_beats

    def edit(*arguments, **more):
        settings.write_text("[motion_beat]\nmethod = 'fft'\ncomponent = 3\n")
        return real(*arguments, **more)

    folder = StudioFolder(studio)
    monkeypatch.setattr(motion, "motion_beats", edit)
    batch = building.Batch("rebuild_motion", ("motion_beat", "motion_tempo"), ("ayame", "kaede"))
    assert building.execute(batch, build_definitions(folder).resolve_job_def, building.open_instance(folder)) == []
    assert freshness(folder).state("motion_beat", "ayame").state == "stale"
    settings.write_text("[motion_beat]\nmethod = 'fft'\ncomponent = 2\n")
    assert freshness(folder).state("motion_beat", "ayame").state == "fresh"


def test_lost_stages_are_made_again(studio):
    stage = studio / "dances" / "beat" / "graph.usdz"
    before = stage.read_bytes()
    stage.unlink()
    finding = freshness(StudioFolder(studio)).state("usd_animation", "beat|graph")
    assert (finding.state, finding.why) == ("stale", "graph.usdz is not there any more")
    outcome = dance_songs(studio, ["beat"], method="graph", frame_rate_hz=None, out=None, progress=NoProgress)
    assert outcome.status == 0
    assert stage.read_bytes() == before


def test_damaged_pages_are_named(studio):
    path = studio / "lake" / "motion_beat" / "ayame.parquet"
    data = bytearray(path.read_bytes())
    data[8:200] = bytes(192)
    path.write_bytes(bytes(data))
    with pytest.raises(LakeError, match=r"ayame\.parquet: .*delete the file"):
        StudioFolder(studio).lake.table("motion_beat", "ayame")


def test_a_link_to_itself_and_a_pipe_stop_nothing(fresh_studio, build):
    (fresh_studio / "clips" / "ayame" / "loop.bvh").symlink_to("loop.bvh")
    os.mkfifo(fresh_studio / "clips" / "ayame" / "pipe.bvh")
    outcome = build(fresh_studio)
    assert outcome.status == 0
    assert outcome.facts["clips"]["read"] == 5


def test_unreadable_file_is_refused_and_read_when_it_can_be(fresh_studio, build, monkeypatch):
    from assets.formats import tree

    real = tree.sha256

    def refuse(path):
        if path.name == "wave.bvh":
            raise PermissionError(13, "Permission denied")
        return real(path)

    monkeypatch.setattr(tree, "sha256", refuse)
    outcome = build(fresh_studio)
    assert outcome.status == 1
    assert outcome.facts["refused"][0]["path"] == "clips/ayame/wave.bvh"
    assert "Permission denied" in outcome.facts["refused"][0]["reason"]
    monkeypatch.setattr(tree, "sha256", real)
    assert build(fresh_studio).status == 0


def test_one_home_of_dagster_for_each_studio(studio, tmp_path, monkeypatch, build):
    other = shutil.copytree(studio, tmp_path / "other")
    monkeypatch.setenv("DAGSTER_HOME", str(tmp_path / "home"))
    assert build(studio).status == 0
    with pytest.raises(StudioError, match="a folder of its own for each studio"):
        build(other)


def test_the_tracker_that_was_asked_for_is_used(studio, build):
    before = pq.read_table(studio / "lake" / "music_tempo" / "beat.parquet").num_rows
    (studio / "odori.toml").write_text('[music_beat]\ntracker = "librosa"\n')
    assert build(studio).status == 0
    assert before > 0
    assert pq.read_table(studio / "lake" / "music_tempo" / "beat.parquet").num_rows == 0


def test_status_tells_machines_what_failed(studio):
    facts = studio_status(studio).facts
    assert json.loads(json.dumps(facts)) == facts
    assert {a["state"] for a in facts["assets"]} == {"fresh"}
