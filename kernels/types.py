"""Records of arrays that kernels pass to each other, checked at birth.

Conventions
-----------
Axes: ``F`` frames, ``J`` joints, ``B`` beats, ``N`` nodes, ``E`` edges, ``S`` steps. Metres, seconds, Hz; quaternions
``wxyz``. World: right-handed, Y up, a body at rest faces +Z with its left hand towards +X.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A hierarchy of joints with rest offsets.

    Rest rotations are all identity: a joint's frame is parallel to the world's at rest.

    Parameters
    ----------
    joints : J names, unique, J >= 1
    parent : (J,) int64
        Topological: ``parent[j] < j``; the root, joint 0, has -1.
    offset_xyz_m : (J, 3) float64, metres
        Rest position of each joint in its parent's frame; the root's in the world.

    Raises
    ------
    ValueError
        If a shape, the order of the joints or a value does not fit.
    """

    joints: tuple[str, ...]
    parent: Int
    offset_xyz_m: Float

    def __post_init__(self) -> None:
        n = len(self.joints)
        if n < 1 or len(set(self.joints)) != n:
            raise ValueError(f"joints: want at least one and no name twice, got {self.joints}")
        if self.parent.shape != (n,) or self.parent[0] != -1:
            raise ValueError(f"parent: want ({n},) with -1 first, got {self.parent}")
        if not ((self.parent[1:] >= 0) & (self.parent[1:] < np.arange(1, n))).all():
            raise ValueError(
                f"parent: want 0 <= parent[j] < j, got {self.parent}; sort the joints from the root outwards"
            )
        if self.offset_xyz_m.shape != (n, 3) or not np.isfinite(self.offset_xyz_m).all():
            raise ValueError(f"offset_xyz_m: want finite ({n}, 3), got {self.offset_xyz_m.shape}")

    def index(self, joint: str) -> int:
        """Find the position of a joint by its name.

        Parameters
        ----------
        joint : str

        Returns
        -------
        int, 0 to J - 1

        Raises
        ------
        ValueError
            If no joint has this name.
        """
        if joint not in self.joints:
            raise ValueError(f"joint: want one of {', '.join(self.joints)}, got {joint!r}")
        return self.joints.index(joint)


@dataclass(frozen=True, eq=False)
class Clip:
    """One take of motion on one skeleton at one frame rate.

    Parameters
    ----------
    skeleton : Skeleton of J joints
    frame_rate_hz : float, > 0
    root_xyz_m : (F, 3) float, metres, world
    rotation_wxyz : (F, J, 4) float, unit, local to the parent; the root's in the world
    translation_xyz_m : (F, J, 3) float, metres, or None
        Local joint positions where a rig moves its joints; None when they stay at the skeleton's offsets.
        Row 0 (the root) is ignored: ``root_xyz_m`` holds it.

    Raises
    ------
    ValueError
        If a shape does not fit, the rate is not > 0, or a value is not finite.
    """

    skeleton: Skeleton
    frame_rate_hz: float
    root_xyz_m: Float
    rotation_wxyz: Float
    translation_xyz_m: Float | None = None

    def __post_init__(self) -> None:
        f, j = len(self.root_xyz_m), len(self.skeleton.joints)
        if not (np.isfinite(self.frame_rate_hz) and self.frame_rate_hz > 0):
            raise ValueError(f"frame_rate_hz: want > 0, got {self.frame_rate_hz}")
        for name, array, shape in (
            ("root_xyz_m", self.root_xyz_m, (f, 3)),
            ("rotation_wxyz", self.rotation_wxyz, (f, j, 4)),
            ("translation_xyz_m", self.translation_xyz_m, (f, j, 3)),
        ):
            if array is not None and array.shape != shape:
                raise ValueError(f"{name}: want {shape}, got {array.shape}")
            if array is not None and not np.isfinite(array).all():
                raise ValueError(f"{name}: not finite; mend or refuse the clip where it is read")

    @property
    def n_frames(self) -> int:
        """Number of frames, F."""
        return len(self.root_xyz_m)

    @property
    def duration_s(self) -> float:
        """Seconds from the first frame to the last; 0 for one frame or none."""
        return max(self.n_frames - 1, 0) / self.frame_rate_hz


@dataclass(frozen=True, eq=False)
class BeatGrid:
    """Beats of a song or a clip, in order.

    Parameters
    ----------
    time_s : (B,) float64, seconds, strictly increasing
    bar_number : (B,) int64, from 1; 0 where unknown
    beat_in_bar_number : (B,) int64, from 1; 0 where unknown
    confidence : (B,) float64, 0 to 1

    Raises
    ------
    ValueError
        If shapes differ, times do not increase, or a value is out of range.
    """

    time_s: Float
    bar_number: Int
    beat_in_bar_number: Int
    confidence: Float

    def __post_init__(self) -> None:
        b = len(self.time_s)
        for name in ("time_s", "bar_number", "beat_in_bar_number", "confidence"):
            if getattr(self, name).shape != (b,):
                raise ValueError(f"{name}: want ({b},), got {getattr(self, name).shape}")
        if not (np.isfinite(self.time_s).all() and (np.diff(self.time_s) > 0).all()):
            raise ValueError("time_s: want finite, strictly increasing seconds; sort the beats and drop repeats")
        if not ((self.confidence >= 0) & (self.confidence <= 1)).all():
            raise ValueError("confidence: want 0 to 1")


