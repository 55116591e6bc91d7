"""A made-up dancer on the canonical skeleton: labelled moves with beats at known times and feet that stay planted.

Nothing here is recorded from anybody. Every move turns or comes to rest exactly on its beats.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kernels import rotation
from kernels.assembly.joins import ease
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.inverse import two_bone
from kernels.types import Clip, Float

_ANKLE_M = 0.08
"""Of a foot that stands, by definition of the canonical body."""

_STANDING_M = 0.91
"""Of the hips. Chosen by hand, 3 cm lower than with stretched knees."""

_X, _Y, _Z = np.eye(3)
"""Left, up and ahead, by convention."""


@dataclass(frozen=True, eq=False)
class Figure:
    """What a move asks of the body over F frames; (2, …) are left and right.

    Parameters
    ----------
    hips_xyz_m : (F, 3) float, metres, world
    heading : (F,) float, radians
        Where the body faces, from +Z towards +X.
    hip_turn, chest_turn : (F,) float, radians
        How far hips and chest are turned from there, about the vertical.
    lean : (F,) float, radians, forwards
    foot_xyz_m : (2, F, 3) float, metres, world
        Where the ankles shall be.
    foot_heading : (2, F) float, radians
    raised, swing : (2, F) float, radians
        Arms from hanging (0) to level (pi/2) at the side, and forwards from the shoulder.
    elbow : (2, F) float, radians, 0 stretched
    """

    hips_xyz_m: Float
    heading: Float
    hip_turn: Float
    chest_turn: Float
    lean: Float
    foot_xyz_m: Float
    foot_heading: Float
    raised: Float
    swing: Float
    elbow: Float


@dataclass(frozen=True, eq=False)
class SyntheticTake:
    """A made-up take: the clip, its label, and when its beats are, seconds."""

    label: str
    clip: Clip
    beat_s: Float


def plan_foot(beats: Float, places: Float, *, lift_m: float = 0.08) -> Float:
    """Move a foot from place to place, planted on the beats and between moves.

    Parameters
    ----------
    beats : (F,) float, time in beats, >= 0 at the first place
    places : (n, 3) float, metres: where the ankle is on beat 0, 1, 2 …; held after the last
    lift_m : float, metres, top of the arc

    Returns
    -------
    (F, 3) float64, metres
        A move takes the middle eight tenths of the interval before its beat.
    """
    number = np.clip(np.floor(beats).astype(int), 0, len(places) - 1)
    following = np.clip(number + 1, 0, len(places) - 1)
    part = np.clip((beats - number - 0.1) / 0.8, 0.0, 1.0)
    moves = np.linalg.norm(places[following] - places[number], axis=-1) > 1e-9
    share = ease(part)[:, None]
    place: Float = (1 - share) * places[number] + share * places[following]
    place[:, 1] += np.where(moves, lift_m * np.sin(np.pi * ease(part)) ** 2, 0.0)
    return place


def pose(figure: Figure, frame_rate_hz: float) -> Clip:
    """Bring a figure onto the canonical skeleton: legs by inverse kinematics, feet flat, arms by angles.

    Parameters
    ----------
    figure : Figure of F frames
        An ankle out of reach is approached as far as the straight leg goes.
    frame_rate_hz : float, > 0

    Returns
    -------
    Clip
        F frames on the canonical skeleton.

    Raises
    ------
    ValueError
        If the rate is not > 0, a value is not finite, or an ankle lies in its hip.
    """
    f = len(figure.heading)
    local = np.zeros((f, len(JOINTS), 4))
    local[..., 0] = 1.0
    hips = rotation.from_heading(figure.heading + figure.hip_turn)
    local[:, 0] = hips
    third = (figure.chest_turn - figure.hip_turn) / 3
    for name in ("spine", "chest", "upperChest"):
        local[:, JOINTS.index(name)] = rotation.mul(
            rotation.from_heading(third), rotation.from_axis_angle(_X, figure.lean / 3)
        )
    local[:, JOINTS.index("head")] = rotation.from_axis_angle(_X, -figure.lean / 2)
    for k, side in enumerate(("left", "right")):
        sign = 1.0 - 2.0 * k
        hang = rotation.from_axis_angle(_Z, -sign * (np.pi / 2 - figure.raised[k]))
        local[:, JOINTS.index(f"{side}UpperArm")] = rotation.mul(rotation.from_axis_angle(_X, -figure.swing[k]), hang)
        local[:, JOINTS.index(f"{side}LowerArm")] = rotation.from_axis_angle(_Y, -sign * figure.elbow[k])
        upper, lower, foot = (JOINTS.index(f"{side}{part}") for part in ("UpperLeg", "LowerLeg", "Foot"))
        start = figure.hips_xyz_m + rotation.apply(hips, CANONICAL.offset_xyz_m[upper])
        facing = rotation.from_heading(figure.foot_heading[k])
        q_upper, q_lower, _ = two_bone(
            start,
            figure.foot_xyz_m[k],
            upper_m=-CANONICAL.offset_xyz_m[lower, 1],
            lower_m=-CANONICAL.offset_xyz_m[foot, 1],
            pole=rotation.apply(facing, _Z),
        )
        local[:, upper] = rotation.mul(rotation.inv(hips), q_upper)
        local[:, lower] = rotation.mul(rotation.inv(q_upper), q_lower)
        local[:, foot] = rotation.mul(rotation.inv(q_lower), facing)
    return Clip(CANONICAL, frame_rate_hz, figure.hips_xyz_m, rotation.continuous(rotation.normalize(local)))


def _stand(beats: Float, size: float) -> Figure:
    """Standing still, feet under the hips, arms hanging a little off the body."""
    f = len(beats)
    zero = np.zeros(f)
    side = np.array([0.10, -0.10])
    foot = np.zeros((2, f, 3))
    foot[..., 0], foot[..., 1] = side[:, None], _ANKLE_M
    hips = np.tile([0.0, _STANDING_M, 0.0], (f, 1))
    quiet = np.full((2, f), 0.2)
    return Figure(hips, zero, zero, zero, zero, foot, np.zeros((2, f)), quiet, np.zeros((2, f)), quiet + 0.2 * size)


def _replace(figure: Figure, **changes: Float) -> Figure:
    return Figure(**{**figure.__dict__, **changes})


def _places(offsets: list[tuple[float, float]], n: int, x_m: float) -> Float:
    """Repeat a pattern of sideways and forward offsets of one foot, from ``x_m``, n beats long."""
    pattern = np.array(offsets)[np.arange(n) % len(offsets)]
    return np.stack([x_m + pattern[:, 0], np.full(n, _ANKLE_M), pattern[:, 1]], axis=1)


def _step(beats: Float, size: float) -> Figure:
    """Step to the side and touch, arms swinging."""
    n, far = int(np.ceil(beats[-1])) + 2, 0.30 * size
    left = plan_foot(beats, _places([(0, 0), (0, 0), (far, 0), (far, 0)], n, 0.10))
    right = plan_foot(beats, _places([(0, 0), (0, 0), (0, 0), (far, 0)], n, -0.10))
    hips = np.stack([left[:, 0] + right[:, 0], np.full(len(beats), 2 * _STANDING_M), left[:, 2] + right[:, 2]], 1) / 2
    arm = 0.7 * size * np.cos(np.pi * beats)
    base = _stand(beats, size)
    return _replace(
        base, hips_xyz_m=hips, foot_xyz_m=np.stack([left, right]), swing=np.stack([arm, -arm]), chest_turn=0.15 * arm
    )


def _bounce(beats: Float, size: float) -> Figure:
    """Bend the knees on every beat: two turns a beat, down on it and up between."""
    dip = 0.11 * size * (0.5 + 0.5 * np.cos(2 * np.pi * beats)) ** 2
    base = _stand(beats, size)
    hips = base.hips_xyz_m - dip[:, None] * _Y
    fold = 0.5 + 6.0 * dip
    return _replace(base, hips_xyz_m=hips, elbow=np.stack([fold, fold]))


def _wave(beats: Float, size: float) -> Figure:
    """Raise one arm and then the other."""
    up = 0.5 + 0.5 * np.cos(np.pi * beats)
    base = _stand(beats, size)
    return _replace(base, raised=0.2 + 2.3 * size * np.stack([up, 1 - up]), chest_turn=0.1 * (2 * up - 1))


def _twist(beats: Float, size: float) -> Figure:
    """Turn hips and chest against each other on planted feet."""
    turn = 0.5 * size * np.cos(np.pi * beats)
    base = _stand(beats, size)
    arms = np.full((2, len(beats)), 1.0)
    return _replace(base, hip_turn=0.4 * turn, chest_turn=-1.2 * turn, raised=arms, elbow=arms)


def _kick(beats: Float, size: float) -> Figure:
    """Kick forwards with one leg and then the other, arms against them."""
    reach = np.clip(np.cos(np.pi * beats), 0, 1) ** 1.5, np.clip(-np.cos(np.pi * beats), 0, 1) ** 1.5
    base = _stand(beats, size)
    foot = base.foot_xyz_m + np.stack([r[:, None] * np.array([0.0, 0.30, 0.45]) * size for r in reach])
    arm = 0.8 * size * np.cos(np.pi * beats)
    hips = base.hips_xyz_m + 0.05 * np.cos(np.pi * beats)[:, None] * -_X
    return _replace(base, hips_xyz_m=hips, foot_xyz_m=foot, swing=np.stack([-arm, arm]))


def _rock(beats: Float, size: float) -> Figure:
    """Rock forwards and back, one foot in front."""
    n, far = int(np.ceil(beats[-1])) + 2, 0.25 * size
    left = plan_foot(beats, _places([(0, far), (0, 0)], n, 0.10))
    sway = 0.10 * size * np.cos(np.pi * beats)
    base = _stand(beats, size)
    foot = np.stack([left, base.foot_xyz_m[1]])
    arm = 0.6 * size * np.cos(np.pi * beats)
    hips = base.hips_xyz_m + (0.06 + sway)[:, None] * _Z - 0.02 * _Y
    return _replace(
        base, hips_xyz_m=hips, foot_xyz_m=foot, swing=np.stack([-arm, arm]), lean=0.15 * np.cos(np.pi * beats)
    )


def _spin(beats: Float, size: float) -> Figure:
    """Turn once round in four beats, a quarter a beat, arms opening and closing."""
    number = np.floor(beats)
    heading = np.pi / 2 * (number + ease(beats - number))
    n = int(np.ceil(beats[-1])) + 2
    corner = np.pi / 2 * np.arange(n)
    # The left foot follows the turn on every beat, half of it; the right foot closes.
    feet, ways = [], []
    for side in (0.12, -0.12):
        places = np.stack([side * np.cos(corner), np.full(n, _ANKLE_M), -side * np.sin(corner)], axis=1)
        feet.append(plan_foot(beats, places, lift_m=0.05))
        ways.append(heading)
    base = _stand(beats, size)
    open_ = 0.9 + 0.5 * size * np.cos(np.pi * beats)
    return _replace(
        base,
        heading=heading,
        chest_turn=np.zeros(len(beats)),
        foot_xyz_m=np.stack(feet),
        foot_heading=np.stack(ways),
        raised=np.stack([open_, open_]),
    )


def _idle(beats: Float, size: float) -> Figure:
    """Stand and breathe: no beats to speak of."""
    base = _stand(beats, size)
    sway = 0.004 * size * np.sin(2 * np.pi * beats / 7)
    return _replace(base, hips_xyz_m=base.hips_xyz_m + sway[:, None] * _X)


MOVES: dict[str, Callable[[Float, float], Figure]] = {
    "step": _step,
    "bounce": _bounce,
    "wave": _wave,
    "twist": _twist,
    "kick": _kick,
    "rock": _rock,
    "spin": _spin,
    "idle": _idle,
}
"""Moves by label: each takes time in beats, (F,) >= 0 with F >= 1, and a factor >= 0 on its size, and gives what it
asks of the body over these F frames."""


def take(
    label: str,
    *,
    n_beats: int = 16,
    interval_s: float = 0.5,
    first_beat_s: float = 0.25,
    frame_rate_hz: float = 30.0,
    size: float = 1.0,
    turned_rad: float = 0.0,
) -> SyntheticTake:
    """Make one take of a move.

    Parameters
    ----------
    label : key of :data:`MOVES`
    n_beats : int, >= 2
    interval_s : float, seconds, > 0
    first_beat_s : float, seconds, >= 0
    frame_rate_hz : float, > 0
    size : float, 0.5 to 1.2
        How large the movement is.
    turned_rad : float, radians
        Heading of the whole take.

    Returns
    -------
    SyntheticTake
        Ends ``first_beat_s`` after its last beat. The beats of ``idle`` are empty.

    Raises
    ------
    ValueError
        If the label is not known.
    """
    if label not in MOVES:
        raise ValueError(f"label: want one of {', '.join(MOVES)}, got {label!r}")
    duration_s = 2 * first_beat_s + (n_beats - 1) * interval_s
    time_s = np.arange(int(np.floor(duration_s * frame_rate_hz + 1e-9)) + 1) / frame_rate_hz
    lead = 2 * int(np.ceil(first_beat_s / interval_s / 2))  # whole pairs, so that the first beat is an even one
    clip = pose(MOVES[label]((time_s - first_beat_s) / interval_s + lead, size), frame_rate_hz)
    q = rotation.from_heading(turned_rad)
    turned = clip.rotation_wxyz.copy()
    turned[:, 0] = rotation.mul(q, turned[:, 0])
    clip = Clip(CANONICAL, frame_rate_hz, rotation.apply(q, clip.root_xyz_m), rotation.continuous(turned))
    beat_s: Float = first_beat_s + interval_s * np.arange(n_beats, dtype=np.float64)
    return SyntheticTake(label, clip, beat_s if label != "idle" else np.zeros(0))


def place(made: SyntheticTake) -> Float:
    """Place a take's joints in the world.

    Parameters
    ----------
    made : SyntheticTake of F frames

    Returns
    -------
    (F, 22, 3) float64, metres
    """
    return kinematics.place(made.clip)[0]
