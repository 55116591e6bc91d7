"""Measure the calibration of suits: speed beside springs, and with --bars the table of accuracies.

    python benchmarks/calibration.py [--frames N] [--repeats R] [--device NAME] [--bars] [--seeds K] [--json]

*Speed*: poses of the same made-up recording by two Gauss-Newton steps on OpenCL (transfers in, compiling out), by the
literal 30-iteration springs compiled with numba, one frame after another on one thread, and by the same loop in plain
Python (timed on some frames). All three in one run; every figure is the median of the repeats after a warm-up, in CPU
seconds of all threads, wall seconds beside. *Whole*: reading the recording from Parquet, cleaning, calibrating, solving
poses. *Linear*: ten times the frames. The figure of [Kitsunai2007], 519 s for 30 iterations on 8 cores of 2006, is
quoted beside: a soft peer.

*Bars*: recordings made as told in docs/calibration.md, with seeds that nothing was tuned on.
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

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

import pyopencl as cl
from calibration_bars import bars
from numba_springs import relax_serial
from threadpoolctl import threadpool_limits

from assets.formats import suit as suit_file
from kernels.calibration.calibrate import calibrate
from kernels.calibration.cleaning import clean
from kernels.calibration.poses import body_model, gaps, solve_poses, to_stream
from kernels.calibration.records import PARENT
from kernels.calibration.springs import relax_frame, spring_body
from kernels.calibration.tree_solver import Stream
from kernels.opencl.choice import pick_device
from kernels.opencl.tree_gauss_newton import TreeGaussNewton
from kernels.synthetic import suit_performer

DOCUMENT_S = 518.8
N_PYTHON_FRAMES = 30


def median(repeats: int, run: Callable[[], object]) -> tuple[float, float, float]:
    """Median CPU and wall seconds of some runs after a warm-up, and the spread of the CPU seconds."""
    run()
    cpu, wall = [], []
    for _ in range(repeats):
        begin, begin_cpu = time.perf_counter(), time.process_time()
        run()
        wall.append(time.perf_counter() - begin)
        cpu.append(time.process_time() - begin_cpu)
    middle = statistics.median(cpu)
    return middle, statistics.median(wall), (max(cpu) - min(cpu)) / middle


def speed(n_frames: int, repeats: int, device: str | None) -> dict[str, float | str]:
    """Figures of speed."""
    made = suit_performer.made_up(1000, n_frames=n_frames)
    begin = time.perf_counter()
    solver = TreeGaussNewton(cl.Context([pick_device(device)]), parent=PARENT)
    build_s = time.perf_counter() - begin
    cleaned = clean(made.recording)
    calibration = calibrate(cleaned)
    model, stream = body_model(calibration), to_stream(cleaned)
    springs = spring_body(model)

    tree_cpu_s, tree_s, tree_spread = median(repeats, lambda: solver(model, stream, iterations=2))
    numba_cpu_s, numba_s, numba_spread = median(repeats, lambda: relax_serial(springs, model.parent, stream, 30))
    some = np.linspace(0, n_frames - 1, N_PYTHON_FRAMES).astype(int)
    begin = time.process_time()
    for k in some:
        relax_frame(springs, model.parent, stream.position_xyz_m[k].tolist(), stream.rotation_wxyz[k].tolist())
    python_cpu_s = (time.process_time() - begin) / len(some) * n_frames

    # is the baseline that of [Kitsunai2007]? its gaps, on the recording as received where every sensor was good
    whole = np.flatnonzero(~cleaned.is_filled.any(axis=1))
    received = Stream(made.recording.position_xyz_m[whole], made.recording.rotation_wxyz[whole], stream.weight[whole])
    spring_gap = {}
    for n in (1, 2, 30):
        solved = relax_serial(springs, model.parent, received, n)
        gap = gaps(model, solved.position_xyz_m, solved.rotation_wxyz)
        spring_gap[n] = float(1000 * np.sqrt(np.mean(gap**2)))

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "recording.parquet"
        path.write_bytes(suit_file.format_parquet(made.recording))

        def everything() -> None:
            read = clean(suit_file.read(path).recording)
            solve_poses(read, calibrate(read), device=solver)

        whole_cpu_s, whole_s, whole_spread = median(repeats, everything)
    ten = Stream(
        *(np.concatenate([part] * 10) for part in (stream.position_xyz_m, stream.rotation_wxyz, stream.weight))
    )
    ten_cpu_s, ten_s, _ = median(repeats, lambda: solver(model, ten, iterations=2))
    return {
        "frames": n_frames,
        "device_name": solver.name,
        "device_build_s": build_s,
        "stage2_cpu_s": tree_cpu_s,
        "stage2_wall_s": tree_s,
        "stage2_spread_ratio": tree_spread,
        "numba_springs_cpu_s": numba_cpu_s,
        "numba_springs_wall_s": numba_s,
        "numba_springs_spread_ratio": numba_spread,
        "python_springs_cpu_s": python_cpu_s,
        "stage2_over_numba_springs_ratio": numba_cpu_s / tree_cpu_s,
        "stage2_over_numba_springs_wall_ratio": numba_s / tree_s,
        "stage2_over_python_springs_ratio": python_cpu_s / tree_cpu_s,
        "document_springs_8_cores_quoted_s": DOCUMENT_S,
        "stage2_over_document_quoted_ratio": DOCUMENT_S / tree_s,
        **{f"springs_gap_after_{n}_mm": gap for n, gap in spring_gap.items()},
        "whole_cpu_s": whole_cpu_s,
        "whole_wall_s": whole_s,
        "whole_spread_ratio": whole_spread,
        "linear_10x_ratio": ten_cpu_s / tree_cpu_s,
        "linear_10x_wall_ratio": ten_s / tree_s,
    }


def main() -> None:
    """Parse the command line, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=suit_performer.N_DOCUMENT_FRAMES)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--device", default=None, help="index or part of a name; default: first GPU, else CPU")
    parser.add_argument("--bars", action="store_true", help="the table of accuracies too: minutes")
    parser.add_argument("--seeds", type=int, default=4, help="recordings a row of the table")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    arguments = parser.parse_args()
    with threadpool_limits(1):  # small matrices: a second thread of linear algebra slows them, and changes last bits
        found = speed(arguments.frames, arguments.repeats, arguments.device)
        if arguments.bars:
            found |= bars(arguments.frames, arguments.seeds, arguments.device)
    if arguments.json:
        print(json.dumps(found))
        return
    for name, value in found.items():
        print(f"{name:44s} {value if isinstance(value, str) else format(value, ',.4g')}")


if __name__ == "__main__":
    main()