@dataclass(frozen=True, eq=False)
class MotionGraph:
    """Which beat of which clip may follow which.

    Parameters
    ----------
    clip_index : (N,) int64
        Clip of each node; nodes are sorted by clip, then by beat.
    time_s : (N,) float64, seconds from the clip's first frame
    next_node : (N,) int64
        The following beat of the same clip: the unidirectional edge; -1 at a clip's last beat.
    source, target : (E,) int64
        Transition edges, sorted by source, then weight, then target. A bidirectional edge is two rows; where missing
        frames or a jump in the recording forbid one direction, there is only the other.
    weight : (E,) float64, >= 0
        d(i, j) / (d(i) + d(j)), equation 20 of [Xu2015].
    accent : (N,) float64, 0 to 1, or None
        How plainly the body stops at each node, :func:`kernels.motion.velocity.accents`; None where it is not known.
    peak_jerk, usual_jerk : (N,) float64, >= 0, metres per second cubed, or None
        Of the recording around each node, and its clip's usual, :func:`kernels.motion.velocity.jerk_around`.
    speed : (N,) float64, >= 0, metres per second, or None
        Mean speed of the joints from each node to the clip's next.

    Raises
    ------
    ValueError
        If shapes differ or an index points outside.
    """

    clip_index: Int
    time_s: Float
    next_node: Int
    source: Int
    target: Int
    weight: Float
    accent: Float | None = None
    peak_jerk: Float | None = None
    usual_jerk: Float | None = None
    speed: Float | None = None

    def __post_init__(self) -> None:
        n, e = len(self.clip_index), len(self.source)
        for name in ("peak_jerk", "usual_jerk", "speed"):
            found = getattr(self, name)
            if found is not None and not (found.shape == (n,) and np.isfinite(found).all() and (found >= 0).all()):
                raise ValueError(f"{name}: want ({n},) finite, >= 0, got {found.shape}")
        if self.accent is not None and not (
            self.accent.shape == (n,) and ((self.accent >= 0) & (self.accent <= 1)).all()
        ):
            raise ValueError(f"accent: want ({n},) from 0 to 1, got {self.accent.shape}")
        for name, size in (("time_s", n), ("next_node", n), ("target", e), ("weight", e)):
            if getattr(self, name).shape != (size,):
                raise ValueError(f"{name}: want ({size},), got {getattr(self, name).shape}")
        for name, low in (("next_node", -1), ("source", 0), ("target", 0)):
            value = getattr(self, name)
            if value.size and (value.min() < low or value.max() >= n):
                raise ValueError(f"{name}: want {low} <= node < {n}, got {value.min()} to {value.max()}")
        if not (np.isfinite(self.weight).all() and (self.weight >= 0).all()):
            raise ValueError("weight: want finite, >= 0")


@dataclass(frozen=True, eq=False)
class Choreography:
    """Phrases in order, timed to a song: the record every method writes and the assembler reads.

    Parameters
    ----------
    clip_id : S names
    song_start_s, song_end_s : (S,) float64, seconds of the song, contiguous: each step starts where the last ended
    clip_start_s, clip_end_s : (S,) float64, seconds of the clip, end > start
    has_seam : (S,) bool
        True where a step does not continue the one before in its clip: at every change of clip or jump in time.
    blend_s : (S,) float64, seconds of song, width of the blend centred on the step's start; 0 without a seam

    Raises
    ------
    ValueError
        If shapes differ, an interval is empty, or the steps do not join up.
    """

    clip_id: tuple[str, ...]
    song_start_s: Float
    song_end_s: Float
    clip_start_s: Float
    clip_end_s: Float
    has_seam: NDArray[np.bool_]
    blend_s: Float

    def __post_init__(self) -> None:
        s = len(self.clip_id)
        for name in ("song_start_s", "song_end_s", "clip_start_s", "clip_end_s", "has_seam", "blend_s"):
            if getattr(self, name).shape != (s,):
                raise ValueError(f"{name}: want ({s},), got {getattr(self, name).shape}")
        if not ((self.song_end_s > self.song_start_s) & (self.clip_end_s > self.clip_start_s)).all():
            raise ValueError("steps: want end > start for every step, in the song and in the clip")
        if s and not np.allclose(self.song_start_s[1:], self.song_end_s[:-1], atol=1e-9):
            raise ValueError("steps: want each to start in the song where the one before ended")

    @property
    def warp_ratio(self) -> Float:
        """Song time over clip time of each step, (S,); 1 is the clip's own pace."""
        return (self.song_end_s - self.song_start_s) / (self.clip_end_s - self.clip_start_s)
