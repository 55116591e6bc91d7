"""Bringing a studio up to date: partitions follow the sources, then whatever is stale runs, stage by stage.

The command, the sensor and the schedule share the planning here; the command also runs what was planned, as ordinary
Dagster runs on the studio's own instance, so the UI shows them like any other.
"""

import fcntl
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import dagster as dg
from dagster_shared.error import SerializableErrorInfo

from assets.partitions import SESSION, SONG, dagster_key
from pipelines.files import StudioError, why
from pipelines.freshness import Finding, Freshness
from pipelines.jobs import JOB_OF_GROUP
from pipelines.resources import StudioFolder

# Stages in order; the groups of one stage run together, clip by clip carried over.
STAGES: tuple[tuple[str, ...], ...] = (("capture", "motion"), ("music",), ("catalog",), ("dance",))
GROUPS = tuple(JOB_OF_GROUP)
_RANGE_START, _RANGE_END = "dagster/asset_partition_range_start", "dagster/asset_partition_range_end"
PID_TAG = "odori/pid"


@dataclass(frozen=True)
class Batch:
    """Assets to run together over neighbouring partitions."""

    job: str
    assets: tuple[str, ...]
    keys: tuple[str, ...]

    def singles(self) -> list["Batch"]:
        """Split into batches of one partition each."""
        return [Batch(self.job, self.assets, (key,)) for key in self.keys]

    def tags(self) -> dict[str, str]:
        """Tags that tell Dagster which partitions: one, or a range run as one."""
        if len(self.keys) < 2:
            return {}
        return {_RANGE_START: self.keys[0], _RANGE_END: self.keys[-1]}

    @property
    def partition_key(self) -> str | None:
        """The one partition, where there is one."""
        return dagster_key(self.keys[0]) if len(self.keys) == 1 and self.keys[0] else None


@dataclass
class Report:
    """What a build did."""

    ran: list[Batch] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)

    @property
    def is_done(self) -> bool:
        """Whether nothing failed."""
        return not self.failed


def sync_partitions(instance: dg.DagsterInstance, state: Freshness, studio: StudioFolder) -> None:
    """Make Dagster's partitions those of the sources, and forget what was stored for sources that are gone."""
    for definition, kind in ((SESSION, "session"), (SONG, "song")):
        name = str(definition.name)
        wanted, known = state.keys(kind), instance.get_dynamic_partitions(name)  # type: ignore[arg-type]
        new = [key for key in wanted if key not in set(known)]
        if new:
            instance.add_dynamic_partitions(name, new)
        for key in known:
            if key not in set(wanted):
                instance.delete_dynamic_partition(name, key)
    for asset, key in state.orphans():
        studio.lake.remove(asset, key)
    state.forget()


def plan(
    state: Freshness,
    instance: dg.DagsterInstance,
    *,
    groups: Iterable[str],
    keys: Callable[[str, str], bool] | None = None,
) -> list[Batch]:
    """Plan the first stage that has something to do.

    Parameters
    ----------
    state : Freshness
    instance : DagsterInstance
        Its order of dynamic partitions decides which are neighbours.
    groups : groups of assets that may run
    keys : of (kind, key), whether a partition may run; None for all

    Returns
    -------
    list of Batch
        Empty when everything asked for is fresh.
    """
    wanted = set(groups)
    findings = [f for f in state.findings() if state.assets[f.asset].group in wanted]
    if keys is not None:
        findings = [f for f in findings if keys(state.assets[f.asset].kind, f.key)]
    for stage in STAGES:
        todo = [f for f in findings if state.assets[f.asset].group in stage and f.state != "fresh"]
        if any(f.state != "waiting" for f in todo):
            return _batches(todo, state, instance)
    return []


def _batches(todo: Sequence[Finding], state: Freshness, instance: dg.DagsterInstance) -> list[Batch]:
    """Group partitions that need the same assets, and split them where Dagster's order has others between."""
    ready = {f.key for f in todo if f.state != "waiting"}
    assets_of: dict[str, tuple[str, ...]] = {}
    for finding in todo:
        if finding.key in ready:
            # Assets made in one pass are made together.
            together = state.assets[finding.asset].together
            assets_of[finding.key] = tuple(dict.fromkeys((*assets_of.get(finding.key, ()), *together)))
    batches = []
    for assets in dict.fromkeys(assets_of.values()):
        keys = [key for key, needed in assets_of.items() if needed == assets]
        node = state.assets[assets[0]]
        for run in _neighbours(keys, node.kind, instance):
            batches.append(Batch(JOB_OF_GROUP[node.group], assets, tuple(run)))
    return batches


