"""How the pieces of neighbouring segments join: poses at their ends, compared, and the room their blends need."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from kernels.matching import connect
from kernels.matching.match_sequence import Joint
from kernels.matching.price import MatchPiece
from kernels.motion.motion_features import at_feature_rate, link_directions, link_weights
from kernels.motion.velocity import usable_frames
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Float

APART_S = 0.1
"""Time between two moments of a clip that count as neighbours: pieces connect where they differ no more
than those. Tuned on real clips: at 0.017 s only a clip itself connects, at 0.2 s over half of all pairs do, with feet
that visibly slide."""

MARGIN_COST = 0.5
"""Price of a blend half of which would lie past the clip's end. Chosen by hand."""


def clip_directions(position_xyz_m: Float, root_wxyz: Float, frame_rate_hz: float) -> tuple[Float, tuple[float, float]]:
    """Take the link directions of a clip at 120 Hz, and the seconds between which it can be used.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, metres, F >= 1
    root_wxyz : (F, 4) float
    frame_rate_hz : float, > 0

    Returns
    -------
    direction : (T, 21, 3) float64
    usable_s : (first, last) seconds
    """
    position, root = (at_feature_rate(values, frame_rate_hz) for values in (position_xyz_m, root_wxyz))
    first, last = usable_frames(position_xyz_m, frame_rate_hz)
    return link_directions(position, root, CANONICAL.parent), (first / frame_rate_hz, last / frame_rate_hz)


def joints_of(
    pieces: Sequence[Sequence[MatchPiece]],
    spans: Float,
    clips: Iterable[tuple[str, Float, tuple[float, float]]],
    *,
    blend_s: float,
    seam_weight: float,
) -> tuple[connect.ConnectionThresholds, list[Joint]]:
    """Compare the ends of all pieces with the starts of the next, and say which connect.

    Parameters
    ----------
    pieces : S lists of pieces
    spans : (S + 1,) float, seconds of the song
    clips : each clip of the pieces once: its name, and what :func:`clip_directions` has of it
    blend_s : float, seconds of song, >= 0
        A blend that would reach past the usable part of a clip costs more.
    seam_weight : float, >= 0
        Cost of two poses as unlike as the limits.

    Returns
    -------
    limits : ConnectionThresholds, measured in the clips of these pieces
    joints : S - 1 Joint
    """
    n_links = len(CANONICAL.joints) - 1
    weight = link_weights(CANONICAL.offset_xyz_m, CANONICAL.parent)
    half_s = blend_s / 2
    ends = [_no_poses(len(ps), n_links) for ps in pieces]
    starts = [_no_poses(len(ps), n_links) for ps in pieces]
    lacking_end, lacking_start = ([np.zeros(len(ps)) for ps in pieces] for _ in range(2))
    of_clip: dict[str, list[tuple[int, int]]] = {}
    for i, ps in enumerate(pieces):
        for j, piece in enumerate(ps):
            of_clip.setdefault(piece.clip_id, []).append((i, j))
    changes = []
    for clip_id, direction, (first_s, last_s) in clips:
        changes.append(connect.own_changes(direction, weight, apart_s=APART_S))
        here = of_clip[clip_id]
        own = [pieces[i][j] for i, j in here]
        pace = np.array(
            [(p.end_s - p.start_s) / (spans[i + 1] - spans[i]) for (i, _), p in zip(here, own, strict=True)]
        )
        at_start = connect.poses_at(direction, np.array([p.start_s for p in own]), pace=pace)
        at_end = connect.poses_at(direction, np.array([p.end_s for p in own]), pace=pace)
        for n, (i, j) in enumerate(here):
            starts[i].direction[j], starts[i].velocity[j] = at_start.direction[n], at_start.velocity[n]
            ends[i].direction[j], ends[i].velocity[j] = at_end.direction[n], at_end.velocity[n]
            room = half_s * pace[n]
            if room > 0:
                lacking_start[i][j] = max(first_s + room - own[n].start_s, 0.0) / room
                lacking_end[i][j] = max(own[n].end_s + room - last_s, 0.0) / room
    limits = connect.calibrate(changes)
    joints = []
    for i in range(len(pieces) - 1):
        pose, speed = connect.differences(ends[i], starts[i + 1], weight)
        unlike = (pose / limits.pose_rad + speed / limits.speed_rad_per_s) / 2
        # A blend that reaches past a clip's end stands still there.
        stands = MARGIN_COST * (lacking_end[i][:, None] + lacking_start[i + 1][None])
        joints.append(Joint(seam_weight * unlike + stands, connect.connects(pose, speed, limits)))
    return limits, joints


def _no_poses(n: int, n_links: int) -> connect.JointPoses:
    return connect.JointPoses(np.zeros((n, n_links, 3)), np.zeros((n, n_links, 3)))
