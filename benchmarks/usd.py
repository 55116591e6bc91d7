"""Time a stage of 22 joints x 3600 frames: ours beside USD's usual way of one attr.Set a frame, in one run.

    python benchmarks/usd.py [--frames N] [--repeats N] [--json]

"animation" is what is authored and written of the SkelAnimation alone; "whole stage" adds skeleton, body, looks,
extents and provenance. Each figure is the median of the repeats, the ways taking turns.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdSkel, Vt

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from assets.formats import usd, usd_check, usd_package, usd_read
from kernels import rotation
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.types import Clip
from schemas import stage_contract as contract


def made_up_clip(n_frames: int) -> Clip:
    """Smooth turns of every joint that never repeat: arrays that are equal would be written once."""
    time_s = np.arange(n_frames) / 60
    rng = np.random.default_rng(0)
    turn = rng.uniform(0.1, 0.8, (22, 3)) * np.sin(rng.uniform(1, 9, (22, 3)) * time_s[:, None, None])
    root = np.stack([np.sin(time_s), 0.94 + 0.05 * np.cos(5 * time_s), 0.1 * time_s], -1)
    return Clip(CANONICAL, 60.0, root, rotation.continuous(rotation.exp(turn)))


def ours(path: Path, clip: Clip) -> None:
    """Sdf time samples in one change block."""
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    with Sdf.ChangeBlock():
        usd.write_animation(layer, clip)
    usd.save(layer, path)


def by_attribute(path: Path, clip: Clip) -> None:
    """Call attr.Set once a frame, from the same arrays."""
    stage = Usd.Stage.CreateInMemory(".usdc")
    animation = UsdSkel.Animation.Define(stage, contract.ANIMATION_PATH)
    animation.CreateJointsAttr(usd.joint_paths(clip.skeleton))
    animation.CreateScalesAttr([Gf.Vec3h(1, 1, 1)] * len(JOINTS))
    rotations, translations = animation.CreateRotationsAttr(), animation.CreateTranslationsAttr()
    imaginary_first = np.ascontiguousarray(np.roll(clip.rotation_wxyz, -1, axis=-1), np.float32)
    moved = np.tile(clip.skeleton.offset_xyz_m.astype(np.float32), (clip.n_frames, 1, 1))
    moved[:, 0] = clip.root_xyz_m
    for frame in range(clip.n_frames):
        rotations.Set(Vt.QuatfArray.FromNumpy(imaginary_first[frame]), frame)
        translations.Set(Vt.Vec3fArray.FromNumpy(moved[frame]), frame)
    stage.GetRootLayer().Export(str(path))


def measure(n_frames: int, n_repeats: int) -> dict[str, float]:
    """Figures by name; the names end in their unit."""
    clip = made_up_clip(n_frames)
    with tempfile.TemporaryDirectory() as folder:
        stage, package = Path(folder) / "a.usdc", Path(folder) / "a.usdz"
        ways: dict[str, Callable[[], object]] = {
            "animation_ours_s": lambda: ours(Path(folder) / "ours.usdc", clip),
            "animation_attr_set_s": lambda: by_attribute(Path(folder) / "attr.usdc", clip),
            "whole_stage_s": lambda: usd.write_stage(stage, clip, provenance={"seed": 0}),
            "package_s": lambda: usd_package.write_package(package, stage),
            "read_back_s": lambda: usd_read.read_animation(stage),
            "inspect_s": lambda: usd_check.inspect(stage),
        }
        taken_s: dict[str, list[float]] = {name: [] for name in ways}
        for repeat in range(n_repeats + 1):
            for name, way in ways.items():
                start_s = time.perf_counter()
                way()
                if repeat:  # the first round loads plug-ins
                    taken_s[name].append(time.perf_counter() - start_s)
        figures = {name: statistics.median(values) for name, values in taken_s.items()}
        figures["animation_attr_set_over_ours_ratio"] = figures["animation_attr_set_s"] / figures["animation_ours_s"]
        figures |= {"joint_count": len(JOINTS), "frame_count": n_frames, "stage_bytes": stage.stat().st_size}
    return figures


def main() -> None:
    """Print a table, or one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=3600)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    figures = measure(options.frames, options.repeats)
    if options.json:
        print(json.dumps(figures))
        return
    for name, value in figures.items():
        print(f"{name:36} {value:14,.4f}" if isinstance(value, float) else f"{name:36} {value:14,}")


if __name__ == "__main__":
    main()
