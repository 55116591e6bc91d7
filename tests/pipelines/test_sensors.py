"""Sensor and schedule: new, changed and removed files become partitions and runs, once."""

import shutil

import dagster as dg
import pytest

from pipelines import build as building
from pipelines.definitions import build_definitions
from pipelines.resources import StudioFolder
from pipelines.schedules import nightly
from pipelines.sensors import source_sensor


@pytest.fixture
def look():
    """Evaluate the sensor on a studio with its own instance: (instance, results)."""

    def evaluate(root, evaluator=source_sensor):
        folder = StudioFolder(root)
        instance = building.open_instance(folder)
        if evaluator is source_sensor:
            context = dg.build_sensor_context(
                instance=instance, resources={"studio": folder}, definitions=build_definitions(folder)
            )
            return instance, list(source_sensor(context))
        context = dg.build_schedule_context(instance=instance, resources={"studio": folder})
        found = nightly(context)
        return instance, found if isinstance(found, list) else [found]

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


def test_nightly_asks_for_the_same(studio, look):
    _, results = look(studio, nightly)
    assert [type(r) for r in results] == [dg.SkipReason]
    shutil.copytree(studio / "clips" / "kaede", studio / "clips" / "more")
    _, results = look(studio, nightly)
    assert [r.partition_key for r in requests(results)] == ["more"]
    assert nightly.cron_schedule == "0 3 * * *"
