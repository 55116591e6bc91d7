"""What a clip does at 120 values a second: weight effort, its stops (rhythm) and its drive (intensity).

After Shiratori, Nakazawa and Ikeuchi [Shiratori2006], whose features the matching of [Yagi2009] compares with those of
music. The formula of weight effort is theirs; saliency weights, thresholds and widths are not in the copies we have and
are ours.

Conventions
-----------
*Links* are the segments from a joint to its parent. *Body-centred*: turned about the vertical so that the hips face +Z;
where the dancer stands and faces does not count, how the body leans does.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from kernels import rotation
from kernels.motion.motion_beats import check_position
from kernels.motion.velocity import usable_frames
from kernels.types import Float, Int

FEATURE_RATE_HZ = 120.0
"""Values a second of every feature series, as in [Yagi2009]."""

SMOOTHING_S = 0.04
"""Standard deviation of the Gaussian over weight effort: what is faster is marker noise. Chosen by hand."""

LEAST_DROP_RATIO, LEAST_DROP_RAD_PER_S = 0.08, 0.2
"""A minimum is a stop where effort drops by so much of the clip's 99th percentile, and by so much at all: a tenth of
what a dance moves with, less is not seen. Chosen by hand; without the second, clips of people who stand and wave were
scaled up to full rhythm."""

LEAST_EFFORT_RAD_PER_S = 0.02
"""A clip whose 99th percentile is lower stands still: its rhythm and intensity are 0, not its noise blown up. Chosen by
hand."""


@dataclass(frozen=True, eq=False)
class MotionFeatures:
    """Features of one clip, (F,) each, at 120 Hz from its first frame.

    Parameters
    ----------
    rhythm, intensity : >= 0, no unit, scaled so that the 99th percentile is 1
    effort_rad_per_s, peak_effort_rad_per_s : >= 0, weight effort, and intensity before it was scaled
    """

    rhythm: Float
    intensity: Float
    effort_rad_per_s: Float
    peak_effort_rad_per_s: Float

    @property
    def time_s(self) -> Float:
        """Seconds of each value."""
        return np.arange(len(self.rhythm)) / FEATURE_RATE_HZ

    def without(self, is_fenced: NDArray[np.bool_]) -> MotionFeatures:
        """Take rhythm and intensity away where nothing is shown.

        Parameters
        ----------
        is_fenced : (F,) bool
        """
        return replace(
            self, rhythm=np.where(is_fenced, 0.0, self.rhythm), intensity=np.where(is_fenced, 0.0, self.intensity)
        )


def at_feature_rate(values: Float, frame_rate_hz: float) -> Float:
    """Resample along the first axis to 120 Hz by natural cubic splines.

    Parameters
    ----------
    values : (F, ...) float
    frame_rate_hz : float, > 0

    Returns
    -------
    (G, ...) float64, G = floor((F - 1) / rate * 120) + 1, the first value at the first frame
        As it is for one frame or none, and at 120 Hz; by lines between two or three frames.
    """
    n = len(values)
    if n < 2 or frame_rate_hz == FEATURE_RATE_HZ:
        return np.asarray(values, np.float64)
    at = np.arange(int(np.floor((n - 1) / frame_rate_hz * FEATURE_RATE_HZ + 1e-6)) + 1)
    frame = np.minimum(at * (frame_rate_hz / FEATURE_RATE_HZ), n - 1)
    if n < 4:
        flat = values.reshape(n, -1)
        lines = np.stack([np.interp(frame, np.arange(n), column) for column in flat.T], axis=1)
        return lines.reshape(len(frame), *values.shape[1:])
    return np.asarray(scipy.interpolate.CubicSpline(np.arange(n), values, axis=0, bc_type="natural")(frame), np.float64)


def link_directions(position_xyz_m: Float, root_wxyz: Float, parent: Int) -> Float:
    """Directions of the body's links, body-centred.

    Parameters
    ----------
    position_xyz_m : (F, J, 3) float, metres, world
    root_wxyz : (F, 4) float, unit, the hips' rotation in the world
    parent : (J,) int, -1 for the root

    Returns
    -------
    (F, J - 1, 3) float64, unit vectors from parent to joint, in the order of joints
        Zero for a link without length.
    """
    links = np.flatnonzero(parent >= 0)
    along = position_xyz_m[:, links] - position_xyz_m[:, parent[links]]
    size = np.linalg.norm(along, axis=-1, keepdims=True)
    unit = np.divide(along, size, out=np.zeros_like(along), where=size > 1e-9)
    facing = rotation.from_heading(-np.unwrap(rotation.heading_rad(root_wxyz))) if len(root_wxyz) else root_wxyz
    return rotation.apply(facing[:, None], unit)


def link_weights(offset_xyz_m: Float, parent: Int) -> Float:
    """Weights of the links, alpha of the formula: each link's share of the body's whole length of links.

    A link of length l that turns by d moves its end by l d against its start, so with these weights effort is the way
    that the ends of links move against their starts, over the length of all links: what a viewer sees move, and no
    joint counts for more because a rig cuts it in two.

    Parameters
    ----------
    offset_xyz_m : (J, 3) float, metres, rest offsets
    parent : (J,) int

    Returns
    -------
    (J - 1,) float64, >= 0, sum 1
    """
    length = np.linalg.norm(offset_xyz_m[parent >= 0], axis=-1)
    return np.asarray(length / max(float(length.sum()), 1e-12), np.float64)


def weight_effort(direction: Float, weight: Float, *, rate_hz: float = FEATURE_RATE_HZ) -> Float:
    """Weight effort: W(f) = sum_i alpha_i arccos(v_i(f) . v_i(f + 1)), as a speed.

    Parameters
    ----------
    direction : (F, L, 3) float, unit, body-centred
    weight : (L,) float, alpha
    rate_hz : float, > 0

    Returns
    -------
    (F,) float64, radians a second, >= 0
        Times the rate, so that it does not depend on it; at frame f the mean of the steps before and after it, so that
        a stop stands on its frame. Zeros when F < 2.

    Notes
    -----
    The angle is taken as 2 arcsin(|v - v'| / 2), which is the same and keeps its digits where arccos loses them.
    """
    if len(direction) < 2:
        return np.zeros(len(direction))
    chord = np.linalg.norm(np.diff(direction, axis=0), axis=-1)
    step = (2.0 * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))) @ weight * rate_hz
    padded = np.concatenate([step[:1], step, step[-1:]])
    return np.asarray((padded[1:] + padded[:-1]) / 2.0, np.float64)


def stops(effort: Float) -> tuple[Int, Float]:
    """Find where a body stops: local minima of weight effort that are deep enough.

    Parameters
    ----------
    effort : (F,) float, radians a second, smoothed

    Returns
    -------
    frame : (B,) int64, increasing
    drop : (B,) float64, radians a second, > 0
        From the lower of the two highest points towards the neighbouring stops.
    """
    if len(effort) < 3:
        return np.zeros(0, np.int64), np.zeros(0)
    least = max(LEAST_DROP_RATIO * float(np.percentile(effort, 99)), LEAST_DROP_RAD_PER_S)
    frame, _ = scipy.signal.find_peaks(-effort, prominence=least)
    if len(frame) == 0:
        return frame.astype(np.int64), np.zeros(0)
    cut = np.concatenate([[0], frame, [len(effort) - 1]])
    high = np.array([effort[a : b + 1].max() for a, b in itertools.pairwise(cut)])
    return frame.astype(np.int64), np.minimum(high[:-1], high[1:]) - effort[frame]


def bumps(n_frames: int, at: Float, height: Float, *, width_s: float, rate_hz: float = FEATURE_RATE_HZ) -> Float:
    """Draw moments as bumps: Gaussians cut at three standard deviations; of two that overlap the higher counts.

    Parameters
    ----------
    n_frames : int, >= 0
    at : (B,) float, frames
    height : (B,) float, >= 0
    width_s : float, seconds, >= 0
        Standard deviation; 0 draws one frame a moment (raw impulses).
    rate_hz : float, > 0, frames a second

    Returns
    -------
    (n_frames,) float64, >= 0; exactly 0 away from the moments
    """
    out = np.zeros(n_frames)
    sigma = width_s * rate_hz
    reach = int(np.ceil(3.0 * sigma))
    for centre, peak in zip(at, height, strict=True):
        nearest = round(float(centre))
        frame = np.arange(max(nearest - reach, 0), min(nearest + reach + 1, n_frames))
        off = (frame - centre) / sigma if sigma else np.zeros(len(frame))
        shape = np.where(np.abs(off) <= 3.0, np.exp(-0.5 * off**2), 0.0)
        out[frame] = np.maximum(out[frame], peak * shape)
    return out


def robust_unit(values: Float) -> Float:
    """Scale so that the 99th percentile is 1, or the largest value where fewer than one in a hundred is above 0.

    Parameters
    ----------
    values : (F,) float, >= 0

    Returns
    -------
    (F,) float64; as it is where all are 0 or there is none
    """
    if not len(values):
        return np.asarray(values, np.float64)
    scale = float(np.percentile(values, 99)) or float(values.max())
    return values / scale if scale > 0 else np.asarray(values, np.float64)


def motion_features(
    position_xyz_m: Float,
    root_wxyz: Float,
    *,
    parent: Int,
    offset_xyz_m: Float,
    frame_rate_hz: float,
    width_s: float = 0.05,
) -> MotionFeatures:
    """Measure weight effort, rhythm and intensity of a clip.

    *Rhythm*: the moments the body stops (:func:`stops`), as bumps as high as the drop. *Intensity*: between two
    stops, the largest effort there.

    Parameters
    ----------
    position_xyz_m : (F, J, 3) float, metres, world
    root_wxyz : (F, 4) float, unit
    parent : (J,) int
    offset_xyz_m : (J, 3) float, metres, rest offsets
    frame_rate_hz : float, > 0
    width_s : float, seconds, >= 0
        Of the bumps, see :func:`bumps`. 50 ms is the tolerance at which beats are heard as together (the sigma of beat
        alignment scores).

    Returns
    -------
    MotionFeatures
        Of floor((F - 1) / rate * 120) + 1 values; of one where F is 1, none where it is 0. All 0 where the body stands
        still, and at a clip's ends in the frames no body moves to (a T-pose before the take,
        :func:`kernels.motion.velocity.usable_frames`).

    Raises
    ------
    ValueError
        If the shape is not (F, J, 3), a value is not finite, or the rate is not > 0.
    """
    check_position(position_xyz_m, frame_rate_hz)
    if len(position_xyz_m) == 0:
        none = np.zeros(0)
        return MotionFeatures(none, none, none, none)
    n = len(at_feature_rate(position_xyz_m[:, 0, 0], frame_rate_hz))
    first, last = usable_frames(position_xyz_m, frame_rate_hz)
    if (first, last) != (0, len(position_xyz_m) - 1):
        inner = motion_features(
            position_xyz_m[first : last + 1],
            root_wxyz[first : last + 1],
            parent=parent,
            offset_xyz_m=offset_xyz_m,
            frame_rate_hz=frame_rate_hz,
            width_s=width_s,
        )
        return _inside(inner, n, round(first / frame_rate_hz * FEATURE_RATE_HZ))
    position = at_feature_rate(position_xyz_m, frame_rate_hz)
    root = rotation.normalize(at_feature_rate(rotation.continuous(root_wxyz), frame_rate_hz))
    effort = weight_effort(link_directions(position, root, parent), link_weights(offset_xyz_m, parent))
    if len(effort) > 1:
        effort = scipy.ndimage.gaussian_filter1d(effort, SMOOTHING_S * FEATURE_RATE_HZ, mode="nearest")
    if float(np.percentile(effort, 99)) < LEAST_EFFORT_RAD_PER_S:
        still = np.zeros(len(effort))
        return MotionFeatures(still, still, effort, effort)
    frame, drop = stops(effort)
    rhythm = bumps(len(effort), frame.astype(np.float64), drop, width_s=width_s)
    peak = between(effort, frame)
    return MotionFeatures(robust_unit(rhythm), robust_unit(peak), effort, peak)


def _inside(found: MotionFeatures, n: int, first: int) -> MotionFeatures:
    """Features of ``n`` values, 0 but where those found lie, scaled over all of them."""
    columns = []
    for values in (found.rhythm, found.intensity, found.effort_rad_per_s, found.peak_effort_rad_per_s):
        out = np.zeros(n)
        out[first : first + len(values)] = values[: max(n - first, 0)]
        columns.append(out)
    rhythm, intensity, effort, peak = columns
    return MotionFeatures(robust_unit(rhythm), robust_unit(intensity), effort, peak)


def between(values: Float, frame: Int) -> Float:
    """Find the largest value of each stretch between neighbouring frames, and hold it over the stretch.

    Parameters
    ----------
    values : (F,) float
    frame : (B,) int64, not falling, 0 to F
        The first stretch begins at 0, the last ends with the series.

    Returns
    -------
    (F,) float64
        Without frames the largest of all; empty for F = 0.
    """
    out = np.zeros(len(values))
    cut = np.concatenate([[0], frame, [len(values)]])
    for a, b in itertools.pairwise(cut):
        if b > a:
            out[a:b] = values[a:b].max()
    return out


def contacts_at_feature_rate(contact: NDArray[np.bool_], frame_rate_hz: float, n_values: int) -> NDArray[np.bool_]:
    """Read contacts at 120 Hz, each of the nearest frame.

    Parameters
    ----------
    contact : (F, 2) bool, left and right foot, F >= 1 unless ``n_values`` is 0
    frame_rate_hz : float, > 0, of ``contact``
    n_values : int, >= 0

    Returns
    -------
    (n_values, 2) bool
        Beyond the last frame, as in it.
    """
    nearest = np.rint(np.arange(n_values) * (frame_rate_hz / FEATURE_RATE_HZ)).astype(np.int64)
    return np.asarray(contact[np.clip(nearest, 0, max(len(contact) - 1, 0))], np.bool_)


def fence_at_feature_rate(is_fenced: NDArray[np.bool_], frame_rate_hz: float, n_values: int) -> NDArray[np.bool_]:
    """Say at 120 Hz what is never shown: a moment beside a fenced frame is fenced.

    Parameters
    ----------
    is_fenced : (F,) bool, F >= 1 unless ``n_values`` is 0
    frame_rate_hz : float, > 0, of ``is_fenced``
    n_values : int, >= 0

    Returns
    -------
    (n_values,) bool
        Beyond the last frame, as in it.
    """
    at = np.clip(np.arange(n_values) * (frame_rate_hz / FEATURE_RATE_HZ), 0, max(len(is_fenced) - 1, 0))
    before, after = np.floor(at + 1e-6).astype(np.int64), np.ceil(at - 1e-6).astype(np.int64)
    return np.asarray(is_fenced[before] | is_fenced[after], np.bool_)
