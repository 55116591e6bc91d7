"""How much of a melody's contour is heard in audio? Songs whose notes are known, played and listened to.

    python benchmarks/audio_melody.py [--songs N] [--json]

General MIDI songs of real test data are played by our own preview, the highest notes that start together are the melody
(:func:`kernels.music.drums_and_melody.contour`), and the same five ways to go are sought in the sound: by pYIN (Mauch
and Dixon, 2014), and by the strongest harmonic sum of a constant-Q transform, between C4 and C7; a note is a pitch held
for 70 ms. *Found* is the share of the melody's steps with a heard one within 70 ms that goes the same way, *chance* the
same with the heard ways shuffled, *right* the share of heard steps that are the melody's.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

import librosa
import numpy as np

REPOSITORY = Path(__file__).parents[1]
sys.path.insert(0, str(REPOSITORY))

from assets.formats import midi  # noqa: E402
from kernels.music.drums_and_melody import LARGEST_STEP, Contour, contour  # noqa: E402
from kernels.music.preview import render_preview  # noqa: E402
from kernels.types import Float  # noqa: E402

DATA = Path(os.environ.get("ODORI_TEST_DATA", REPOSITORY.parent / "shared" / "data"))
PLAYED_HZ, RATE_HZ, HOP, HELD_S, NEAR_S, HEARD_S = 44100, 22050, 512, 0.07, 0.07, 60.0
LOWEST, HIGHEST = 60, 96


def strongest(samples: Float) -> Float:
    """Pitch of each frame by harmonic sum, in semitones; NaN in silence."""
    level = np.abs(librosa.cqt(samples, sr=RATE_HZ, hop_length=HOP, fmin=librosa.midi_to_hz(LOWEST), n_bins=60))
    harmonics = [(0, 1.0), (12, 0.6), (19, 0.4), (24, 0.3)]
    n = HIGHEST - LOWEST
    salience = sum(weight * level[shift : shift + n] for shift, weight in harmonics)
    pitch = LOWEST + salience.argmax(axis=0).astype(float)
    return np.where(salience.max(axis=0) > 0.05 * np.percentile(salience.max(axis=0), 95), pitch, np.nan)


def by_pyin(samples: Float) -> Float:
    """Pitch of each frame by pYIN, in semitones; NaN where there is none."""
    found, _, _ = librosa.pyin(
        samples, fmin=librosa.midi_to_hz(LOWEST), fmax=librosa.midi_to_hz(HIGHEST), sr=RATE_HZ, hop_length=HOP
    )
    return np.round(librosa.hz_to_midi(found))


def heard(pitch: Float) -> Contour:
    """Contour of the notes that a row of pitches holds."""
    least = max(round(HELD_S * RATE_HZ / HOP), 1)
    edges = np.flatnonzero(np.append(True, pitch[1:] != pitch[:-1]))
    ends = np.append(edges[1:], len(pitch))
    kept = (ends - edges >= least) & ~np.isnan(pitch[edges])
    at, key = edges[kept] * HOP / RATE_HZ, pitch[edges[kept]]
    moved = np.diff(key)
    size = np.where(np.abs(moved) > LARGEST_STEP, 2, 1) * np.sign(moved)
    return Contour(at[1:], (size + 2).astype(np.int64))


def agreement(true: Contour, found: Contour) -> tuple[float, float]:
    """Share of true steps found, and of found steps that are true."""

    def share(of: Contour, among: Contour) -> float:
        if not len(of.time_s) or not len(among.time_s):
            return 0.0
        near = np.abs(of.time_s[:, None] - among.time_s[None]) <= NEAR_S
        return float((near & (of.symbol[:, None] == among.symbol[None])).any(axis=1).mean())

    return share(true, found), share(found, true)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--songs", type=int, default=8, help="songs, taken evenly from all")
    options = parser.parse_args()
    files = [f for name in ("freedoom", "openmsx") for f in sorted((DATA / "midi" / name).glob("*.mid"))]
    rows: dict[str, list[tuple[float, float, float]]] = {"pyin": [], "harmonic_sum": []}
    for file in files[:: max(len(files) // options.songs, 1)][: options.songs]:
        notes = midi.read(file).notes
        played = render_preview(notes)
        mono = played.mean(axis=1) if played.ndim == 2 else played
        samples = librosa.resample(mono[: int(HEARD_S * PLAYED_HZ)].astype(float), orig_sr=PLAYED_HZ, target_sr=RATE_HZ)
        true = contour(notes)
        true = Contour(true.time_s[true.time_s < HEARD_S], true.symbol[true.time_s < HEARD_S])
        if len(true.time_s) < 20:
            continue
        rng = np.random.default_rng(0)
        for name, listen in (("pyin", by_pyin), ("harmonic_sum", strongest)):
            found = heard(listen(samples))
            hit, right = agreement(true, found)
            chance, _ = agreement(true, Contour(found.time_s, rng.permutation(found.symbol)))
            rows[name].append((hit, chance, right))
    figures = {
        f"{name}_{what}_ratio": float(np.mean([row[i] for row in found]))
        for name, found in rows.items()
        for i, what in enumerate(("found", "chance", "right"))
        if found
    } | {"songs": float(len(rows["pyin"]))}
    if options.json:
        print(json.dumps({name: round(value, 4) for name, value in figures.items()}))
    else:
        for name, value in figures.items():
            print(f"{name:32} {value:10.4f}")


if __name__ == "__main__":
    main()
