"""Whether a clip can be a dancing person's at all: two legs, a person's proportions, a person's pace, up that is up.

Conventions
-----------
Lengths are compared with thigh and shin, so that units do not matter; speeds and accelerations are brought to the
canonical body. What no person can be is refused; what few people are is doubtful, and danced.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from kernels.health.body_in_motion import SIDES, BodyInMotion
from kernels.health.verdicts import ClipFault
from kernels.skeleton import alignment, topology
from kernels.types import Float

_ACROSS_COS = 0.7
_BESIDE_COS = 0.7
"""Cosines of the trunk with the legs, below, and of the arms with the legs, above, of a body on four legs. Chosen by
hand: people stand at 1 and -1."""

_LONG_TRUNK = 0.85
_LONG_ARMS = 0.8
"""Trunk and arms over legs, above those of people. Measured on 500 takes of 60 people: .40 to .75, and .58 to .72."""

_PROPORTIONS = {
    "trunk": (0.3, 1.1),
    "arms": (0.4, 1.0),
    "hips": (0.05, 0.6),
    "shoulders": (0.1, 1.0),
}
"""Over the legs, of bodies that pass for people's, drawn ones too. Chosen by hand around the widest measured on 500
takes: .40 to .75, .58 to .72, .16 to .31, .24 to .50."""

_STRETCH_RATIO = 0.25
"""By how much a limb's bone may change its length. Chosen by hand: drawn characters stretch, people do not."""

_LYING_COS = 0.35
"""Of the trunk with the vertical, usually: below, the body lies, or up is another axis. Chosen by hand."""

_SLOWEST_S, _FASTEST_S = 2.0, 0.11
"""Reach of hands and feet over the speed that they have in a 20th of the frames, of slow people, and in three of ten,
of fast ones. Measured on 351 takes: at most 1.1, in waving, and at least .17, in a run; chosen beyond both."""

_PACE_HZ = 60.0
"""Over which time speeds are taken: a frame, or less than one of too fast a take. Chosen by hand."""

_REACH_M = 0.25
"""Of a hand or foot about the hips from which it tells the pace, on the canonical body. Chosen by hand."""

_SLOWEST_HZ, _HIGHEST_HZ = 12.0, 500.0
"""Rates at which people are recorded. Chosen by hand."""

_UNBENT_RAD = float(np.radians(5.0))
"""Elbows and knees that never bend further show no axis. Chosen by hand."""


def implausible(body: BodyInMotion) -> tuple[None, list[ClipFault]]:
    """Tell why a clip may be no dancing person's.

    Parameters
    ----------
    body : BodyInMotion

    Returns
    -------
    None, and the faults
        One refused for a body on four legs; else any doubts.
    """
    ratio = _ratios(body)
    legs = _four_legs(body, ratio)
    if legs is not None:
        return None, [legs]
    doubts = [_odd_proportions(body, ratio), _lying(body), _odd_pace(body), _idle_rest(body)]
    return None, [doubt for doubt in doubts if doubt is not None]


def _ratios(body: BodyInMotion) -> dict[str, float]:
    def length(a: str, b: str) -> float:
        return float(np.median(np.linalg.norm(body.place(b) - body.place(a), axis=-1))) / body.leg_m

    arms = [length(side + "UpperArm", side + "LowerArm") + length(side + "LowerArm", side + "Hand") for side in SIDES]
    return {
        "trunk": float(np.median(np.linalg.norm(body.trunk, axis=-1))) / body.leg_m,
        "arms": sum(arms) / 2,
        "hips": length("leftUpperLeg", "rightUpperLeg"),
        "shoulders": length("leftUpperArm", "rightUpperArm"),
    }


def _four_legs(body: BodyInMotion, ratio: dict[str, float]) -> ClipFault | None:
    legs = body.place("leftFoot", "rightFoot") - body.hips
    arms = body.place("leftHand", "rightHand") - body.place("leftUpperArm", "rightUpperArm")
    across = float(np.median(-_cosine(body.trunk, legs)))
    beside = float(np.median(_cosine(arms, legs)))
    is_animal = ratio["trunk"] > _LONG_TRUNK or ratio["arms"] > _LONG_ARMS
    if not (abs(across) < _ACROSS_COS and beside > _BESIDE_COS and is_animal):
        return None
    said = (
        f"a body on four legs: the trunk lies across the legs (cosine {across:.2f}, want near 1), the arms stand "
        f"beside them, and the trunk is {ratio['trunk']:.2f}, the arms {ratio['arms']:.2f} legs long (people have .4 "
        "to .75 and .58 to .72); its joints have a person's names; leave it out"
    )
    return body.whole("proportions", "refused", said)


