"""How good a dance is, measured on the finished motion.

Each measure says what is wanted of it. Beat measures use an observer that knows nothing of the plan (minima of joint
speed), and chance is measured on the same dance: raw beat alignment near 0.25 is what chance gives.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kernels.assembly.blend import Dance, assemble, sample
from kernels.assembly.feet import clip_contacts, planted_feet
from kernels.assembly.timing import clock
from kernels.motion import contacts
from kernels.motion.velocity import jerk, kinematic_beats
from kernels.skeleton import grounding, kinematics
from kernels.types import Choreography, Clip, Float, Skeleton

Bool = NDArray[np.bool_]


UNSEEN_SLIDE_CM_PER_S = 0.5
"""Slide of planted feet that nobody sees, whatever the clips do: a twentieth of what captured clips have."""


@dataclass(frozen=True)
class Measure:
    """One figure of a dance: its name ends in its unit; ``is_passed`` is None where it is only reported."""

    name: str
    value: float
    wanted: str = ""
    is_passed: bool | None = None


def f_measure(found_s: Float, wanted_s: Float, *, tolerance_s: float = 0.07) -> float:
    """Share of beats met, both ways, one to one.

    Parameters
    ----------
    found_s, wanted_s : (n,), (m,) float, seconds, increasing
    tolerance_s : float, seconds

    Returns
    -------
    float, 0 to 1
        0 when either is empty. The greedy walk in order of time is a largest matching on a line.
    """
    if len(found_s) == 0 or len(wanted_s) == 0:
        return 0.0
    i = j = hits = 0
    while i < len(found_s) and j < len(wanted_s):
        gap = found_s[i] - wanted_s[j]
        if abs(gap) <= tolerance_s + 1e-9:
            i, j, hits = i + 1, j + 1, hits + 1
        elif gap < 0:
            i += 1
        else:
            j += 1
    return 2 * hits / (len(found_s) + len(wanted_s))


def beat_alignment(motion_s: Float, music_s: Float, *, sigma_s: float = 0.05) -> float:
    """Beat alignment score: how near the closest motion beat is to each music beat.

    Mean of exp(-d^2 / 2 sigma^2) over music beats (Siyao et al., "Bailando", CVPR 2022), in seconds. Chance level for
    regular beats half a second apart is 0.25.

    Parameters
    ----------
    motion_s, music_s : (n,), (m,) float, seconds, increasing
    sigma_s : float, seconds

    Returns
    -------
    float, 0 to 1; 0 when either is empty
    """
    if len(motion_s) == 0 or len(music_s) == 0:
        return 0.0
    after = (
        np.clip(np.searchsorted(motion_s, music_s), 1, len(motion_s) - 1)
        if len(motion_s) > 1
        else np.zeros(len(music_s), int)
    )
    near = np.minimum(np.abs(motion_s[after] - music_s), np.abs(motion_s[after - 1] - music_s))
    return float(np.mean(np.exp(-(near**2) / (2 * sigma_s**2))))


def block_shifted(beat_s: Float, duration_s: float, *, rng: np.random.Generator, block_s: float = 4.0) -> Float:
    """Shift every block of beats round itself by its own random amount.

    Keeps how many beats there are and how they follow each other, and destroys where they fall. One shift for the
    whole song would prove nothing: at a steady tempo every whole-beat shift fits again.

    Parameters
    ----------
    beat_s : (B,) float, seconds
    duration_s : float, seconds
    rng : Generator
    block_s : float, seconds

    Returns
    -------
    (B,) float64, seconds, sorted
    """
    block = np.floor(beat_s / block_s).astype(int)
    shift = rng.uniform(0.0, block_s, int(np.ceil(duration_s / block_s)) + 1)
    length = np.minimum(block_s, np.maximum(duration_s - block * block_s, 1e-9))
    return np.sort(block * block_s + np.mod(beat_s - block * block_s + shift[block], length))


def beat_measures(dance: Dance, music_beat_s: Float, *, seed: int = 0, n_shifts: int = 1000) -> list[Measure]:
    """Judge the beats of a dance by an independent observer.

    Parameters
    ----------
    dance : Dance
    music_beat_s : (B,) float, seconds, as heard: not the ones added to cover the song
    seed : int
    n_shifts : int
        Random block shifts that measure chance.

    Returns
    -------
    list of Measure
        Beat F at 70 ms, alignment corrected for chance, its p-value (share of shifts at least as good, counting the
        dance itself).
    """
    duration_s = float(dance.time_s[-1]) if len(dance.time_s) else 0.0
    moved_s = kinematic_beats(dance.position_xyz_m, dance.frame_rate_hz) / dance.frame_rate_hz
    music_s = music_beat_s[(music_beat_s >= 0) & (music_beat_s <= duration_s)]
    score = beat_alignment(moved_s, music_s)
    rng = np.random.default_rng(seed)
    if len(moved_s) and len(music_s):
        chance = np.array(
            [beat_alignment(block_shifted(moved_s, duration_s, rng=rng), music_s) for _ in range(n_shifts)]
        )
    else:
        chance = np.zeros(n_shifts)
    p = (1 + int(np.sum(chance >= score))) / (1 + n_shifts)
    mean = float(chance.mean())
    return [
        Measure("beat_f_ratio", f_measure(moved_s, music_s)),
        Measure("beat_alignment_ratio", score),
        Measure("beat_alignment_chance_ratio", mean),
        Measure(
            "beat_alignment_corrected_ratio", (score - mean) / (1 - mean) if mean < 1 else 0.0, "above 0", score > mean
        ),
        Measure("beat_p_probability", p, "below 0.01", p < 0.01),
    ]


def lag_measures(dance: Dance, steps: Choreography, music_beat_s: Float) -> list[Measure]:
    """Judge whether planned motion beats fall on music beats.

    Measured on the finished frames: where the dominant clip's time, read from the lineage, passes the step's start in
    the clip, against the music beat there. Steps that start on an added beat do not count.

    Parameters
    ----------
    dance : Dance
    steps : Choreography it was assembled from
    music_beat_s : (B,) float, seconds, as heard

    Returns
    -------
    list of Measure
        The worst lag, milliseconds; 0 where no step starts on a beat.
    """
    is_heard = [np.min(np.abs(music_beat_s - s), initial=np.inf) < 1e-6 for s in steps.song_start_s]
    crossed_s = [
        _crossing_s(dance, i, float(c)) if heard else None
        for i, (c, heard) in enumerate(zip(steps.clip_start_s, is_heard, strict=True))
    ]
    lag_ms = [1e3 * abs(c - s) for c, s in zip(crossed_s, steps.song_start_s, strict=True) if c is not None]
    worst_ms = float(max(lag_ms, default=0.0))
    half_frame_ms = 500.0 / dance.frame_rate_hz
    return [
        Measure(
            "beat_lag_ms", worst_ms, f"at most {half_frame_ms:.1f}, half an output frame", worst_ms <= half_frame_ms
        )
    ]


def warp_measures(steps: Choreography) -> list[Measure]:
    """Judge the pace: song time over clip time of every step.

    Parameters
    ----------
    steps : Choreography of at least one step

    Returns
    -------
    list of Measure
        Share of steps near their own pace, least and most warp ratio.
    """
    warp = steps.warp_ratio
    easy, least, most = (
        float(np.mean((warp >= 0.90 - _SLACK) & (warp <= 1.10 + _SLACK))),
        float(warp.min()),
        float(warp.max()),
    )
    return [
        Measure("warp_easy_ratio", easy, "at least 0.95 of steps within 0.90 to 1.10", easy >= 0.95),
        Measure("warp_least_ratio", least, "never below 0.80", least >= 0.80 - _SLACK),
        Measure("warp_most_ratio", most, "never above 1.25", most <= 1.25 + _SLACK),
    ]


_SLACK = 1e-6


def _crossing_s(dance: Dance, step: int, clip_s: float) -> float | None:
    """Song time at which a step's clip passes a clip time, by the frames of that step; None where it has too few."""
    frame = np.flatnonzero(dance.lineage.step_index == step)[:2]
    if len(frame) < 2:
        return None
    time_s, passed_s = frame / dance.frame_rate_hz, dance.lineage.clip_time_s[frame]
    slope = (passed_s[1] - passed_s[0]) / (time_s[1] - time_s[0])
    return float(time_s[0] + (clip_s - passed_s[0]) / slope) if slope > 0 else None


