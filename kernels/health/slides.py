"""Stretches in which a body slides: its feet glide over the floor, or all of it moves while its pose stands still."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.health.body_in_motion import BodyInMotion
from kernels.health.verdicts import ClipFault
from kernels.runs import runs_of
from kernels.types import Float

_GLIDE_M_PER_S = 0.35
"""Of the slowest point of both feet, on the canonical body. Chosen by hand above the .2 of feet that are put down."""

_GLIDE_M = 0.45
"""How far that point glides, on the canonical body. Measured on 16 salsa takes, whose spins reach .35; chosen above."""

_ON_FLOOR_M = 0.06
"""How far from the floor the lowest point of a foot that stands may be, on the canonical body. Chosen by hand."""

_UPRIGHT_COS = 0.35
"""Of the trunk with the vertical, above which the feet may carry the body. Chosen by hand, as of a body that lies."""

_CALM_DEG_PER_S = 2.0
"""Usual turn of the joints in a pose that stands still. Chosen by hand, twice what people have who stand about."""

_DRIFT_M_PER_S = 0.1
_DRIFT_S = 0.2
"""How fast and how long a still pose moves that slides, on the canonical body. Chosen by hand."""

_DRIFT_M = 0.08
"""How far. Chosen by hand, more than anybody sways."""


def slides(body: BodyInMotion, is_hidden: NDArray[np.bool_]) -> list[ClipFault]:
    """Find where the body slides.

    Parameters
    ----------
    body : BodyInMotion of F frames
    is_hidden : (F,) bool
        Frames that are fenced already, which are not looked at.

    Returns
    -------
    list of ClipFault
        Fenced, by frame.
    """
    clip, rate_hz = body.clip, body.clip.frame_rate_hz
    if clip.n_frames < max(_DRIFT_S * rate_hz, 4):
        return []
    is_shown = ~(is_hidden[1:] | is_hidden[:-1])
    glide, lowest = _glide(body), body.feet[..., 1].min(axis=1)
    floor = float(np.quantile(lowest, 0.05))
    # Who lies, or stands on head or hands, slides and spins as dancers do.
    is_upright = body.trunk[:, 1] > _UPRIGHT_COS * np.linalg.norm(body.trunk, axis=-1)
    is_standing = ((lowest < floor + _ON_FLOOR_M * body.scale) & is_upright)[1:]
    found = []
    for first, last in runs_of((glide > _GLIDE_M_PER_S * body.scale) & is_standing & is_shown).tolist():
        way = float(glide[first : last + 1].sum()) / rate_hz
        if way > _GLIDE_M * body.scale:
            found.append((first, last, f"both feet glide {way:.2f} m over the floor"))
    drift = np.maximum(np.linalg.norm(np.diff(body.hips[:, ::2], axis=0), axis=-1) * rate_hz - body.spin_m_per_s, 0.0)
    is_drifting = (_turning(body) < _CALM_DEG_PER_S) & (drift > _DRIFT_M_PER_S * body.scale) & is_shown
    for first, last in runs_of(is_drifting).tolist():
        way = float(drift[first : last + 1].sum()) / rate_hz
        if (last - first + 1) / rate_hz >= _DRIFT_S and way > _DRIFT_M * body.scale:
            found.append((first, last, f"the whole body moves {way:.2f} m while its pose stands still"))
    faults, end = [], -1
    for first, last, what in sorted(found):
        if first > end:
            said = f"{what} in {(last - first + 1) / rate_hz:.2f} s from {body.at_s(first)}; not shown"
            said += "; see to the root where it was recorded"
            faults.append(ClipFault("sliding", "", first, last + 1, "fenced", said))
            end = last
    return faults


def _glide(body: BodyInMotion) -> Float:
    """Horizontal speed of whichever point is slowest, over a 30th of a second; (F - 1,).

    The points are those of the feet and the one between them. What a spin alone carries them is left out.
    """
    rate_hz = body.clip.frame_rate_hz
    n = max(round(rate_hz / 30.0), 1)
    middle = body.place("leftFoot", "rightFoot")[:, None]
    step = np.diff(np.concatenate([body.feet, middle], axis=1)[..., ::2], axis=0)
    if n > 1:
        total = np.cumsum(np.concatenate([np.zeros((1, *step.shape[1:])), step]), axis=0)
        after = np.minimum(np.arange(len(step)) + (n + 1) // 2, len(step))
        before = np.maximum(np.arange(len(step)) - n // 2, 0)
        step = (total[after] - total[before]) / (after - before)[:, None, None]
    speed = np.linalg.norm(step, axis=-1).min(axis=1) * rate_hz
    return np.asarray(np.maximum(speed - body.spin_m_per_s, 0.0), np.float64)


def _turning(body: BodyInMotion) -> Float:
    """Mean speed of the joints below the hips, degrees a second; (F - 1,)."""
    below = [i for i, k in enumerate(body.needed) if k > body.at["hips"]]
    return np.asarray(body.step_size_deg[:, below].mean(axis=1) * body.clip.frame_rate_hz, np.float64)
