"""`odori build`: the catalogue brought up to date."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipelines import build
from pipelines.commands.outcome import DONE, NOTHING_DONE, SOME_REFUSED, Outcome
from pipelines.commands.session import Session
from pipelines.commands.status import any_read, clips_of, counts, refusals, songs_of
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder, existing


def build_studio(root: Path, *, dances: bool, progress: Callable[[], Any]) -> Outcome:
    """Bring a studio up to date."""
    studio = existing(root)
    work = Session(studio, progress)
    sources = work.state.sources
    if not sources.clips and not sources.songs:
        raise StudioError(f"{root}: want clips under clips/ and songs under songs/, got none; put some there")
    groups = build.GROUPS if dances else [g for g in build.GROUPS if g != "dance"]
    report = work.run(groups)
    clips, songs = clips_of(work.state, studio), songs_of(work.state, studio)
    refused = [f for f in (*clips, *songs) if f["state"] == "refused"]
    facts = {
        "clips": counts(clips),
        "songs": counts(songs),
        "refused": [{"path": f["path"], "reason": f["reason"]} for f in refused],
        "ran": [{"assets": list(b.assets), "partitions": list(b.keys)} for b in report.ran],
        "failed": report.failed,
        "notes": [*sources.notes, *work.notes],
    }
    troubles = [*refusals(refused), *(f"failed: {f}" for f in report.failed), *(f"note: {n}" for n in sources.notes)]
    status = (
        NOTHING_DONE
        if report.failed and not any_read(clips, songs)
        else SOME_REFUSED
        if refused or report.failed
        else DONE
    )
    return Outcome(status, facts, _build_report(facts, studio), troubles)


def _build_report(facts: dict[str, Any], studio: StudioFolder) -> str:
    clips, songs = facts["clips"], facts["songs"]
    made = sum(len(batch["partitions"]) for batch in facts["ran"])
    work = f"{made} partitions made" if made else "everything was up to date"
    refused = clips["refused"] + songs["refused"]
    return (
        f"{clips['read']} clips and {songs['read']} songs read, {refused} files refused; {work}\n"
        f"next: odori dance SONG --studio {studio.root}, or odori ui --studio {studio.root}"
    )
