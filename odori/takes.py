"""Files on their own, without a studio: the takes of a motion file, the beats of a song."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from kernels.skeleton.naming import JointMapping
from kernels.types import Clip, Float
from odori import inputs
from odori.answers import BeatTimes, PoseSequence
from odori.exceptions import InputError, OdoriError, refused


@dataclass(frozen=True, eq=False)
class MotionTake:
    """One take of motion, on the rig of its file.

    Parameters
    ----------
    name : the file's name without its suffix
    path : Path
    clip : kernels.types.Clip, metres, Y up
        ``skeleton``, ``root_xyz_m`` (F, 3), ``rotation_wxyz`` (F, J, 4).
    mapping : which joint is which of a body's, or None where the rig is not known to be one

    See Also
    --------
    read : where takes come from
    """

    name: str
    path: Path
    clip: Clip
    mapping: JointMapping | None

    def __repr__(self) -> str:
        return (
            f"<take {self.name}: {self.clip.n_frames} frames of {len(self.joints)} joints at {self.frame_rate_hz:g} Hz>"
        )

    @property
    def frame_rate_hz(self) -> float:
        """Frames a second."""
        return self.clip.frame_rate_hz

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the J joints, as in the file."""
        return self.clip.skeleton.joints

    @property
    def time_s(self) -> Float:
        """Seconds from the first frame, (F,) float64."""
        return np.arange(self.clip.n_frames) / self.clip.frame_rate_hz

    @property
    def position_xyz_m(self) -> Float:
        """Joints in the world, (F, J, 3) float64, metres."""
        from kernels.skeleton import kinematics

        return kinematics.place(self.clip)[0]

    def canonical(self) -> PoseSequence:
        """Bring the take to odori's 22 joints and to one size, feet on the floor.

        Returns
        -------
        PoseSequence

        Raises
        ------
        OdoriError
            If the rig is not known to be a human body.

        Examples
        --------
        >>> import odori
        >>> studio = odori.demo()
        >>> [take] = odori.read(studio.root / "clips/ayame/step_01.bvh")
        >>> take.canonical().position_xyz_m.shape[1:]
        (22, 3)

        See Also
        --------
        OpenStudio.poses : the same, as a studio holds it
        """
        from kernels.skeleton.naming import map_joints
        from kernels.skeleton.retarget import retarget

        with refused():
            moved = retarget(self.clip, self.mapping or map_joints(self.clip.skeleton))
        return PoseSequence(
            self.name, self.frame_rate_hz, self.time_s, moved.root_xyz_m, moved.rotation_wxyz, moved.position_xyz_m
        )


def read(path: str | PathLike[str], *, joints: Mapping[str, str] | None = None) -> list[MotionTake]:
    """Read the takes of a motion file: a BVH, or a recording of a suit of 17 sensors, which is calibrated.

    Parameters
    ----------
    path : ``.bvh``; ``.parquet`` or ``.csv`` of a suit
    joints : names of joints in the file and what they are of odori's 22, as ``[joints]`` in ``odori.toml``

    Returns
    -------
    list of MotionTake
        One for each take of the file; these formats hold one.

    Raises
    ------
    OdoriError
        If the file is none of these, cannot be read, or holds no body; the sentence says where and what would help.

    Examples
    --------
    >>> import odori
    >>> studio = odori.demo()
    >>> [take] = odori.read(studio.root / "clips/ayame/step_01.bvh")
    >>> take.name, take.frame_rate_hz
    ('step_01', 30.0)
    >>> take.position_xyz_m.shape == (len(take.time_s), len(take.joints), 3)
    True

    See Also
    --------
    MotionTake.canonical : on odori's 22 joints
    song_beats : of a music file
    """
    place = inputs.path("path", path)
    if joints is not None and not isinstance(joints, Mapping):
        raise InputError(f"joints: want a mapping of names to odori's joints, got {joints!r}")
    suffix = place.suffix.lower()
    if suffix not in (".bvh", ".parquet", ".csv"):
        raise OdoriError(
            f"{place}: want a motion file, .bvh, or .parquet or .csv of a suit, got {suffix or 'no suffix'}"
        )
    if not place.is_file():
        raise OdoriError(f"{place}: want a motion file, got nothing there")
    with refused():
        return [_bvh(place, joints or {}) if suffix == ".bvh" else _suit(place, joints or {})]


def _bvh(path: Path, joints: Mapping[str, str]) -> MotionTake:
    from assets.formats import bvh

    found = bvh.to_clip(bvh.read(path), extra=joints)
    return MotionTake(path.stem, path, found.clip, found.mapping)


def _suit(path: Path, joints: Mapping[str, str]) -> MotionTake:
    from assets.sources.calibration import calibrate_file
    from kernels.skeleton.naming import map_joints
    from pipelines.device_fallback import Devices
    from pipelines.solvers import PoseSolvers
    from schemas.settings import Settings

    settings = Settings()
    found = calibrate_file(
        path,
        settings=settings.calibration,
        sensors=settings.sensors,
        solvers=PoseSolvers(Devices(settings.opencl.device)),
        max_bytes=int(settings.limits.largest_clip_mb * 1e6),
    )
    return MotionTake(path.stem, path, found.clip, map_joints(found.clip.skeleton, joints))


def song_beats(path: str | PathLike[str]) -> BeatTimes:
    """Find the beats of a song's file: as a listener taps them in sound, as the file has them in MIDI.

    Parameters
    ----------
    path : ``.wav``, ``.mp3``, ``.flac``, ``.ogg`` or ``.mid``

    Returns
    -------
    BeatTimes
        Empty where there is nothing to tap to.

    Raises
    ------
    OdoriError
        If the file cannot be read.

    Examples
    --------
    >>> import odori
    >>> studio = odori.demo()
    >>> heard = odori.song_beats(studio.root / "songs/drum_machine.wav")
    >>> played = odori.song_beats(studio.root / "songs/drum_machine.mid")
    >>> odori.score_beats(heard, played) > 0.95
    True

    See Also
    --------
    track_beats : of samples
    OpenStudio.beats : as a studio holds them, its brief obeyed
    """
    from assets.formats import audio, midi
    from assets.sources.scan import MIDI_SUFFIXES
    from odori.arrays import track_beats

    place = inputs.path("path", path)
    if not place.is_file():
        raise OdoriError(f"{place}: want a music file, got nothing there")
    with refused():
        if place.suffix.lower() in MIDI_SUFFIXES:
            grid = midi.read(place).beats
            return BeatTimes(grid.time_s, grid.bar_number, grid.beat_in_bar_number, grid.confidence)
        sound = audio.read(place)
    return track_beats(sound.samples, sound.sample_rate_hz)
