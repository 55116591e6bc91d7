"""`odori dance`: songs danced, building first what they need."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from assets.dancing.methods import METHODS, MOST_ALTERNATIVES
from assets.sources.sources import Request
from pipelines import build
from pipelines.collection import freshness
from pipelines.commands import casting, dance_report
from pipelines.commands.arguments import briefed_method, pin_texts, wanted_songs
from pipelines.commands.outcome import DONE, NOTHING_DONE, SOME_REFUSED, Outcome
from pipelines.commands.session import Session
from pipelines.commands.status import songs_of
from pipelines.studio.files import StudioError
from pipelines.studio.folder import existing
from schemas.keys import base_method


def dance_songs(
    root: Path,
    wanted: Sequence[str],
    *,
    method: str | None = None,
    frame_rate_hz: float | None,
    out: Path | None,
    progress: Callable[[], Any],
    pins: Sequence[str] = (),
    alternatives: int = 1,
    character: str = "",
    temperature: float | None = None,
    seed: int = 0,
) -> Outcome:
    """Dance songs, building first what they need and nothing else; by their briefs' methods where none is given."""
    studio = existing(root)
    if method is not None and method not in METHODS:
        raise StudioError(f"--method: want one of {', '.join(METHODS)}, got {method!r}")
    if out is not None:
        dance_report.check_out(out)
    pins = pin_texts(pins, root, progress)
    if temperature is not None and not 0 <= temperature <= 10:
        raise StudioError(f"--temperature: want 0 to 10, got {temperature:g}")
    if not 1 <= alternatives <= MOST_ALTERNATIVES:
        raise StudioError(f"--alternatives: want 1 to {MOST_ALTERNATIVES}, got {alternatives}")
    work = Session(studio, progress)
    songs = wanted_songs(work.state.sources, wanted, studio)
    character = casting.named(studio, work.state.sources, character)
    if out is not None and len(songs) > 1:
        raise StudioError(f"--out: want one song, got {len(songs)}; leave it out, the dances are under {studio.dances}")
    methods = {song.key: _ways(method or briefed_method(studio, song), alternatives) for song in songs}
    keys = {f"{song}|{chosen}" for song, ways in methods.items() for chosen in ways}
    if temperature is not None and not any(METHODS[base_method(key.split("|")[1])].draws for key in keys):
        able = " or ".join(method.name for method in METHODS.values() if method.draws)
        raise StudioError(
            f"--temperature: want the method {able}, which draws dances, got another; name it by --method"
        )
    before = studio.requests()
    for key in sorted(keys):
        studio.remember(key, Request(frame_rate_hz or 0.0, pins, character, temperature, seed))
    names = {song.key for song in songs}
    if any(METHODS[base_method(chosen)].learns for ways in methods.values() for chosen in ways):
        names |= work.state.sources.performed_songs  # what the dancer danced to is what the model learns from
    try:
        report = work.run(
            build.GROUPS,
            keys=lambda kind, key: key in keys if kind == "dance" else key in names if kind == "song" else True,
            assets=set().union(*(work.state.needed_for(key) for key in keys)),
        )
    except StudioError:  # nothing was danced: nobody has asked
        for key in sorted(keys):
            studio.remember(key, before.get(key))
        raise
    state = freshness(studio)
    refused = {f["key"]: f["reason"] for f in songs_of(state, studio) if f["state"] == "refused"}
    made, troubles = [], []
    for song, way in [(one, way) for one in songs for way in methods[one.key]]:
        key = f"{song.key}|{way}"
        if refused.get(song.key):
            troubles.append(f"refused: {song.path}: {refused[song.key]}")
        elif not state.is_danced(key):
            troubles += [f"failed: {f}" for f in report.failed] or [f"failed: {song.path}"]
            studio.remember(key, before.get(key))  # what cannot be is not asked for again every night
        else:
            made.append(dance_report.facts_of(studio, song.key, way))
    if out is not None and made:
        dance_report.copy_out(made[0], out)
    told = tuple(f"[{song}{end}" for song in refused for end in "|]")  # a refused song's dance failed, of course
    troubles += [f"failed: {f}" for f in report.failed if not f.startswith(told)]
    troubles = list(dict.fromkeys(troubles))
    is_wanted = all(dance["as_wanted"] for dance in made)
    status = NOTHING_DONE if not made else DONE if is_wanted and not troubles else SOME_REFUSED
    facts = dance_report.dances_facts(made, troubles, len(keys)) | {"notes": work.notes}
    if not made:
        facts |= next((dict(t.facts) for t in report.troubles if "conflict" in t.facts), {})
    return Outcome(status, facts, "\n".join(dance_report.report_of(d) for d in made), troubles)


def _ways(method: str, alternatives: int) -> tuple[str, ...]:
    """Name the dances to make of a method: itself, and its alternatives."""
    if alternatives > 1 and not METHODS[method].has_alternatives:
        able = " or ".join(other.name for other in METHODS.values() if other.has_alternatives)
        raise StudioError(f"--alternatives: want the method {able}, which has them, got {method}")
    return (method, *(f"{method}_{number}" for number in range(2, alternatives + 1)))
