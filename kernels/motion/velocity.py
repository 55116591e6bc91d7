"""How fast a body moves, and the moments it nearly stops: the beats an independent observer sees."""

from __future__ import annotations

import numpy as np
import scipy

from kernels.motion.motion_beats import check_position
from kernels.types import Float, Int


def mean_speed(position_m: Float, frame_rate_hz: float, *, smoothing_s: float = 0.0833) -> Float:
    """Mean speed of the joints, smoothed.

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world
    frame_rate_hz : float, > 0
    smoothing_s : float, seconds
        Standard deviation of the Gaussian; 0 for none. Five frames at 60 Hz in Bailando's measure.

    Returns
    -------
    (F,) float64, metres per second
        Central differences inside, one-sided at the ends; zeros when F < 2.

    Raises
    ------
    ValueError
        If the shape is not (F, J, 3) with J >= 1, a value is not finite, or the rate is not > 0.
    """
    check_position(position_m, frame_rate_hz)
    if len(position_m) < 2:
        return np.zeros(len(position_m))
    speed = np.linalg.norm(np.gradient(position_m, axis=0), axis=-1).mean(axis=-1) * frame_rate_hz
    if smoothing_s > 0:
        speed = scipy.ndimage.gaussian_filter1d(speed, smoothing_s * frame_rate_hz, mode="nearest")
    return np.asarray(speed, np.float64)


def kinematic_beats(position_m: Float, frame_rate_hz: float, *, smoothing_s: float = 0.0833) -> Int:
    """Find the frames where mean joint speed is at a local minimum.

    After the kinematic beats of AI Choreographer [Li2021], with the smoothing of Bailando [Siyao2022]. Used to judge
    dances only: it knows nothing of motion beats.

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world
    frame_rate_hz : float, > 0
    smoothing_s : float, seconds, see :func:`mean_speed`

    Returns
    -------
    (B,) int64, strictly increasing frame indices
        Empty when F < 4 or nothing moves.

    Raises
    ------
    ValueError
        As :func:`mean_speed`.
    """
    speed = mean_speed(position_m, frame_rate_hz, smoothing_s=smoothing_s)
    if len(speed) < 4:
        return np.zeros(0, np.int64)
    before, here, after = speed[:-2], speed[1:-1], speed[2:]
    return np.flatnonzero((here < before) & (here <= after)) + 1


def usable_frames(position_m: Float, frame_rate_hz: float) -> tuple[int, int]:
    """Leave out frames at a clip's ends that no body moves to: a T-pose before the take, a reset after it (ours).

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world
    frame_rate_hz : float, > 0

    Returns
    -------
    first, last : int, frames
        What lies between a jump in the first three steps and one in the last three; a jump is a joint faster than
        8 m/s and than four times the 95th percentile of the clip. 0 and F - 1 where there is none, and when F < 12.

    Raises
    ------
    ValueError
        As :func:`mean_speed`.
    """
    check_position(position_m, frame_rate_hz)
    n = len(position_m)
    if n < 12:
        return 0, max(n - 1, 0)
    fastest = np.linalg.norm(np.diff(position_m, axis=0), axis=-1).max(axis=-1) * frame_rate_hz
    jump = fastest > max(8.0, 4 * float(np.percentile(fastest, 95)))
    first = int(np.flatnonzero(jump[:3])[-1]) + 1 if jump[:3].any() else 0
    last = n - 4 + int(np.flatnonzero(jump[-3:])[0]) if jump[-3:].any() else n - 1
    return first, last


def accents(
    position_m: Float, frame_rate_hz: float, *, time_s: Float, sigma_s: float = 0.05, half_drop_m_per_s: float = 0.05
) -> Float:
    """Measure how plainly the body stops at given moments: towards 1 on a marked stop, 0 far from any (ours).

    A motion beat of the largest component is not always a moment a viewer sees as one; a choice of beats weighed by
    this is. A stop counts by how much speed is lost on it, so that a dance is not sought among people who hardly move.

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world
    frame_rate_hz : float, > 0
    time_s : (B,) float, seconds from the first frame
    sigma_s : float, seconds, > 0
        A stop this far away counts exp(-1/2).
    half_drop_m_per_s : float, metres per second, >= 0
        Drop in mean joint speed, from the peaks on either side, that counts one half.

    Returns
    -------
    (B,) float64, 0 to 1
        ``exp(-d^2 / 2 sigma^2) * drop / (drop + half)`` of the nearest of :func:`kinematic_beats`, d away; zeros when
        there are none.

    Raises
    ------
    ValueError
        As :func:`mean_speed`.
    """
    speed = mean_speed(position_m, frame_rate_hz)
    stop = kinematic_beats(position_m, frame_rate_hz)
    if len(stop) == 0 or len(time_s) == 0:
        return np.zeros(len(time_s))
    peak = np.maximum.reduceat(speed, np.append(0, stop))
    drop = (peak[:-1] + peak[1:]) / 2 - speed[stop]
    apart_s = np.abs(np.asarray(time_s)[:, None] - stop / frame_rate_hz)
    nearest = apart_s.argmin(axis=1)
    marked = drop / np.maximum(drop + half_drop_m_per_s, 1e-12)
    return np.asarray(np.exp(-(apart_s.min(axis=1) ** 2) / (2 * sigma_s**2)) * marked[nearest], np.float64)


