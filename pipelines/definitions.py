"""Everything Dagster loads: gathers assets, jobs, sensor, schedule and resources; decides nothing."""

from typing import Any

import dagster as dg

from pipelines import jobs, schedules, sensors
from pipelines.build import mark_asked
from pipelines.caches import settle
from pipelines.collection import ASSETS, freshness
from pipelines.device_fallback import Devices
from pipelines.io_managers import EarlierTables, IndexIOManager, LakeIOManager, StageIOManager
from pipelines.resources import GraphMemory, NoProgress
from pipelines.solvers import PoseSolvers
from pipelines.studio.folder import StudioFolder, studio_from_environment
from pipelines.twins import Distances, Matches


def build_definitions(studio: StudioFolder | None = None, **overrides: Any) -> dg.Definitions:  # noqa: ANN401 - resources are of any type
    """Gather the definitions for one studio.

    Parameters
    ----------
    studio : StudioFolder, or None for the one named by the environment
    overrides : resources by key, in place of the usual ones
    """
    settle()
    folder = studio or studio_from_environment()
    devices: dict[str, Devices] = {}
    made: list[dg.Definitions] = []
    # Made for each run anew: a run keeps to the settings and sources it began with, and its stamps say so.
    resources: dict[str, Any] = {
        "studio": dg.ResourceDefinition(lambda context: _frozen(folder, context)),
        "earlier": EarlierTables(folder.lake),
        "find_job": dg.ResourceDefinition(lambda _: made[0].resolve_job_def),
        "progress": NoProgress(),
        "devices": dg.ResourceDefinition(
            lambda context: _devices(devices, context.resources.studio.settings().opencl.device),
            required_resource_keys={"studio"},
        ),
        "pair_distance": dg.ResourceDefinition(
            lambda context: Distances(context.resources.devices), required_resource_keys={"devices"}
        ),
        "graph_memory": GraphMemory(folder.lake),
        "matcher": dg.ResourceDefinition(
            lambda context: Matches(context.resources.devices, context.resources.studio.settings().matching),
            required_resource_keys={"devices", "studio"},
        ),
        "solvers": dg.ResourceDefinition(
            lambda context: PoseSolvers(context.resources.devices), required_resource_keys={"devices"}
        ),
        "lake": dg.IOManagerDefinition(
            lambda context: LakeIOManager(context.resources.studio.lake, freshness(context.resources.studio)),
            required_resource_keys={"studio"},
        ),
        "index": dg.IOManagerDefinition(
            lambda context: IndexIOManager(context.resources.studio, freshness(context.resources.studio)),
            required_resource_keys={"studio"},
        ),
        "stage": dg.IOManagerDefinition(
            lambda context: StageIOManager(context.resources.studio, freshness(context.resources.studio)),
            required_resource_keys={"studio"},
        ),
    }
    definitions = dg.Definitions(
        assets=ASSETS,
        jobs=[*jobs.JOBS, schedules.rebuild_all],
        schedules=[schedules.nightly],
        sensors=[sensors.source_sensor],
        resources=resources | overrides,
        executor=dg.in_process_executor,
    )
    made.append(definitions)
    return definitions


def _frozen(folder: StudioFolder, context: dg.InitResourceContext) -> StudioFolder:
    """Give the studio as a run begins with it, which is what the run is marked with."""
    studio = folder.frozen()
    if context.run is not None and context.instance is not None:
        mark_asked(context.instance, context.run, freshness(studio))
    return studio


def _devices(known: dict[str, Devices], wanted: str) -> Devices:
    """Make the devices by the setting: one that failed in a run of this process is not taken again in the next."""
    if wanted not in known:
        known[wanted] = Devices(wanted)
    return known[wanted]


defs = build_definitions()
