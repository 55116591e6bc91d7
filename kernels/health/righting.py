"""Clips that are right but for one thing that was done to the whole: head down, mirrored, the path in another unit.

Conventions
-----------
Each function returns the clip put right, or None where it may stay as it is, and the faults that say so. Feet are what
stays planted: the *glide* of a motion is the mean speed, over the ground, of whichever point of the feet is slowest,
the fastest tenth of the frames left out.
"""

from __future__ import annotations

import numpy as np

from kernels.health.body_in_motion import FARTHEST_M, SIDES, BodyInMotion
from kernels.health.verdicts import ClipFault
from kernels.types import Clip, Float, Skeleton

_UPSIDE_DOWN = -0.5
"""Median height of the trunk, over its length, below which a body hangs. Chosen by hand, 30 degrees off."""

_PLANTED_M_PER_S = 0.25
"""Slower over the ground, a foot is planted, on the canonical body. Chosen by hand, twice the slide of good takes."""

_LEVEL_M = 0.06
"""How far from the level of the feet a planted one may be, on the canonical body. Chosen by hand: a heel's lift."""

_PLANTED_SHARE = 0.2
"""Of the frames, with a foot planted at the level farthest from the head, which tells a floor. Chosen by hand."""

_BENT_RATIO = 0.02
"""How far, in legs, a knee stands off the line from hip to ankle to tell ahead from behind. Chosen by hand."""

_POINTING_RATIO = 0.3
"""Cosine between foot and facing that tells ahead from behind. Chosen by hand."""

_BACKWARDS_COS = 0.6
"""Cosine between foot and facing, below whose opposite toes point behind, whatever the knees. Chosen by hand."""

_BACKWARDS_RATIO = 0.05
"""How far, in legs, knees bend backwards that no knee does. Chosen by hand: three degrees more than overstretched."""

_UNITS = (0.01, 100.0, 0.001, 1000.0, 0.1, 10.0, 0.0254, 1 / 0.0254, 2.54, 1 / 2.54, 0.3048, 1 / 0.3048)
"""Between metres, centimetres, millimetres, inches and feet, by definition."""

_UNIT_NAMES = {0.01: "centimetres", 100.0: "metres", 0.001: "millimetres", 1000.0: "metres"}
"""Unit of the path where the offsets' is the metre, the centimetre or the other way about, by definition."""

_FASTEST_GLIDE_M_PER_S = 2.0
"""Of the canonical body, whose slower foot is never faster for a whole take. Chosen by hand: a sprint has about 1."""

_FLOOR_RATIO = 0.35
"""How far, in legs, the level of the feet may be from zero in the right unit. Chosen by hand."""


def turned_upright(body: BodyInMotion) -> tuple[Clip | None, list[ClipFault]]:
    """Turn a take upright that was stored head down, as cameras have it whose y axis points down.

    Parameters
    ----------
    body : BodyInMotion

    Returns
    -------
    clip : turned by half about the x axis, or None
    faults : none, one mended, or one doubtful where the body hangs and nothing shows a floor
        None where head or hands are on the floor, at zero: a stand on them.
    """
    trunk = body.trunk
    length = np.maximum(np.linalg.norm(trunk, axis=-1), 1e-9)
    upright = float(np.median(trunk[:, 1] / length))
    if not upright < _UPSIDE_DOWN:
        return None, []
    height = body.feet[..., 1]
    level = float(np.quantile(height.max(axis=1), 0.9))
    is_planted = (_ground_speed(body.feet, body.clip.frame_rate_hz) < _PLANTED_M_PER_S * body.scale) & (
        height[1:] > level - _LEVEL_M * body.scale
    )
    share = float(is_planted.any(axis=1).mean()) if len(is_planted) else 1.0
    head = f"the head is under the hips (the trunk points up by {upright:.2f} of its length, want above 0)"
    if share < _PLANTED_SHARE:
        on_floor = np.min([body.place(name)[:, 1] for name in ("head", "leftHand", "rightHand")], axis=0)
        if abs(float(np.quantile(on_floor, 0.05))) < _FLOOR_RATIO * body.leg_m:
            return None, []
        said = f"{head}, and no floor shows over the feet: a handstand, or y points down; say health = ok, or turn it"
        return None, [body.whole("up_axis", "doubtful", said)]
    said = (
        f"{head} and the feet are planted above it in {100 * share:.0f} % of the frames: y points down; "
        "turned upright by half a turn about x; export with y up"
    )
    return _mapped(body.clip, np.array([1.0, -1.0, -1.0]), np.array([1.0, -1.0, -1.0])), [
        body.whole("up_axis", "mended", said)
    ]


