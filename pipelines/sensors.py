"""New, changed and removed source files become partitions and runs."""

from collections.abc import Iterator

import dagster as dg

from assets.sources import fingerprint
from pipelines import build
from pipelines.collection import freshness
from pipelines.freshness import Freshness
from pipelines.jobs import JOBS
from pipelines.resources import StudioFolder

UNFINISHED = (
    dg.DagsterRunStatus.QUEUED,
    dg.DagsterRunStatus.NOT_STARTED,
    dg.DagsterRunStatus.STARTING,
    dg.DagsterRunStatus.STARTED,
)


def requests(
    instance: dg.DagsterInstance, studio: StudioFolder, state: Freshness, *, groups: tuple[str, ...]
) -> list[dg.RunRequest]:
    """Ask for a run of every batch of the first stage that has something to do.

    A run's key is what it would be made from: the same sources are asked for once, changed ones again.
    """
    build.sync_partitions(instance, state, studio)
    return [
        dg.RunRequest(
            run_key=fingerprint([batch.job, batch.assets, batch.keys, _made_from(state, batch)]),
            job_name=batch.job,
            asset_selection=[dg.AssetKey(asset) for asset in batch.assets],
            partition_key=batch.partition_key,
            tags=batch.tags(),
        )
        for batch in build.plan(state, instance, groups=groups)
    ]


def _made_from(state: Freshness, batch: build.Batch) -> list[object]:
    return [
        [
            asset,
            key,
            state.inputs(asset, key),
            state.source_version(asset, key),
            state.settings_version(asset),
            state.assets[asset].code_version,
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
    if context.instance.get_runs(dg.RunsFilter(statuses=list(UNFINISHED)), limit=1):
        yield dg.SkipReason("runs are going on; looking again when they are done")
        return
    found = requests(context.instance, studio, freshness(studio), groups=build.GROUPS)
    if not found:
        yield dg.SkipReason("everything is up to date")
    yield from found
