"""Copies of a motion, found by laying it over others frame by frame: begun later, cut, faster or slower, a part of it.

A vector sums a motion up and brings takes of one action together on purpose; whether one is a copy of the other is told
by where hands, feet and head are at each moment. No labels and no training.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.search.normalise import normalise, resample
from kernels.skeleton.canonical import JOINTS
from kernels.types import Float, Int

TRACK_HZ = 7.5
"""Frames a second of the tracks of a catalogue. Chosen for time and memory, by hand."""

QUERY_HZ = 30.0
"""Frames a second of a query's track: it is laid between the frames of others. Chosen as four times as many."""

_SIDED = ("LowerArm", "Hand", "LowerLeg", "Foot")
_TRACKED = [
    JOINTS.index(name) for name in ("head", *(f"{side}{part}" for side in ("left", "right") for part in _SIDED))
]
N_TRACK = 3 * len(_TRACKED)
"""Values of a frame, three a joint by definition."""

COPY_M = 0.03
"""Mean distance of the joints below which a motion counts as a copy. Tuned on real clips: 45 copies are within 0.014,
other takes of one in ten clips within 0.02, and 0.08 drew in other takes of three in four short gestures."""

MOST_FRAMES = 16_000
"""Frames of others, with the room between them, that a query is laid over: about 200 clips of 5 s. Chosen for time, by
hand."""

_LONGEST_S = 8.0
"""What is laid of a query, from its middle. Chosen as the longest window that is searched whole."""

_LEAST_SHARE = 0.8
_LEAST_OF_QUERY = 0.5
"""Shares of the shorter of the two, and of the query, that must lie over each other. Chosen by hand."""

_PACES = tuple(np.exp(np.linspace(-1, 1, 5) * np.log(1.22)).tolist())
"""Paces at which a query is laid, about a fifth slower to a fifth faster. Chosen by hand."""

_PACED = 20
_POLISHED = 8
_POLISHED_M = 0.16
"""Clips that are laid at other paces, and of these the ones laid between the frames, where they lie within so far.
Chosen for time, by hand."""

_STEP = 2
"""Every second frame of a track is compared at first. Chosen for time, by hand."""
_EACH = int(QUERY_HZ / TRACK_HZ) * _STEP

Track = NDArray[np.float32]


@dataclass(frozen=True, order=True)
class Alignment:
    """Where a motion lies in another.

    Parameters
    ----------
    distance_m : root mean square over joints, mean over frames; inf where they cannot be laid over each other
    start_s, end_s : seconds of the other, the stretch that the motion lies over; it may end a frame behind the last
    """

    distance_m: float
    start_s: float
    end_s: float


def track(
    position_xyz_m: Float,
    frame_rate_hz: float,
    *,
    start_s: float = 0.0,
    end_s: float = np.inf,
    rate_hz: float = TRACK_HZ,
) -> Track:
    """Follow the joints that tell motions apart, seen from the body.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, metres, canonical joints, F >= 1
    frame_rate_hz : float, > 0
    start_s, end_s : float, seconds, the stretch that counts
    rate_hz : float
        :data:`TRACK_HZ` for a catalogue, :data:`QUERY_HZ` for what is looked for.

    Returns
    -------
    (T, N_TRACK) float32, metres, T >= 1
        Head, elbows, hands, knees and feet from the root's place on the floor and its heading, legs of one length.

    Raises
    ------
    ValueError
        As :func:`kernels.search.normalise.normalise`.
    """
    stretch = resample(position_xyz_m, frame_rate_hz, start_s, end_s, rate_hz=rate_hz)
    seen = normalise(stretch, per_frame=True)
    return seen[:, _TRACKED].reshape(len(seen), -1).astype(np.float32)