def jerk(position_m: Float, frame_rate_hz: float) -> Float:
    """Third difference of every joint's position, largest joint of each frame.

    After FlowMDM [Barquero2024], in SI units so that the frame rate does not count.

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world
    frame_rate_hz : float, > 0

    Returns
    -------
    (F,) float64, metres per second cubed
        The difference over frames f-1 to f+2 stands at f; zeros where there is none. All zeros when F < 4.

    Raises
    ------
    ValueError
        If the shape is not (F, J, 3) with J >= 1, a value is not finite, or the rate is not > 0.
    """
    check_position(position_m, frame_rate_hz)
    result = np.zeros(len(position_m))
    if len(position_m) >= 4:
        third = np.linalg.norm(np.diff(position_m, n=3, axis=0), axis=-1).max(axis=-1)
        result[1:-2] = third * frame_rate_hz**3
    return result


SEEN_STEP_S = 1.0 / 30.0
"""Time of one difference where jerk is taken as a viewer sees it, whatever rate a clip was recorded at. Chosen as a
frame of the usual stage."""


def jerk_around(
    position_m: Float, frame_rate_hz: float, *, time_s: Float, reach_s: float = 0.33
) -> tuple[Float, float]:
    """Find how rough a clip is around given moments, and usually (ours).

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world
    frame_rate_hz : float, > 0
    time_s : (B,) float, seconds from the first frame
    reach_s : float, seconds
        Looked at on either side: half a blend and a tenth of a second of song, danced a tenth faster.

    Returns
    -------
    peak_m_per_s3 : (B,) float64, metres per second cubed
        Largest jerk of any joint within reach, by differences over about 1/30 s; zeros for a clip of fewer than four.
    usual_m_per_s3 : float
        99th percentile over the clip; 0 for a clip too short.

    Raises
    ------
    ValueError
        As :func:`mean_speed`.
    """
    check_position(position_m, frame_rate_hz)
    stride = max(round(SEEN_STEP_S * frame_rate_hz), 1)
    n = len(position_m) - 3 * stride
    if n < 1:
        return np.zeros(len(time_s)), 0.0
    a, b, c, d = (position_m[k * stride : k * stride + n] for k in range(4))
    found = np.linalg.norm(d - 3 * c + 3 * b - a, axis=-1).max(axis=-1) * (frame_rate_hz / stride) ** 3
    middle = (np.arange(n) + 1.5 * stride) / frame_rate_hz
    first, last = np.searchsorted(middle, time_s - reach_s), np.searchsorted(middle, time_s + reach_s, side="right")
    peak = np.array([found[a:b].max(initial=0.0) for a, b in zip(first, last, strict=True)]).reshape(-1)
    return peak, float(np.percentile(found, 99))


def speed_between(position_m: Float, frame_rate_hz: float, *, time_s: Float) -> Float:
    """Mean speed of the joints from each moment to the next.

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world
    frame_rate_hz : float, > 0
    time_s : (B,) float, seconds from the first frame, increasing

    Returns
    -------
    (B,) float64, metres per second
        The last has the value of the one before it; of a single moment, the mean over the clip.

    Raises
    ------
    ValueError
        As :func:`mean_speed`.
    """
    speed = mean_speed(position_m, frame_rate_hz, smoothing_s=0)
    if len(time_s) < 2:
        return np.full(len(time_s), speed.mean() if len(speed) else 0.0)
    total = np.append(0.0, np.cumsum(speed))
    edge = np.clip(np.rint(np.asarray(time_s) * frame_rate_hz).astype(np.int64), 0, max(len(speed) - 1, 0))
    after = np.maximum(edge[1:], edge[:-1] + 1)
    between = (total[after] - total[edge[:-1]]) / (after - edge[:-1])
    return np.append(between, between[-1])
