"""Stick figures around the seams of a finished dance, drawn from its USD stage as an animator would look at them.

``python examples/seam_strips.py STAGE.usdc STRIPS.png [SEAMS]``: a row a seam, ten where no number is given, evenly
from all seams; eleven frames from 0.5 s before to 0.5 s after, seen from the front as the dancer stands at the seam.
Left limbs are red, right limbs blue; a dot marks a foot on the floor.
"""

import json
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from pxr import Usd

from assets.formats.usd_read import read_animation
from kernels import rotation
from kernels.skeleton import kinematics

mpl.use("Agg")
from matplotlib import pyplot as plt

N_FRAMES, REACH_S = 11, 0.5


def seams_of(stage: Path) -> list[tuple[float, str]]:
    """Seconds of each seam, and what goes over into what, from what the stage says of its frames."""
    found, last = [], None
    opened = Usd.Stage.Open(str(stage))
    for prim in opened.Traverse():
        told = prim.GetAttribute("odori:step")
        if not told:
            continue
        for time in told.GetTimeSamples():
            step = json.loads(told.Get(time))
            if last and step["step_index"] != last["step_index"] and step["has_seam"]:
                name = [s["clip_id"] + (" (mirrored)" if s.get("is_mirrored") else "") for s in (last, step)]
                found.append((step["song_start_s"], f"{name[0][-34:]} -> {name[1][-34:]}"))
            last = step
    return found


def draw(stage: Path, picture: Path, most: int = 10) -> int:
    """Draw the strips; how many seams there are."""
    clip, seams = read_animation(stage), seams_of(stage)
    position, orientation = kinematics.place(clip)
    names = [name.rsplit("/", 1)[-1] for name in clip.skeleton.joints]
    chosen = [seams[i] for i in np.unique(np.linspace(0, len(seams) - 1, min(most, len(seams))).round().astype(int))]
    figure, axes = plt.subplots(len(chosen), 1, figsize=(16, 2.1 * len(chosen)), squeeze=False)
    for axis, (at_s, title) in zip(axes[:, 0], chosen, strict=True):
        centre = int(np.clip(round(at_s * clip.frame_rate_hz), 0, len(position) - 1))
        turn = rotation.from_heading(-rotation.heading_rad(orientation[centre, 0]))
        for column, offset_s in enumerate(np.linspace(-REACH_S, REACH_S, N_FRAMES)):
            frame = int(np.clip(round((at_s + offset_s) * clip.frame_rate_hz), 0, len(position) - 1))
            seen = rotation.apply(turn, position[frame] - position[centre, 0] * [1, 0, 1])
            for joint, parent in enumerate(clip.skeleton.parent):
                if parent >= 0:
                    x, y = seen[[parent, joint], 0] + 1.3 * column, seen[[parent, joint], 1]
                    side = {"left": "tab:red", "righ": "tab:blue"}.get(names[joint][:4], "black")
                    axis.plot(x, y, color=side, linewidth=1.5)
                if names[joint].endswith("Toes") and seen[joint, 1] < 0.045:
                    axis.plot(seen[joint, 0] + 1.3 * column, seen[joint, 1], "o", color="black", markersize=2.5)
            axis.text(1.3 * column, -0.18, f"{offset_s:+.1f}", fontsize=6, ha="center")
        axis.axhline(0, color="grey", linewidth=0.5)
        axis.set(xlim=(-0.9, 1.3 * N_FRAMES - 0.4), ylim=(-0.25, 2.0), aspect="equal")
        axis.set_title(f"{at_s:.2f} s  {title}", fontsize=8, loc="left", pad=1)
        axis.axis("off")
    figure.tight_layout(pad=0.3)
    figure.savefig(picture, dpi=80)
    plt.close(figure)
    return len(seams)


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    n_seams = draw(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) == 4 else 10)
    sys.stdout.write(f"{n_seams} seams; strips in {sys.argv[2]}\n")