def align(query: Track, others: Sequence[Track]) -> list[Alignment]:
    """Lay a motion over others, at any moment and up to a fifth faster or slower.

    Parameters
    ----------
    query : (T, N_TRACK) float32, at :data:`QUERY_HZ`
        Of more than 8 s the middle 8 s are compared, and the stretch is that of the whole.
    others : C of (T_c, N_TRACK) float32, at :data:`TRACK_HZ`, the likeliest first

    Returns
    -------
    list of C Alignment
        Of the stretch over which they differ least, of those in which four fifths of the shorter lie, and half of the
        query. The nearest are laid over more closely, at other paces and between frames; of the rest the distance is an
        upper bound.
    """
    if not len(others):
        return []
    most = int(_LONGEST_S * QUERY_HZ)
    first = max(len(query) - most, 0) // 2
    middle = query[first : first + most]
    rough = _Laid(others, len(middle[::_EACH])).over(middle, [(1.0, 0)])
    found: list[tuple[float, float, float]] = [
        (float(d), float(m), 1.0) for d, m in zip(rough.distance_m, rough.middle_s, strict=True)
    ]
    order = np.argsort(rough.distance_m, kind="stable")
    half = _EACH // 4
    ways = [(pace, phase) for pace in _PACES for phase in ((0, half) if pace != 1 else range(0, 2 * half, half // 2))]
    ways = ways if len(middle) > _EACH else [(1.0, 0)]
    kept = list(dict.fromkeys([*range(min(_PACED // 3, len(others))), *order.tolist()]))[:_PACED]
    paced = _Laid([others[c] for c in kept], int(len(middle[::_EACH]) / _PACES[0]) + 1).over(middle, ways)
    for i, c in enumerate(kept):
        found[c] = min(found[c], (float(paced.distance_m[i]), float(paced.middle_s[i]), float(paced.pace[i])))
    for i in np.argsort(paced.distance_m, kind="stable")[:_POLISHED].tolist():
        if paced.distance_m[i] < _POLISHED_M:
            c = kept[i]
            found[c] = min(found[c], _polished(middle, others[c], float(paced.middle_s[i]), float(paced.pace[i])))
    centre_s = (first + (len(middle) - 1) / 2) / QUERY_HZ
    after_s = (len(query) - 1) / QUERY_HZ - centre_s
    distance_m, middle_s, pace = np.array(found).T
    last_s = (np.array([len(other) for other in others]) - 1) / TRACK_HZ
    start_s = np.clip(middle_s - centre_s / pace, 0.0, last_s)
    end_s = np.clip(middle_s + after_s / pace, 0.0, last_s + 1 / TRACK_HZ)
    return [Alignment(*row) for row in zip(distance_m.tolist(), start_s.tolist(), end_s.tolist(), strict=True)]


def room(query: Track, n_frames: Int) -> Int:
    """Count the frames that tracks take to be laid over.

    Parameters
    ----------
    query : (T, N_TRACK) float32, at :data:`QUERY_HZ`
    n_frames : (C,) int, frames of each track

    Returns
    -------
    (C,) int64
        A track's own frames, and room for the query to stand out of it.
    """
    n = min(len(query), int(_LONGEST_S * QUERY_HZ))
    return np.asarray(n_frames) + _STEP * (n // _EACH + 1)


@dataclass(frozen=True, eq=False)
class _Best:
    """Of each of C others: the least distance, where the query's middle falls then, and at which pace."""

    distance_m: Float
    middle_s: Float
    pace: Float


class _Laid:
    """Tracks laid out one behind the other, with room for a query of some rows to stand out of each."""

    def __init__(self, others: Sequence[Track], rows: int) -> None:
        gap = _STEP * rows
        self._length = np.array([len(other) for other in others])
        self._begin = gap + np.cumsum(np.append(0, self._length + gap))[:-1]
        put = np.repeat(self._begin - np.append(0, np.cumsum(self._length))[:-1], self._length)
        put += np.arange(len(put))
        frames = np.concatenate(others)
        # Behind the joints a one and their squares: one product with a query's rows gives squared distances, and 0 in
        # the gaps.
        self._frames = np.zeros((int(self._begin[-1] + self._length[-1]) + gap, N_TRACK + 2), np.float32)
        self._frames[put, :N_TRACK] = frames
        self._frames[put, N_TRACK] = 1.0
        self._frames[put, N_TRACK + 1] = np.einsum("td,td->t", frames, frames)
        self._there = np.ascontiguousarray(self._frames[:, N_TRACK])

    def over(self, query: Track, ways: Sequence[tuple[float, int]]) -> _Best:
        """Lay a query over all at every frame, at some paces and from some phases (frames of the query) on."""
        best = _Best(*(np.full(len(self._begin), v) for v in (np.inf, 0.0, 1.0)))
        centre = (len(query) - 1) / 2
        for pace, phase in ways:
            frame = np.arange(phase, len(query) - 1 + 1e-6, _EACH * pace) if len(query) > 1 else np.zeros(1)
            mean, low = self._mean(_at(query, frame))
            least = np.minimum.reduceat(mean, low)
            of = np.repeat(np.arange(len(low)), np.diff(np.append(low, len(mean))))
            at = np.flatnonzero(mean[low[0] :] == least[of])[::-1]
            first = np.zeros(len(low), np.int64)
            first[of[at]] = at + low[0]  # the earliest of equals, written last
            is_less = least < best.distance_m
            best.distance_m[is_less], best.pace[is_less] = least[is_less], pace
            middle_s = (first - self._begin) / TRACK_HZ + (centre - phase) / QUERY_HZ / pace
            best.middle_s[is_less] = middle_s[is_less]
        return best

    def _mean(self, rows: Track) -> tuple[Float, Int]:
        """Mean distance with row 0 over each frame (inf: too little lies over), and each other's first such frame."""
        n = len(rows)
        told = np.concatenate([-2 * rows, (rows**2).sum(axis=1)[:, None], np.ones((n, 1), np.float32)], axis=1)
        apart = (told * np.float32(1 / len(_TRACKED))) @ self._frames.T
        np.sqrt(np.maximum(apart, 0.0, out=apart), out=apart)
        offsets = apart.shape[1] - _STEP * (n - 1)
        across, along = apart.strides
        view = np.lib.stride_tricks.as_strided
        total = view(apart, (n, offsets), (across + _STEP * along, along)).sum(axis=0)
        count = view(self._there, (n, offsets), (_STEP * along, along)).sum(axis=0)
        low = self._begin - _STEP * (n - 1)
        wanted = np.maximum(_LEAST_SHARE * np.minimum(n, self._length / _STEP), _LEAST_OF_QUERY * n)
        least = np.repeat(wanted, np.diff(np.append(low, offsets)))
        mean = np.full(offsets, np.inf)
        counted = count[low[0] :]
        mean[low[0] :] = np.where(counted >= least, total[low[0] :] / np.maximum(counted, 1), np.inf)
        return mean, low


def _polished(query: Track, other: Track, middle_s: float, pace: float) -> tuple[float, float, float]:
    """Move a query over another by less than a frame, and change its pace a little, to where they differ least."""
    time_s = np.arange(len(other)) / TRACK_HZ
    last, centre = len(query) - 1, (len(query) - 1) / 2
    best = (np.inf, middle_s, pace)
    for scale in (1.0, 0.3):
        shift = np.linspace(-1, 1, 5) * scale / 15
        change = np.exp(np.linspace(-1, 1, 5) * scale * 0.04) if last else np.ones(1)
        ways = [(best[1] + s, best[2] * c) for c in change.tolist() for s in shift.tolist()]
        m, p = np.array(ways).T[:, :, None]
        at = centre + (time_s - m) * p * QUERY_HZ
        is_over = (at >= -0.5) & (at <= last + 0.5)
        columns = is_over.any(axis=0)
        at, is_over = np.clip(at[:, columns], 0, last), is_over[:, columns]
        apart = ((_at(query, at) - other[columns]) ** 2).sum(axis=-1) / len(_TRACKED)
        count = is_over.sum(axis=1)
        least = _LEAST_SHARE * min(len(other), last / QUERY_HZ / pace * TRACK_HZ) if last else 1
        mean = np.where(count >= max(least, 1), (np.sqrt(apart) * is_over).sum(axis=1) / np.maximum(count, 1), np.inf)
        i = int(mean.argmin())
        best = min(best, (float(mean[i]), *ways[i]))
    return best


def _at(query: Track, frame: Float) -> Track:
    """Take a query between its frames: (T, D) and (...,) to (..., D)."""
    low = np.minimum(frame.astype(np.int64), max(len(query) - 2, 0))
    share = (frame - low)[..., None].astype(np.float32)
    return np.asarray(query[low] * (1 - share) + query[np.minimum(low + 1, len(query) - 1)] * share, np.float32)
