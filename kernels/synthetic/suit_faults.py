"""Recordings of a suit spoilt on purpose, one fault each, with the words a report of it must hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from kernels.calibration.records import Recording, Severity
from kernels.synthetic.suit_performer import swap
from kernels.types import Float

ARM = ("shoulder", "upper_arm", "forearm", "hand")
LEG = ("thigh", "shank", "foot")


@dataclass(frozen=True)
class Fault:
    """One way to spoil a recording.

    Parameters
    ----------
    spoil : Recording to Recording
    severity : "error" or "warning"
        Of the finding that must come.
    sensor : str or None
        The sensor it must name.
    words : str
        What its sentence must hold.
    """

    spoil: Callable[[Recording], Recording]
    severity: Severity
    sensor: str | None
    words: str


def _scaled(factor: float) -> Callable[[Recording], Recording]:
    return lambda recording: replace(recording, position_xyz_m=recording.position_xyz_m * factor)


def _turned(change: Callable[[Float], Float]) -> Callable[[Recording], Recording]:
    return lambda recording: replace(recording, rotation_wxyz=change(recording.rotation_wxyz))


def _exchanged(*parts: str) -> Callable[[Recording], Recording]:
    return lambda recording: swap(recording, {f"l_{part}": f"r_{part}" for part in parts})


def _stretched(factor: float) -> Callable[[Recording], Recording]:
    def spoil(recording: Recording) -> Recording:
        turned = recording.rotation_wxyz.copy()
        frame = int(np.flatnonzero(recording.is_valid[100:, 3])[0]) + 100
        turned[frame, 3] *= factor
        return replace(recording, rotation_wxyz=turned)

    return spoil


def _not_a_number(recording: Recording) -> Recording:
    position, is_valid = recording.position_xyz_m.copy(), recording.is_valid.copy()
    position[50, 2], is_valid[50, 2] = np.nan, True
    return replace(recording, position_xyz_m=position, is_valid=is_valid)


def _dropped(recording: Recording) -> Recording:
    is_valid = recording.is_valid.copy()
    is_valid[len(is_valid) // 3 : 2 * len(is_valid) // 3, 7] = False
    return replace(recording, is_valid=is_valid)


def _wild(recording: Recording) -> Recording:
    position = recording.position_xyz_m.copy()
    rng = np.random.default_rng(0)
    is_wild = rng.random(len(position)) < 0.12
    position[is_wild, 5] += rng.normal(0, 0.3, (int(is_wild.sum()), 3))
    return replace(recording, position_xyz_m=position)


def _without(recording: Recording) -> Recording:
    kept = [k for k, name in enumerate(recording.sensors) if name != "head"]
    return Recording(
        recording.frame_rate_hz,
        tuple(recording.sensors[k] for k in kept),
        recording.position_xyz_m[:, kept],
        recording.rotation_wxyz[:, kept],
        recording.is_valid[:, kept],
    )


def _first(n: int) -> Callable[[Recording], Recording]:
    return lambda recording: Recording(
        recording.frame_rate_hz,
        recording.sensors,
        recording.position_xyz_m[:n],
        recording.rotation_wxyz[:n],
        recording.is_valid[:n],
    )


def _mirrored(recording: Recording) -> Recording:
    position = recording.position_xyz_m.copy()
    position[500:900, 6] *= -1
    return replace(recording, position_xyz_m=position)


FAULTS: dict[str, Fault] = {
    "missing sensor": Fault(_without, "error", "head", "want all 17 sensors"),
    "unknown sensor": Fault(
        lambda recording: replace(recording, sensors=("hips", *recording.sensors[1:])), "error", "hips", "want one of"
    ),
    "not a number": Fault(_not_a_number, "error", "head", "frame 50"),
    "not unit": Fault(_stretched(1.05), "error", "l_shoulder", "unit quaternions"),
    "nearly unit": Fault(_stretched(1.003), "warning", "l_shoulder", "unit quaternions"),
    "millimetres": Fault(_scaled(1000.0), "error", None, "millimetres"),
    "centimetres": Fault(_scaled(100.0), "error", None, "centimetres"),
    "inches": Fault(_scaled(1 / 0.0254), "error", None, "inches"),
    "inverted": Fault(_turned(lambda q: q * [1, -1, -1, -1]), "error", None, "inverted"),
    "x y z w": Fault(_turned(lambda q: q[..., [1, 2, 3, 0]]), "error", None, "x y z w"),
    "x y z w inverted": Fault(
        _turned(lambda q: (q * [1, -1, -1, -1])[..., [1, 2, 3, 0]]), "error", None, "x y z w and inverted"
    ),
    "neighbours exchanged": Fault(
        lambda recording: swap(recording, {"l_upper_arm": "l_forearm"}), "error", "l_upper_arm", "l_forearm"
    ),
    "shins exchanged": Fault(_exchanged("shank"), "error", "l_shank", "r_shank"),
    "arms exchanged": Fault(_exchanged(*ARM), "error", "l_shoulder", "exchange l_ and r_ of shoulder"),
    "legs exchanged": Fault(_exchanged(*LEG), "error", "l_thigh", "exchange l_ and r_ of thigh"),
    "sides exchanged": Fault(_exchanged(*ARM, *LEG), "error", "l_shoulder", "exchange l_ and r_ of shoulder"),
    "too short": Fault(_first(200), "error", None, "240 frames"),
    "short": Fault(_first(800), "warning", "thorax", "960 frames"),
    "dropped": Fault(_dropped, "error", "l_thigh", "frames lost"),
    "outliers": Fault(_wild, "warning", "l_forearm", "outliers"),
    "hemisphere": Fault(_mirrored, "warning", "l_hand", "frame 500"),
}
"""Every fault that arrays can show; a joint that does not move is made by ``range_of_motion(frozen=...)``. Sizes are
chosen by hand."""