def unmirrored(body: BodyInMotion) -> tuple[Clip | None, list[ClipFault]]:
    """Mirror a take back whose knees and toes point behind the hips.

    Parameters
    ----------
    body : BodyInMotion

    Returns
    -------
    clip : mirrored in x, names kept, or None
    faults : none, one mended where knees and toes agree, one refused where knees bend backwards before toes that
        point ahead
    """
    knees = knee_bend(body)
    toes = _pointing(body)
    knee = float(np.median(knees)) if len(knees) else 0.0
    toe = float(np.median(toes)) if len(toes) else 0.0
    is_behind = knee < -_BENT_RATIO if len(knees) else False
    by_toes = (is_behind and toe < 0) or (knee < _BACKWARDS_RATIO and toe < -_BACKWARDS_COS)
    if by_toes or (is_behind and not len(toes) and knee < -_BACKWARDS_RATIO):
        what = [f"knees bend {-100 * knee * body.leg_m:.0f} cm behind the hips"] if is_behind else []
        what += ["toes point behind"] if len(toes) else []
        said = (
            f"left and right are exchanged: {' and '.join(what)}, want ahead; mirrored back; "
            "export without changing the handedness"
        )
        mirrored = _mapped(body.clip, np.array([-1.0, 1.0, 1.0]), np.array([1.0, -1.0, -1.0]))
        return mirrored, [body.whole("mirrored", "mended", said)]
    if len(knees) and knee < -_BACKWARDS_RATIO:
        where = "while toes point ahead" if toe > _POINTING_RATIO else "and toes tell nothing"
        said = (
            f"knees bend backwards by {-100 * knee * body.leg_m:.0f} cm, want ahead of hips and ankles, {where}; "
            "see to the order of the rotations and the joints' names"
        )
        return None, [body.whole("facing", "refused", said)]
    return None, []


def knee_bend(body: BodyInMotion) -> Float:
    """Measure how far the knees stand ahead of the line from hip to ankle, in legs.

    Parameters
    ----------
    body : BodyInMotion

    Returns
    -------
    (N,) float64, below 0 behind
        Of both knees in the frames in which they are bent; (0,) where they never are.
    """
    found = []
    for side in SIDES:
        hip, knee, ankle = (body.place(side + part) for part in ("UpperLeg", "LowerLeg", "Foot"))
        off = (knee - (hip + ankle) / 2) / body.leg_m
        along = np.sum(off * body.forward, axis=-1)
        found.append(along[np.linalg.norm(off, axis=-1) > _BENT_RATIO])
    return np.concatenate(found)


