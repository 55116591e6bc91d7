"""Every clip: its label and style, its state, what is wrong with it, and which methods can dance it."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from assets.sources.sources import brief_of
from assets.tables.pack import by_clip
from pipelines.commands.arguments import wanted_songs
from pipelines.commands.outcome import DONE, SOME_REFUSED, Outcome
from pipelines.studio import inventory
from pipelines.studio.danceable import DancedSong, why_not
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder, existing
from schemas.motion import CLIP_FAULT, VERDICTS
from schemas.settings import METHODS

LONGEST_LIST = 60
"""Clips. Chosen by hand, to be looked through; --json has all."""

STATES = ("read", "new", "changed", *VERDICTS)


@dataclass(frozen=True)
class ClipFilter:
    """Which clips are listed: those that fit everything that is said.

    Parameters
    ----------
    label, style : any of these; all where empty
    state : any of :data:`STATES`: of the file, or a verdict on a fault of it
    method : that can dance it
    not_method : that cannot
    """

    label: Sequence[str] = ()
    style: Sequence[str] = ()
    state: Sequence[str] = ()
    method: str = ""
    not_method: str = ""

    def __post_init__(self) -> None:
        for option, given, known in (
            ("--state", self.state, STATES),
            ("--method", [self.method] if self.method else [], METHODS),
            ("--not-method", [self.not_method] if self.not_method else [], METHODS),
        ):
            for value in given:
                if value not in known:
                    raise StudioError(f"{option}: want one of {', '.join(known)}, got {value!r}")

    def fits(self, clip: Mapping[str, Any]) -> bool:
        """Whether a clip of the listing is wanted.

        Parameters
        ----------
        clip : one of the listing
        """
        states = {clip["state"], *(fault["verdict"] for fault in clip["faults"])}
        return (
            (not self.label or clip["label"] in self.label)
            and (not self.style or clip["style"] in self.style)
            and (not self.state or bool(states & set(self.state)))
            and (not self.method or clip["danceable"][self.method])
            and (not self.not_method or not clip["danceable"][self.not_method])
        )


def list_clips(root: Path, song: str | None, wanted: ClipFilter) -> Outcome:
    """List the clips of a studio; nothing is built.

    Parameters
    ----------
    root : the studio
    song : for which they are to be danced; None for no song in particular
    wanted : ClipFilter

    Raises
    ------
    StudioError
        If there is no studio, or no such song.
    """
    studio = existing(root)
    sources, rows = studio.sources(), inventory.clip_rows(studio.lake)
    danced = None if song is None else _danced(studio, wanted_songs(sources, [song], studio)[0].key)
    files, _ = inventory.clips_and_doubts(sources, studio.lake, rows)
    faults = _faults(studio)
    told = {file["path"]: rows.get(file["path"]) or {} for file in files}
    facts = [{**file, "clip_id": file["key"], "licence": told[file["path"]].get("licence")} for file in files]
    refusals = why_not(studio.lake, facts, danced)
    every = [
        {
            "clip_id": clip["clip_id"],
            "path": clip["path"],
            "label": told[clip["path"]].get("label") or "",
            "style": told[clip["path"]].get("style") or "",
            "state": clip["state"],
            "reason": clip["reason"],
            "danceability_ratio": float(told[clip["path"]].get("danceability_ratio") or 0.0),
            "danceable": {name: name not in refusals[clip["clip_id"]] for name in METHODS},
            "why_not": refusals[clip["clip_id"]],
            "faults": faults.get(clip["clip_id"], []),
        }
        for clip in facts
    ]
    shown = sorted((clip for clip in every if wanted.fits(clip)), key=lambda clip: str(clip["clip_id"]))
    status = SOME_REFUSED if any(clip["state"] == "refused" for clip in shown) else DONE
    song_facts = {"song": danced.song_id} if danced else {}
    return Outcome(status, {"clips": shown, **song_facts}, _report(shown, len(every), danced))


def _danced(studio: StudioFolder, song: str) -> DancedSong:
    keys = studio.lake.keys("music_beat")
    beat_s = studio.lake.table("music_beat", song)["time_s"].to_numpy() if song in keys else np.zeros(0)
    interval_s = float(np.median(np.diff(beat_s))) if len(beat_s) > 1 else 0.0
    return DancedSong(song, tuple(brief_of(studio, song).allow), interval_s)


def _faults(studio: StudioFolder) -> dict[str, list[dict[str, Any]]]:
    """Gather the faults of all clips."""
    found: dict[str, list[dict[str, Any]]] = {}
    for session in studio.lake.keys(CLIP_FAULT.name):
        if studio.lake.stamp(CLIP_FAULT.name, session) is not None:
            for clip, rows in by_clip(studio.lake.table(CLIP_FAULT.name, session)).items():
                found[clip] = [
                    {name: value for name, value in row.items() if name not in ("clip_id", "fault_index")}
                    for row in rows.to_pylist()
                ]
    return found


def _report(shown: Sequence[Mapping[str, Any]], n_clips: int, song: DancedSong | None) -> str:
    able = {name: sum(clip["danceable"][name] for clip in shown) for name in METHODS}
    counted = ", ".join(f"{n} by {name}" for name, n in able.items())
    lines = [f"{len(shown)} of {n_clips} clips; danceable{f' to {song.song_id}' if song else ''}: {counted}"]
    common = _common(shown)
    lines += [f"  not by {name}, none of them: {sentence}" for name, sentence in common.items()]
    for clip in shown[:LONGEST_LIST]:
        ways = ", ".join(name for name, is_able in clip["danceable"].items() if is_able) or "by none"
        kind = " / ".join(text for text in (clip["label"], clip["style"]) if text)
        lines.append(f"  {clip['clip_id']}  {kind}  {clip['state']}  {ways}")
        lines += [f"      {line}" for line in _said(clip, common)]
    if len(shown) > LONGEST_LIST:
        lines.append(f"  … and {len(shown) - LONGEST_LIST} more; --json has all, --label, --style and --state fewer")
    return "\n".join(lines)


def _common(shown: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Find the methods that can dance no clip of several, for one reason."""
    found = {}
    for name in METHODS:
        reasons = {clip["why_not"].get(name, "") for clip in shown}
        if len(shown) > 1 and len(reasons) == 1 and "" not in reasons:
            found[name] = reasons.pop()
    return found


def _said(clip: Mapping[str, Any], common: Mapping[str, str]) -> list[str]:
    """Say why a clip is not danced, one line for methods of one reason; and what is wrong with it, in short."""
    if clip["state"] == "refused":
        return [f"refused: {clip['reason']}"]
    by_reason: dict[str, list[str]] = {}
    for name, sentence in clip["why_not"].items():
        if name not in common:
            by_reason.setdefault(sentence, []).append(name)
    lines = [f"not by {', '.join(names)}: {sentence}" for sentence, names in by_reason.items()]
    counted = Counter((fault["verdict"], fault["fault_kind"]) for fault in clip["faults"])
    for (verdict, kind), n in counted.items():
        first = next(f for f in clip["faults"] if (f["verdict"], f["fault_kind"]) == (verdict, kind))
        where = f"{first['start_s']:.2f} s" + (f", {first['joint_name']}" if first["joint_name"] else "")
        more = f" and {n - 1} more" if n > 1 else ""
        lines.append(f"{verdict}: {kind} at {where}{more}: {first['reason']}")
    return lines
