"""The nightly rebuild of the catalogue."""

import dagster as dg

from pipelines import build
from pipelines.collection import freshness
from pipelines.studio.folder import StudioFolder


@dg.op(description="Brings catalogue and dances up to date, stage by stage, as `odori build --dances` does.")
def bring_up_to_date(
    context: dg.OpExecutionContext, studio: dg.ResourceParam[StudioFolder], find_job: dg.ResourceParam[build.FindJob]
) -> None:
    """Run whatever is stale, each batch as an ordinary run of its own; fail when something could not be made."""
    with build.exclusive(studio):
        build.clear_after_kill(studio, context.instance)
        report = build.bring_up_to_date(studio, find_job, context.instance, freshness(studio), groups=build.GROUPS)
    context.add_output_metadata({"runs": len(report.ran), "failed": dg.MetadataValue.json(report.failed)})
    if report.failed:
        raise dg.Failure("; ".join(report.failed), allow_retries=False)


@dg.job(description="Everything that is stale, catalogue and dances.")
def rebuild_all() -> None:
    """Bring a studio up to date in one go."""
    bring_up_to_date()


@dg.schedule(
    cron_schedule="0 3 * * *",
    target=rebuild_all,
    default_status=dg.DefaultScheduleStatus.RUNNING,
    description="Every night at three: whatever is stale, catalogue and dances.",
)
def nightly(context: dg.ScheduleEvaluationContext) -> dg.RunRequest:
    """Ask for a rebuild of what is stale."""
    return dg.RunRequest(tags=build.own_tags())
