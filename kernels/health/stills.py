"""Stretches in which nothing moves as a body does: frozen frames, frames said twice, calibration poses at the ends.

Conventions
-----------
A step is *still* where no joint turns and nothing moves, to the last digit that files have: a living body never stands
so. A still stretch is *frozen* where the body is in motion up to it or right after it; a hold that somebody drew eases
in and out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.health import mending
from kernels.health.body_in_motion import SIDES, BodyInMotion
from kernels.health.speed_limit import LIMIT_DEG_PER_S
from kernels.health.verdicts import ClipFault
from kernels.runs import runs_of
from kernels.types import Clip, Float

_STILL_DEG = 1e-3
_STILL_M = 1e-5
"""What no joint turns and the hips do not move in a still step. Chosen below the digits of exporters and above the
noise of single precision."""

_FROZEN_S = 0.2
"""Shortest stretch that is said to be frozen. Chosen by hand: less is a frame said twice."""

_ABRUPT_RATIO = 0.5
"""Share of the usual motion that goes on up to a frozen stretch, or sets in right after it. Chosen by hand."""

_MOVING_DEG = 1.0
"""Sum of all joints' turns in a step, from which a body moves so that a repeated frame is seen. Chosen by hand."""

_CAUGHT_UP_RATIO = 1.6
"""How much larger than usual the step after one repeated frame is. Chosen between 1, nothing was left out, and 2, time
went on."""

_MOST_SAID = 5
"""Repeated frames that are told one by one. Chosen by hand."""

PLAIN_DEG = 4.0
"""How far the same curves may miss frames just before and after, so that repeated frames are mended. Chosen by hand."""

_LEVEL_COS = float(np.cos(np.radians(25.0)))
_LOOSE_COS = float(np.cos(np.radians(50.0)))
_STRAIGHT_COS = float(np.cos(np.radians(20.0)))
"""Of arms with the line of the shoulders in a T-pose that is held, and in one that is left in a jump; of legs and trunk
with the vertical. Chosen by hand."""

_REST_DEG = 3.0
"""How far any joint may be turned in the rig's own rest pose. Chosen by hand."""

_HELD_S = 0.2
_HELD_M_PER_S = 0.06
"""How long and how still, on the canonical body, a T-pose is held that calibrates. Chosen by hand."""

_LET_GO_S = 0.25
"""Longest way out of a calibration pose that goes with it. Chosen by hand."""


def frozen(body: BodyInMotion, is_hidden: NDArray[np.bool_]) -> tuple[Clip, list[ClipFault]]:
    """Find frozen stretches, and mend frames that were said twice.

    Parameters
    ----------
    body : BodyInMotion of F frames
    is_hidden : (F,) bool
        Frames that are fenced already: what is frozen within them is theirs.

    Returns
    -------
    clip : with repeated frames mended, where the step after them shows that time went on
    faults : fenced stretches, mended frames; one doubtful where nothing moves at all
    """
    clip, rate_hz = body.clip, body.clip.frame_rate_hz
    if clip.n_frames < 4:
        return clip, []
    motion = _motion_deg(body)
    is_still = _is_still(body)
    if is_still.all():
        said = f"nothing moves in its {clip.duration_s:.2f} s: a pose, not a motion"
        return clip, [body.whole("frozen", "doubtful", said)]
    faults, twice = [], []
    for first, last in runs_of(is_still).tolist():
        around = np.concatenate([motion[max(first - 15, 0) : first], motion[last + 1 : last + 16]])
        usual = float(np.median(around[around > 0])) if (around > 0).any() else 0.0
        edges = [motion[k] for k in (first - 1, last + 1) if 0 <= k < len(motion)]
        n = last - first + 1
        if is_hidden[first : last + 2].all():
            continue
        if n + 1 >= max(_FROZEN_S * rate_hz, 4):
            if usual > 0 and max(edges) > _ABRUPT_RATIO * usual:
                said = (
                    f"frozen for {n / rate_hz:.2f} s from {body.at_s(first)}, in the middle of motion; not shown; "
                    "fill the gap where it was recorded"
                )
                faults.append(ClipFault("frozen", "", first, last + 1, "fenced", said))
        elif (
            usual > _MOVING_DEG
            and n <= mending.longest_gap(rate_hz)
            and last + 1 < len(motion)
            and motion[last + 1] > (1 + n * (_CAUGHT_UP_RATIO - 1)) * _beside(motion, first, last)
        ):
            twice.append((first + 1, last + 1))
    mended, done, left = _filled(body, twice)
    for first, last in left:
        said = f"{last - first + 1} frames at {body.at_s(first)} say the one before again in fast motion; not shown"
        faults.append(ClipFault("frozen", "", first, last, "fenced", f"{said}; fill them where it was recorded"))
    return mended, sorted(faults + _told(body, done), key=lambda fault: fault.first)


