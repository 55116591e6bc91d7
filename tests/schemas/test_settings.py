"""Every setting has a default that its own declaration allows, and a meaning."""

from dataclasses import fields, is_dataclass

import pytest

from schemas.settings import (
    BasicMotionSettings,
    BeatsBrief,
    Brief,
    DanceSettings,
    MotionBeatSettings,
    MotionGraphSettings,
    Settings,
)


def declared(record):
    for field in fields(record):
        value = getattr(record, field.name)
        if is_dataclass(value):
            yield from declared(value)
        else:
            yield field


@pytest.mark.parametrize("record", [Settings(), Brief()])
def test_every_key_has_a_meaning(record):
    for field in declared(record):
        assert field.metadata["meaning"].rstrip().endswith("."), field.name


@pytest.mark.parametrize(
    ("kind", "wrong", "word"),
    [
        (MotionBeatSettings, {"method": "guess"}, "want one of pulse, fft, autocorrelation, got 'guess'"),
        (MotionBeatSettings, {"component": 0}, "component: want 1 to 22, got 0"),
        (MotionGraphSettings, {"neighbours": -1}, "neighbours"),
        (
            BasicMotionSettings,
            {"shortest_s": 0.8, "longest_s": 1.0},
            r"longest_s: want at least twice shortest_s \(0.8\)",
        ),
        (DanceSettings, {"frame_rate_hz": 1000.0}, "want 1 to 240"),
        (DanceSettings, {"blend_s": float("nan")}, "blend_s: want a finite number, got nan"),
        (DanceSettings, {"blend_s": float("inf")}, "blend_s: want a finite number, got inf"),
        (BeatsBrief, {"nudge_ms": float("-inf")}, "nudge_ms: want a finite number"),
        (BeatsBrief, {"nudge_beats": float("nan")}, "nudge_beats: want a finite number"),
    ],
)
def test_values_are_checked(kind, wrong, word):
    with pytest.raises(ValueError, match=word):
        kind(**wrong)
