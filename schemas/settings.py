"""The shape of ``odori.toml`` and of a song's brief: every key, its default and its meaning.

A section is a frozen record; the field's metadata holds the meaning. The sections an asset reads are part of what its
result was made from.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


def key(default: Any, meaning: str) -> Any:  # noqa: ANN401 - a default may be of any type
    """Declare one setting."""
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True)
class Limits:
    """What is too large to be read."""

    largest_clip_mb: float = key(512.0, "A larger motion file is refused unread.")
    largest_song_mb: float = key(512.0, "A larger music file is refused unread.")
    longest_song_s: float = key(1200.0, "A longer song is refused.")


@dataclass(frozen=True)
class MotionBeatSettings:
    """How the beats of a clip are found (JP5778523B2)."""

    method: str = key("fft", "'fft', as the document has it, or 'autocorrelation'.")
    component: int = key(1, "Principal component that carries the beat, from 1.")
    frame: str = key("body", "'body': joints seen from where the dancer faces; 'world': as the document has it.")
    joints: tuple[str, ...] = key((), "Canonical joints whose movement counts; empty for all.")
    extrema_per_beat: int = key(0, "1: every turn is a beat; 2: every second; 0: decided by rule.")


@dataclass(frozen=True)
class MusicBeatSettings:
    """How the beats of a song are found."""

    tracker: str = key("bar_pointer", "'bar_pointer' or 'librosa'.")


@dataclass(frozen=True)
class MotionGraphSettings:
    """Which beat of which clip may follow which."""

    metric: str = key("position", "'position' (equation 18) or 'rotation' (equation 17).")
    threshold: float = key(0.0, "Equation 19: a transition is allowed below this ratio; 0 takes the built-in value.")
    neighbours: int = key(20, "Transitions kept for each beat.")
    prune: str = key("reach", "'reach' (a dance can go on for ever), 'dead_ends' or 'component'.")


@dataclass(frozen=True)
class PathSettings:
    """What a dance costs."""

    transition_weight: float = key(1.0, "Cost of a seam, by pose distance.")
    warp_weight: float = key(1.0, "Cost of leaving a clip's own pace.")
    repetition_weight: float = key(1.0, "Cost of showing again what was shown.")


@dataclass(frozen=True)
class DanceSettings:
    """What a dance looks like on disk."""

    frame_rate_hz: float = key(30.0, "Frames a second of the stage.")
    blend_s: float = key(0.4, "Song time over which two clips are blended, centred on the beat of the seam.")


@dataclass(frozen=True)
class OpenClSettings:
    """Where the heavy arithmetic runs."""

    device: str = key("", "Name or index of a device; empty: the first GPU, else the CPU.")


@dataclass(frozen=True)
class Settings:
    """``odori.toml``, every key with a default."""

    limits: Limits = field(default_factory=Limits)
    joints: dict[str, str] = field(
        default_factory=dict,
        metadata={"meaning": "Names of a rig's joints to canonical joints, where odori cannot tell."},
    )
    motion_beat: MotionBeatSettings = field(default_factory=MotionBeatSettings)
    music_beat: MusicBeatSettings = field(default_factory=MusicBeatSettings)
    motion_graph: MotionGraphSettings = field(default_factory=MotionGraphSettings)
    path: PathSettings = field(default_factory=PathSettings)
    dance: DanceSettings = field(default_factory=DanceSettings)
    opencl: OpenClSettings = field(default_factory=OpenClSettings)


@dataclass(frozen=True)
class BeatsBrief:
    """What the brief says of a song's beats."""

    file: str = key("", "A beats file beside the brief: one beat a line, seconds, optional beat in bar.")
    octave: float = key(1.0, "Factor on the tempo found: 2 counts twice as fast, 0.5 half.")
    nudge_beats: float = key(0.0, "Shift of all beats in beats; 0.5 moves them to the off-beats.")
    nudge_ms: float = key(0.0, "Shift of all beats in milliseconds.")


@dataclass(frozen=True)
class Brief:
    """``songs/NAME.brief.toml``: what a person wants of one song."""

    beats: BeatsBrief = field(default_factory=BeatsBrief)
