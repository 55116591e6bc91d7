"""What odori answers with: poses, beats, rows of the catalogue, hits of a search.

Conventions: metres, seconds, Hz; Y up, a body at rest faces +Z; quaternions ``wxyz``. ``F`` frames, ``B`` beats.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Protocol, TypeVar, overload

from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.types import Float, Int
from odori.exceptions import OdoriError


@dataclass(frozen=True, eq=False)
class PoseSequence:
    """A motion on odori's 22 joints: of a clip, or of a dance.

    Parameters
    ----------
    name : key of the clip, or ``<song>|<method>`` of a dance
    frame_rate_hz : float, > 0
    time_s : (F,) float64, seconds from the first frame
    root_xyz_m : (F, 3) float64, metres, world
    rotation_wxyz : (F, 22, 4) float64, unit, local to the parent; the root's in the world
    position_xyz_m : (F, 22, 3) float64, metres, world

    Examples
    --------
    >>> import odori
    >>> poses = odori.demo().poses("ayame-step_01")
    >>> poses.position_xyz_m.shape[1:]
    (22, 3)
    >>> poses.joints[:3]
    ('hips', 'spine', 'chest')
    >>> head_m = poses.of("head")
    >>> head_m.shape == poses.root_xyz_m.shape
    True

    See Also
    --------
    odori.OpenStudio.poses : where they come from
    odori.motion_beats : when the body turns or stops
    """

    name: str
    frame_rate_hz: float
    time_s: Float
    root_xyz_m: Float
    rotation_wxyz: Float
    position_xyz_m: Float

    def __repr__(self) -> str:
        return f"<poses {self.name}: {self.n_frames} frames at {self.frame_rate_hz:g} Hz>"

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the 22 joints, as VRM 1.0 has them, in the order of the arrays."""
        return JOINTS

    @property
    def parents(self) -> tuple[int, ...]:
        """Place of each joint's parent; -1 for the root."""
        return tuple(CANONICAL.parent.tolist())

    @property
    def n_frames(self) -> int:
        """Number of frames, F."""
        return len(self.time_s)

    def of(self, joint: str) -> Float:
        """Positions of one joint.

        Parameters
        ----------
        joint : one of :attr:`joints`

        Returns
        -------
        (F, 3) float64, metres, world

        Raises
        ------
        OdoriError
            If there is no such joint; names the nearest.
        """
        if joint not in JOINTS:
            raise OdoriError(_unknown("a joint", joint, JOINTS))
        return self.position_xyz_m[:, JOINTS.index(joint)]


