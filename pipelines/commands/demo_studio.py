"""A made-up studio on disk: dancers on two rigs, in a suit, and one who follows hidden rules; songs as WAV and MIDI."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

import numpy as np

from assets.formats import audio, bvh, midi, suit
from assets.formats.audio import Audio
from kernels.calibration.records import Recording
from kernels.synthetic import rigs
from kernels.synthetic.dancer import MOVES, SyntheticTake, take
from kernels.synthetic.drum_machine import drum_machine_song
from kernels.synthetic.hidden_rules import SyntheticPerformance, hidden_rules, perform
from kernels.synthetic.medley import medley, wear
from kernels.synthetic.suit_performer import Disturbance, make_body, record
from pipelines.studio.files import StudioError, write_beside

SONG = "drum_machine"
TEMPO_BPM = 116.0
"""Of the demo's song. Chosen by hand."""

_MARK = ".made-by-odori-demo"
_SETTINGS = "# A made-up studio. Every key has a default; see 'docs/settings.md'.\n\n[dance]\nframe_rate_hz = 30\n"
# A third dancer wears a suit and dances without a break; the seed is chosen by hand.
_SUIT, _SUIT_SEED = "tsubaki", 11
_MEDLEY = ("step", "twist", "kick", "wave", "rock", "spin")
# A fourth dances to a drum track by rules that the model of the dancer can be compared with. Number of motions and seed
# are chosen by hand.
PERFORMER, PERFORMANCE, N_MOTIONS, _RULES_SEED = "sumire", "hidden_rules", 200, 4
# Beat intervals of the takes, and where each dancer faces: near the song's own beat, and one far from it. Chosen by
# hand.
_TAKES = ((0.50, 0.0, 1.0), (0.54, 0.8, 0.8), (0.62, -1.2, 1.1))


def make(root: Path) -> None:
    """Write the studio, the same bytes every time.

    Raises
    ------
    StudioError
        If the folder holds something else: nothing of a user's own is ever written over.
    """
    if root.exists() and (not root.is_dir() or (any(root.iterdir()) and not (root / _MARK).exists())):
        raise StudioError(
            f"{root}: want a new folder or an earlier demo, got something else; name another with --studio"
        )
    for path, data in _files():
        place = root / path
        if not place.is_file() or place.read_bytes() != data:
            write_beside(place, _writer(data))


def _writer(data: bytes) -> Callable[[IO[bytes]], int]:
    return lambda file: file.write(data)


def _files() -> Iterator[tuple[str, bytes]]:
    yield _MARK, b""
    yield "odori.toml", _SETTINGS.encode()
    for dancer, plan, unit, up, rate_hz in (
        ("ayame", rigs.RigPlan(axes=rigs.a_pose()), 0.01, "Y", 30.0),
        (
            "kaede",
            rigs.RigPlan(axes=rigs.splayed(), stretch={"leftLowerLeg": 1.04, "rightLowerLeg": 1.04}),
            1.0,
            "Z",
            60.0,
        ),
    ):
        rows = ["file,label,style,subject,licence"]
        for name, made in _takes(rate_hz):
            yield (
                f"clips/{dancer}/{name}.bvh",
                bvh.format(rigs.author(made.clip, plan), metres_per_unit=unit, up_axis=up),
            )
            rows.append(f"{name}.bvh,{made.label},procedural,{dancer},CC0-1.0")
        yield f"clips/{dancer}/clips.csv", ("\n".join(rows) + "\n").encode()
    yield f"clips/{_SUIT}/medley.parquet", suit.format_parquet(suit_recording())
    yield (
        f"clips/{_SUIT}/clips.csv",
        f"file,label,style,subject,licence\nmedley.parquet,medley,procedural,{_SUIT},CC0-1.0\n".encode(),
    )
    performed = performance()
    yield f"clips/{PERFORMER}/{PERFORMANCE}.bvh", bvh.format(performed.clip)
    yield (
        f"clips/{PERFORMER}/clips.csv",
        "file,label,style,subject,licence,performed_to,performed_offset_s\n"
        f"{PERFORMANCE}.bvh,performance,procedural,{PERFORMER},CC0-1.0,{PERFORMANCE}.mid,0\n".encode(),
    )
    yield f"songs/{PERFORMANCE}.mid", midi.format(performed.notes, tempo=performed.tempo)
    song = drum_machine_song(tempo_bpm=TEMPO_BPM, n_bars=16, seed=7)
    yield f"songs/{SONG}.wav", audio.format_wav(Audio(song.render(), 44100))
    yield f"songs/{SONG}.mid", midi.format(song.notes, tempo=song.tempo)


def performance() -> SyntheticPerformance:
    """Dance 200 motions to the drums they call, one a beat."""
    return perform(hidden_rules(seed=_RULES_SEED), n_motions=N_MOTIONS, interval_s=60 / TEMPO_BPM, seed=_RULES_SEED)


def suit_recording() -> Recording:
    """Record the dancer in a suit: 28 s at 120 Hz with noise, soft tissue, outliers and drop-outs."""
    body = make_body(_SUIT_SEED)
    motion = wear(medley(_MEDLEY, interval_s=60 / TEMPO_BPM, frame_rate_hz=120.0, seed=_SUIT_SEED).clip, body)
    noise = Disturbance(position_m=0.0015, rotation_rad=0.012, wobble_m=0.003, outlier_ratio=0.005, dropped_ratio=0.005)
    return record(body, motion, seed=_SUIT_SEED, disturbance=noise).recording


def _takes(rate_hz: float) -> Iterator[tuple[str, SyntheticTake]]:
    for label in MOVES:
        for number, (interval_s, turned, size) in enumerate(_TAKES, start=1):
            yield (
                f"{label}_{number:02d}",
                take(label, n_beats=16, interval_s=interval_s, size=size, turned_rad=turned, frame_rate_hz=rate_hz),
            )


def beats_s() -> np.ndarray:
    """When the beats of the made-up song are, (64,) float64, seconds."""
    return drum_machine_song(tempo_bpm=TEMPO_BPM, n_bars=16, seed=7).beats.time_s
