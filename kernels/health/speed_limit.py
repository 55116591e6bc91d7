"""The last check of a clip: no frame that is shown turns a joint faster than a dance may.

Conventions
-----------
The limit is 45 degrees in a 30th of a second against the parent, or as much in the world where no neighbouring step
carries the turn on: a spin carries on, a flip does not. What is faster and smooth is *fast*, real motion that is not
shown; what is faster and sudden, or faster than any joint, is a *flip*.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.jumps import TURN_DEG, TURN_LEAST_DEG, bound, sharp_steps
from kernels.runs import runs_of
from kernels.types import Float

LIMIT_DEG_PER_S = 1350.0
"""Agreed for dances: 45 degrees from one frame to the next at 30 a second."""

_CARRIED_RATIO = 0.5
"""Share of a turn, about its own axis, that a neighbouring step of a spin has at least. Chosen by hand, below the .7 to
1 of spins that gather and lose speed, above the 0 of a flip."""

_NO_JOINT_DEG_PER_S = 2250.0
"""Faster is no joint: 75 degrees in a 30th of a second. Chosen by hand, above all that 325 Bandai takes hold (64)."""

_SUDDEN_RATIO = 0.75
"""Share of a fast turn that both its neighbours lack where it is sudden. Chosen by hand."""

_NEAR_S = 0.05
"""Between fast steps that are said as one. Chosen by hand."""


@dataclass(frozen=True)
class FastTurn:
    """Steps of one joint beyond the limit.

    Parameters
    ----------
    joint : canonical name
    first, last : int, frames on both sides of those steps
    speed_deg_per_s : float, the fastest
    is_sudden : bool
        Whether it comes out of nothing, or is faster than any joint.
    is_in_world : bool
        Whether it is the turn in the world that is too fast, not that against the parent.
    """

    joint: str
    first: int
    last: int
    speed_deg_per_s: float
    is_sudden: bool
    is_in_world: bool


def fast_turns(body: BodyInMotion, is_hidden: NDArray[np.bool_]) -> list[FastTurn]:
    """Find what turns faster than the limit in frames that are shown.

    Parameters
    ----------
    body : BodyInMotion of F frames
    is_hidden : (F,) bool
        Frames that are fenced already: a step from or to one of them is never shown.

    Returns
    -------
    list of FastTurn
        By joint, then by frame; those against the parent first.
    """
    if body.clip.n_frames < 2:
        return []
    is_shown = ~(is_hidden[1:] | is_hidden[:-1])
    world = body.orientation_wxyz[:, list(body.at.values())]
    against = _steps_deg(body.canonical_turn_wxyz[:, 1:])
    in_world = _world_steps_deg(world)
    limit = LIMIT_DEG_PER_S / body.clip.frame_rate_hz
    names = list(body.at)
    size = np.linalg.norm(against, axis=-1)
    found = _said(body, against, size, (size > limit) & is_shown[:, None], names[1:], is_in_world=False)
    for turn in found:
        is_shown[turn.first : turn.last] = False
    size = np.linalg.norm(in_world, axis=-1)
    is_lone = (size > limit) & ~_is_carried(in_world, size) & is_shown[:, None]
    return found + _said(body, in_world, size, is_lone, names, is_in_world=True)


def _steps_deg(turn_wxyz: Float) -> Float:
    return np.degrees(rotation.log(rotation.mul(rotation.inv(turn_wxyz[:-1]), turn_wxyz[1:])))


def _world_steps_deg(world_wxyz: Float) -> Float:
    """Take steps about the world's axes, where a spin keeps its own."""
    return np.degrees(rotation.log(rotation.mul(world_wxyz[1:], rotation.inv(world_wxyz[:-1]))))


def _is_carried(step: Float, size: Float) -> NDArray[np.bool_]:
    along = np.sum(step[1:] * step[:-1], axis=-1)
    share = np.zeros((*size.shape, 2))
    share[1:, :, 0] = along / np.maximum(size[1:] ** 2, 1e-12)
    share[:-1, :, 1] = along / np.maximum(size[:-1] ** 2, 1e-12)
    return np.asarray(share.max(axis=-1) >= _CARRIED_RATIO, np.bool_)


def _said(
    body: BodyInMotion,
    step: Float,
    size: Float,
    is_over: NDArray[np.bool_],
    names: list[str],
    *,
    is_in_world: bool,
) -> list[FastTurn]:
    rate_hz = body.clip.frame_rate_hz
    over = np.flatnonzero(is_over.any(axis=0))
    if not len(over) or len(step) < 2:
        return [FastTurn(names[i], 0, 1, float(size[0, i]) * rate_hz, True, is_in_world) for i in over if is_over[0, i]]
    least = bound(TURN_DEG, TURN_LEAST_DEG, rate_hz)
    is_sharp, _ = sharp_steps(step[:, over], size[:, over], least=least, frame_rate_hz=rate_hz)
    gap = round(_NEAR_S * rate_hz)
    found = []
    for n, i in enumerate(over.tolist()):
        marked = is_over[:, i]
        for first, last in _closed(marked, gap):
            here = slice(first, last + 1)
            peak = float(size[here, i].max())
            sides = np.concatenate([size[max(first - 1, 0) : first, i], size[last + 1 : last + 2, i]])
            is_lone = bool(last == first and len(sides) and sides.max() < (1 - _SUDDEN_RATIO) * peak)
            is_sudden = peak * rate_hz > _NO_JOINT_DEG_PER_S or (is_lone and bool(is_sharp[here, n].any()))
            found.append(FastTurn(names[i], int(first), int(last) + 1, peak * rate_hz, is_sudden, is_in_world))
    return found


def _closed(marked: NDArray[np.bool_], gap: int) -> list[tuple[int, int]]:
    """List runs of marked steps, those joined that have no more than ``gap`` others between them."""
    joined: list[tuple[int, int]] = []
    for first, last in runs_of(marked).tolist():
        if joined and first - joined[-1][1] <= gap + 1:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    return joined
