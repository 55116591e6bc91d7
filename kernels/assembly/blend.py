"""From a choreography and its clips to one motion: sampled, warped, joined, every frame accounted for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from kernels import rotation
from kernels.assembly.joins import PROBE_S, SHAPES, Side, ease
from kernels.assembly.stance import clip_contacts, meet, planted_share
from kernels.assembly.timing import clock
from kernels.skeleton import kinematics
from kernels.skeleton.contacts import FootContacts
from kernels.types import Choreography, Clip, Float, Int, Skeleton


@dataclass(frozen=True, eq=False)
class Lineage:
    """Where each frame of a dance comes from.

    Parameters
    ----------
    step_index, blend_step_index : (F,) int64
        Step of the dominant clip and of its partner; -1 for no partner.
    clip_time_s, blend_time_s : (F,) float64, seconds in the clips, never beyond their ends; NaN for no partner
    blend_weight : (F,) float64, the partner's share, 0 to 0.5
    """

    step_index: Int
    clip_time_s: Float
    blend_step_index: Int
    blend_time_s: Float
    blend_weight: Float


@dataclass(frozen=True, eq=False)
class Dance:
    """A finished motion: (F, 3), (F, J, 4) local, (F, J, 3) world, at one frame rate, with its lineage."""

    frame_rate_hz: float
    root_xyz_m: Float
    rotation_wxyz: Float
    position_xyz_m: Float
    lineage: Lineage

    @property
    def time_s(self) -> Float:
        """Seconds of each frame, (F,)."""
        return np.arange(len(self.root_xyz_m)) / self.frame_rate_hz


def sample(clip: Clip, time_s: Float) -> tuple[Float, Float]:
    """Pose of a clip at any times, by cubic splines through its frames.

    Parameters
    ----------
    clip : Clip
    time_s : (n,) float, seconds
        Held at the clip's first and last frame beyond its ends.

    Returns
    -------
    root_xyz_m : (n, 3) float64, metres
    rotation_wxyz : (n, J, 4) float64, unit, local

    Notes
    -----
    Quaternions are interpolated by component in one hemisphere and scaled back to unit length: between frames 1/24 s
    apart the difference from a spline on the sphere is below what the data resolve, and velocity stays continuous,
    which linear interpolation does not give. Two or three frames are joined by lines.
    """
    frame = np.clip(np.asarray(time_s, np.float64) * clip.frame_rate_hz, 0.0, max(clip.n_frames - 1, 0))
    if len(frame) == 0:
        return np.zeros((0, 3)), np.zeros((0, len(clip.skeleton.joints), 4))
    # Four frames either side decide a natural cubic to far below a micrometre.
    low = max(int(np.floor(frame.min())) - 8, 0)
    high = min(int(np.ceil(frame.max())) + 9, clip.n_frames)
    knots = np.arange(low, high)
    values = np.concatenate(
        [clip.root_xyz_m[low:high], rotation.continuous(clip.rotation_wxyz[low:high]).reshape(high - low, -1)], axis=1
    )
    if len(knots) >= 4:
        found = scipy.interpolate.CubicSpline(knots, values, axis=0, bc_type="natural")(frame)
    else:
        found = np.stack([np.interp(frame, knots, column) for column in values.T], axis=1)
    return found[:, :3], rotation.normalize(found[:, 3:].reshape(len(frame), -1, 4))


def turn(root_xyz_m: Float, rotation_wxyz: Float, angle_rad: float) -> tuple[Float, Float]:
    """Turn a motion about the vertical through the origin: (F, 3) and (F, J, 4) local.

    Parameters
    ----------
    root_xyz_m : (F, 3) float, metres
    rotation_wxyz : (F, J, 4) float, unit, local to the parent
    angle_rad : float, radians, from +Z towards +X

    Returns
    -------
    root_xyz_m : (F, 3) float64, metres
    rotation_wxyz : (F, J, 4) float64, unit, local
    """
    q = rotation.from_heading(angle_rad)
    turned = rotation_wxyz.copy()
    turned[:, 0] = rotation.mul(q, rotation_wxyz[:, 0])
    return rotation.apply(q, root_xyz_m), turned


def _lowest_m(skeleton: Skeleton, root_xyz_m: Float, rotation_wxyz: Float) -> Float:
    """Height of the lowest joint of each frame, (F,): of the feet, whatever else lies on the floor."""
    position, _ = kinematics.forward(skeleton, root_xyz_m, rotation_wxyz)
    feet = [k for k, name in enumerate(skeleton.joints) if name.endswith(("Foot", "Toes"))]
    return np.asarray(position[:, feet or slice(None), 1].min(axis=1), np.float64)


def _planted_through(
    steps: Choreography, clips: Mapping[str, Clip], standing: Mapping[str, FootContacts], seam: int
) -> Float:
    """Share of half a blend for which each point of the feet is planted in both clips, (2, 2)."""
    half_s = steps.blend_s[seam] / 2
    before, after = steps.clip_id[seam - 1], steps.clip_id[seam]
    end_s, start_s = float(steps.clip_end_s[seam - 1]), float(steps.clip_start_s[seam])
    return planted_share(standing[before], end_s - half_s, end_s, clips[before].frame_rate_hz) * planted_share(
        standing[after], start_s, start_s + half_s, clips[after].frame_rate_hz
    )


def assemble(
    steps: Choreography,
    clips: Mapping[str, Clip],
    *,
    skeleton: Skeleton,
    frame_rate_hz: float,
    duration_s: float,
    shape: str = "slerp",
) -> Dance:
    """Dance a choreography.

    Between the boundaries of steps the clips are played by the clock of :mod:`kernels.assembly.timing`, so every
    boundary falls on its song time. At a seam the following clip is turned and moved so that its root stands where the
    one before stood and faces where it faced, and then so that feet planted in both clips stand where they stood
    (:mod:`kernels.assembly.stance`); over the blend both are played at the same pace and joined by ``shape``.
    The dance starts at the origin, facing +Z.

    After [Xu2015], equations 21, 22 and 27; centred blends, blended root travel, feet kept at their height through a
    blend and the smooth clock are ours.

    Parameters
    ----------
    steps : Choreography of at least one step, from song time 0
    clips : by clip_id, all on ``skeleton``
    skeleton : Skeleton of the canonical joints
    frame_rate_hz : float, > 0
    duration_s : float, seconds, > 0
    shape : name of one of :data:`kernels.assembly.joins.SHAPES`

    Returns
    -------
    Dance
        floor(duration * rate) + 1 frames, the first at 0.

    Raises
    ------
    ValueError
        If there is no step, a clip is missing, the shape is unknown, or a rate or duration is not > 0.
    """
    if shape not in SHAPES:
        raise ValueError(f"shape: want one of {', '.join(SHAPES)}, got {shape!r}")
    if not (frame_rate_hz > 0 and duration_s > 0):
        raise ValueError(f"frame_rate_hz, duration_s: want > 0, got {frame_rate_hz}, {duration_s}")
    missing = sorted(set(steps.clip_id) - set(clips))
    if missing:
        raise ValueError(f"clips: want all that are danced, {', '.join(missing)} missing; build the catalogue again")
    motion = clock(steps)
    n_frames = int(np.floor(duration_s * frame_rate_hz + 1e-6)) + 1
    time_s = np.arange(n_frames) / frame_rate_hz
    motion_s = motion.at(time_s)
    n_joints = len(skeleton.joints)

    start = np.flatnonzero(np.append(True, steps.has_seam[1:]))
    end = np.append(start[1:], len(steps.clip_id))
    half = steps.blend_s / 2
    root, rot = np.zeros((n_frames, 3)), np.zeros((n_frames, n_joints, 4))
    step = np.clip(np.searchsorted(steps.song_start_s, time_s + 1e-9, side="right") - 1, 0, len(steps.clip_id) - 1)
    clip_time, partner_time = np.zeros(n_frames), np.full(n_frames, np.nan)
    partner, weight = np.full(n_frames, -1), np.zeros(n_frames)
    place, heading = np.zeros(3), 0.0
    standing = {name: clip_contacts(clips[name], kinematics.place(clips[name])[0]) for name in set(steps.clip_id)}
    probe = np.array([-PROBE_S, 0.0, PROBE_S])
    edge_root, edge_rot = np.zeros((3, 3)), np.zeros((3, n_joints, 4))
    for a, b in zip(start, end, strict=True):
        clip = clips[steps.clip_id[a]]
        seam_s, next_seam_s = steps.song_start_s[a], steps.song_end_s[b - 1]
        before = half[a]
        after = half[b] if b < len(half) else 0.0
        is_here = (time_s >= seam_s - before) | (a == 0)
        span = np.flatnonzero(is_here & ((time_s < next_seam_s + after) | (b == len(half))))
        # More samples at each seam: where this phrase takes over, and where it hands over.
        edges = motion.at(np.concatenate([seam_s + probe, next_seam_s + probe]))
        # A blend that reaches past a clip's end is held at its last frame, and says so.
        clip_s = np.clip(
            steps.clip_start_s[a] + np.append(motion_s[span], edges) - motion.motion_s[a], 0.0, clip.duration_s
        )
        xyz, q = sample(clip, clip_s)
        angle = heading - float(rotation.heading_rad(q[-5, 0]))
        xyz, q = turn(xyz, q, angle)
        shift = (place - xyz[-5]) * np.array([1.0, 0.0, 1.0])
        xyz = xyz + shift
        if a:
            before_xyz_m, after_xyz_m = (
                kinematics.forward(skeleton, r, j)[0][1] for r, j in ((edge_root, edge_rot), (xyz[-6:-3], q[-6:-3]))
            )
            planted = _planted_through(steps, clips, standing, int(a))
            angle, shift = meet(before_xyz_m, after_xyz_m, planted, heading_rad=heading)
            xyz, q = turn(xyz, q, angle)
            xyz = xyz + shift
        place, heading = xyz[-2], float(rotation.heading_rad(q[-2, 0]))
        entry_root, entry_rot = xyz[-6:-3], q[-6:-3]
        next_root, next_rot = xyz[-3:], q[-3:]
        xyz, q, clip_s = xyz[:-6], q[:-6], clip_s[:-6]

        mixed = time_s[span] < seam_s + before
        alone, both = span[~mixed], span[mixed]
        root[alone], rot[alone], clip_time[alone] = xyz[~mixed], q[~mixed], clip_s[~mixed]
        if len(both):
            x = (time_s[both] - seam_s) / before
            share = ease((x + 1) / 2)
            low_m = (1 - share) * _lowest_m(skeleton, root[both], rot[both]) + share * _lowest_m(
                skeleton, xyz[mixed], q[mixed]
            )
            root[both], rot[both] = SHAPES[shape](
                x,
                before,
                Side(root[both], rot[both], edge_root, edge_rot),
                Side(xyz[mixed], q[mixed], entry_root, entry_rot),
            )
            # Knees bent halfway do not carry hips at half the height: the lower foot decides instead.
            root[both, 1] += low_m - _lowest_m(skeleton, root[both], rot[both])
            leads = time_s[both] + 1e-9 >= seam_s
            partner[both] = np.where(leads, a - 1, a)
            partner_time[both] = np.where(leads, clip_time[both], clip_s[mixed])
            clip_time[both] = np.where(leads, clip_s[mixed], clip_time[both])
            weight[both] = np.minimum(share, 1 - share)
        edge_root, edge_rot = next_root, next_rot
    rot = rotation.continuous(rot)
    position, _ = kinematics.forward(skeleton, root, rot)
    return Dance(frame_rate_hz, root, rot, position, Lineage(step, clip_time, partner, partner_time, weight))
