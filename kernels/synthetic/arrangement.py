"""A made-up band: random songs in a given style, whose beats and bars are known exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.music.notes import DRUM_CHANNEL_NUMBER, Notes, sorted_notes
from kernels.synthetic.grooves import CRASH, GROOVES, HIGH_TOM, KICK, LOW_TOM, MIDDLE_TOM, SNARE, Groove
from kernels.types import BeatGrid

Float = NDArray[np.float64]
Row = tuple[float, float, int, int, int, int]

VELOCITY = {"o": 52, "x": 90, "X": 114}
"""How hard a step of a pattern is struck, 1 to 127. Chosen by hand."""

BASS_CHANNEL, CHORD_CHANNEL, MELODY_CHANNEL = 2, 3, 4
"""Chosen by hand, of those that are not the drums'."""

MAJOR, MINOR = (0, 2, 4, 5, 7, 9, 11), (0, 2, 3, 5, 7, 8, 10)
"""Semitones of the scales, by definition."""

BASS_STEPS = {
    "eighths": "x.x.",
    "roots": "x...............",
    "walking": "x...",
    "octaves": "x.x.",
    "offbeat": "..x.",
    "syncopated": "x..x..x.x..x..x.",
    "syncopated16": "x..x.xx..x.x..x.",
    "shuffle": "x.x",
    "twobeat": "x.......x.......",
}
CHORD_STEPS = {
    "held": ("x...............", "x.......x......."),
    "quarters": ("x...",),
    "eighths": ("x.x.", "X.x."),
    "sixteenths": ("xoxo",),
    "gallop": ("x.xx",),
    "offbeat": ("..x.", "..x...xx"),
    "backbeat": ("....x...x...x...", "....x.......x..."),
    "syncopated": ("x..x..x.", "x.....x...x.....", "x..x......x.....", "..x..x..x.x..x.."),
    "syncopated16": ("x..x.xx..x.x..x.", "..x..xx..x..xx.x"),
    "tresillo": ("x..x..x.", "x..x..x.x..x..x.", "x..x..x.x...x..."),
    "strum": ("x...x.x...x.x.x.", "x.x.x.xxx.x.x.xx", "x..xx.xxx..xx.xx", "x.xxx.xx"),
    "triplets": ("xxx", "Xox"),
    "shuffle": ("x.x",),
    "arpeggio8": ("x.x.",),
    "arpeggio16": ("xxxx",),
}
INVENTION = ((0.95, 0.65, 0.3, 0.25, 0.1), (0.04, 0.15, 0.8, 0.12, 0.08))
"""Chance of a kick and of a snare on the one, on other odd beats, on even beats, half-way between, and elsewhere.
Chosen by hand."""

BASS_PROGRAMS = (32, 33, 34, 36, 38)
CHORD_PROGRAMS = (0, 4, 16, 24, 25, 27, 29, 30, 30, 48, 50, 81, 88)
MELODY_PROGRAMS = (40, 52, 54, 56, 65, 73, 80, 81, 0, 11, 26)
"""Programs of General MIDI [MMA1991], chosen by hand."""


@dataclass(frozen=True, eq=False)
class Arrangement:
    """A made-up song as notes.

    Parameters
    ----------
    notes : :class:`kernels.music.notes.Notes`
    beats : :class:`kernels.types.BeatGrid`
        Every beat with its bar; confidence 1.
    style : name of the groove
    """

    notes: Notes
    beats: BeatGrid
    style: str


@dataclass(frozen=True)
class Line:
    """How one instrument keeps time: seconds late on average and the spread of single notes."""

    late_s: float
    spread_s: float


def arrange(
    rng: np.random.Generator, *, duration_s: float = 30.0, groove: Groove | None = None, tempo_bpm: float | None = None
) -> Arrangement:
    """Make up a song.

    Parameters
    ----------
    rng : numpy.random.Generator
        The only source of chance: equal states give equal songs.
    duration_s : float, seconds, > 0
        The song ends with the first bar that reaches it.
    groove : Groove, optional
        Chosen by weight when left out.
    tempo_bpm : float, optional
        Steady tempo, beats a minute; otherwise one of the groove's range that may drift, ramp or jump.

    Returns
    -------
    :class:`Arrangement`

    Raises
    ------
    ValueError
        If the duration or the tempo is not > 0.
    """
    if not duration_s > 0 or (tempo_bpm is not None and not tempo_bpm > 0):
        raise ValueError(f"duration_s, tempo_bpm: want > 0, got {duration_s} and {tempo_bpm}")
    if groove is None:
        weight = np.array([g.weight for g in GROOVES])
        groove = GROOVES[int(rng.choice(len(GROOVES), p=weight / weight.sum()))]
    beat_s = _beat_times(rng, groove, duration_s, tempo_bpm)
    band = _Band(rng, groove, beat_s)
    rows = band.play()
    n_beats = len(beat_s) - 1
    number = np.arange(n_beats)
    grid = BeatGrid(
        time_s=beat_s[:-1],
        bar_number=number // groove.beats_per_bar + 1,
        beat_in_bar_number=number % groove.beats_per_bar + 1,
        confidence=np.ones(n_beats),
    )
    return Arrangement(sorted_notes(rows), grid, groove.name)


