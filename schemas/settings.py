"""The shape of ``odori.toml`` and of a song's brief: every key, its default and its meaning.

A section is a frozen record; the field's metadata holds the meaning. The sections an asset reads are part of what its
result was made from.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any


def key(
    default: Any,  # noqa: ANN401 - a default may be of any type
    meaning: str,
    *,
    values: tuple[object, ...] = (),
    least: float | None = None,
    most: float | None = None,
) -> Any:  # noqa: ANN401
    """Declare one setting: its default, its meaning, and what it may be (a closed list, or bounds)."""
    allowed = {"values": values, "least": least, "most": most}
    return field(default=default, metadata={"meaning": meaning, **allowed})


def check(record: object) -> None:
    """Raise ValueError where a value is none that its declaration allows."""
    for declared in fields(record):  # type: ignore[arg-type]
        value, allowed = getattr(record, declared.name), declared.metadata
        least, most = allowed.get("least"), allowed.get("most")
        if allowed.get("values") and value not in allowed["values"]:
            raise ValueError(f"{declared.name}: want one of {', '.join(map(str, allowed['values']))}, got {value!r}")
        if (least is not None and not value >= least) or (most is not None and not value <= most):
            bounds = f"at least {least:g}" if most is None else f"{least:g} to {most:g}"
            raise ValueError(f"{declared.name}: want {bounds}, got {value!r}")


class _Checked:
    """A section whose values are checked at birth."""

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True)
class Limits(_Checked):
    """What is too large to be read."""

    largest_clip_mb: float = key(512.0, "A larger motion file is refused unread.", least=0)
    largest_song_mb: float = key(512.0, "A larger music file is refused unread.", least=0)
    longest_song_s: float = key(1200.0, "A longer song is refused.", least=0)


@dataclass(frozen=True)
class CalibrationSettings(_Checked):
    """How a suit recording becomes a skeleton and its poses."""

    method: str = key(
        "gauss_newton",
        "'gauss_newton' (joints closed, two steps) or 'springs' (the document's relaxation, for comparison).",
        values=("gauss_newton", "springs"),
    )
    iterations: int = key(0, "Steps of the method; 0: its usual, 2 of Gauss-Newton, 30 of springs.", least=0, most=1000)
    low_pass_hz: float = key(
        12.0, "Cutoff of the low-pass on sensors, which runs forwards and back.", least=1, most=1000
    )
    unit: str = key(
        "auto",
        "Lengths of recordings that do not say theirs: 'm', 'cm', 'mm', 'in', or 'auto'.",
        values=("auto", "m", "cm", "mm", "in"),
    )


@dataclass(frozen=True)
class MotionBeatSettings(_Checked):
    """How the beats of a clip are found (JP5778523B2)."""

    method: str = key("fft", "'fft', as the document has it, or 'autocorrelation'.", values=("fft", "autocorrelation"))
    component: int = key(1, "Principal component that carries the beat, from 1.", least=1)
    frame: str = key(
        "body", "'body': joints seen from where the dancer faces; 'world': as the document.", values=("body", "world")
    )
    joints: tuple[str, ...] = key((), "Canonical joints whose movement counts; empty for all.")
    extrema_per_beat: int = key(0, "1: every turn is a beat; 2: every second; 0: decided by rule.", values=(0, 1, 2))


@dataclass(frozen=True)
class MusicBeatSettings(_Checked):
    """How the beats of a song are found."""

    tracker: str = key("bar_pointer", "'bar_pointer' or 'librosa'.", values=("bar_pointer", "librosa"))


@dataclass(frozen=True)
class MotionGraphSettings(_Checked):
    """Which beat of which clip may follow which."""

    metric: str = key(
        "position", "'position' (equation 18) or 'rotation' (equation 17).", values=("position", "rotation")
    )
    threshold: float = key(
        0.0, "Equation 19: a transition is allowed below this ratio; 0: the built-in value.", least=0
    )
    neighbours: int = key(20, "Transitions kept for each beat.", least=1)
    prune: str = key(
        "reach",
        "'reach' (a dance can go on for ever), 'dead_ends' (the document's), 'component' or 'none'.",
        values=("reach", "dead_ends", "component", "none"),
    )


@dataclass(frozen=True)
class PathSettings(_Checked):
    """What a dance costs."""

    transition_weight: float = key(1.0, "Weight of seams, by pose distance.", least=0)
    warp_weight: float = key(1.0, "Weight of leaving a clip's own pace.", least=0)
    repetition_weight: float = key(1.0, "Weight of showing again what was shown.", least=0)
    beat_weight: float = key(1.0, "Weight of beats on which the body does not visibly stop.", least=0)


@dataclass(frozen=True)
class DanceSettings(_Checked):
    """What a dance looks like on disk."""

    frame_rate_hz: float = key(30.0, "Frames a second of the stage.", least=1, most=240)
    blend_s: float = key(0.4, "Song time over which two clips are blended, centred on the beat of the seam.", least=0)


@dataclass(frozen=True)
class OpenClSettings(_Checked):
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
    calibration: CalibrationSettings = field(default_factory=CalibrationSettings)
    sensors: dict[str, str] = field(
        default_factory=dict,
        metadata={"meaning": "Names of a recording's sensors to the suit's, where odori cannot tell."},
    )
    motion_beat: MotionBeatSettings = field(default_factory=MotionBeatSettings)
    music_beat: MusicBeatSettings = field(default_factory=MusicBeatSettings)
    motion_graph: MotionGraphSettings = field(default_factory=MotionGraphSettings)
    path: PathSettings = field(default_factory=PathSettings)
    dance: DanceSettings = field(default_factory=DanceSettings)
    opencl: OpenClSettings = field(default_factory=OpenClSettings)


@dataclass(frozen=True)
class BeatsBrief(_Checked):
    """What the brief says of a song's beats."""

    file: str = key("", "A beats file beside the brief: one beat a line, seconds, optional beat in bar.")
    octave: float = key(1.0, "Factor on the tempo found: 2 counts twice as fast, 0.5 half.", least=0.125, most=8)
    nudge_beats: float = key(0.0, "Shift of all beats in beats; 0.5 moves them to the off-beats.")
    nudge_ms: float = key(0.0, "Shift of all beats in milliseconds.")


@dataclass(frozen=True)
class Brief:
    """``songs/NAME.brief.toml``: what a person wants of one song."""

    beats: BeatsBrief = field(default_factory=BeatsBrief)
