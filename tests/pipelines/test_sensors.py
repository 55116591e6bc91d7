"""Sensor and schedule: new, changed and removed files become partitions and runs, once."""

import shutil
import subprocess
import sys

import dagster as dg
import pytest

from pipelines import build as building
from pipelines.collection import freshness
from pipelines.definitions import build_definitions
from pipelines.schedules import nightly
from pipelines.sensors import source_sensor
from pipelines.studio.folder import StudioFolder


@pytest.fixture
def look():
    """Evaluate the sensor on a studio with its own instance: (instance, results)."""

    def evaluate(root):
        folder = StudioFolder(root)
        instance = building.open_instance(folder)
        context = dg.build_sensor_context(
            instance=instance, resources={"studio": folder}, definitions=build_definitions(folder)
        )
        return instance, list(source_sensor(context))

    return evaluate


def requests(results):
    return [r for r in results if isinstance(r, dg.RunRequest)]


def test_new_studio_asks_for_its_sessions_first(fresh_studio, look):
    instance, results = look(fresh_studio)
    (request,) = requests(results)
    assert request.job_name == "rebuild_motion"
    assert request.tags["dagster/asset_partition_range_start"] == "ayame"
    assert request.tags["dagster/asset_partition_range_end"] == "kaede"
    assert sorted(instance.get_dynamic_partitions("session")) == ["ayame", "kaede"]
    assert instance.get_dynamic_partitions("song") == ["beat"]


def test_nothing_to_do_is_a_skip(studio, look):
    _, results = look(studio)
    assert [type(r) for r in results] == [dg.SkipReason]


def test_changed_clip_asks_for_its_session_alone_and_only_once(studio, look):
    shutil.copy(studio / "clips" / "ayame" / "wave.bvh", studio / "clips" / "ayame" / "step.bvh")
    _, first = look(studio)
    _, second = look(studio)
    (request,) = requests(first)
    assert request.partition_key == "ayame"
    assert {a.to_user_string() for a in request.asset_selection} >= {"clip", "pose", "skeleton"}
    assert requests(second)[0].run_key == request.run_key
    clip = studio / "clips" / "ayame" / "step.bvh"
    clip.write_bytes(clip.read_bytes() + b"\n")
    _, third = look(studio)
    assert requests(third)[0].run_key != request.run_key


def test_removed_session_and_song_are_retired(studio, look):
    shutil.rmtree(studio / "clips" / "kaede")
    (studio / "songs" / "beat.wav").unlink()
    instance, results = look(studio)
    assert instance.get_dynamic_partitions("session") == ["ayame"]
    assert instance.get_dynamic_partitions("song") == []
    assert [r.job_name for r in requests(results)] == ["rebuild_catalog"]
    assert not (studio / "lake" / "music_beat" / "beat.parquet").exists()


def test_requests_carried_out_one_after_the_other_bring_all_up_to_date(fresh_studio, look):
    jobs = []
    for _ in range(10):
        instance, results = look(fresh_studio)
        if not requests(results):
            break
        definitions = build_definitions(StudioFolder(fresh_studio))
        for request in requests(results):
            jobs.append(request.job_name)
            done = definitions.resolve_job_def(request.job_name).execute_in_process(
                instance=instance,
                asset_selection=list(request.asset_selection),
                partition_key=request.partition_key,
                tags=request.tags,
            )
            assert done.success
    assert jobs == ["rebuild_motion", "rebuild_music", "rebuild_catalog"]


def test_sensor_waits_for_runs_that_are_going_on(studio, look):
    shutil.copytree(studio / "clips" / "kaede", studio / "clips" / "more")
    folder = StudioFolder(studio)
    instance = building.open_instance(folder)
    job = build_definitions(folder).resolve_job_def("rebuild_catalog")
    instance.create_run_for_job(job, status=dg.DagsterRunStatus.STARTED)
    _, results = look(studio)
    assert [type(r) for r in results] == [dg.SkipReason]


def test_nightly_brings_everything_up_to_date_in_one_run(studio):
    shutil.copytree(studio / "clips" / "kaede", studio / "clips" / "more")
    folder = StudioFolder(studio)
    instance, definitions = building.open_instance(folder), build_definitions(folder)
    request = nightly(dg.build_schedule_context(instance=instance))
    assert nightly.cron_schedule == "0 3 * * *"
    job = definitions.resolve_job_def(nightly.job_name)
    assert job.execute_in_process(instance=instance, tags=request.tags).success
    state = freshness(folder)
    assert {f.state for f in state.findings()} == {"fresh"}
    assert "more" in state.keys("session")


def test_what_comes_back_is_asked_for_again(studio, look):
    """A, B and A again: the second A is another request than the first."""
    clip = studio / "clips" / "ayame" / "step.bvh"
    original = clip.read_bytes()
    keys = []
    for content in (original + b"\n", original, original + b"\n"):
        clip.write_bytes(content)
        _, results = look(studio)
        keys.append(requests(results)[0].run_key)
        instance = building.open_instance(StudioFolder(studio))
        building.bring_up_to_date(
            StudioFolder(studio),
            build_definitions(StudioFolder(studio)).resolve_job_def,
            instance,
            freshness(StudioFolder(studio)),
        )
    assert len(set(keys)) == 3


def test_a_killed_run_does_not_stop_the_sensor(studio, look):
    shutil.copytree(studio / "clips" / "kaede", studio / "clips" / "more")
    folder = StudioFolder(studio)
    instance = building.open_instance(folder)
    job = build_definitions(folder).resolve_job_def("rebuild_catalog")
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    tags = {building.PID_TAG: f"{gone.pid} 12345"}
    dead = instance.create_run_for_job(job, status=dg.DagsterRunStatus.STARTED, tags=tags)
    _, results = look(studio)
    assert requests(results)
    assert instance.get_run_by_id(dead.run_id).status == dg.DagsterRunStatus.FAILURE


def test_a_share_that_is_not_mounted_costs_nothing(studio, look):
    stored = sorted(p.name for p in (studio / "lake" / "clip").iterdir())
    (studio / "clips").rename(studio / "elsewhere")
    _, results = look(studio)
    (skip,) = results
    assert "want the clips that were there (2 sessions" in skip.skip_message
    assert sorted(p.name for p in (studio / "lake" / "clip").iterdir()) == stored
