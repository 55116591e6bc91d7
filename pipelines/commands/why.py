"""Where a moment of a dance comes from, and why: answered from the lake, or from a stage alone."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from assets.dancing import licences
from assets.stage import lineage_of
from assets.tables.pack import frame_rate_hz
from pipelines.collection import freshness
from pipelines.commands.arguments import briefed_method, wanted_songs
from pipelines.commands.outcome import DONE, Outcome
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder, existing
from schemas.keys import mirrored, seen_label

STAGE_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")


@dataclass(frozen=True)
class Told:
    """What is known of a dance: a value a frame by the names of the contract's ``LINEAGE``, its clips, its licence."""

    name: str
    frame_rate_hz: float
    frames: Mapping[str, Sequence[Any]]
    clips: Mapping[str, Mapping[str, Any]]
    licence: Mapping[str, Any]

    @property
    def duration_s(self) -> float:
        """Seconds from the first frame to the last."""
        return (len(self.frames["odori:step"]) - 1) / self.frame_rate_hz


def explain(told: Told, at_s: float | None) -> Outcome:
    """Say where a moment of a dance comes from, or where all of it does.

    Parameters
    ----------
    told : Told
    at_s : float, seconds of the song, or None for the whole dance

    Raises
    ------
    StudioError
        If the moment is not in the dance.
    """
    if at_s is None:
        return _whole(told)
    if not 0 <= at_s <= told.duration_s + 1 / told.frame_rate_hz:
        raise StudioError(f"--at: want seconds within the dance, 0 to {told.duration_s:.2f}, got {at_s:g}")
    facts = moment(told, at_s)
    return Outcome(DONE, facts, "\n".join(_lines(facts)))


def moment(told: Told, at_s: float) -> dict[str, Any]:
    """Facts of the frame nearest to a moment."""
    n = len(told.frames["odori:step"])
    index = min(round(at_s * told.frame_rate_hz), n - 1)
    here = {name: values[index] for name, values in told.frames.items()}
    step = json.loads(here["odori:step"])
    clip, partner = told.clips.get(here["odori:clip"], {}), told.clips.get(here["odori:blendClip"], {})
    is_blended = bool(here["odori:blendClip"])
    return {
        "dance": told.name,
        "frame_index": index,
        "time_s": round(index / told.frame_rate_hz, 6),
        "clip_id": here["odori:clip"],
        "clip_time_s": round(float(here["odori:clipTime"]), 4),
        **_facts(clip, is_mirrored=bool(here["odori:mirrored"])),
        "warp_ratio": round(float(here["odori:warp"]), 4),
        "is_mirrored": bool(here["odori:mirrored"]),
        "blend": {
            "clip_id": here["odori:blendClip"] or None,
            "clip_time_s": round(float(here["odori:blendTime"]), 4) if is_blended else None,
            "is_mirrored": bool(here["odori:blendMirrored"]),
            "weight_ratio": round(float(here["odori:blendWeight"]), 4),
            **(_facts(partner, is_mirrored=bool(here["odori:blendMirrored"])) if is_blended else {}),
        },
        "step": step,
        "pin": step["pin"],
    }


def _facts(clip: Mapping[str, Any], *, is_mirrored: bool = False) -> dict[str, Any]:
    """Gather what is known of a clip; the label is that of what is seen."""
    names = ("session", "label", "style", "path", "sha256", "licence")
    facts = {name: clip.get(name, "") for name in names}
    return facts | {"label": seen_label(facts["label"] or "", mirrored("")) if is_mirrored else facts["label"]}


def _lines(facts: Mapping[str, Any]) -> list[str]:
    """Write the facts of a moment as lines."""
    step, blend = facts["step"], facts["blend"]
    return [
        f"{facts['dance']} at {facts['time_s']:.2f} s (frame {facts['frame_index']})",
        f"  clip     {facts['clip_id']} at {facts['clip_time_s']:.2f} s{', mirrored' if facts['is_mirrored'] else ''}",
        f"  source   {facts['path'] or 'not known'}, session {facts['session'] or 'not known'}"
        + (f", {facts['label']}" if facts["label"] else "")
        + (f", {facts['style']}" if facts["style"] else ""),
        f"  licence  {facts['licence'] or 'none named: counts as the studio' + chr(39) + 's own'}",
        f"  blend    {blend['weight_ratio']:.0%} of {blend['clip_id']} at {blend['clip_time_s']:.2f} s"
        f"{', mirrored' if blend['is_mirrored'] else ''}, {blend['path']}"
        if blend["clip_id"]
        else "  blend    none",
        f"  warp     {facts['warp_ratio']:.3f} (song time over clip time)",
        f"  step     {step['step_index']}: song {step['song_start_s']:.2f} to {step['song_end_s']:.2f} s, "
        + ("after a seam" if step["has_seam"] else "going on in the clip" if step["step_index"] else "the first"),
        f"  why      {_reason(step)}",
    ]


def _reason(step: Mapping[str, Any]) -> str:
    costs = ", ".join(f"{name} {value:.2f}" for name, value in sorted(step["costs"].items(), key=lambda c: -c[1]))
    pin = f"pin {step['pin']}; " if step["pin"] else ""
    return f"{pin}the cheapest path for the whole song; cost of this step: {costs or 'nothing'}"