@dataclass(frozen=True, eq=False)
class BeatTimes:
    """Beats of a song, in order.

    Parameters
    ----------
    time_s : (B,) float64, seconds from the first sample, rising
    bar_number : (B,) int64, from 1; 0 where bars cannot be heard
    beat_in_bar_number : (B,) int64, from 1, 1 being the downbeat; 0 where bars cannot be heard
    confidence : (B,) float64, 0 to 1

    Examples
    --------
    >>> import odori
    >>> beats = odori.demo().beats("drum_machine")
    >>> len(beats)
    66
    >>> round(beats.tempo_bpm)
    116
    >>> beats.downbeat_s[:2].round(1).tolist()
    [0.0, 2.1]

    See Also
    --------
    odori.track_beats, odori.song_beats : beats of sound, and of a file
    """

    time_s: Float
    bar_number: Int
    beat_in_bar_number: Int
    confidence: Float

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        tempo_bpm = self.tempo_bpm
        return f"<{len(self)} beats{'' if tempo_bpm is None else f', {tempo_bpm:.1f} a minute'}>"

    @property
    def tempo_bpm(self) -> float | None:
        """Beats a minute, by the median interval; None for fewer than two beats."""
        if len(self.time_s) < 2:
            return None
        interval_s = sorted((self.time_s[1:] - self.time_s[:-1]).tolist())
        middle = (interval_s[(len(interval_s) - 1) // 2] + interval_s[len(interval_s) // 2]) / 2
        return float(60.0 / middle)

    @property
    def downbeat_s(self) -> Float:
        """First beats of bars, seconds; empty where bars cannot be heard."""
        first: Float = self.time_s[self.beat_in_bar_number == 1]
        return first


@dataclass(frozen=True)
class CatalogueClip:
    """A motion file of a studio.

    Parameters
    ----------
    clip_id : its key
    session, path : where it lies; the path is relative to the studio
    state : ``read``, ``refused``, ``new`` before the first build, ``changed`` since the last
    reason : why it is refused, one sentence; None where it is not
    label, style, subject, licence : what ``clips.csv`` or its name says
    frame_rate_hz, frame_count, duration_s : 0 where it was not read
    """

    clip_id: str
    session: str
    path: str
    state: str
    reason: str | None
    label: str = ""
    style: str = ""
    subject: str = ""
    licence: str = ""
    frame_rate_hz: float = 0.0
    frame_count: int = 0
    duration_s: float = 0.0

    @property
    def key(self) -> str:
        """The clip's key: its ``clip_id``."""
        return self.clip_id


@dataclass(frozen=True)
class CatalogueSong:
    """A music file of a studio; ``state`` and ``reason`` as of :class:`CatalogueClip`, ``duration_s`` 0 if not read."""

    song_id: str
    path: str
    state: str
    reason: str | None
    duration_s: float = 0.0

    @property
    def key(self) -> str:
        """The song's key: its ``song_id``."""
        return self.song_id


@dataclass(frozen=True)
class SearchHit:
    """A stretch of a clip that is like what was searched for; ``distance`` is 0 for the same and 2 at most."""

    clip_id: str
    start_s: float
    end_s: float
    distance: float
    label: str
    style: str
    licence: str
    path: str


class _HasKey(Protocol):
    @property
    def key(self) -> str: ...


Listed = TypeVar("Listed", bound=_HasKey)


class Listing(Sequence[Listed]):
    """What a studio has of one kind, in order; found by place or by key.

    Parameters
    ----------
    what : the kind, as in ``a clip``
    rows : in order

    Examples
    --------
    >>> import odori
    >>> clips = odori.demo().clips
    >>> len(clips)
    50
    >>> clips["ayame-step_01"].label
    'step'
    >>> sorted({clip.label for clip in clips})[:3]
    ['bounce', 'idle', 'kick']

    See Also
    --------
    odori.OpenStudio.table : all there is to know, as Arrow
    """

    def __init__(self, what: str, rows: Sequence[Listed]) -> None:
        self._what = what
        self._rows = tuple(rows)

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[Listed]:
        return iter(self._rows)

    @overload
    def __getitem__(self, at: int | str) -> Listed: ...
    @overload
    def __getitem__(self, at: slice) -> tuple[Listed, ...]: ...

    def __getitem__(self, at: int | str | slice) -> Listed | tuple[Listed, ...]:
        """Find a row by its place or its key; OdoriError names the nearest keys where there is none."""
        if not isinstance(at, str):
            return self._rows[at]
        for row in self._rows:
            if row.key == at:
                return row
        raise OdoriError(_unknown(self._what, at, self.keys()))

    def __contains__(self, item: object) -> bool:
        return item in self._rows or any(row.key == item for row in self._rows)

    def has(self, key: str) -> bool:
        """Whether a row has this key.

        Parameters
        ----------
        key : str
        """
        return any(row.key == key for row in self._rows)

    def keys(self) -> list[str]:
        """Keys, in order."""
        return [row.key for row in self._rows]

    def __repr__(self) -> str:
        shown = ", ".join(self.keys()[:3])
        return f"<{len(self)} listed: {shown}{', …' if len(self) > 3 else ''}>"


def _unknown(what: str, name: str, known: Sequence[str]) -> str:
    near = get_close_matches(name, known, n=3) or list(known[:5])
    return f"{name}: want {what}, got none of that name; near are {', '.join(near) or 'none'}"
