"""The shape of ``odori.toml`` and of a song's brief: every key, its default and its meaning.

A section is a frozen record; the field's metadata holds the meaning. The sections an asset reads are part of what its
result was made from.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from schemas.options import check, key
from schemas.pins import PinWish

METHODS = ("graph", "matching", "hmm")
"""Ways to choose a choreography, each with its file ``assets/dancing/by_<name>.py``; the first is the usual one."""


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
        "'gauss_newton' (joints closed, two steps) or 'springs' (the relaxation of [Kitsunai2007], for comparison).",
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
    """How the beats of a clip are found."""

    method: str = key(
        "pulse",
        "'pulse': the stops of the body, none without a pulse; principal components [Xu2015]: 'fft', as they have it, "
        "or 'autocorrelation'. The other keys are of the last two.",
        values=("pulse", "fft", "autocorrelation"),
    )
    component: int = key(1, "Principal component that carries the beat, from 1.", least=1, most=22)
    frame: str = key(
        "body", "'body': joints seen from where the dancer faces; 'world': as [Xu2015].", values=("body", "world")
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
        "position", "'position' or 'rotation': equations 18 and 17 of [Xu2015].", values=("position", "rotation")
    )
    threshold: float = key(
        0.0, "A transition is allowed below this ratio (equation 19 of [Xu2015]); 0: the built-in value.", least=0
    )
    neighbours: int = key(20, "Transitions kept for each beat.", least=1)
    turns: bool = key(
        True, "Step on the turns of a clip's largest movement as well as on its beats, where its beats are its pulse."
    )
    mirror: bool = key(False, "Dance clips mirrored, left for right, as well: twice the catalogue.")
    prune: str = key(
        "reach",
        "'reach' (a dance can go on for ever), 'dead_ends' ([Xu2015]), 'component' ([Kovar2002]) or 'none'.",
        values=("reach", "dead_ends", "component", "none"),
    )


@dataclass(frozen=True)
class PathSettings(_Checked):
    """What a dance costs."""

    transition_weight: float = key(1.0, "Weight of seams, by pose distance.", least=0)
    warp_weight: float = key(1.0, "Weight of leaving a clip's own pace.", least=0)
    repetition_weight: float = key(1.0, "Weight of showing again what was shown.", least=0)
    intensity_weight: float = key(6.0, "Weight of movement unlike the music in strength.", least=0)
    seam_cost: float = key(1.0, "Price of any seam: more makes phrases longer.", least=0)
    stay_beats: int = key(
        4, "Beats of the music from one seam to the next below which the second seam costs more.", least=1, most=32
    )
    stay_cost: float = key(4.0, "Price of a seam right after another, falling evenly to 0 at `stay_beats`.", least=0)
    repeat: str = key(
        "none",
        "'structure': where the song repeats a part, the dance repeats, too; 'none': every part has its own dance.",
        values=("none", "structure"),
    )
    beat_weight: float = key(1.0, "Weight of beats on which the body does not visibly stop.", least=0)


@dataclass(frozen=True)
class FeatureSettings(_Checked):
    """What clips and songs are compared by."""

    rhythm: str = key("bumps", "'bumps', or 'impulses': one value a stop or beat, raw.", values=("bumps", "impulses"))
    bump_width_s: float = key(0.05, "Standard deviation of a bump of rhythm.", least=0.005, most=0.5)

    @property
    def width_s(self) -> float:
        """Width of a bump; 0 for raw impulses."""
        return self.bump_width_s if self.rhythm == "bumps" else 0.0


@dataclass(frozen=True)
class MusicSegmentSettings(_Checked):
    """How a song is cut into what one clip dances."""

    longest_s: float = key(8.0, "No segment is longer.", least=1, most=8)


@dataclass(frozen=True)
class MatchingSettings(_Checked):
    """Which clips a song is compared with, and how many are kept."""

    candidates: int = key(20, "Clips kept for every segment.", least=1, most=1000)
    memory_mb: float = key(2048.0, "Device memory the search may use; clips are streamed through it.", least=16)


@dataclass(frozen=True)
class MatchPathSettings(_Checked):
    """What a dance chosen among matches costs."""

    match_weight: float = key(1.0, "Weight of rhythm unlike the music's.", least=0)
    intensity_weight: float = key(1.0, "Weight of intensity unlike the music's.", least=0)
    seam_weight: float = key(0.5, "Weight of seams between unlike poses.", least=0)
    repetition_weight: float = key(1.0, "Weight of showing again what was shown.", least=0)
    unconnected_cost: float = key(
        0.0,
        "Price of a seam between poses beyond the thresholds; 0: as few such seams as possible, at any cost.",
        least=0,
    )
    other_starts: int = key(
        4, "Other places of each matched clip that are tried too, where they match nearly as well.", least=0, most=50
    )
    snap_loss_ratio: float = key(
        0.05,
        "A piece is moved to start on a beat of its clip if its score loses less than this share.",
        least=0,
        most=1,
    )


@dataclass(frozen=True)
class SearchSettings(_Checked):
    """How motions are made searchable."""

    has_travel: bool = key(True, "Where the root goes and turns counts; false: a walk on the spot is a walk.")
    window_s: float = key(4.0, "Length of the windows long clips are searched by.", least=0.5, most=8)
    longest_whole_s: float = key(8.0, "A clip no longer than this is one window.", least=0.5, most=16)
    labels: str = key(
        "clips.csv",
        "What the encoder learns from: labels of 'clips.csv', 'folders' too, or 'none'.",
        values=("clips.csv", "folders", "none"),
    )
    training_windows: int = key(4000, "Windows the encoder learns from at most.", least=2, most=100000)
    training_steps: int = key(250, "Steps of its training at most.", least=1, most=100000)
    seed: int = key(0, "Number that training starts from; another number gives another encoder.", least=0)


@dataclass(frozen=True)
class BasicMotionSettings(_Checked):
    """How clips are cut into motions, and these clustered to basic motions."""

    states: int = key(0, "Number of basic motions; 0: chosen by how clearly they differ.", least=0, most=200)
    shortest_s: float = key(0.25, "No motion is shorter.", least=0.1, most=1.0)
    longest_s: float = key(2.0, "No motion is longer; at least twice shortest_s.", least=1.0, most=8.0)
    seed: int = key(0, "Number that clustering starts from.", least=0)

    def __post_init__(self) -> None:
        check(self)
        if self.longest_s < 2 * self.shortest_s:
            raise ValueError(f"longest_s: want at least twice shortest_s ({self.shortest_s:g}), got {self.longest_s:g}")


@dataclass(frozen=True)
class ChoreographyModelSettings(_Checked):
    """How the model of the dancer is counted."""

    subject: str = key("", "Learn from performances of this subject alone (clips.csv); empty for all.")
    smoothing: float = key(0.0, "Added to every count; 0: chosen on performances held out.", least=0, most=100)
    symbols: str = key(
        "product",
        "'product': all drums of a motion, each by itself; 'single': the loudest, as [Kameda2009].",
        values=("product", "single"),
    )
    melody_weight: float = key(0.5, "Weight of the melody, where the drums have 1.", least=0, most=10)


@dataclass(frozen=True)
class HmmPathSettings(_Checked):
    """What a dance by the model costs where the model leaves a choice."""

    seam_weight: float = key(1.0, "Weight of seams between unlike poses.", least=0)
    warp_weight: float = key(1.0, "Weight of leaving a motion's own pace.", least=0)
    repetition_weight: float = key(1.0, "Weight of showing the same recording again.", least=0)
    temperature: float = key(
        0.0,
        "0: the most probable dance; 1: drawn by the model's probabilities; --temperature overrides.",
        least=0,
        most=10,
    )


@dataclass(frozen=True)
class DanceSettings(_Checked):
    """What a dance looks like on disk."""

    frame_rate_hz: float = key(30.0, "Frames a second of the stage.", least=1, most=240)
    blend_s: float = key(
        0.4, "Song time over which two clips are blended, centred on the beat of the seam.", least=0, most=2
    )
    blend_shape: str = key(
        "slerp",
        "'slerp' (eased), 'linear_slerp' ([Xu2015]) or 'inertial' (springs both ways): docs/seams.md.",
        values=("slerp", "linear_slerp", "inertial"),
    )
    lock_feet: bool = key(True, "Keep planted feet where they stand, by moving root and legs.")


@dataclass(frozen=True)
class OpenClSettings(_Checked):
    """Where the heavy arithmetic runs."""

    device: str = key(
        "",
        "Name or index of a device, or 'reference' for NumPy; empty: the first that works of GPUs, CPU drivers, NumPy.",
    )


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
    feature: FeatureSettings = field(default_factory=FeatureSettings)
    music_segment: MusicSegmentSettings = field(default_factory=MusicSegmentSettings)
    matching: MatchingSettings = field(default_factory=MatchingSettings)
    match_path: MatchPathSettings = field(default_factory=MatchPathSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    basic_motion: BasicMotionSettings = field(default_factory=BasicMotionSettings)
    choreography_model: ChoreographyModelSettings = field(default_factory=ChoreographyModelSettings)
    hmm_path: HmmPathSettings = field(default_factory=HmmPathSettings)
    dance: DanceSettings = field(default_factory=DanceSettings)
    opencl: OpenClSettings = field(default_factory=OpenClSettings)


@dataclass(frozen=True)
class BeatsBrief(_Checked):
    """What the brief says of a song's beats."""

    file: str = key("", "A beats file beside the brief: one beat a line, seconds, optional beat in bar.")
    octave: float = key(1.0, "Factor on the tempo found: 2 counts twice as fast, 0.5 half.", least=0.125, most=8)
    nudge_beats: float = key(0.0, "Shift of all beats in beats; 0.5 moves them to the off-beats.", least=-16, most=16)
    nudge_ms: float = key(0.0, "Shift of all beats in milliseconds.", least=-10000, most=10000)


@dataclass(frozen=True)
class Brief(_Checked):
    """``songs/NAME.brief.toml``: what a person wants of one song."""

    method: str = key(METHODS[0], "How its dance is chosen where the command does not say.", values=METHODS)
    pin: tuple[PinWish, ...] = key((), "What is to be danced when: one [[pin]] each, a place and a wish.")
    pins: str = key("hard", "'hard': kept or refused; 'soft': a price where not kept.", values=("hard", "soft"))
    allow: tuple[str, ...] = key((), "Licences of the clips that may be danced; empty for all.")
    character: str = key("", "Whose body is danced with: a clip's key, or a rigged USD file beside the songs.")
    beats: BeatsBrief = field(default_factory=BeatsBrief)