def calibration_ends(body: BodyInMotion) -> list[ClipFault]:
    """Find calibration poses at the beginning and at the end.

    Parameters
    ----------
    body : BodyInMotion

    Returns
    -------
    list of ClipFault
        Fenced: a T-pose, or the rig's rest pose, that is held or left in a jump; with the way out of it.
    """
    clip, rate_hz = body.clip, body.clip.frame_rate_hz
    if clip.n_frames < max(_LET_GO_S * rate_hz, 4) or _is_still(body).all():
        return []
    level, is_rest = _arms_level_cos(body), _is_rest(body)
    limit = LIMIT_DEG_PER_S / rate_hz
    step = body.step_size_deg
    ends = body.place("leftHand", "rightHand", "head") - body.hips
    speed = np.linalg.norm(np.diff(ends, axis=0), axis=-1) * rate_hz / body.scale
    faults = []
    for name, back in (("beginning", False), ("end", True)):
        cos, rest, steps, speeds = (x[::-1] if back else x for x in (level, is_rest, step, speed))
        for pose, is_posed, is_held_too in (
            ("a T-pose", cos > _LEVEL_COS, True),
            ("a T-pose", cos > _LOOSE_COS, False),
            ("the rest pose", rest, False),
        ):
            n = int(np.argmin(is_posed)) if not is_posed.all() else 0
            if n == 0:
                continue
            away = steps[n - 1 : n + 2]
            is_left_at_once = bool(((away > limit).sum(axis=1) >= 2).any())
            is_held = n >= _HELD_S * rate_hz and float(np.median(speeds[: n - 1])) < _HELD_M_PER_S
            if not (is_left_at_once or (is_held and is_held_too)):
                continue
            good = n - 1
            while good < len(steps) and good < n + _LET_GO_S * rate_hz and steps[good].max() > limit / 2:
                good += 1
            n_bad = max(n, good)
            first, last = (clip.n_frames - n_bad, clip.n_frames - 1) if back else (0, n_bad - 1)
            how = "left in a jump" if is_left_at_once else "held"
            said = f"{pose} at the {name}, {n / rate_hz:.2f} s, {how}: a calibration, no dance; not shown; cut it off"
            faults.append(ClipFault("tpose", "", max(first, 0), last, "fenced", said))
            break
    return faults


def _beside(motion: Float, first: int, last: int) -> float:
    """Mean motion just before a still stretch and after the step that catches up."""
    beside = [motion[k] for k in (first - 1, last + 2) if 0 <= k < len(motion) and motion[k] > _STILL_DEG]
    return float(np.mean(beside)) if beside else np.inf


def _motion_deg(body: BodyInMotion) -> Float:
    """Sum of the turns of all joints in each step, (F - 1,), degrees; a centimetre of the hips counts as one."""
    return np.asarray(
        body.step_size_deg.sum(axis=1) + 100 * np.linalg.norm(np.diff(body.hips, axis=0), axis=-1), np.float64
    )


def _is_still(body: BodyInMotion) -> NDArray[np.bool_]:
    moved = np.linalg.norm(np.diff(body.hips, axis=0), axis=-1)
    return np.asarray((body.step_size_deg.max(axis=1) < _STILL_DEG) & (moved < _STILL_M), np.bool_)


