"""Bringing a studio up to date: partitions follow the sources, then whatever is stale runs, stage by stage.

The command, the sensor and the schedule share the planning here; the command also runs what was planned, as ordinary
Dagster runs on the studio's own instance, so the UI shows them like any other.
"""

import os
from collections.abc import Callable, Collection, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import dagster as dg
import filelock
from dagster_shared.error import SerializableErrorInfo

from assets.formats import beside
from assets.formats.errors import FormatError
from assets.partitions import SESSION, SONG, dagster_key, lake_key
from pipelines.freshness import Freshness, PartitionState
from pipelines.jobs import JOB_OF_GROUP, job_of
from pipelines.processes import is_running, started
from pipelines.studio.files import StudioError, why
from pipelines.studio.folder import StudioFolder
from schemas.keys import check_key

# Stages in order; the groups of one stage run together, clip by clip carried over.
STAGES: tuple[tuple[str, ...], ...] = (("capture", "motion"), ("music",), ("catalog",), ("search",), ("dance",))
GROUPS = tuple(JOB_OF_GROUP)
_PARTITION = "dagster/partition"
_RANGE_START, _RANGE_END = "dagster/asset_partition_range_start", "dagster/asset_partition_range_end"
PID_TAG = "odori/pid"
ASKED_TAG = "odori/asked"
"""On a run: the version of what was asked of its partition, :meth:`pipelines.freshness.Freshness.asked_version`."""
FindJob = Callable[[str], dg.JobDefinition]
"""Gives a job by its name."""


@dataclass(frozen=True)
class Batch:
    """Assets to run together over neighbouring partitions."""

    job: str
    assets: tuple[str, ...]
    keys: tuple[str, ...]

    def singles(self) -> list["Batch"]:
        """Split into batches of one partition each."""
        return [Batch(self.job, self.assets, (key,)) for key in self.keys]

    def without(self, given_up: Collection[tuple[str, str]]) -> list["Batch"]:
        """Batches of the partitions in which no asset was given up: this one if that is all, else one a partition."""
        left = [b for b in self.singles() if not any((asset, b.keys[0]) in given_up for asset in b.assets)]
        return [self] if len(left) == len(self.keys) else left

    def tags(self) -> dict[str, str]:
        """Tags that tell Dagster which partitions: one, or a range run as one."""
        if len(self.keys) < 2:
            return {}
        return {_RANGE_START: self.keys[0], _RANGE_END: self.keys[-1]}

    @property
    def partition_key(self) -> str | None:
        """The one partition, where there is one."""
        return dagster_key(self.keys[0]) if len(self.keys) == 1 and self.keys[0] else None


@dataclass(frozen=True)
class Trouble:
    """Why a run failed: a sentence, and what the asset said of it for machines."""

    sentence: str
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass
class Report:
    """What a build did."""

    ran: list[Batch] = field(default_factory=list)
    troubles: list[Trouble] = field(default_factory=list)

    @property
    def failed(self) -> list[str]:
        """What failed, one sentence each."""
        return [trouble.sentence for trouble in self.troubles]

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
            instance.add_dynamic_partitions(name, [check_key(key) for key in new])
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
    tried: Collection[Batch] = (),
    given_up: Collection[tuple[str, str]] = (),
    assets: Container[str] | None = None,
) -> list[Batch]:
    """Plan the first stage that has something to do.

    Parameters
    ----------
    state : Freshness
    instance : DagsterInstance
        Its order of dynamic partitions decides which are neighbours.
    groups : groups of assets that may run
    keys : of (kind, key), whether a partition may run; None for all
    tried : batches not to be planned again
    given_up : (asset, partition) that could not be made: what reads every partition goes on without them
    assets : assets that may run; None for all

    Returns
    -------
    list of Batch
        Empty when everything asked for is fresh or was tried.
    """
    wanted = set(groups)
    every = state.findings(given_up=given_up, keys=keys)
    findings = [f for f in every if state.assets[f.asset].group in wanted]
    if assets is not None:
        findings = [f for f in findings if f.asset in assets]
    if keys is not None:
        findings = [f for f in findings if keys(state.assets[f.asset].kind, f.key)]
    coming = {(f.asset, f.key) for f in findings if f.state != "fresh"} - set(given_up)
    for stage in STAGES:
        todo = [f for f in findings if state.assets[f.asset].group in stage and f.state != "fresh"]
        if any(f.state != "waiting" for f in todo):
            batches = [batch for batch in _batches(todo, coming, state, instance) if batch not in tried]
            if batches:
                return batches
    return []