def seam_measures(
    dance: Dance, steps: Choreography, clips: Mapping[str, Clip], *, skeleton: Skeleton, reach_s: float = 0.1
) -> list[Measure]:
    """Judge the seams: peak jerk there over the 99th percentile inside the source clips at the dance's own pace.

    A plain cut (the same choreography without blends) is measured beside it: a blend must do better.

    Parameters
    ----------
    dance, steps, clips, skeleton : as :func:`kernels.assembly.blend.assemble` has them
    reach_s : float, seconds
        Looked at on either side of the blend as well.

    Returns
    -------
    list of Measure
        Count; the 95th percentile of the ratio over seams, which is judged (an actual seam: the worst of up to
        twenty), its median and worst; the 95th percentile of plain cuts. Zeros without seams.
    """
    seam = np.flatnonzero(steps.has_seam)
    nothing = [Measure("seam_count", float(len(seam)))]
    if len(seam) == 0 or len(dance.time_s) < 4:
        return [*nothing, Measure("seam_jerk_ratio", 0.0, "at most 1.5, and below a plain cut", True)]
    reference = float(np.percentile(_source_jerk(dance, steps, clips, skeleton), 99)) or 1.0
    cut = assemble(
        replace(steps, blend_s=np.zeros_like(steps.blend_s)),
        clips,
        skeleton=skeleton,
        frame_rate_hz=dance.frame_rate_hz,
        duration_s=float(dance.time_s[-1]) or 1.0 / dance.frame_rate_hz,
    )
    at_s = steps.song_start_s[seam]
    width_s = steps.blend_s[seam] / 2 + reach_s
    blended = _peaks(jerk(dance.position_xyz_m, dance.frame_rate_hz), dance.time_s, at_s, width_s) / reference
    plain = _peaks(jerk(cut.position_xyz_m, cut.frame_rate_hz), cut.time_s, at_s, width_s) / reference
    high, plain_high = (float(np.percentile(peak, 95, method="higher")) for peak in (blended, plain))
    # A plain cut hardly rougher than the clips themselves leaves nothing to better.
    is_better = high < plain_high or max(high, plain_high) <= 1.1
    return [
        *nothing,
        Measure("seam_jerk_ratio", high, "at most 1.5, and below a plain cut", high <= 1.5 and is_better),
        Measure("seam_jerk_median_ratio", float(np.median(blended))),
        Measure("seam_jerk_worst_ratio", float(blended.max())),
        Measure("seam_jerk_plain_cut_ratio", plain_high),
    ]


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
    motion = clock(steps)
    motion_s = motion.at(dance.time_s)
    start = np.flatnonzero(np.append(True, steps.has_seam[1:]))
    end = np.append(start[1:], len(steps.clip_id))
    found = []
    for a, b in zip(start, end, strict=True):
        frame = np.flatnonzero((dance.lineage.step_index >= a) & (dance.lineage.step_index < b))
        if len(frame) < 4:
            continue
        root, rot = sample(clips[steps.clip_id[a]], steps.clip_start_s[a] + motion_s[frame] - motion.motion_s[a])
        found.append(jerk(kinematics.forward(skeleton, root, rot)[0], dance.frame_rate_hz)[1:-2])
    return np.concatenate(found) if found else np.ones(1)