def _whole(told: Told) -> Outcome:
    """List every step of a dance, the clips it shows and their licence."""
    steps = [json.loads(text) for text in dict.fromkeys(told.frames["odori:step"])]
    named = [
        {**step, **_facts(told.clips.get(step["clip_id"], {}), is_mirrored=step.get("is_mirrored", False))}
        for step in steps
    ]
    facts = {
        "dance": told.name,
        "duration_s": round(told.duration_s, 4),
        "frame_rate_hz": told.frame_rate_hz,
        "licence": dict(told.licence),
        "steps": named,
        "clips": [{"clip_id": clip, **_facts(row)} for clip, row in told.clips.items()],
    }
    lines = [f"{told.name}: {told.duration_s:.2f} s, {len(told.clips)} clips; {told.licence.get('sentence', '')}"]
    lines.append("     song          clip seconds     warp  cost  clip")
    for run in _phrases(named):
        first, last = run[0], run[-1]
        cost = sum(sum(step["costs"].values()) for step in run)
        pace = (last["song_end_s"] - first["song_start_s"]) / max(last["clip_end_s"] - first["clip_start_s"], 1e-9)
        pins = list(dict.fromkeys(step["pin"] for step in run if step["pin"]))
        lines.append(
            f"{first['song_start_s']:7.2f} {last['song_end_s']:7.2f}   {first['clip_start_s']:7.2f} "
            f"{last['clip_end_s']:7.2f}   {pace:5.2f} {cost:5.2f}  {first['clip_id']}"
            + (" (mirrored)" if first.get("is_mirrored") else "")
            + (f", {first['licence']}" if first["licence"] else "")
            + (f"  <- pin {', '.join(pins)}" if pins else "")
        )
    return Outcome(DONE, facts, "\n".join(lines))


def _phrases(steps: Sequence[Mapping[str, Any]]) -> list[list[Mapping[str, Any]]]:
    """Put steps together that go on in one clip."""
    runs: list[list[Mapping[str, Any]]] = []
    for step in steps:
        if not runs or step["has_seam"]:
            runs.append([])
        runs[-1].append(step)
    return runs


def from_lake(studio: StudioFolder, key: str) -> Told:
    """Read what the lake knows of a dance, ``<song>|<method>``."""
    frames, steps = studio.lake.table("frame_lineage", key), studio.lake.table("choreography", key)
    danced = set(frames["clip_id"].to_pylist()) | set(filter(None, frames["blend_clip_id"].to_pylist()))
    rows = pl.concat([pl.DataFrame(studio.lake.table("clip", s, clip_ids=danced)) for s in studio.lake.keys("clip")])
    clips = {row["clip_id"]: {**row, "sha256": row["source_sha256"]} for row in rows.iter_rows(named=True)}
    licence = licences.report({clip: str(row["licence"]) for clip, row in clips.items()})
    return Told(key, frame_rate_hz(frames), lineage_of(frames, steps), clips, licence)


def from_stage(path: Path) -> Told:
    """Read what a stage says of itself; no studio is needed.

    Raises
    ------
    FormatError, StudioError
        If it is no stage, or none that says where its frames come from.
    """
    from assets.formats import usd_lineage, usd_read

    stage = usd_read.open_stage(path)
    animation = usd_lineage.animation_with_lineage(stage)
    if animation is None:
        raise StudioError(
            f"{path}: want a stage with the lineage of its frames, got none; dance the song again with this odori"
        )
    codes = np.arange(stage.GetStartTimeCode(), stage.GetEndTimeCode() + 1)
    provenance = usd_read.read_provenance(path)
    clips = json.loads(str(provenance.get("clips", "[]")))
    licence = provenance.get("licence", {})
    return Told(
        path.name,
        float(stage.GetTimeCodesPerSecond()),
        usd_lineage.read_lineage(animation, codes),
        {clip["clip_id"]: clip for clip in clips},
        licence if isinstance(licence, dict) else {},
    )


def find_dance(studio: StudioFolder, text: str, preferred: str) -> str:
    """Find a stored dance by its song, or its song and method.

    Parameters
    ----------
    studio : StudioFolder
    text : key of a ``song``, or ``song|method``
    preferred : method to take where a song is danced by several

    Raises
    ------
    StudioError
        If it was not danced; names what was.
    """
    song, _, method = text.partition("|")
    danced = [k for k in studio.lake.keys("frame_lineage") if k.split("|")[0] == song]
    wanted = f"{song}|{method or preferred}"
    if wanted in danced:
        return wanted
    if danced and not method:
        return danced[0]
    every = studio.lake.keys("frame_lineage")
    known = f"it was danced as {', '.join(danced)}" if danced else f"danced are {', '.join(every[:10]) or 'none'}"
    raise StudioError(f"{text}: want a dance, got none of that name; {known}; make it with 'odori dance'")


def explain_dance(root: Path, danced: str, *, at_s: float | None) -> Outcome:
    """Say where a moment of a dance comes from, or where all of it does; a stage answers without a studio."""
    if danced.lower().endswith(STAGE_SUFFIXES):
        return explain(from_stage(Path(danced)), at_s)
    studio = existing(root)
    state = freshness(studio)
    text, bar, method = danced.partition("|")
    song = wanted_songs(state.sources, [text], studio)[0]
    key = find_dance(studio, f"{song.key}{bar}{method}", briefed_method(studio, song))
    return explain(from_lake(studio, key), at_s)