def _batches(
    todo: Sequence[PartitionState], coming: Collection[tuple[str, str]], state: Freshness, instance: dg.DagsterInstance
) -> list[Batch]:
    """Group partitions that need the same assets, and split them where Dagster's order has others between.

    What waits for something joins a batch only where that is made in the batch itself.
    """
    assets_of: dict[str, tuple[str, ...]] = {}
    for finding in todo:  # inputs come first
        here = assets_of.get(finding.key, ())
        awaited = state.input_pairs(finding.asset, finding.key) & set(coming)
        if finding.state == "waiting" and any(k != finding.key or name not in here for name, k in awaited):
            continue
        if finding.state == "waiting" and not awaited:
            continue
        # Assets made in one pass are made together.
        assets_of[finding.key] = tuple(dict.fromkeys((*here, *state.assets[finding.asset].together)))
    batches = []
    for assets in dict.fromkeys(assets_of.values()):
        keys = [key for key, needed in assets_of.items() if needed == assets]
        node = state.assets[assets[0]]
        for run in _neighbours(keys, node.kind, instance):
            batches.append(Batch(job_of(node.name, node.group), assets, tuple(run)))
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


def execute(batch: Batch, find_job: FindJob, instance: dg.DagsterInstance) -> list[Trouble]:
    """Run a batch in this process; what failed."""
    job = find_job(batch.job)
    result = job.execute_in_process(
        instance=instance,
        asset_selection=[dg.AssetKey(asset) for asset in batch.assets],
        partition_key=batch.partition_key,
        tags={**batch.tags(), **own_tags()},
        raise_on_error=False,
        run_config={"loggers": {"console": {"config": {"log_level": "CRITICAL"}}}},
    )
    if result.success:
        return []
    causes = {
        _cause(event.step_key or batch.job, error): _said(event)
        for event in result.all_events
        for error in _errors(event)
    } or {f"{batch.job}: the run failed and gave no reason; see it in 'odori ui'": {}}
    of = f"[{', '.join(batch.keys)}] " if any(batch.keys) else ""
    return [Trouble(f"{of}{cause}", facts) for cause, facts in causes.items()]


def _said(event: dg.DagsterEvent) -> dict[str, Any]:
    """Find what a failing asset said for machines."""
    if not event.is_step_failure or event.step_failure_data.user_failure_data is None:
        return {}
    metadata = event.step_failure_data.user_failure_data.metadata
    return {name: getattr(value, "data", getattr(value, "value", None)) for name, value in metadata.items()}


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
    find_job: FindJob,
    instance: dg.DagsterInstance,
    state: Freshness,
    *,
    groups: Iterable[str] = ("capture", "motion", "music", "catalog"),
    keys: Callable[[str, str], bool] | None = None,
    assets: Container[str] | None = None,
) -> Report:
    """Run whatever is not fresh, stage by stage, until all is or nothing more can be done."""
    sync_partitions(instance, state, studio)
    report = Report()
    tried: set[Batch] = set()
    given_up: set[tuple[str, str]] = set()
    groups = tuple(groups)
    while True:
        batches = plan(state, instance, groups=groups, keys=keys, assets=assets, tried=tried, given_up=given_up)
        if not batches:
            return report
        for planned in batches:
            tried.add(planned)
            for batch in planned.without(given_up):  # what it would be made from may have failed a moment ago
                tried.add(batch)
                report.ran.append(batch)
                failed = execute(batch, find_job, instance)
                if failed and len(batch.keys) > 1:  # one partition's trouble must not stop its neighbours: one by one
                    for single in batch.singles():
                        tried.add(single)
                        failed = execute(single, find_job, instance)
                        report.troubles += failed
                        given_up |= unmade(single, state) if failed else set()
                else:
                    report.troubles += failed
                    given_up |= unmade(batch, state) if failed else set()
        state.forget()
        # What was made and is not fresh was edited meanwhile: the next build takes it up, this one goes on.
        given_up |= {(a, k) for b in batches for a in b.assets for k in b.keys if state.state(a, k).state == "stale"}


def unmade(batch: Batch, state: Freshness) -> set[tuple[str, str]]:
    """Partitions a failed batch leaves as they were, and those made from them: of the same key, and a song's dances.

    What is made from many partitions, like the motion graph, goes on with what there is.
    """
    left = {(asset, key) for asset in batch.assets for key in batch.keys}
    kind = state.assets[batch.assets[0]].kind
    for node in state.assets.values():  # inputs come first
        if node.kind == kind:
            keys: Iterable[str] = batch.keys
        elif kind == "song" and node.kind == "dance":
            keys = [key for key in state.partitions(node.name) if key.split("|")[0] in batch.keys]
        else:
            continue
        left |= {(node.name, key) for key in keys if state.input_pairs(node.name, key) & left}
    return left


def mark_asked(instance: dg.DagsterInstance, run: dg.DagsterRun, state: Freshness) -> None:
    """Write on a run of one partition what was asked of it, so that a failure is told of that and of nothing else.

    Sources or settings that cannot be read leave it unmarked: the run says itself what is wrong.
    """
    of = _made_in(run)
    if of is None or not of[0] or ASKED_TAG in run.tags:
        return
    try:
        instance.add_run_tags(run.run_id, {ASKED_TAG: state.asked_version(*of)})
    except (StudioError, FormatError, OSError):
        return


