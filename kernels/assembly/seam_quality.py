"""How smooth the seams of a dance are: peak jerk there against the clips themselves, a plain cut beside."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from kernels.assembly.blend import Dance, assemble, sample
from kernels.assembly.quality import Measure
from kernels.assembly.timing import clock
from kernels.motion.velocity import jerk
from kernels.skeleton import kinematics
from kernels.types import Choreography, Clip, Float, Int, Skeleton

UNSEEN_JERK_M_PER_S3 = 30.0
"""Jerk that nobody sees, however still the clips stand: of half a centimetre to and fro three times a second. Chosen by
hand, of viewers nobody was asked."""


def seam_ratios(
    dance: Dance, steps: Choreography, clips: Mapping[str, Clip], *, skeleton: Skeleton, reach_s: float = 0.1
) -> tuple[Float, Float]:
    """Peak jerk at each seam over the 99th percentile inside the source clips at the dance's own pace.

    Parameters
    ----------
    dance, steps, clips, skeleton : as :func:`kernels.assembly.blend.assemble` has them
    reach_s : float, seconds
        Looked at on either side of the blend as well.

    Returns
    -------
    blended, cut : (S,) float64 of S seams, >= 0
        Of the dance, and of the same choreography without blends; empty without seams.
    """
    cut = assemble(
        replace(steps, blend_s=np.zeros_like(steps.blend_s)),
        clips,
        skeleton=skeleton,
        frame_rate_hz=dance.frame_rate_hz,
        duration_s=float(dance.time_s[-1]) or 1.0 / dance.frame_rate_hz,
    )
    width_s = steps.blend_s[steps.has_seam] / 2 + reach_s
    blended, plain = (peak_ratios(d, steps, clips, skeleton=skeleton, reach_s=width_s) for d in (dance, cut))
    return blended, plain


def peak_ratios(
    dance: Dance, steps: Choreography, clips: Mapping[str, Clip], *, skeleton: Skeleton, reach_s: Float | float
) -> Float:
    """Peak jerk near each seam over the 99th percentile inside the source clips at the dance's own pace.

    Clips that stand still count as :data:`UNSEEN_JERK_M_PER_S3`.

    Parameters
    ----------
    dance, steps, clips, skeleton : as :func:`kernels.assembly.blend.assemble` has them
    reach_s : (S,) float or float, seconds either side of each seam

    Returns
    -------
    (S,) float64 of S seams, >= 0; empty without seams or in a dance of fewer than four frames
    """
    at_s = steps.song_start_s[steps.has_seam]
    if len(at_s) == 0 or len(dance.time_s) < 4:
        return np.zeros(0)
    reference = max(float(np.percentile(_source_jerk(dance, steps, clips, skeleton), 99)), UNSEEN_JERK_M_PER_S3)
    found = jerk(dance.position_xyz_m, dance.frame_rate_hz)
    return _peaks(found, dance.time_s, at_s, np.broadcast_to(reach_s, at_s.shape)) / reference


def seam_measures(dance: Dance, steps: Choreography, clips: Mapping[str, Clip], *, skeleton: Skeleton) -> list[Measure]:
    """Judge the seams by :func:`seam_ratios`: a blend must also do better than a plain cut.

    Parameters
    ----------
    dance, steps, clips, skeleton : as :func:`kernels.assembly.blend.assemble` has them

    Returns
    -------
    list of Measure
        Count; the median over seams, their 95th percentile (an actual seam: the worst of up to twenty) and the worst;
        the 95th percentile of plain cuts. Zeros without seams.
    """
    blended, plain = seam_ratios(dance, steps, clips, skeleton=skeleton)
    n_seams = float(steps.has_seam.sum())
    if len(blended) == 0:
        return [Measure("seam_count", n_seams), Measure("seam_jerk_ratio", 0.0, _WANTED, True)]
    high, plain_high = (float(np.percentile(peak, 95, method="higher")) for peak in (blended, plain))
    # A plain cut hardly rougher than the clips themselves leaves nothing to better.
    is_better = high < plain_high or max(high, plain_high) <= 1.1
    median, worst = float(np.median(blended)), float(blended.max())
    return [
        Measure("seam_count", n_seams),
        Measure("seam_jerk_ratio", high, _WANTED, high <= 1.5 and is_better),
        Measure("seam_jerk_median_ratio", median, "at most 1.2", median <= 1.2),
        Measure("seam_jerk_worst_ratio", worst, "at most 2.0", worst <= 2.0),
        Measure("seam_jerk_plain_cut_ratio", plain_high),
    ]


_WANTED = "at most 1.5, and below a plain cut"


def _peaks(values: Float, time_s: Float, at_s: Float, width_s: Float) -> Float:
    """Largest value within ``width_s`` of each moment."""
    return np.array(
        [
            values[np.abs(time_s - s) <= max(w, 1.5 * (time_s[1] - time_s[0]))].max(initial=0.0)
            for s, w in zip(at_s, width_s, strict=True)
        ]
    )


def _source_jerk(dance: Dance, steps: Choreography, clips: Mapping[str, Clip], skeleton: Skeleton) -> Float:
    """Jerk of every frame if its clip had gone on unblended, at the dance's own pace."""
    found = [
        jerk(position, dance.frame_rate_hz)[1:-2]
        for _, position in phrases_alone(dance, steps, clips, skeleton=skeleton)
    ]
    return np.concatenate(found) if found else np.ones(1)


def phrases_alone(
    dance: Dance, steps: Choreography, clips: Mapping[str, Clip], *, skeleton: Skeleton
) -> Iterator[tuple[Int, Float]]:
    """Give what the clips themselves do at the dance's own pace, phrase by phrase, without blends or locked feet.

    Parameters
    ----------
    dance, steps, clips, skeleton : as :func:`kernels.assembly.blend.assemble` has them

    Yields
    ------
    (n,) int64 frames of a phrase, n >= 4, and (n, J, 3) float64 joints, metres
    """
    motion = clock(steps)
    motion_s = motion.at(dance.time_s)
    start = np.flatnonzero(np.append(True, steps.has_seam[1:]))
    end = np.append(start[1:], len(steps.clip_id))
    for a, b in zip(start, end, strict=True):
        frame = np.flatnonzero((dance.lineage.step_index >= a) & (dance.lineage.step_index < b))
        if len(frame) >= 4:
            root, rot = sample(clips[steps.clip_id[a]], steps.clip_start_s[a] + motion_s[frame] - motion.motion_s[a])
            yield frame, kinematics.forward(skeleton, root, rot)[0]