def _beat_times(rng: np.random.Generator, groove: Groove, duration_s: float, tempo_bpm: float | None) -> Float:
    """Lay out beats, whole bars and one more, in seconds; the tempo may drift, ramp or jump."""
    bpm = tempo_bpm or float(np.exp(rng.uniform(np.log(groove.slowest_bpm), np.log(groove.fastest_bpm))))
    n_bars = max(int(np.ceil(duration_s * bpm / 60.0 / groove.beats_per_bar)), 2)
    n = n_bars * groove.beats_per_bar
    log_tempo = np.zeros(n)
    kind = rng.random()
    if tempo_bpm is None and kind < 0.30:
        step = rng.uniform(0.001, 0.008) * rng.standard_normal(n)
        for i in range(1, n):
            log_tempo[i] = 0.97 * log_tempo[i - 1] + step[i]
    elif tempo_bpm is None and kind < 0.42:
        log_tempo = np.linspace(0.0, rng.uniform(-0.25, 0.25), n)
    elif tempo_bpm is None and kind < 0.46:
        log_tempo[int(rng.integers(n)) :] = rng.uniform(-0.3, 0.3)
    lead_s = 0.0 if tempo_bpm or rng.random() < 0.3 else float(rng.uniform(0.0, 2.0))
    return lead_s + np.concatenate([[0.0], np.cumsum(60.0 / bpm * np.exp(-log_tempo))])


