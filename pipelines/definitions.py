"""Everything Dagster loads: gathers assets, jobs, sensor, schedule and resources; decides nothing."""

from typing import Any

import dagster as dg

from pipelines import jobs, schedules, sensors
from pipelines.calibrate import PoseSolvers
from pipelines.collection import ASSETS, freshness
from pipelines.io_managers import EarlierTables, IndexIOManager, LakeIOManager, StageIOManager
from pipelines.resources import GraphMemory, NoProgress, StudioFolder, matcher, pair_distance, studio_from_environment


def build_definitions(studio: StudioFolder | None = None, **overrides: Any) -> dg.Definitions:  # noqa: ANN401 - resources are of any type
    """Gather the definitions for one studio.

    Parameters
    ----------
    studio : StudioFolder, or None for the one named by the environment
    overrides : resources by key, in place of the usual ones
    """
    folder = studio or studio_from_environment()
    # Made for each run anew: a run keeps to the settings and sources it began with, and its stamps say so.
    resources: dict[str, Any] = {
        "studio": dg.ResourceDefinition(lambda _: folder.frozen()),
        "earlier": EarlierTables(folder.lake),
        "progress": NoProgress(),
        "pair_distance": dg.ResourceDefinition(
            lambda context: pair_distance(context.resources.studio.settings().opencl), required_resource_keys={"studio"}
        ),
        "graph_memory": GraphMemory(folder.lake),
        "matcher": dg.ResourceDefinition(
            lambda context: matcher(context.resources.studio.settings()), required_resource_keys={"studio"}
        ),
        "solvers": dg.ResourceDefinition(
            lambda context: PoseSolvers(context.resources.studio.settings().opencl), required_resource_keys={"studio"}
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
    return dg.Definitions(
        assets=ASSETS,
        jobs=[*jobs.JOBS, schedules.rebuild_all],
        schedules=[schedules.nightly],
        sensors=[sensors.source_sensor],
        resources=resources | overrides,
        executor=dg.in_process_executor,
    )


defs = build_definitions()