def _odd_proportions(body: BodyInMotion, ratio: dict[str, float]) -> ClipFault | None:
    odd = [
        f"{part} {ratio[part]:.2f} (people {low:g} to {high:g})"
        for part, (low, high) in _PROPORTIONS.items()
        if not low < ratio[part] < high
    ]
    if odd:
        return body.whole("proportions", "doubtful", f"lengths over the legs': {', '.join(odd)}; look at its joints")
    if body.clip.translation_xyz_m is None:
        return None
    for side in SIDES:
        for a, b in (*pairwise(topology.ARM[1:]), *pairwise(topology.LEG[:3])):
            length = np.linalg.norm(body.place(side + b) - body.place(side + a), axis=-1)
            usual = float(np.median(length))
            low, high = np.quantile(length, (0.02, 0.98))
            if high - low > _STRETCH_RATIO * usual:
                said = f"{side}{a} is {low:.2f} to {high:.2f} m long, want one length; look at what moves its joints"
                return body.whole("proportions", "doubtful", said, body.mapping.joint[side + a])
    return None


def _lying(body: BodyInMotion) -> ClipFault | None:
    upright = float(np.median(_cosine(body.trunk, np.array([0.0, 1.0, 0.0]))))
    if abs(upright) > _LYING_COS:
        return None
    said = f"the trunk lies (cosine {upright:.2f} with up, usually): a dance on the floor, or another axis is up"
    return body.whole("up_axis", "doubtful", f"{said}; say health = ok, or export with y or z up")


def _odd_pace(body: BodyInMotion) -> ClipFault | None:
    rate_hz = body.clip.frame_rate_hz
    if body.clip.n_frames < 2:
        return None
    if not _SLOWEST_HZ <= rate_hz <= _HIGHEST_HZ:
        said = f"{rate_hz:g} frames a second, want {_SLOWEST_HZ:g} to {_HIGHEST_HZ:g}; see to the frame time"
        return body.whole("rate", "doubtful", said)
    stride = max(round(rate_hz / _PACE_HZ), 1)
    if body.clip.n_frames <= 2 * stride:
        return None
    slow_s, fast_s = _pace_s(body, stride, 0.95), _pace_s(body, stride, 0.7)
    if slow_s is not None and slow_s > _SLOWEST_S:
        said = f"hands and feet take {slow_s:.2g} s for their reach, people at most 1.1: as if slowed several times"
    elif fast_s is not None and fast_s < _FASTEST_S:
        said = (
            f"hands and feet take {fast_s:.2g} s for their reach, people at least .17: as if speeded up several times"
        )
    else:
        return None
    return body.whole("rate", "doubtful", f"{said}; see to the frame time ({1 / rate_hz:.5f} s)")


def _pace_s(body: BodyInMotion, stride: int, share: float) -> float | None:
    """Reach of hands and feet about the hips over a quantile of their speed, the least; None where they stay."""
    found = []
    for name in (side + part for part in ("Hand", "Foot") for side in SIDES):
        place = (body.place(name) - body.hips) / body.scale
        low, high = np.quantile(place, (0.02, 0.98), axis=0)
        reach = float(np.linalg.norm(high - low))
        speed = np.linalg.norm(place[stride:] - place[:-stride], axis=-1) * body.clip.frame_rate_hz / stride
        if reach > _REACH_M:
            found.append(reach / max(float(np.quantile(speed, share)), 1e-9))
    return min(found, default=None)


def _idle_rest(body: BodyInMotion) -> ClipFault | None:
    """Doubt a rest pose that is nobody's in a clip that bends no limb: nothing says how the limbs are turned."""
    rest = alignment.rest_position(body.clip)
    legs = [rest[body.at[side + "Foot"]] - rest[body.at[side + "UpperLeg"]] for side in SIDES]
    top = rest[body.at["neck" if "neck" in body.at else "head"]]
    up = top - (rest[body.at["leftUpperLeg"]] + rest[body.at["rightUpperLeg"]]) / 2
    if float(_cosine(np.mean(legs, axis=0), up)) < 0.0:
        return None
    for side in SIDES:
        for a, b, c in ((*topology.ARM[1:],), (*topology.LEG[:3],)):
            one, two = (body.place(side + q) - body.place(side + p) for p, q in ((a, b), (b, c)))
            if float(np.quantile(_cosine(one, two), 0.05)) < np.cos(_UNBENT_RAD):
                return None
    said = "the rest pose is no person's, and no elbow or knee bends: nothing tells how the limbs are turned"
    return body.whole("rest_pose", "doubtful", f"{said}; export with a T-pose at rest")


def _cosine(a: Float, b: Float) -> Float:
    length = np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1)
    return np.asarray(np.sum(a * b, axis=-1) / np.maximum(length, 1e-12), np.float64)
