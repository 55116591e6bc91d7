"""The health of a clip before it is retargeted."""

from __future__ import annotations

from dataclasses import replace

from kernels.health import fills, glitches, one_body, righting, slides, stills
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.plausible import implausible
from kernels.health.speed_limit import LIMIT_DEG_PER_S, FastTurn, fast_turns
from kernels.health.verdicts import ClipFault, ExaminedClip, fence_of
from kernels.skeleton.naming import JointMapping
from kernels.types import Clip

_LEAST_SHARE = 0.2
"""Of a clip's frames that are left to show, below which it is refused. Chosen by hand."""

_LEAST_S = 1.0
"""Left to show of a clip of which half or more is fenced, below which it is refused: two beats at 120 a minute. Chosen
by hand."""


def examine(clip: Clip, mapping: JointMapping) -> ExaminedClip:
    """Examine a clip: what is plainly wrong is mended, what is not is fenced, doubted or refused.

    Parameters
    ----------
    clip : Clip of F frames on its own skeleton
    mapping : which of its joints is which canonical one

    Returns
    -------
    ExaminedClip
        As it came for F = 0. A clip of which nothing can be danced is given back as it came, with the faults that
        were found first.

    Notes
    -----
    First what was done to the whole: a second body, the path's unit, the up sign, four legs and other doubts, the
    handedness. Each is put right before the next is looked at, since that builds on it. Then stretches and frames:
    calibration poses at the ends, gaps filled in straight lines, frozen frames; jumps are mended or fenced; then
    slides. Last, in what is left to show, no joint may turn faster than a dance may
    (:mod:`kernels.health.speed_limit`).
    """
    if clip.n_frames == 0:
        return ExaminedClip(clip)
    body = BodyInMotion(clip, mapping)
    faults: list[ClipFault] = []
    looks = (
        one_body.more_bodies,
        righting.in_one_unit,
        righting.turned_upright,
        implausible,
        righting.unmirrored,
    )
    for look in looks:
        righted, found = look(body)
        faults += found
        if any(fault.verdict == "refused" for fault in found):
            return ExaminedClip(clip, tuple(faults))
        if righted is not None:
            body = BodyInMotion(righted, mapping)
    faults += stills.calibration_ends(body) + fills.straight_fills(body)
    for mend in (stills.frozen, glitches.mend):
        mended, found = mend(body, fence_of(faults, clip.n_frames))
        faults += found
        if mended is not body.clip:
            body = BodyInMotion(mended, mapping)
    faults += slides.slides(body, fence_of(faults, clip.n_frames))
    is_fenced = fence_of(faults, clip.n_frames)
    faults += glitches.told_once([_fenced(body, turn) for turn in fast_turns(body, is_fenced)])
    faults.sort(key=lambda fault: (fault.first, fault.last, fault.kind, fault.joint))
    faults += _little_left(body, faults)
    return ExaminedClip(body.clip, tuple(faults))


def _fenced(body: BodyInMotion, turn: FastTurn) -> ClipFault:
    joint = body.mapping.joint[turn.joint]
    against = "in the world" if turn.is_in_world else "against its parent"
    said = (
        f"{joint} turns {turn.speed_deg_per_s:.0f}°/s {against} at {body.at_s(turn.first)}, want at most "
        f"{LIMIT_DEG_PER_S:.0f}"
    )
    if turn.is_sudden:
        return ClipFault(
            "flip", joint, turn.first, turn.last, "fenced", f"{said}; not shown; clean it where it was recorded"
        )
    return ClipFault("fast", joint, turn.first, turn.last, "fenced", f"{said}: real, and too fast to be shown")


def _little_left(body: BodyInMotion, faults: list[ClipFault]) -> list[ClipFault]:
    """Refuse a clip of which little is left."""
    is_fenced = fence_of(faults, body.clip.n_frames)
    left = float(1 - is_fenced.mean())
    left_s = left * body.clip.n_frames / body.clip.frame_rate_hz
    if left >= 0.5 or (left >= _LEAST_SHARE and left_s >= _LEAST_S):
        return []
    worst = max((f for f in faults if f.verdict == "fenced"), key=lambda f: f.last - f.first)
    whole_s = body.clip.n_frames / body.clip.frame_rate_hz
    said = f"{left_s:.2f} s of {whole_s:.2f} s are left to show; most is lost to: {worst.reason}"
    said = "; ".join([said, *(fault.reason for fault in faults if fault.verdict == "doubtful")])
    return [replace(worst, first=0, last=body.clip.n_frames - 1, verdict="refused", reason=said)]