def in_one_unit(body: BodyInMotion) -> tuple[Clip | None, list[ClipFault]]:
    """Bring the root's path to the unit of the offsets.

    Parameters
    ----------
    body : BodyInMotion

    Returns
    -------
    clip : its path multiplied by the unit that plants the feet, or None
    faults : none, one mended, or one refused where the feet fly and no unit plants them
    """
    if not np.abs(body.hips).max() < FARTHEST_M:
        said = f"the path lies {np.abs(body.hips).max():.2g} m from the origin, want less than {FARTHEST_M:g} m"
        return None, [body.whole("root_path", "refused", f"{said}; see to the unit of the root's position")]
    if body.clip.n_frames < 2:
        return None, []
    hips, leg = body.hips, body.leg_m
    here, level = _glide_and_floor(body)
    # Feet that go round fast while the hips stay are those of a spin on head, hands or back.
    carried = float(_ground_speed(hips[:, None], body.clip.frame_rate_hz).mean())
    is_flying = min(here, carried) > _FASTEST_GLIDE_M_PER_S * body.scale
    if not is_flying and abs(level) < _FLOOR_RATIO * leg:
        return None, []
    tried = [(*_glide_and_floor(BodyInMotion(_scaled_path(body, scale), body.mapping)), scale) for scale in _UNITS]
    best, scale = min(
        ((glide, s) for glide, floor, s in tried if abs(floor) < _FLOOR_RATIO * leg), default=(np.inf, 1.0)
    )
    travelled = float(np.linalg.norm(np.diff(hips, axis=0), axis=-1).sum())
    path = (
        f"the hips are {np.median(hips[:, 1]):.3g} m high and travel {travelled:.3g} m in {body.clip.duration_s:.3g} s"
    )
    if best < 0.5 * here:
        units = f", as if in {_UNIT_NAMES[scale]}" if scale in _UNIT_NAMES else ""
        said = (
            f"{path} on legs of {leg:.2f} m, and the feet glide at {here:.2g} m/s: offsets and root in different "
            f"units{units}; path multiplied by {scale:.4g}, they glide at {best:.2g} m/s; export both in one unit"
        )
        return _scaled_path(body, scale), [body.whole("root_path", "mended", said)]
    if is_flying:
        said = (
            f"{path} on legs of {leg:.2f} m, and the slower foot glides at {here:.2g} m/s, want below "
            f"{_FASTEST_GLIDE_M_PER_S * body.scale:.2g}: offsets and root in different units, or a wrong frame rate"
        )
        return None, [body.whole("root_path", "refused", f"{said}; export both in one unit")]
    return None, []


def _glide_and_floor(body: BodyInMotion) -> tuple[float, float]:
    """Glide of a motion, metres a second, and the level of its floor, metres."""
    slowest = np.sort(_ground_speed(body.feet, body.clip.frame_rate_hz).min(axis=1))
    glide = float(slowest[: max(len(slowest) * 9 // 10, 1)].mean())
    return glide, float(np.quantile(body.feet[..., 1].min(axis=1), 0.05))


def _ground_speed(place: Float, frame_rate_hz: float) -> Float:
    """Horizontal speed (F - 1, K) of points (F, K, 3), metres a second."""
    step = np.diff(place[..., ::2], axis=0) * frame_rate_hz
    return np.asarray(np.linalg.norm(step, axis=-1), np.float64)


def _pointing(body: BodyInMotion) -> Float:
    """Cosines between feet and facing; (0,) where the rig has no toes."""
    found = []
    for side in SIDES:
        if side + "Toes" in body.at:
            foot = body.place(side + "Toes") - body.place(side + "Foot")
            length = np.linalg.norm(foot, axis=-1)
            is_foot = length > 1e-6
            found.append(np.sum(foot * body.forward, axis=-1)[is_foot] / length[is_foot])
    return np.concatenate(found) if found else np.zeros(0)


def _mapped(clip: Clip, place: Float, turn: Float) -> Clip:
    """Map the world by a diagonal matrix: places by ``place``, vector parts of quaternions by ``turn``."""
    skeleton = clip.skeleton
    return Clip(
        skeleton=Skeleton(skeleton.joints, skeleton.parent, skeleton.offset_xyz_m * place),
        frame_rate_hz=clip.frame_rate_hz,
        root_xyz_m=clip.root_xyz_m * place,
        rotation_wxyz=clip.rotation_wxyz * np.concatenate([[1.0], turn]),
        translation_xyz_m=None if clip.translation_xyz_m is None else clip.translation_xyz_m * place,
    )


def _scaled_path(body: BodyInMotion, scale: float) -> Clip:
    """Scale what carries the hips: the root's places, and those of joints that move from there to the hips."""
    clip, moved = body.clip, body.clip.translation_xyz_m
    if moved is not None:
        moved = moved.copy()
        k = body.at["hips"]
        while k > 0:
            if np.ptp(moved[:, k], axis=0).max() > 1e-3 * body.leg_m:
                moved[:, k] *= scale
            k = int(clip.skeleton.parent[k])
    return Clip(clip.skeleton, clip.frame_rate_hz, clip.root_xyz_m * scale, clip.rotation_wxyz, moved)
