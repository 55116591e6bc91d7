"""What could be pinned at a place of a song, and what it would cost: facts for machines, a report for people."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from assets.dancing import proposals
from assets.dancing.methods import USUAL
from assets.dancing.refusal import RefusalError
from pipelines.commands.arguments import pin_texts, wanted_songs
from pipelines.commands.outcome import DONE, NOTHING_DONE, Outcome
from pipelines.commands.session import Session
from pipelines.studio.files import LakeError, StudioError
from pipelines.studio.folder import StudioFolder, existing
from pipelines.studio.stored import StoredTable, partitions_for

LONGEST_TABLE = 12
"""Rows of candidates. Chosen by hand, to fit on a screen."""


def priced(studio: StudioFolder, song: str, place: str, pins: Sequence[str]) -> Outcome:
    """Price what could be pinned at a place of a song.

    Parameters
    ----------
    studio : with the motion graph and the song's beats in its lake
    song : its key
    place : as a pin names it
    pins : to be kept beside those of the brief

    Raises
    ------
    StudioError
        If the place is none of the song's.
    """
    lake = studio.lake
    inputs = {name: StoredTable(lake, name, partitions_for(lake, name, song)) for name in proposals.INPUTS}
    try:
        facts = proposals.propose_at(inputs, studio, song, place, pins=pins)
    except proposals.PlaceError as error:
        raise StudioError(f"--propose: {error}") from error
    except RefusalError as refused:
        told = {"error": refused.sentence, **refused.facts}
        return Outcome(NOTHING_DONE, told, troubles=[refused.sentence])
    if facts["best_cost"] is None:
        trouble = f"{song}: cannot be danced at all with the clips that 'allow' admits; 'odori dance' says why"
        return Outcome(NOTHING_DONE, {"error": trouble}, troubles=[trouble])
    return Outcome(DONE, facts, _report(facts))


def _report(facts: Mapping[str, Any]) -> str:
    """Write one table a kind, the cheapest first."""
    pins = f", with {', '.join(facts['pins'])}" if facts["pins"] else ""
    lines = [
        f"{facts['song']} from {facts['from_s']:.2f} to {facts['to_s']:.2f} s: what could be pinned there{pins}",
        f"extra cost of the whole dance, beyond the best one's {facts['best_cost']:.2f}; a seam costs about 1",
    ]
    for kind in ("labels", "styles", "clips"):
        rows = facts[kind]
        lost = facts["out_of_reach"][kind]
        if not rows and not lost:
            continue
        lines.append(f"{kind}: {len(rows)} can be danced there, {len(lost)} cannot")
        lines += [f"  {_price(row):>9}  {row['pin']}{_also(row)}" for row in rows[:LONGEST_TABLE]]
        if len(rows) > LONGEST_TABLE:
            lines.append(f"             … and {len(rows) - LONGEST_TABLE} more, up to {_price(rows[-1])}: see --json")
    return "\n".join(lines)


def _price(row: Mapping[str, Any]) -> str:
    return f"{max(row['extra_cost'], 0.0) if abs(row['extra_cost']) < 0.005 else row['extra_cost']:+.2f}"


def _also(row: Mapping[str, Any]) -> str:
    told = []
    if "clip_count" in row:
        told.append(f"{row['clip_count']} clip{'s' * (row['clip_count'] != 1)}")
    else:
        told += [text for text in (row["label"], row["style"]) if text]
    if row["steps_outside_warp_bounds"]:
        told.append(f"{row['steps_outside_warp_bounds']} steps outside the warp bounds")
    return f"  ({', '.join(told)})" if told else ""


def propose_pins(
    root: Path,
    wanted: str,
    place: str,
    *,
    pins: Sequence[str] = (),
    progress: Callable[[], Any],
) -> Outcome:
    """List what could be pinned at a place of a song, building first what that takes; nothing is danced."""
    studio = existing(root)
    pins = pin_texts(pins, root, progress)
    work = Session(studio, progress)
    songs = wanted_songs(work.state.sources, [wanted], studio)
    if len(songs) > 1:
        raise StudioError(f"--propose: want one song, got {len(songs)}")
    report = work.run_before_dance(songs[0].key, USUAL)
    try:
        return priced(studio, songs[0].key, place, pins)
    except LakeError as error:
        raise StudioError("; ".join([str(error), *report.failed])) from error
