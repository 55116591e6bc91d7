"""Write docs/clip-health.png: faults planted in made-up dances, as recorded and as danced."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from assets.plots.draw import COOL, SOFT, WARM, figure_of, plain, png
from kernels import rotation
from kernels.health.bridging import bridge
from kernels.health.examine import examine
from kernels.health.turns import around, turn_rad_per_s
from kernels.skeleton.kinematics import place
from kernels.skeleton.naming import map_joints
from kernels.synthetic.dancer import take
from kernels.types import Clip, Float

HERE = Path(__file__).parent
SHOWN = 9


def turned(clip: Clip, joint: str, frames: range, angle_rad: Float, axis: tuple[float, float, float]) -> Clip:
    """Turn a joint by an angle a frame."""
    rotations = clip.rotation_wxyz.copy()
    at = clip.skeleton.index(joint)
    off = rotation.from_axis_angle(np.array(axis), np.asarray(angle_rad))
    rotations[frames.start : frames.stop, at] = rotation.mul(rotations[frames.start : frames.stop, at], off)
    return replace(clip, rotation_wxyz=rotations)


def planted() -> list[tuple[str, Clip, str]]:
    """Make up the dances: title, clip, and the joint at fault."""
    step, wave, kick = (take(move, n_beats=10, frame_rate_hz=30.0).clip for move in ("step", "wave", "kick"))
    burst = np.tile([2.4, -1.9, 2.1, -2.6], 4)
    return [
        ("the hips flip for one frame", turned(step, "hips", range(60, 61), np.array([2.2]), (0, 0, 1)), "hips"),
        ("a hand flips for two", turned(wave, "leftHand", range(75, 77), np.array([2.8, 2.7]), (1, 0, 0)), "leftHand"),
        ("a foot bursts for half a second", turned(kick, "rightFoot", range(50, 66), burst, (0, 1, 0)), "rightFoot"),
    ]


def _speeds(axes: Any, title: str, clip: Clip, danced: Clip, fault: Any) -> None:  # noqa: ANN401 - matplotlib's
    first, recorded = around(fault, clip)
    time_s = (first + np.arange(len(recorded))) / clip.frame_rate_hz
    now = turn_rad_per_s(danced, fault.joint)[first : first + len(recorded)]
    half_s = 0.5 / clip.frame_rate_hz
    axes.axvspan(
        fault.first / clip.frame_rate_hz - half_s, fault.last / clip.frame_rate_hz + half_s, color=SOFT, alpha=0.25
    )
    axes.plot(time_s, np.degrees(recorded), color=WARM, linewidth=1.2, label="as recorded")
    axes.plot(time_s, np.degrees(now), color=COOL, linewidth=1.2, label="as danced")
    axes.set_title(f"{title}: {fault.kind}, {fault.verdict}", fontsize=9)
    axes.set_ylabel(f"{fault.joint}, degrees/s", fontsize=8)
    axes.legend(fontsize=7, frameon=False)
    plain(axes)


def _figures(axes: Any, clip: Clip, first: int, colour: str, title: str) -> None:  # noqa: ANN401 - matplotlib's
    position, _ = place(clip)
    for column, frame in enumerate(range(first, first + SHOWN)):
        seen = position[frame] - position[first, 0] * [1, 0, 1]
        for joint, parent in enumerate(clip.skeleton.parent):
            if parent >= 0:
                axes.plot(
                    seen[[parent, joint], 0] + 1.1 * column, seen[[parent, joint], 1], color=colour, linewidth=1.5
                )
    axes.set_aspect("equal")
    axes.set_title(title, fontsize=9)
    axes.axis("off")


def picture() -> bytes:
    """Draw the whole picture."""
    cases = planted()
    figure = figure_of(11, 3.4 * len(cases))
    grid = figure.add_gridspec(2 * len(cases), 2, width_ratios=[1, 1.5])
    for i, (title, clip, joint) in enumerate(cases):
        found = examine(clip, map_joints(clip.skeleton))
        own = [f for f in found.faults if f.joint == joint and f.verdict in ("mended", "fenced")]
        fault = max(own, key=lambda f: (f.last - f.first, -f.first))
        danced = bridge(found.clip, found.is_fenced)
        _speeds(figure.add_subplot(grid[2 * i : 2 * i + 2, 0]), title, clip, danced, fault)
        first = max(fault.first - SHOWN // 2, 0)
        _figures(figure.add_subplot(grid[2 * i, 1]), clip, first, WARM, "as recorded, frame by frame")
        _figures(figure.add_subplot(grid[2 * i + 1, 1]), danced, first, COOL, "as danced")
    return png(figure)


if __name__ == "__main__":
    (HERE / "clip-health.png").write_bytes(picture())