def _neighbours(keys: list[str], kind: str, instance: dg.DagsterInstance) -> list[list[str]]:
    if kind not in ("session", "song"):
        return [[key] for key in keys]
    order = {key: i for i, key in enumerate(instance.get_dynamic_partitions(kind))}
    runs: list[list[str]] = []
    for key in sorted(keys, key=lambda k: order.get(k, len(order))):
        if runs and order.get(key, -1) == order.get(runs[-1][-1], -3) + 1:
            runs[-1].append(key)
        else:
            runs.append([key])
    return runs


def execute(batch: Batch, definitions: dg.Definitions, instance: dg.DagsterInstance) -> list[str]:
    """Run a batch in this process; what failed, one sentence each."""
    job = definitions.resolve_job_def(batch.job)
    result = job.execute_in_process(
        instance=instance,
        asset_selection=[dg.AssetKey(asset) for asset in batch.assets],
        partition_key=batch.partition_key,
        tags={**batch.tags(), PID_TAG: str(os.getpid())},
        raise_on_error=False,
        run_config={"loggers": {"console": {"config": {"log_level": "CRITICAL"}}}},
    )
    if result.success:
        return []
    causes = [_cause(event.step_key or batch.job, error) for event in result.all_events for error in _errors(event)]
    return list(dict.fromkeys(causes)) or [f"{batch.job}: the run failed and gave no reason; see it in 'odori ui'"]


def _errors(event: dg.DagsterEvent) -> list[SerializableErrorInfo]:
    """Find what an event says went wrong: in a step, or while its resources were made."""
    if event.is_step_failure:
        found = event.step_failure_data.error
    elif event.event_type == dg.DagsterEventType.RESOURCE_INIT_FAILURE:
        found = event.engine_event_data.error
    else:
        found = None
    return [found] if found else []


def _cause(where: str, error: SerializableErrorInfo) -> str:
    while error.cause is not None:
        error = error.cause
    message = error.message.strip()
    return f"{where}: {message.partition(': ')[2] or message}"


def bring_up_to_date(
    studio: StudioFolder,
    definitions: dg.Definitions,
    instance: dg.DagsterInstance,
    state: Freshness,
    *,
    groups: Iterable[str] = ("capture", "motion", "music", "catalog"),
    keys: Callable[[str, str], bool] | None = None,
) -> Report:
    """Run whatever is not fresh, stage by stage, until all is or nothing more can be done."""
    sync_partitions(instance, state, studio)
    report = Report()
    tried: set[Batch] = set()
    groups = tuple(groups)
    while True:
        batches = [b for b in plan(state, instance, groups=groups, keys=keys) if b not in tried]
        if not batches:
            return report
        for batch in batches:
            tried.add(batch)
            report.ran.append(batch)
            failed = execute(batch, definitions, instance)
            if failed and len(batch.keys) > 1:  # one partition's trouble must not stop its neighbours: one by one
                for single in batch.singles():
                    tried.add(single)
                    report.failed += execute(single, definitions, instance)
            else:
                report.failed += failed
        state.forget()


@contextmanager
def exclusive(studio: StudioFolder) -> Iterator[None]:
    """Hold the studio for one build at a time.

    Raises
    ------
    StudioError
        If another build holds it, or the folder cannot be written to.
    """
    place = studio.root / "lake" / ".lock"
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        file = place.open("a")
    except OSError as error:
        raise StudioError(f"{studio.root}: cannot be written: {why(error)}") from error
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise StudioError(f"{studio.root}: another odori is building it; wait for it to finish") from error
        yield


def clear_after_kill(studio: StudioFolder, instance: dg.DagsterInstance) -> int:
    """Tidy up after a run that was killed: half-made files, and runs that Dagster still takes for running.

    Only to be called while the studio is held.
    """
    removed = studio.lake.sweep()
    unfinished = dg.RunsFilter(statuses=[dg.DagsterRunStatus.STARTED, dg.DagsterRunStatus.STARTING])
    for run in instance.get_runs(unfinished):
        if PID_TAG in run.tags:
            instance.report_run_failed(run, "its process was killed; the next build does its work again")
    return removed


# Odori prints nothing inside a run that its metadata and events do not say better: no log files beside each run.
_CONFIGURATION = """\
telemetry:
  enabled: false
nux:
  enabled: false
compute_logs:
  module: dagster._core.storage.noop_compute_log_manager
  class: NoOpComputeLogManager
"""


def open_instance(studio: StudioFolder) -> dg.DagsterInstance:
    """Open the studio's Dagster storage, making it where there is none.

    Raises
    ------
    StudioError
        If the folder cannot be written to.
    """
    home = studio.dagster_home
    try:
        home.mkdir(parents=True, exist_ok=True)
        configuration = home / "dagster.yaml"
        if not configuration.exists():
            configuration.write_text(_CONFIGURATION)
        return dg.DagsterInstance.from_config(str(home))
    except OSError as error:
        raise StudioError(f"{home}: cannot be written: {why(error)}") from error
