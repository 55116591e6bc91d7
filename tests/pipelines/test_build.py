"""Bringing a studio up to date: what runs, what is carried over, what survives a kill."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import dagster as dg
import pyarrow.parquet as pq
import pytest

from assets.formats.file_names import WINDOWS
from kernels.opencl.choice import pick_device
from pipelines import build as building
from pipelines.collection import freshness
from pipelines.definitions import build_definitions
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder


def ran(outcome):
    return {asset for batch in outcome.facts["ran"] for asset in batch["assets"]}


def lake_bytes(root):
    return {str(p.relative_to(root)): p.read_bytes() for p in sorted((root / "lake").rglob("*.parquet"))}


def metadata(root, asset, key):
    """What Dagster keeps of the last materialisation of a partition."""
    instance = building.open_instance(StudioFolder(root))
    records = instance.fetch_materializations(
        dg.AssetRecordsFilter(asset_key=dg.AssetKey(asset), asset_partitions=[key] if key else None), limit=1
    ).records
    return {name: value.value for name, value in records[0].asset_materialization.metadata.items()}


def test_first_build_makes_everything_and_says_so(fresh_studio, build):
    outcome = build(fresh_studio)
    assert outcome.status == 0
    assert outcome.facts["clips"] == {"read": 5, "refused": 0, "new": 0, "changed": 0}
    assert outcome.facts["songs"]["read"] == 1
    assert {"clip", "pose", "canonical_pose", "motion_beat", "music_beat", "motion_graph_edge"} <= ran(outcome)
    assert "usd_animation" not in ran(outcome)
    assert metadata(fresh_studio, "clip", "ayame")["computed_clips"] == 3
    device = pick_device()
    assert device.name.strip() in metadata(fresh_studio, "motion_graph_node", "")["device"]


def test_unchanged_studio_runs_nothing(studio, build):
    before = lake_bytes(studio)
    outcome = build(studio, dances=True)
    assert outcome.facts["ran"] == []
    assert lake_bytes(studio) == before


def test_building_anew_gives_the_same_bytes(built, fresh_studio, build):
    build(fresh_studio)
    again = lake_bytes(fresh_studio)
    first = lake_bytes(built)
    assert again == {path: first[path] for path in again}


def test_one_changed_clip_runs_its_session_and_the_catalogue_and_computes_one_clip(studio, build):
    clip = studio / "clips" / "ayame" / "step.bvh"
    clip.write_bytes(clip.read_bytes().replace(b"Frames: ", b"Frames:  "))
    outcome = build(studio)
    made = {(asset, key) for batch in outcome.facts["ran"] for asset in batch["assets"] for key in batch["partitions"]}
    assert {key for asset, key in made if asset in ("clip", "pose", "canonical_pose", "motion_beat")} == {"ayame"}
    assert "music_beat" not in ran(outcome)
    found = metadata(studio, "clip", "ayame")
    assert (found["computed_clips"], found["carried_clips"]) == (1, 2)


def test_changed_motion_reaches_the_catalogue(studio, build):
    for name in ("step", "twist"):
        shutil.copy(studio / "clips" / "ayame" / "wave.bvh", studio / "clips" / "ayame" / f"{name}.bvh")
    outcome = build(studio)
    assert "motion_graph_node" in ran(outcome)
    found = metadata(studio, "canonical_pose", "ayame")
    assert (found["computed_clips"], found["carried_clips"]) == (2, 1)


def test_the_graph_computes_the_row_and_column_of_a_changed_clip_and_equals_a_full_rebuild(studio, build):
    clips = studio / "clips" / "ayame"
    shutil.copy(clips / "wave.bvh", clips / "step.bvh")
    build(studio)
    found = metadata(studio, "motion_graph_node", "")
    nodes = pq.read_table(studio / "lake" / "motion_graph_node" / "all.parquet")
    rows = nodes["clip_id"].to_pylist().count("ayame-step")
    assert found["computed_clips"] == 1
    assert found["computed_rows"] == rows
    assert found["rows_searched_again"] == 0
    assert found["computed_distances"] == 2 * rows * nodes.num_rows
    tables = [studio / "lake" / f"motion_graph_{what}" / "all.parquet" for what in ("node", "edge")]
    updated = [path.read_bytes() for path in tables]
    (studio / "lake" / "motion_graph.npz").write_bytes(b"damaged")
    for path in tables:
        path.unlink()
    build(studio)
    assert metadata(studio, "motion_graph_node", "")["computed_rows"] == nodes.num_rows
    assert [path.read_bytes() for path in tables] == updated


def test_touching_without_changing_runs_nothing(studio, build):
    for clip in studio.rglob("*.bvh"):
        os.utime(clip)
    assert build(studio).facts["ran"] == []


def test_relabelled_clip_is_not_read_again(studio, build):
    table = studio / "clips" / "ayame" / "clips.csv"
    table.write_text(table.read_text().replace("wave.bvh,wave", "wave.bvh,greeting"))
    build(studio)
    rows = pq.read_table(studio / "lake" / "clip" / "ayame.parquet").to_pylist()
    assert {r["label"] for r in rows} == {"step", "twist", "greeting"}
    assert metadata(studio, "clip", "ayame")["computed_clips"] == 0


def test_removed_clip_and_session_are_forgotten(studio, build):
    (studio / "clips" / "ayame" / "wave.bvh").unlink()
    shutil.rmtree(studio / "clips" / "kaede")
    build(studio)
    poses = pq.read_table(studio / "lake" / "canonical_pose" / "ayame.parquet")
    assert set(poses["clip_id"].to_pylist()) == {"ayame-step", "ayame-twist"}
    assert not (studio / "lake" / "pose" / "kaede.parquet").exists()
    nodes = pq.read_table(studio / "lake" / "motion_graph_node" / "all.parquet")
    assert set(nodes["clip_id"].to_pylist()) <= {"ayame-step", "ayame-twist"}
    instance = building.open_instance(StudioFolder(studio))
    assert instance.get_dynamic_partitions("session") == ["ayame"]


def test_new_session_leaves_the_others_alone(studio, build):
    shutil.copytree(studio / "clips" / "kaede", studio / "clips" / "midori")
    outcome = build(studio)
    sessions = {key for batch in outcome.facts["ran"] if "clip" in batch["assets"] for key in batch["partitions"]}
    assert sessions == {"midori"}


def test_changed_setting_makes_stale_what_reads_it(studio, build):
    (studio / "odori.toml").write_text("[motion_beat]\nmethod = 'fft'\n")
    outcome = build(studio)
    assert {"motion_beat", "motion_graph_node"} <= ran(outcome)
    assert not {"clip", "canonical_pose", "music_beat"} & ran(outcome)


def test_brief_changes_the_beats(studio, build):
    before = pq.read_table(studio / "lake" / "music_beat" / "beat.parquet").num_rows
    (studio / "songs" / "beat.brief.toml").write_text("[beats]\noctave = 0.5\n")
    assert "music_beat" in ran(build(studio))
    after = pq.read_table(studio / "lake" / "music_beat" / "beat.parquet").num_rows
    assert after == pytest.approx(before / 2, abs=1)


def test_dances_follow_the_catalogue_when_asked(studio, build):
    shutil.rmtree(studio / "clips" / "kaede")
    assert "usd_animation" not in ran(build(studio))
    assert {"choreography", "usd_animation"} <= ran(build(studio, dances=True))


def test_lost_partition_is_made_again_with_the_same_bytes(studio, build):
    place = studio / "lake" / "canonical_pose" / "ayame.parquet"
    before = place.read_bytes()
    place.unlink()
    # What follows it in its session runs along, every row carried over; the catalogue sees equal content.
    assert ran(build(studio)) == {"canonical_pose", "motion_beat", "motion_tempo", "motion_turn", "motion_feature"}
    assert metadata(studio, "motion_beat", "ayame")["computed_clips"] == 0
    assert place.read_bytes() == before


def test_damaged_partition_is_made_again(studio, build):
    place = studio / "lake" / "motion_beat" / "ayame.parquet"
    before = place.read_bytes()
    place.write_bytes(before[: len(before) // 2])
    assert "motion_beat" in ran(build(studio))
    assert place.read_bytes() == before


def test_many_sessions_run_as_one(fresh_studio, build):
    for i in range(4):
        shutil.copytree(fresh_studio / "clips" / "kaede", fresh_studio / "clips" / f"take_{i}")
    outcome = build(fresh_studio)
    batches = [b["partitions"] for b in outcome.facts["ran"] if "clip" in b["assets"]]
    assert batches == [["ayame", "kaede", "take_0", "take_1", "take_2", "take_3"]]


def test_two_builds_do_not_share_a_studio(studio):
    folder = StudioFolder(studio)
    with building.exclusive(folder), pytest.raises(StudioError, match="another odori"), building.exclusive(folder):
        pass


@pytest.mark.slow
def test_killed_build_is_finished_by_the_next_one(fresh_studio, built, build):
    for i in range(6):
        shutil.copytree(fresh_studio / "clips" / "ayame", fresh_studio / "clips" / f"more_{i}")
    process = subprocess.Popen(
        [sys.executable, "-m", "pipelines.cli", "build", "--studio", str(fresh_studio)],
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 120
    while not list((fresh_studio / "lake").glob("pose/more_0.parquet")) and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    (fresh_studio / "lake" / "pose" / ".tmp-left").write_bytes(b"half")
    (fresh_studio / "lake" / ".tmp-left").write_bytes(b"half")
    (fresh_studio / "dances" / "beat").mkdir(parents=True)
    (fresh_studio / "dances" / "beat" / ".tmp-left.usdc").write_bytes(b"half")
    assert build(fresh_studio).status == 0
    assert not list(fresh_studio.rglob(".tmp-*"))
    assert build(fresh_studio).facts["ran"] == []
    instance = building.open_instance(StudioFolder(fresh_studio))
    assert not instance.get_runs(dg.RunsFilter(statuses=[dg.DagsterRunStatus.STARTED]))
    for name in ("pose", "canonical_pose", "motion_beat"):
        path = Path("lake") / name / "ayame.parquet"
        assert (fresh_studio / path).read_bytes() == (built / path).read_bytes()


def test_freshness_says_why(studio):
    (studio / "odori.toml").write_text("[motion_beat]\ncomponent = 2\n")
    state = freshness(StudioFolder(studio))
    found = {(f.asset, f.key): f for f in state.findings()}
    assert found["motion_beat", "ayame"].state == "stale"
    assert "motion_beat" in found["motion_beat", "ayame"].why
    assert found["motion_graph_node", ""].state == "waiting"
    assert found["canonical_pose", "ayame"].state == "fresh"


def test_a_build_in_another_process_holds_the_studio_and_lets_go_when_it_is_killed(studio):
    code = (
        "import pathlib, sys, time; from pipelines import build; from pipelines.studio.folder import StudioFolder\n"
        "with build.exclusive(StudioFolder(pathlib.Path(sys.argv[1]))): print('held', flush=True); time.sleep(60)"
    )
    holder = subprocess.Popen([sys.executable, "-c", code, str(studio)], stdout=subprocess.PIPE)
    try:
        assert holder.stdout.readline().strip() == b"held"
        refused = pytest.raises(StudioError, match="another odori is building it; wait for it to finish")
        with refused, building.exclusive(StudioFolder(studio)):
            pass
    finally:
        holder.kill()
        holder.wait()
        holder.stdout.close()
    with building.exclusive(StudioFolder(studio)):
        pass


def test_a_folder_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / "lake").write_bytes(b"a file where a folder has to be")
    with pytest.raises(StudioError, match="cannot be written"), building.exclusive(StudioFolder(tmp_path)):
        pass


def test_runs_of_the_dead_are_ended_and_those_of_the_living_are_not(studio):
    instance = building.open_instance(StudioFolder(studio))
    job = build_definitions(StudioFolder(studio)).resolve_job_def("rebuild_catalog")
    pid, _, since = building.own_tags()[building.PID_TAG].partition(" ")
    assert int(pid) == os.getpid()
    tags = {
        "mine": f"{pid} {since}",
        "of another that had my number": f"{pid} {float(since) - 100:.2f}",
        "of the version before": f"{pid} 123456789",
        "nobody's": "4194305 5.00",
    }
    runs = {
        name: instance.create_run_for_job(job, status=dg.DagsterRunStatus.STARTED, tags={building.PID_TAG: tag})
        for name, tag in tags.items()
    }
    by_hand = instance.create_run_for_job(job, status=dg.DagsterRunStatus.STARTED)
    building.end_dead_runs(instance)
    ended = {name for name, run in runs.items() if instance.get_run_by_id(run.run_id).is_failure}
    assert ended == set(tags) - {"mine"}
    assert not instance.get_run_by_id(by_hand.run_id).is_failure
    building.end_dead_runs(instance, untagged=True)
    assert instance.get_run_by_id(by_hand.run_id).is_failure
    assert not instance.get_run_by_id(runs["mine"].run_id).is_failure


def windows_names(root):
    """Rename a lake's files to what Windows calls them."""
    for path in [*root.rglob("*|*")]:
        path.rename(path.with_name(path.name.replace("|", "%7C")))


