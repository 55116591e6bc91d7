"""The nightly rebuild of the catalogue."""

import dagster as dg

from pipelines import build, sensors
from pipelines.collection import freshness
from pipelines.jobs import JOBS
from pipelines.resources import StudioFolder


@dg.schedule(
    cron_schedule="0 3 * * *",
    target=JOBS[0],
    default_status=dg.DefaultScheduleStatus.RUNNING,
    description="Every night at three: whatever is stale, catalogue and dances, stage by stage with the sensor.",
)
def nightly(
    context: dg.ScheduleEvaluationContext, studio: dg.ResourceParam[StudioFolder]
) -> list[dg.RunRequest] | dg.SkipReason:
    """Ask for the first stale stage; the sensor goes on from there."""
    found = sensors.requests(context.instance, studio, freshness(studio), groups=build.GROUPS)
    return found or dg.SkipReason("everything is up to date")