def catalogue_measures(steps: Choreography, catalogue_s: Mapping[str, float]) -> list[Measure]:
    """Report what share of the catalogue's time is danced, and how long the longest repeated run is.

    Parameters
    ----------
    steps : Choreography
    catalogue_s : seconds of every clip of the catalogue, by clip_id

    Returns
    -------
    list of Measure
        Clips danced; the union of the stretches danced over the seconds of the catalogue, 0 to 1, 0 where it is empty;
        the longest run of steps that comes twice.
    """
    word = [f"{c}@{round(s * 1000)}" for c, s in zip(steps.clip_id, steps.clip_start_s, strict=True)]
    total_s = sum(catalogue_s.values())
    return [
        Measure("clip_count", float(len(set(steps.clip_id)))),
        Measure("coverage_ratio", _danced_s(steps, catalogue_s) / total_s if total_s else 0.0),
        Measure("longest_repeat_steps", float(_longest_repeat(word))),
    ]


def _danced_s(steps: Choreography, catalogue_s: Mapping[str, float]) -> float:
    """Seconds of the clips that are danced, each counted once however often it is danced."""
    reached: dict[str, float] = {}
    danced_s = 0.0
    for start_s, end_s, clip_id in sorted(zip(steps.clip_start_s, steps.clip_end_s, steps.clip_id, strict=True)):
        low, high = max(float(start_s), reached.get(clip_id, 0.0)), min(float(end_s), catalogue_s.get(clip_id, 0.0))
        danced_s += max(high - low, 0.0)
        reached[clip_id] = max(high, reached.get(clip_id, 0.0))
    return danced_s


