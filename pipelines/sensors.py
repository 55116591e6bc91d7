"""New, changed and removed source files become partitions and runs."""

from collections.abc import Iterator

import dagster as dg

from assets.sources.sources import fingerprint
from pipelines import build
from pipelines.collection import freshness
from pipelines.freshness import Freshness
from pipelines.jobs import JOBS
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder

RUN_KEY_TAG = "dagster/run_key"


def requests(
    instance: dg.DagsterInstance, studio: StudioFolder, state: Freshness, *, groups: tuple[str, ...]
) -> list[dg.RunRequest]:
    """Ask for a run of every batch of the first stage that has something to do.

    A run's key is what it would be made from, what is stored, and the job's last success: the same sources are asked
    for once, changed ones again, those changed back again too. What failed and would be made from the same is passed
    over, so that it does not stop the stages after it.
    """
    build.sync_partitions(instance, state, studio)
    tried: set[build.Batch] = set()
    given_up: set[tuple[str, str]] = set()
    while batches := build.plan(state, instance, groups=groups, tried=tried, given_up=given_up):
        asked = [_request(state, instance, part) for batch in batches for part in batch.without(given_up)]
        new = [request for request in asked if not _has_run(instance, request)]
        if new:
            return new
        tried.update(batches)
        given_up |= {pair for batch in batches for pair in build.unmade(batch, state)}
    return []


def _request(state: Freshness, instance: dg.DagsterInstance, batch: build.Batch) -> dg.RunRequest:
    done = instance.get_runs(dg.RunsFilter(job_name=batch.job, statuses=[dg.DagsterRunStatus.SUCCESS]), limit=1)
    last = done[0].run_id if done else ""
    return dg.RunRequest(
        run_key=fingerprint([batch.job, batch.assets, batch.keys, _made_from(state, batch), last]),
        job_name=batch.job,
        asset_selection=[dg.AssetKey(asset) for asset in batch.assets],
        partition_key=batch.partition_key,
        tags=batch.tags() | build.own_tags(),
    )


def _has_run(instance: dg.DagsterInstance, request: dg.RunRequest) -> bool:
    return bool(instance.get_runs(dg.RunsFilter(tags={RUN_KEY_TAG: request.run_key or ""}), limit=1))


def _made_from(state: Freshness, batch: build.Batch) -> list[object]:
    return [
        [
            asset,
            key,
            getattr(state.stamp(asset, key), "content", ""),
            state.inputs(asset, key),
            state.source_version(asset, key),
            state.settings_version(asset, key),
            state.assets[asset].code_version_of(key),
        ]
        for asset in batch.assets
        for key in batch.keys
    ]


@dg.sensor(
    jobs=JOBS,
    minimum_interval_seconds=30,
    default_status=dg.DefaultSensorStatus.RUNNING,
    description="Finds new, changed and removed clips and songs and asks for what they make stale, stage by stage.",
)
def source_sensor(
    context: dg.SensorEvaluationContext, studio: dg.ResourceParam[StudioFolder]
) -> Iterator[dg.RunRequest | dg.SkipReason]:
    """Look at the sources; while runs are going on, wait for them."""
    build.end_dead_runs(context.instance)
    if context.instance.get_runs(dg.RunsFilter(statuses=list(build.UNFINISHED)), limit=1):
        yield dg.SkipReason("runs are going on; looking again when they are done")
        return
    try:
        found = requests(context.instance, studio, freshness(studio), groups=build.GROUPS)
    except StudioError as error:
        yield dg.SkipReason(str(error))
        return
    if not found:
        yield dg.SkipReason("everything is up to date")
    yield from found