class _Band:
    """Everything chosen once a song, and the bars it gives."""

    def __init__(self, rng: np.random.Generator, groove: Groove, beat_s: Float) -> None:
        self.rng, self.groove, self.beat_s = rng, groove, beat_s
        self.n_steps = groove.beats_per_bar * groove.steps_per_beat
        self.n_bars = (len(beat_s) - 1) // groove.beats_per_bar
        self.key = int(rng.integers(12))
        self.scale = MAJOR if rng.random() < 0.5 else MINOR
        straight = groove.steps_per_beat == 4
        self.swing_16 = float(rng.uniform(0.1, 0.35)) if straight and rng.random() < 0.15 else 0.0
        self.swing_8 = float(rng.uniform(0.15, 0.34)) if straight and rng.random() < 0.08 else 0.0
        tightness_s = float(rng.choice([0.0, 0.003, 0.008, 0.015]))
        self.line = {
            part: Line(0.4 * tightness_s * float(rng.standard_normal()), tightness_s)
            for part in ("drums", "bass", "chords", "melody")
        }
        self.line["melody"] = Line(self.line["melody"].late_s, tightness_s + float(rng.choice([0.0, 0.02, 0.04])))
        kind = rng.random()
        self.parts = {
            part for part, share in (("bass", 0.85), ("chords", 0.85), ("melody", 0.6)) if rng.random() < share
        }
        if kind < 0.14:
            self.parts = {"drums"}
        elif kind < 0.86:
            self.parts.add("drums")
        else:
            self.parts.add("chords")
        self.chords_per_bar = float(rng.choice([1.0, 0.5, 2.0], p=[0.65, 0.2, 0.15]))
        self.is_inventive = bool(rng.random() < 0.2)
        self.rows: list[Row] = []

    def play(self) -> list[Row]:
        """Play all bars, section by section."""
        rng = self.rng
        themes = [self._theme() for _ in range(int(rng.integers(1, 4)))]
        progression = self._progression()
        bar = 0
        while bar < self.n_bars:
            length = int(rng.choice([2, 4, 4, 8]))
            theme = themes[int(rng.integers(len(themes)))]
            # Sorted: the order of a set of names is another in every process.
            playing = {part for part in sorted(self.parts) if rng.random() < 0.9}
            if not playing & {"drums", "chords", "bass"}:
                playing = set(self.parts)
            for i in range(length):
                if bar >= self.n_bars:
                    break
                self._bar(bar, theme, playing, progression, is_first=i == 0, is_last=i == length - 1)
                bar += 1
        return self.rows

    def _theme(self) -> dict[str, str]:
        """Choose what each instrument plays in one kind of section."""
        rng, g = self.rng, self.groove

        def pick(choice: tuple[str, ...]) -> str:
            return choice[int(rng.integers(len(choice)))]

        chords = pick(g.chords)
        bass = pick(g.bass)
        kick = self._vary(self._invent(0) if self.is_inventive else pick(g.kick))
        theme = {
            "kick": kick,
            "snare": self._vary(self._invent(1) if self.is_inventive else pick(g.snare)),
            "time": pick(g.time),
            "snare_key": str(g.snare_keys[int(rng.integers(len(g.snare_keys)))]),
            "time_key": str(g.time_keys[int(rng.integers(len(g.time_keys)))]),
            "bass": bass,
            "bass_steps": kick if bass == "kick" else self._triple(BASS_STEPS[bass]),
            "chords": chords,
            "chord_steps": kick if chords == "kick" else self._triple(pick(CHORD_STEPS[chords])),
            "melody": "".join("x" if rng.random() < self._singing(step) else "." for step in range(self.n_steps)),
            "bass_program": str(int(rng.choice(BASS_PROGRAMS))),
            "chord_program": str(int(rng.choice(CHORD_PROGRAMS))),
            "melody_program": str(int(rng.choice(MELODY_PROGRAMS))),
        }
        for i, (key, steps) in enumerate(g.extra):
            if rng.random() < 0.5:
                theme[f"extra{i}"] = f"{key} {steps}"
        return theme

    def _invent(self, instrument: int) -> str:
        """Draw a bar of kick (0) or snare (1) step by step, strong places more often than weak ones."""
        per_beat, n_beats = self.groove.steps_per_beat, self.groove.beats_per_bar
        on_one, on_odd, on_even, on_half, elsewhere = INVENTION[instrument]
        steps = ""
        for step in range(self.n_steps):
            beat, place = divmod(step, per_beat)
            if place:
                chance = on_half if 2 * place == per_beat or per_beat == 3 else elsewhere
            elif n_beats == 3:
                chance = on_one if beat == 0 else on_even
            else:
                chance = on_one if beat == 0 else on_odd if beat % 2 == 0 else on_even
            steps += "x" if self.rng.random() < chance else "."
        return steps

    def _singing(self, step: int) -> float:
        """Chance of a melody note on a step."""
        place = step % self.groove.steps_per_beat
        if place == 0:
            return 0.55
        return 0.4 if self.groove.steps_per_beat == 3 or place == 2 else 0.12

    def _triple(self, steps: str) -> str:
        """Fit a pattern of four steps a beat to triplets: the off-beat falls on the last third."""
        if self.groove.steps_per_beat == 4 or len(steps) % 4:
            return steps
        return "".join(steps[i] + "." + steps[i + 2] for i in range(0, len(steps), 4))

    def _vary(self, steps: str) -> str:
        """Drop and add a few soft steps."""
        rng = self.rng
        drop, add = rng.uniform(0.0, 0.06), rng.uniform(0.0, 0.03)
        varied = ""
        for character in steps:
            u = rng.random()
            varied += "." if character != "." and u < drop else "o" if character == "." and u < add else character
        return varied

    def _progression(self) -> list[int]:
        """Choose scale degrees, 0 to 6, one a chord, starting on the tonic more often than not."""
        rng = self.rng
        length = int(rng.choice([2, 4, 4, 8]))
        degrees = [
            int(rng.choice([0, 3, 4, 5, 1, 2, 6], p=[0.2, 0.24, 0.24, 0.18, 0.06, 0.05, 0.03])) for _ in range(length)
        ]
        if rng.random() < 0.7:
            degrees[0] = 0
        return degrees

    def _second(self, bar: int, step: float) -> float:
        """Time of a step, swung."""
        per_beat = self.groove.steps_per_beat
        whole = int(step)
        if self.swing_16 and whole % 2 == 1:
            step += self.swing_16
        if self.swing_8 and whole % per_beat == per_beat // 2:
            step += 2 * self.swing_8
        beat = bar * self.groove.beats_per_bar + step / per_beat
        return float(np.interp(beat, np.arange(len(self.beat_s)), self.beat_s))

    def _add(self, part: str, bar: int, step: float, steps: float, key: int, velocity: float, program: int = 0) -> None:
        """Add one note of a part, a little off as its player is."""
        line = self.line[part]
        off = line.late_s + line.spread_s * float(np.clip(self.rng.standard_normal(), -2.5, 2.5))
        start = max(self._second(bar, step) + off, 0.0)
        end = self._second(bar, step + steps)
        channel = {"drums": DRUM_CHANNEL_NUMBER, "bass": BASS_CHANNEL, "chords": CHORD_CHANNEL}.get(
            part, MELODY_CHANNEL
        )
        loud = int(np.clip(velocity + 6.0 * self.rng.standard_normal(), 20, 127))
        self.rows.append((start, max(end - start, 0.03), int(np.clip(key, 0, 127)), loud, channel, program))

    def _hits(self, steps: str) -> list[tuple[int, int]]:
        """Spell a pattern out over a bar: step and velocity of each hit."""
        return [(i, VELOCITY[steps[i % len(steps)]]) for i in range(self.n_steps) if steps[i % len(steps)] != "."]

    def _bar(
        self,
        bar: int,
        theme: dict[str, str],
        playing: set[str],
        progression: list[int],
        *,
        is_first: bool,
        is_last: bool,
    ) -> None:
        if "drums" in playing:
            self._drums(bar, theme, is_first=is_first, is_last=is_last)
        if "bass" in playing:
            self._bass(bar, theme, progression)
        if "chords" in playing:
            self._chords(bar, theme, progression)
        if "melody" in playing and self.rng.random() < 0.85:
            self._melody(bar, theme)

    def _drums(self, bar: int, theme: dict[str, str], *, is_first: bool, is_last: bool) -> None:
        rng, per_beat = self.rng, self.groove.steps_per_beat
        fill_from = self.n_steps
        if is_last and rng.random() < 0.6:
            fill_from -= per_beat * int(rng.integers(1, min(self.groove.beats_per_bar, 4) + 1))
            every = int(rng.choice([1, 1, 2])) if per_beat == 4 else 1
            for step in range(fill_from, self.n_steps, every):
                if rng.random() < 0.8:
                    key = int(rng.choice([SNARE, HIGH_TOM, MIDDLE_TOM, LOW_TOM]))
                    self._add("drums", bar, step, 0.5, key, 95)
        lines = [
            (KICK, theme["kick"]),
            (int(theme["snare_key"]), theme["snare"]),
            (int(theme["time_key"]), theme["time"]),
        ]
        lines += [(int(v.split()[0]), v.split()[1]) for name, v in theme.items() if name.startswith("extra")]
        for i, (key, steps) in enumerate(lines):
            for step, velocity in self._hits(steps):
                if step < fill_from or (i == 0 and rng.random() < 0.4):
                    soften = 12 if i >= 2 and step % per_beat else 0
                    self._add("drums", bar, step, 0.5, key, velocity - soften)
        if is_first and rng.random() < 0.5:
            self._add("drums", bar, 0, 0.5, CRASH, 110)

    def _degree(self, progression: list[int], bar: int, step: int) -> int:
        """Chord of a step as a scale degree: chords last one bar, two, or half a bar."""
        return progression[int((bar + max(step, 0) / self.n_steps) * self.chords_per_bar + 1e-9) % len(progression)]

    def _bass(self, bar: int, theme: dict[str, str], progression: list[int]) -> None:
        hits = self._hits(theme["bass_steps"])
        for i, (step, velocity) in enumerate(hits):
            after = hits[i + 1][0] if i + 1 < len(hits) else self.n_steps
            degree = self._degree(progression, bar, step)
            root = 36 + (self.key + self.scale[degree]) % 12
            key = root
            if theme["bass"] == "walking":
                key = root if step == 0 else 36 + (self.key + self.scale[(degree + int(self.rng.integers(7))) % 7]) % 12
            elif theme["bass"] == "octaves" and step % self.groove.steps_per_beat:
                key = root + 12
            elif theme["bass"] == "twobeat" and step:
                key = root + 7
            elif step and self.rng.random() < 0.12:
                key = root + int(self.rng.choice([7, 12, -5]))
            self._add("bass", bar, step, 0.9 * (after - step), key, velocity, int(theme["bass_program"]))

    def _chords(self, bar: int, theme: dict[str, str], progression: list[int]) -> None:
        hits = self._hits(theme["chord_steps"])
        spread = theme["chords"].startswith("arpeggio")
        if not spread and hits and bar and self.rng.random() < 0.08:
            hits[0] = (-self.groove.steps_per_beat // 2, hits[0][1])  # the push: an eighth early
        for i, (step, velocity) in enumerate(hits):
            after = hits[i + 1][0] if i + 1 < len(hits) else self.n_steps
            degree = self._degree(progression, bar, step)
            tones = [48 + self.key + self.scale[(degree + j) % 7] + 12 * ((degree + j) // 7) for j in (0, 2, 4)]
            keys = [tones[i % 3] + 12 * (i // 3 % 2)] if spread else tones
            for key in keys:
                self._add("chords", bar, step, 0.85 * (after - step), key, velocity - 14, int(theme["chord_program"]))

    def _melody(self, bar: int, theme: dict[str, str]) -> None:
        rng = self.rng
        hits = self._hits(theme["melody"])
        tone = int(rng.integers(7, 14))
        for i, (step, velocity) in enumerate(hits):
            if rng.random() < 0.15:
                continue
            after = hits[i + 1][0] if i + 1 < len(hits) else self.n_steps
            tone = int(np.clip(tone + rng.integers(-2, 3), 5, 16))
            key = 48 + self.key + self.scale[tone % 7] + 12 * (tone // 7)
            length = float(rng.uniform(0.5, 1.0)) * (after - step)
            self._add("melody", bar, step, length, key, velocity, int(theme["melody_program"]))
