"""Everything Dagster loads: gathers assets, jobs, sensor, schedule and resources; decides nothing."""

from typing import Any

import dagster as dg

from pipelines import jobs, schedules, sensors
from pipelines.calibrate import PoseSolvers
from pipelines.collection import ASSETS, freshness
from pipelines.io_managers import EarlierTables, LakeIOManager, StageIOManager
from pipelines.resources import NoProgress, StudioFolder, pair_distance, studio_from_environment


def build_definitions(studio: StudioFolder | None = None, **overrides: Any) -> dg.Definitions:  # noqa: ANN401 - resources are of any type
    """Gather the definitions for one studio.

    Parameters
    ----------
    studio : StudioFolder, or None for the one named by the environment
    overrides : resources by key, in place of the usual ones
    """
    folder = studio or studio_from_environment()
    state = freshness(folder)
    resources: dict[str, Any] = {
        "studio": folder,
        "earlier": EarlierTables(folder.lake),
        "progress": NoProgress(),
        "pair_distance": dg.ResourceDefinition(lambda _: pair_distance(folder.settings().opencl)),
        "solvers": dg.ResourceDefinition(lambda _: PoseSolvers(folder.settings().opencl)),
        "lake": LakeIOManager(folder.lake, state),
        "stage": StageIOManager(folder, state),
    }
    return dg.Definitions(
        assets=ASSETS,
        jobs=jobs.JOBS,
        schedules=[schedules.nightly],
        sensors=[sensors.source_sensor],
        resources=resources | overrides,
        executor=dg.in_process_executor,
    )


defs = build_definitions()
