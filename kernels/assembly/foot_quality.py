"""How still planted feet of a dance stand: slide beyond the clips' own, and depth below the floor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kernels.assembly.blend import Dance
from kernels.assembly.feet import planted_feet
from kernels.assembly.quality import Measure
from kernels.assembly.seam_quality import phrases_alone
from kernels.assembly.stance import clip_contacts
from kernels.skeleton import contacts, grounding, kinematics
from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.contacts import FootContacts
from kernels.types import Choreography, Clip, Float

Bool = NDArray[np.bool_]

UNSEEN_SLIDE_CM_PER_S = 0.5
"""Slide of planted feet that nobody sees, whatever the clips do: a twentieth of the 8.9 measured on the clips of ten
dances. Chosen by hand."""


UNSEEN_KNEE_RAD_PER_S2 = 6.0
"""Change of a knee's turning that nobody sees, however still the clips stand: of a degree to and fro at 3 Hz. Chosen by
hand, of viewers nobody was asked."""


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
        Seconds of contact of both feet, centimetres per second of contact, and centimetres.
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
    limit = max(0.1 * source, UNSEEN_SLIDE_CM_PER_S)
    depth_cm = 100 * max(float(np.max(-point[..., 1], initial=0.0)) for point in feet)
    return [
        Measure("planted_s", float(planted.foot.sum()) / dance.frame_rate_hz),
        Measure("foot_slide_cm_per_s", ours),
        Measure("source_foot_slide_cm_per_s", source),
        Measure(
            "added_foot_slide_cm_per_s",
            ours - source,
            f"at most {limit:.2f}, a tenth of the source's own or what nobody sees",
            ours - source <= limit,
        ),
        Measure("penetration_cm", depth_cm, "at most 1", depth_cm <= 1.0),
    ]


def knee_measures(dance: Dance, steps: Choreography, clips: Mapping[str, Clip]) -> list[Measure]:
    """Judge the knees: a leg that is pulled straight for a foot pops. Knees at rest count as wavering a little.

    Parameters
    ----------
    dance, steps, clips : as :func:`kernels.assembly.blend.assemble` has them, on the canonical skeleton

    Returns
    -------
    list of Measure
        How fast knees change their turning, at the one frame in a thousand where they do so most, over the same of the
        clips at the dance's own pace; 0 for a dance too short.
    """
    own = [_knee_turns(position) for _, position in phrases_alone(dance, steps, clips, skeleton=CANONICAL)]
    ours = _knee_turns(dance.position_xyz_m)
    unseen = UNSEEN_KNEE_RAD_PER_S2 / dance.frame_rate_hz**2
    source = max(float(np.percentile(np.concatenate(own), 99.9)), unseen) if own else 0.0
    ratio = float(np.percentile(ours, 99.9)) / source if source > 0 and len(ours) else 0.0
    return [Measure("knee_pop_ratio", ratio, "at most 1.2", ratio <= 1.2)]


def slip_measures(dance: Dance, steps: Choreography, clips: Mapping[str, Clip]) -> list[Measure]:
    """Judge the feet that are planted through a seam by :func:`seam_slips`.

    Parameters
    ----------
    dance, steps, clips : as :func:`kernels.assembly.blend.assemble` has them, on the canonical skeleton

    Returns
    -------
    list of Measure
        How many, and in centimetres the 95th percentile (an actual foot: the worst of up to twenty) and the worst;
        zeros where none is.
    """
    slip_cm = 100 * seam_slips(dance, steps, planted_feet(dance, steps, clips))
    high = float(np.percentile(slip_cm, 95, method="higher")) if len(slip_cm) else 0.0
    return [
        Measure("seam_planted_count", float(len(slip_cm))),
        Measure("seam_foot_slip_cm", high, "at most 1", high <= 1.0),
        Measure("seam_foot_slip_worst_cm", float(slip_cm.max(initial=0.0))),
    ]


def seam_slips(dance: Dance, steps: Choreography, planted: FootContacts) -> Float:
    """Measure how far each foot that is planted through a seam moves over its blend.

    Parameters
    ----------
    dance : Dance on the canonical skeleton
    steps : Choreography it was assembled from
    planted : FootContacts of its frames, from :func:`kernels.assembly.feet.planted_feet`

    Returns
    -------
    (n,) float64, metres, horizontal; one for each foot whose ankle or toes stand from one end of a blend to the other
    """
    found = []
    for i in np.flatnonzero(steps.has_seam & (steps.blend_s > 0)):
        near = np.abs(dance.time_s - steps.song_start_s[i]) <= steps.blend_s[i] / 2
        frame = np.flatnonzero(near)
        for joints, stands in ((grounding.ANKLES, planted.ankle), (grounding.TOES, planted.toes)):
            for side in range(2):
                if len(frame) > 1 and stands[frame, side].all():
                    a, b = dance.position_xyz_m[frame[0], joints[side]], dance.position_xyz_m[frame[-1], joints[side]]
                    found.append(float(np.linalg.norm((b - a)[[0, 2]])))
    return np.array(found)


def _knee_turns(position_xyz_m: Float) -> Float:
    """Size of the second differences of both knees' angles, radians a frame squared."""
    hip, knee, ankle = (position_xyz_m[:, joints] for joints in (grounding.THIGHS, grounding.KNEES, grounding.ANKLES))
    thigh, shin = hip - knee, ankle - knee
    angle = np.arctan2(np.linalg.norm(np.cross(thigh, shin), axis=-1), (thigh * shin).sum(axis=-1))
    return np.asarray(np.abs(np.diff(angle, n=2, axis=0)).ravel(), np.float64)


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