def _made_in(run: dg.DagsterRun) -> tuple[tuple[str, ...], str] | None:
    """Name the assets of a run and its partition; None for a range, which is run again one by one where it fails."""
    if _RANGE_START in run.tags:
        return None
    assets = tuple(sorted(asset.to_user_string() for asset in run.asset_selection or ()))
    return assets, lake_key(run.tags[_PARTITION]) if _PARTITION in run.tags else ""


def last_failures(
    instance: dg.DagsterInstance, state: Freshness, pairs: Collection[tuple[str, str]], *, newest: int = 200
) -> dict[tuple[str, str], str]:
    """Say why partitions failed whose latest run for what is asked of them now did.

    A failure belongs to what was asked: once request, settings, code or inputs are others, it is none of theirs.

    Parameters
    ----------
    instance : DagsterInstance
    state : Freshness
    pairs : (asset, partition) to look for
    newest : int, > 0
        How many runs are looked at.

    Returns
    -------
    dict
        (asset, partition) to one sentence, of those that failed.
    """
    found: dict[tuple[str, str], str] = {}
    statuses = [dg.DagsterRunStatus.FAILURE, dg.DagsterRunStatus.SUCCESS]
    for run in instance.get_runs(dg.RunsFilter(statuses=statuses), limit=newest) if pairs else ():
        assets, key = _made_in(run) or ((), "")
        wanted = [(asset, key) for asset in assets if (asset, key) in pairs and (asset, key) not in found]
        if not wanted or not state.assets.keys() >= set(assets):
            continue
        if run.tags.get(ASKED_TAG) != state.asked_version(assets, key):
            continue
        reason = ""
        if run.status == dg.DagsterRunStatus.FAILURE:
            causes = [
                _cause(entry.dagster_event.step_key or "", error)
                for entry in instance.all_logs(run.run_id, dg.DagsterEventType.STEP_FAILURE)
                if entry.dagster_event
                for error in _errors(entry.dagster_event)
            ]
            reason = causes[0] if causes else "the run ended without a reason; see it in 'odori ui'"
        found |= dict.fromkeys(wanted, reason)
    return {pair: reason for pair, reason in found.items() if reason}


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
        lock = filelock.FileLock(place, blocking=False).acquire()
    except filelock.Timeout as error:
        raise StudioError(f"{studio.root}: another odori is building it; wait for it to finish") from error
    except OSError as error:
        raise StudioError(f"{studio.root}: cannot be written: {why(error)}") from error
    with lock:
        yield


def clear_after_kill(studio: StudioFolder, instance: dg.DagsterInstance) -> int:
    """Tidy up after a run that was killed: half-made files, and runs that Dagster still takes for running.

    What another system named otherwise gets its name here.

    Only to be called while the studio is held.
    """
    studio.lake.name_anew()
    removed: int = studio.lake.sweep() + beside.sweep(studio.dances)
    end_dead_runs(instance)
    return removed


UNFINISHED = (
    dg.DagsterRunStatus.QUEUED,
    dg.DagsterRunStatus.NOT_STARTED,
    dg.DagsterRunStatus.STARTING,
    dg.DagsterRunStatus.STARTED,
)


def own_tags() -> dict[str, str]:
    """Tags of a run that this process starts or asks for: by them it is known to be dead when the process is."""
    return {PID_TAG: f"{os.getpid()} {started(os.getpid())}"}


def end_dead_runs(instance: dg.DagsterInstance, *, untagged: bool = False) -> None:
    """Report runs as failed whose process is gone; with ``untagged`` also those that were started by hand in the UI."""
    for run in instance.get_runs(dg.RunsFilter(statuses=list(UNFINISHED))):
        pid, _, since = run.tags.get(PID_TAG, "").partition(" ")
        if not is_running(int(pid), since) if pid.isdigit() else untagged:
            instance.report_run_failed(run, "its process was killed; the next build does its work again")


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
        owner = home / "odori-studio"
        if not owner.exists():
            owner.write_bytes(f"{studio.root}\n".encode("utf-8", "surrogateescape"))
        elif home != studio.root / ".dagster" and (of := _owner(owner)) != str(studio.root):
            raise StudioError(
                f"{home}: want Dagster's storage of {studio.root}, got that of {of}; "
                "set DAGSTER_HOME to a folder of its own for each studio"
            )
        configuration = home / "dagster.yaml"
        if not configuration.exists():
            configuration.write_text(_CONFIGURATION, encoding="utf-8")
        return dg.DagsterInstance.from_config(str(home))
    except OSError as error:
        raise StudioError(f"{home}: cannot be written: {why(error)}") from error


def _owner(place: Path) -> str:
    """Read whose storage it is; the path of a studio need not be text of any encoding."""
    return place.read_bytes().decode("utf-8", "surrogateescape").strip()
