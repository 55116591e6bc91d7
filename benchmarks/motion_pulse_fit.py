"""Fit again what the pulse's confidence is made of, and say how well it holds on clips it was not fitted to.

``python benchmarks/motion_pulse_fit.py [--clips N]`` prints the weights for ``kernels/motion/pulse_confidence.py``,
fitted to two sets of N made-up clips, and a row a tenth of probability: fitted to the first, judged on the second.
"""

from __future__ import annotations

import argparse

import numpy as np
from motion_pulse_clips import MadeClip, mixed_clips
from sklearn.linear_model import LogisticRegression

from kernels.motion import dance_pulse as dancing
from kernels.motion.pulse_confidence import level_figures
from kernels.types import Float

DANCE_SHARE = 0.8
"""Share of clips with a pulse that the probability is for, chosen by hand for a studio of dances."""


def nearest_level(found_bpm: float, true_bpm: float) -> float:
    """Octave of the true tempo that was found within 4 %, as 0.5, 1 or 2; 0 where none was."""
    for level in (0.5, 1.0, 2.0):
        if true_bpm and abs(found_bpm / (level * true_bpm) - 1) <= 0.04:
            return level
    return 0.0


def figures_of(clips: list[MadeClip]) -> tuple[Float, Float, Float, Float, Float]:
    """Figures of the pulse and of the level, whether each was right, and what a clip weighs."""
    pulse, level, is_pulse, is_level, weight = [], [], [], [], []
    n_danced = sum(clip.kind == "dance" for clip in clips)
    for clip in clips:
        found = dancing.dance_pulse(clip.position_m, clip.frame_rate_hz)
        if not found.tempo_bpm:
            continue
        right = nearest_level(found.tempo_bpm, clip.true_bpm)
        pulse.append(found.figures)
        is_pulse.append(right > 0)
        level.append(level_figures(dancing.beat_welcome(clip.position_m, clip.frame_rate_hz), found.row_s))
        is_level.append(right == 1.0)
        share = DANCE_SHARE / n_danced if clip.kind == "dance" else (1 - DANCE_SHARE) / (len(clips) - n_danced)
        weight.append(share)
    return tuple(np.array(values) for values in (pulse, level, is_pulse, is_level, weight))  # type: ignore[return-value]


def fitted(figures: Float, is_right: Float, weight: Float | None = None) -> Float:
    """Weights of a logistic model."""
    model = LogisticRegression(C=1000.0, fit_intercept=False, max_iter=20000)
    scaled = None if weight is None else weight * len(weight)
    return np.asarray(model.fit(figures, is_right, sample_weight=scaled).coef_[0], np.float64)


def main() -> None:
    """Fit, print the weights and the reliability."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clips", type=int, default=1500)
    n = parser.parse_args().clips
    first, second = (figures_of(list(mixed_clips(n, seed=seed))) for seed in (0, 1))
    both = [np.concatenate(pair) for pair in zip(first, second, strict=True)]
    print("PULSE_WEIGHTS =", tuple(fitted(both[0], both[2], both[4]).round(2).tolist()))
    known = both[2].astype(bool)
    print("LEVEL_WEIGHTS =", tuple(fitted(both[1][known], both[3][known]).round(2).tolist()))
    said = 1 / (1 + np.exp(-second[0] @ fitted(first[0], first[2], first[4])))
    for low in np.arange(0.0, 1.0, 0.1):
        here = (said >= low) & (said < low + 0.1)
        if here.any():
            weight = second[4][here]
            mean, right = (float(np.average(values[here], weights=weight)) for values in (said, second[2]))
            print(f"{low:.1f} to {low + 0.1:.1f}: {here.sum():4d} clips, said {mean:.2f}, right {right:.2f}")


if __name__ == "__main__":
    main()