def illegal_names(root):
    return [p for p in root.rglob("*") if set('<>:"|?*') & set(p.name) or p.name.endswith((".", " "))]


def test_a_studio_on_windows_is_fresh_danced_and_has_no_name_windows_refuses(studio):
    assert illegal_names(studio)
    windows_names(studio)
    folder = StudioFolder(studio, windows=True)
    assert not [f for f in freshness(folder).findings() if f.state != "fresh"]
    assert set(folder.requests()) == {"beat|graph"}
    for name in ("choreography", "usd_animation"):
        folder.lake.remove(name, "beat|graph")
    report = building.bring_up_to_date(
        folder,
        build_definitions(folder).resolve_job_def,
        building.open_instance(folder),
        freshness(folder),
        groups=building.GROUPS,
    )
    assert {asset for batch in report.ran for asset in batch.assets} >= {"choreography", "usd_animation"}
    assert report.failed == []
    assert illegal_names(studio) == []
    assert (studio / "lake" / "choreography" / "beat%7Cgraph.parquet").is_file()
    folder.remember("beat|graph", None)
    assert folder.requests() == {}


@pytest.mark.skipif(WINDOWS, reason="there no name with a bar can be")
def test_a_studio_that_comes_from_windows_is_fresh_here(studio, build):
    before = {p.relative_to(studio): p.read_bytes() for p in studio.rglob("*|*")}
    windows_names(studio)
    assert build(studio, dances=True).facts["ran"] == []
    assert {p.relative_to(studio): p.read_bytes() for p in studio.rglob("*|*")} == before


def test_a_song_named_like_a_device_has_a_folder_windows_takes(tmp_path):
    assert StudioFolder(tmp_path, windows=True).dances_of("con") == tmp_path / "dances" / "con_"
    assert StudioFolder(tmp_path, windows=False).dances_of("con") == tmp_path / "dances" / "con"
    assert StudioFolder(tmp_path, windows=True).frozen().dances_of("con") == tmp_path / "dances" / "con_"


def test_stored_paths_have_slashes(built):
    rows = pq.read_table(built / "lake" / "usd_animation" / "beat|graph.parquet")
    assert sorted(rows["stage_path"].to_pylist()) == ["dances/beat/graph.usdc", "dances/beat/graph.usdz"]
