"""Time whole BVH files to arrays, to clips and to the canonical skeleton, beside NumPy's readers of the numbers alone.

    python benchmarks/bvh.py [FILE_OR_FOLDER ...] [--repeats N] [--json]

Folders are searched for .bvh files. Without any, the real dances and labelled takes are read where there are some (in
ODORI_TEST_DATA, else beside the checkout), else made-up takes from a temporary folder. Each figure is the best of the
repeats in CPU time of one core, the ways taking turns; MB are 10^6 bytes of whole files, also for the readers that get
the numbers alone. "kframes" are 1000 frames.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from assets.formats import bvh
from kernels.skeleton.retarget import retarget
from kernels.synthetic import dancer


def made_up_files(folder: Path) -> list[Path]:
    """Write takes of the made-up dancer, 20 to 60 s at 60 Hz."""
    paths = []
    for k, label in enumerate(dancer.MOVES):
        clip = dancer.take(label, n_beats=40 + 10 * k, frame_rate_hz=60.0).clip
        paths.append(folder / f"{label}.bvh")
        paths[-1].write_bytes(bvh.format(clip))
    return paths


def real_folders() -> list[Path]:
    """List the folders of real dances and labelled takes that there are."""
    data = Path(os.environ.get("ODORI_TEST_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    return [folder for folder in (data / "bvh_dance", data / "bvh_labelled") if folder.is_dir()]


def numbers_of(path: Path) -> str:
    """Read what stands after the frame time."""
    return path.read_bytes().split(b"Frame Time")[1].split(b"\n", 1)[1].replace(b"\r", b"").decode("latin-1")


def measure(paths: list[Path], n_repeats: int) -> dict[str, float]:
    """Figures by name; the names end in their unit."""
    blocks = [numbers_of(path) for path in paths]
    files = [bvh.read(path) for path in paths]
    takes = [take for take in map(bvh.to_clip, files) if take.mapping is not None]
    for file, block in zip(files, blocks, strict=True):
        if not np.array_equal(file.values.ravel(), [float(word) for word in block.split()]):
            raise SystemExit("values differ from Python's float of their text")
    ways: dict[str, Callable[[], object]] = {
        "whole_file": lambda: [bvh.read(path) for path in paths],
        "whole_file_to_clip": lambda: [bvh.to_clip(bvh.read(path)) for path in paths],
        "loadtxt_block": lambda: [np.loadtxt(io.StringIO(block)) for block in blocks],
        "fromstring_block": lambda: [np.fromstring(block, sep=" ") for block in blocks],
        "retarget": lambda: [retarget(take.clip, take.mapping) for take in takes if take.mapping is not None],
    }
    best_s = dict.fromkeys(ways, np.inf)
    for _ in range(n_repeats):
        for name, way in ways.items():
            start = time.process_time()
            way()
            best_s[name] = min(best_s[name], time.process_time() - start)
    size_mb = sum(path.stat().st_size for path in paths) / 1e6
    n_frames = sum(take.clip.n_frames for take in takes)
    figures = {f"{name}_mb_per_s": size_mb / best_s[name] for name in ways if name != "retarget"}
    return {
        "files": float(len(paths)),
        "size_mb": size_mb,
        **figures,
        "whole_file_over_loadtxt_block_ratio": best_s["loadtxt_block"] / best_s["whole_file"],
        "whole_file_over_fromstring_block_ratio": best_s["fromstring_block"] / best_s["whole_file"],
        "retarget_kframes_per_s": n_frames / best_s["retarget"] / 1e3,
        "whole_way_ms_per_150_frames": 150e3 * (best_s["whole_file_to_clip"] + best_s["retarget"]) / max(n_frames, 1),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="*", type=Path)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    paths = arguments.paths or real_folders()
    with tempfile.TemporaryDirectory() as folder:
        found = [file for path in paths for file in (sorted(path.rglob("*.bvh")) if path.is_dir() else [path])]
        figures = measure(found or made_up_files(Path(folder)), arguments.repeats)
    if arguments.json:
        print(json.dumps(figures))
        return
    for name, value in figures.items():
        print(f"{name:45}{value:10.2f}")


if __name__ == "__main__":
    main()