def _longest_repeat(word: list[str]) -> int:
    """Length of the longest run of steps that comes twice, without overlap, by dynamic programming."""
    n = len(word)
    best, previous = 0, np.zeros(n + 1, int)
    codes = np.unique(np.array(word), return_inverse=True)[1] if n else np.zeros(0, int)
    for i in range(n):
        row = np.zeros(n + 1, int)
        same = np.flatnonzero(codes[i + 1 :] == codes[i]) + i + 1
        row[same + 1] = np.minimum(previous[same] + 1, same - i)
        best = max(best, int(row.max(initial=0)))
        previous = row
    return best


def _danced_frames(dance: Dance, steps: Choreography, clip_id: str, clip: Clip) -> Bool:
    """Mark the frames of a clip that a dance passes, (F,): all from one frame of the dance to the next.

    Not only the nearest to each: a clip recorded faster than the stage would keep no two neighbours.
    """
    step = dance.lineage.step_index
    phrase = np.cumsum(steps.has_seam)[step]
    goes_on = (phrase[1:] == phrase[:-1]) & (np.array(steps.clip_id, object)[step[1:]] == clip_id)
    before = np.flatnonzero(goes_on)
    at = dance.lineage.clip_time_s * clip.frame_rate_hz
    low, high = np.floor(at[before] + 1e-6), np.ceil(at[before + 1] - 1e-6) + 1
    edge = np.zeros(clip.n_frames + 1, int)
    np.add.at(edge, np.clip(low, 0, clip.n_frames).astype(int), 1)
    np.add.at(edge, np.clip(high, 0, clip.n_frames).astype(int), -1)
    return np.asarray(np.cumsum(edge)[:-1] > 0)


def foot_measures(dance: Dance, steps: Choreography, clips: Mapping[str, Clip]) -> list[Measure]:
    """Judge the feet: slide while planted beyond the source clips' own, and depth below the floor.

    Which foot is planted when is taken from the source clips through the lineage: blending must not get to decide what
    counts as contact. The source's own slide is that of every frame danced past, whatever the rate it was recorded at.

    Parameters
    ----------
    dance, steps, clips : as :func:`kernels.assembly.blend.assemble` has them, on the canonical skeleton

    Returns
    -------
    list of Measure
        Centimetres per second of contact, and centimetres.
    """
    planted = planted_feet(dance, steps, clips)
    source_m = source_s = 0.0
    for clip_id in dict.fromkeys(steps.clip_id):
        clip = clips[clip_id]
        position, _ = kinematics.place(clip)
        found = clip_contacts(clip, position)
        used = _danced_frames(dance, steps, clip_id, clip)[:, None]
        danced = replace(found, ankle=found.ankle & used, toes=found.toes & used)
        stood_s = float(danced.foot.sum()) / clip.frame_rate_hz
        slide = contacts.foot_slide(
            position[:, grounding.ANKLES], position[:, grounding.TOES], danced, frame_rate_hz=clip.frame_rate_hz
        )
        source_m, source_s = source_m + slide * stood_s, source_s + stood_s
    feet = dance.position_xyz_m[:, grounding.ANKLES], dance.position_xyz_m[:, grounding.TOES]
    ours = 100 * contacts.foot_slide(*feet, planted, frame_rate_hz=dance.frame_rate_hz)
    source = 100 * source_m / source_s if source_s else 0.0
    limit = max(0.2 * source, UNSEEN_SLIDE_CM_PER_S)
    depth_cm = 100 * max(float(np.max(-point[..., 1], initial=0.0)) for point in feet)
    return [
        Measure("foot_slide_cm_per_s", ours),
        Measure("source_foot_slide_cm_per_s", source),
        Measure(
            "added_foot_slide_cm_per_s",
            ours - source,
            f"at most {limit:.2f}, a fifth of the source's own or what nobody sees",
            ours - source <= limit,
        ),
        Measure("penetration_cm", depth_cm, "at most 1", depth_cm <= 1.0),
    ]