def _filled(
    body: BodyInMotion, gaps: list[tuple[int, int]]
) -> tuple[Clip, list[tuple[int, int]], list[tuple[int, int]]]:
    """Mend frames that were said twice in all joints: the clip, the gaps that were mended, those that cannot be."""
    clip = body.clip
    is_good = np.ones(clip.n_frames, bool)
    for first, last in gaps:
        is_good[first : last + 1] = False
    rotation_wxyz, root = clip.rotation_wxyz.copy(), clip.root_xyz_m.copy()
    moved = None if clip.translation_xyz_m is None else clip.translation_xyz_m.copy()
    done, left = [], []
    for first, last in gaps:
        frames = mending.support(first, last, is_good)
        if frames is None or _worst_doubt_deg(body, first, last, is_good) > PLAIN_DEG:
            left.append((first, last))
            continue
        for k in range(len(clip.skeleton.joints)):
            rotation_wxyz[first : last + 1, k] = mending.bridge_turns(clip.rotation_wxyz[:, k], frames)
            if moved is not None:
                moved[first : last + 1, k] = mending.bridge_places(clip.translation_xyz_m[:, k], frames)  # type: ignore[index]
        root[first : last + 1] = mending.bridge_places(clip.root_xyz_m, frames)
        done.append((first, last))
    if not done:
        return clip, [], left
    rotation_wxyz = rotation.continuous(rotation_wxyz)
    return replace(clip, root_xyz_m=root, rotation_wxyz=rotation_wxyz, translation_xyz_m=moved), done, left


def _worst_doubt_deg(body: BodyInMotion, first: int, last: int, is_good: NDArray[np.bool_]) -> float:
    return max(_doubt_deg(body.clip.rotation_wxyz[:, k], first, last, is_good) for k in body.needed)


def _doubt_deg(turn: Float, first: int, last: int, is_good: NDArray[np.bool_]) -> float:
    """Tell how far a joint's curve would be off; 0 where nothing beside the gap tells."""
    missed = mending.doubt(
        lambda frames: mending.bridge_turns(turn, frames),
        lambda a, curve: float(rotation.angle_between(turn[a : a + len(curve)], curve).max()),
        first,
        last,
        is_good,
    )
    return float(np.degrees(missed)) if np.isfinite(missed) else 0.0


def _told(body: BodyInMotion, done: list[tuple[int, int]]) -> list[ClipFault]:
    if len(done) > _MOST_SAID:
        said = (
            f"{len(done)} times a frame says the one before again, and the next catches up: recorded at a lower rate, "
            "or frames were lost; mended by a cubic from the frames around; export at the rate of the recording"
        )
        return [ClipFault("frozen", "", done[0][0], done[-1][1], "mended", said)]
    return [
        ClipFault(
            "frozen",
            "",
            first,
            last,
            "mended",
            f"{last - first + 1} frames at {body.at_s(first)} say the one before again, and the next catches up; "
            "mended by a cubic from the frames around",
        )
        for first, last in done
    ]


def _arms_level_cos(body: BodyInMotion) -> Float:
    """Least cosine of the arms' bones with the line of the shoulders, (F,); -1 where legs or trunk are bent."""

    def along(a: str, b: str) -> Float:
        way = body.place(b) - body.place(a)
        return np.asarray(way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9), np.float64)

    across = along("rightUpperArm", "leftUpperArm")
    is_straight = along("hips", "head")[:, 1] > _STRAIGHT_COS
    cos = np.ones(len(is_straight))
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        for a, b in (("UpperArm", "LowerArm"), ("LowerArm", "Hand")):
            cos = np.minimum(cos, sign * np.sum(along(side + a, side + b) * across, axis=-1))
        for a, b in (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot")):
            is_straight &= -along(side + a, side + b)[:, 1] > _STRAIGHT_COS
    return np.where(is_straight, cos, -1.0)


def _is_rest(body: BodyInMotion) -> NDArray[np.bool_]:
    below = [k for k in body.needed if k > 0 and k != body.at["hips"]]
    turned = np.degrees(rotation.angle_between(rotation.IDENTITY, body.clip.rotation_wxyz[:, below]))
    return np.asarray(turned.max(axis=1) < _REST_DEG, np.bool_)
