"""Poses as pins: which nodes show what a clip shows at a moment, and what a finished dance shows there."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl

from assets.dancing.wishes import DirectionError, stretch
from assets.reading.clips import named_clips
from assets.reading.songs import PlayedSong
from assets.stamps import Stored
from assets.tables.motion import CanonicalClip
from kernels.graph.beat_features import VELOCITY_TIME_S, BeatFeatures, beat_features
from kernels.graph.distance import pose_distance
from kernels.graph.pin_conflicts import Pin
from kernels.graph.pose_nodes import (
    ON_TIME_S,
    PosePrice,
    furthest_ratio,
    is_own_moment,
    pose_pin,
    pose_ratio,
    song_moment,
)
from kernels.graph.transitions import THRESHOLD
from kernels.runs import touches
from kernels.types import Float, MotionGraph
from schemas.keys import is_mirrored, mirrored, source_clip
from schemas.pins import PinWish


@dataclass(frozen=True, eq=False)
class ClipPoses:
    """The poses of all clips, each read when first used.

    Parameters
    ----------
    stored : the table ``canonical_pose``
    threshold : float, > 0
        Poses are alike below this ratio, as :func:`kernels.graph.pose_nodes.pose_ratio` has it, by the metric
        "position".
    """

    stored: Stored
    threshold: float = THRESHOLD

    def read(self, names: Sequence[str]) -> Iterator[CanonicalClip]:
        """Read some clips; those with names of mirrored ones, mirrored. Clips there are not are left out.

        Parameters
        ----------
        names : clips, or mirrored ones as :func:`schemas.keys.mirrored` names them

        Returns
        -------
        iterator of CanonicalClip, in the stored order
        """
        return named_clips(self.stored, names)

    def wanted(self, wish: PinWish) -> BeatFeatures | None:
        """Take the pose of a wish; None where there is no such clip.

        Parameters
        ----------
        wish : PinWish that names a pose

        Returns
        -------
        BeatFeatures of that one moment, or None

        Raises
        ------
        DirectionError
            If the moment is not in the clip, or is never shown.
        """
        clip, at_s = wish.pose_moment
        for moved in self.read([clip]):
            if at_s > moved.duration_s + ON_TIME_S:
                raise DirectionError(
                    f"{wish.text}: want a moment of {clip}, 0 to {moved.duration_s:.2f} s, got {at_s:g}"
                )
            if touches(moved.is_fenced, moved.frame_rate_hz, np.array([at_s]), np.array([at_s]))[0]:
                shown_s = np.flatnonzero(~moved.is_fenced) / moved.frame_rate_hz
                near_s = shown_s[np.abs(shown_s - at_s).argmin()]
                raise DirectionError(
                    f"{wish.text}: {clip} is never shown at {at_s:g} s, 'odori clips' says why; {near_s:.2f} s is the "
                    "nearest that is"
                )
            return _features(moved, np.array([at_s]))
        return None

    def ratios(
        self, wanted: Sequence[BeatFeatures], clips: Sequence[str], of_node: Sequence[int], times: Float
    ) -> Float:
        """Compare poses with what clips show at some moments.

        Parameters
        ----------
        wanted : one pose each
        clips : names, by clip index
        of_node : (N,) int, clip of each node
        times : (T, N) float, seconds of its clip, NaN for none

        Returns
        -------
        (len(wanted), 2, T, N) float64
            Ratios, and roots of the distances in metres; infinite for none.
        """
        found = np.full((len(wanted), 2, *times.shape), np.inf)
        for moved in self.read(clips):
            nodes = np.flatnonzero(np.asarray(of_node) == clips.index(moved.clip_id))
            row, at = np.nonzero(np.isfinite(times[:, nodes]))
            shown = _features(moved, np.clip(times[row, nodes[at]], 0.0, moved.duration_s))
            for i, pose in enumerate(wanted):
                found[i, 0, row, nodes[at]] = pose_ratio(pose, shown)[0]
                found[i, 1, row, nodes[at]] = np.sqrt(pose_distance(pose.pose, shown.pose)[0])
        return found


def to_pose_pins(
    wishes: Sequence[PinWish],
    song: PlayedSong,
    graph: MotionGraph,
    clip_ids: tuple[str, ...],
    poses: ClipPoses,
    *,
    weight: float,
) -> dict[str, Pin]:
    """Bring wishes for poses onto beats and nodes.

    Parameters
    ----------
    wishes : PinWish; those for a pose count
    song : PlayedSong
    graph, clip_ids : the motion graph of N nodes, and its clips
    poses : ClipPoses
    weight : float, >= 0, price of a metre

    Returns
    -------
    dict of Pin by the text of its wish
        The moment is the first beat of the place; at the song's start the first frame, at its end the last. Shown are
        poses nearer than the threshold; the clip's own nearest moment that the dance can show then, always; where there
        is neither, the nearest there are. A clip that is not known admits no node.

    Raises
    ------
    DirectionError
        If a place is not in the song, or a moment not in its clip.
    """
    asked = [wish for wish in wishes if wish.pose]
    wanted = [poses.wanted(wish) for wish in asked]
    places = [song_moment(graph, song.grid_s, moment_of(wish, song)) for wish in asked]
    times = np.concatenate([graph.time_s[None], *(place.times_s for place in places)])
    known = [pose for pose in wanted if pose is not None]
    ratios = iter(poses.ratios(known, clip_ids, graph.clip_index.tolist(), times) if known else np.zeros((0, 2, 1, 0)))
    row, pins = 1, {}
    for wish, pose, place in zip(asked, wanted, places, strict=True):
        between, row = slice(row, row + len(place.times_s)), row + len(place.times_s)
        if pose is None:
            none = np.zeros(len(graph.time_s), bool)
            pins[wish.text] = Pin(wish.text, place.first, place.first + 1, none)
            continue
        clip, at_s = wish.pose_moment
        is_clip = np.array([name == clip for name in clip_ids] or [False])[graph.clip_index]
        price = PosePrice(is_clip, at_s, poses.threshold, weight)
        ratio: Float = next(ratios)
        last = len(song.grid_s) - 1
        pins[wish.text] = pose_pin(wish.text, graph, place, price, ratio[:, 0], ratio[:, between], last=last)
    return pins


def moment_of(wish: PinWish, song: PlayedSong) -> float:
    """Find the moment of the song in which a pose is to be shown.

    Parameters
    ----------
    wish : PinWish that names a pose
    song : PlayedSong

    Returns
    -------
    float, seconds of the song, >= 0

    Raises
    ------
    DirectionError
        If the place is not in the song.
    """
    if wish.place:
        return 0.0 if wish.place == "start" else song.duration_s
    return float(max(song.grid_s[stretch(wish, song)[0]], 0.0))


def _features(moved: CanonicalClip, time_s: Float, *, velocity_time_s: float = VELOCITY_TIME_S) -> BeatFeatures:
    return beat_features(
        moved.rotation_wxyz,
        moved.position_xyz_m,
        frame_rate_hz=moved.frame_rate_hz,
        time_s=time_s,
        velocity_time_s=velocity_time_s,
    )


def shown_pose(
    wish: PinWish,
    moment_s: float,
    lineage: pl.DataFrame,
    dance: CanonicalClip,
    poses: ClipPoses,
    beats: pl.DataFrame,
) -> dict[str, Any]:
    """Find what a finished dance shows at the moment of a pin of a pose.

    Parameters
    ----------
    wish : PinWish for a pose
    moment_s : float, seconds of the song
    lineage : rows of ``frame_lineage`` of the dance
    dance : its frames, as a clip
    poses : ClipPoses
    beats : rows of ``motion_graph_node``

    Returns
    -------
    dict
        ``is_kept``; ``at_s``; ``shown_clip_id`` and ``shown_time_s``, what of the catalogue is shown there;
        ``distance_m``, how far the joints of the finished frame are from the pose in the mean, body to body.
    """
    clip, at_s = wish.pose_moment
    pose = poses.wanted(wish)
    if pose is None or not len(lineage):
        return {"is_kept": False, "at_s": moment_s}
    frame = lineage.row(int(np.argmin(np.abs(lineage["time_s"].to_numpy() - moment_s))), named=True)
    shown_s = frame["clip_time_s"] + (moment_s - frame["time_s"]) / frame["warp_ratio"]
    name = mirrored(frame["clip_id"]) if frame["is_mirrored"] else frame["clip_id"]
    ratio = poses.ratios([pose], [name], [0], np.array([[shown_s]]))[0, 0, 0, 0]
    own = beats.filter((pl.col("clip_id") == clip) & ~pl.col("is_mirrored") & pl.col("is_kept"))["time_s"].to_numpy()
    is_own = name == clip and is_own_moment(shown_s, at_s, own)
    is_kept = bool(ratio < poses.threshold or is_own)
    if not is_kept and not len(own):
        names = [mirrored(c) if m else c for c, m in beats.filter("is_kept")["clip_id", "is_mirrored"].iter_rows()]
        every = list(dict.fromkeys(names))
        time_s = beats.filter("is_kept")["time_s"].to_numpy()[None]
        of_node = [every.index(name) for name in names]
        is_kept = bool(ratio <= furthest_ratio(poses.ratios([pose], every, of_node, time_s)[0, 0, 0], poses.threshold))
    still = [
        _features(moved, np.array([np.clip(time_s, 0.0, moved.duration_s)]), velocity_time_s=0.0).pose
        for moved, time_s in ((dance, moment_s), *((moved, at_s) for moved in poses.read([clip])))
    ]
    return {
        "is_kept": is_kept,
        "at_s": moment_s,
        "shown_clip_id": source_clip(name),
        "is_mirrored": is_mirrored(name),
        "shown_time_s": float(shown_s),
        "distance_m": float(np.sqrt(pose_distance(still[0], still[1])[0, 0])),
    }
