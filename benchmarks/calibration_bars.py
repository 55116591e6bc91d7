"""The table of accuracies of the calibration, on made-up recordings: the second half of calibration.py."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pyopencl as cl

from kernels import rotation
from kernels.calibration.calibrate import calibrate
from kernels.calibration.cleaning import clean
from kernels.calibration.faults import check_recording
from kernels.calibration.pairs import pair_costs, spanning_tree
from kernels.calibration.poses import body_model, solve_poses, to_stream
from kernels.calibration.records import JOINTS, PARENT, SENSORS, Calibration, Cleaned, Recording, RecordingFinding
from kernels.calibration.tree_solver import solve_tree
from kernels.opencl.choice import pick_device
from kernels.opencl.spring_relaxation import SpringRelaxation
from kernels.opencl.tree_gauss_newton import TreeGaussNewton
from kernels.synthetic import suit_performer
from kernels.synthetic.suit_faults import FAULTS
from kernels.types import Float

FIRST_SEED = 2000
_MM = 1000.0
_DEGREE = float(np.radians(1.0))
Figures = dict[str, float | str]


def lengths(in_parent_m: Float, in_child_m: Float) -> Float:
    """Distances between the joints on each segment, (19,) metres: what no choice of bone frames changes."""
    found = []
    for s in range(len(SENSORS)):
        points = [in_child_m[s - 1]] if s else []
        points += [in_parent_m[c - 1] for c in range(1, len(SENSORS)) if PARENT[c] == s]
        found += [float(np.linalg.norm(a - b)) for a, b in combinations(points, 2)]
    return np.array(found)


def anchor_errors_mm(found: Calibration, body: suit_performer.SyntheticBody) -> Float:
    """Error of each joint, (16,), the larger of its two sensors' views."""
    return _MM * np.maximum(
        np.linalg.norm(found.in_parent_sensor_m - body.in_parent_sensor_m, axis=1),
        np.linalg.norm(found.in_child_sensor_m - body.in_child_sensor_m, axis=1),
    )


def length_errors_mm(found: Calibration, body: suit_performer.SyntheticBody) -> Float:
    """Error of each length, (19,)."""
    truth = lengths(body.in_parent_sensor_m, body.in_child_sensor_m)
    return _MM * np.abs(lengths(found.in_parent_sensor_m, found.in_child_sensor_m) - truth)


def bars(n_frames: int, n_seeds: int, device: str | None) -> Figures:
    """Figures of every row but speed, numbered as in docs/calibration.md."""
    context = cl.Context([pick_device(device)])
    seeds = range(FIRST_SEED, FIRST_SEED + n_seeds)
    return {
        **_accuracy(n_frames, seeds),
        **_hinges(n_frames, seeds),
        **_frozen(n_frames, seeds),
        **_topology(n_frames, seeds),
        **_poses(n_frames, seeds, context),
        **_twins(n_frames, context, device),
        **_faults(n_frames, seeds),
    }


def _made(seed: int, n_frames: int, **how: float) -> tuple[suit_performer.MadeUp, Cleaned, Calibration]:
    made = suit_performer.made_up(seed, n_frames=n_frames, disturbance=suit_performer.Disturbance(**how))
    cleaned = clean(made.recording)
    return made, cleaned, calibrate(cleaned)


def _accuracy(n_frames: int, seeds: range) -> Figures:
    found: Figures = {}
    rows: dict[str, dict[str, float]] = {
        "row01_clean": dict.fromkeys(("position_m", "rotation_rad", "outlier_ratio", "dropped_ratio"), 0.0),
        "row02_2mm_1deg": {},
        "row03_5mm_2deg": {"position_m": 0.005, "rotation_rad": 2 * _DEGREE},
        "row04_wobble_5mm": {"wobble_m": 0.005},
        "row05_wobble_10mm": {"wobble_m": 0.010},
        "row06_outliers_5pct_dropped_2pct": {"outlier_ratio": 0.05, "dropped_ratio": 0.02},
    }
    for row, how in rows.items():
        length, anchor, is_high = [], [], []
        for seed in seeds:
            made, _, calibration = _made(seed, n_frames, **how)
            length.append(length_errors_mm(calibration, made.body))
            anchor.append(anchor_errors_mm(calibration, made.body))
            is_high.append([joint.confidence == "high" for joint in calibration.joints])
        lengths_mm, anchors_mm = np.concatenate(length), np.concatenate(anchor)
        high = np.concatenate(is_high)
        found |= {
            f"{row}_length_median_mm": float(np.median(lengths_mm)),
            f"{row}_length_p90_mm": float(np.quantile(lengths_mm, 0.9)),
            f"{row}_length_max_mm": float(lengths_mm.max()),
            f"{row}_anchor_p90_mm": float(np.quantile(anchors_mm, 0.9)),
            f"{row}_anchor_max_mm": float(anchors_mm.max()),
            f"{row}_high_count": int(high.sum()),
            f"{row}_high_anchor_max_mm": float(anchors_mm[high].max(initial=0.0)),
            f"{row}_high_and_off_30mm_count": int((high & (anchors_mm > 30)).sum()),
        }
    return found


def _hinges(n_frames: int, seeds: range) -> Figures:
    """Knees that are exact hinges about the y axis of the shank."""
    wrong, across, far, length = 0, [0.0], [0.0], []
    knees = ("l_shank", "r_shank")
    for seed in seeds:
        made = suit_performer.made_up(seed, n_frames=n_frames, hinged=knees)
        found = calibrate(clean(made.recording))
        wrong += sum((joint.rank != 3) != (joint.joint in knees) for joint in found.joints)
        for name in knees:
            k = JOINTS.index(name)
            axis = rotation.apply(rotation.inv(made.body.mount_wxyz[k + 1]), np.array([0.0, 1.0, 0.0]))
            off = found.in_child_sensor_m[k] - made.body.in_child_sensor_m[k]
            across.append(_MM * float(np.linalg.norm(off - axis * (off @ axis))))
        far.append(float(np.abs([found.in_parent_sensor_m, found.in_child_sensor_m]).max()))
        length.append(length_errors_mm(found, made.body)[_lengths_without(knees)])
    return {
        "row07_hinge_wrong_rank_count": wrong,
        "row07_hinge_across_axis_max_mm": max(across),
        "row07_hinge_other_length_max_mm": float(np.concatenate(length).max()),
        "row07_hinge_largest_m": max(far),
    }


def _lengths_without(joints: tuple[str, ...]) -> list[int]:
    """List the lengths that end at none of some joints."""
    ends = []
    for s in range(len(SENSORS)):
        points = ([SENSORS[s]] if s else []) + [SENSORS[c] for c in range(1, len(SENSORS)) if PARENT[c] == s]
        ends += list(combinations(points, 2))
    return [k for k, pair in enumerate(ends) if not set(pair) & set(joints)]


def _frozen(n_frames: int, seeds: range) -> Figures:
    named, length = 0, []
    for seed in seeds:
        made = suit_performer.made_up(seed, n_frames=n_frames, frozen=("head",))
        found = calibrate(clean(made.recording))
        errors = [one for one in found.findings if one.severity == "error"]
        named += [one.sensor for one in errors] == ["head"] and found.joints[JOINTS.index("head")].rank < 2
        length.append(length_errors_mm(found, made.body)[_lengths_without(("head",))])
    pooled = np.concatenate(length)
    return {
        "row08_frozen_named_ratio": named / len(seeds),
        "row08_frozen_other_length_median_mm": float(np.median(pooled)),
        "row08_frozen_other_length_max_mm": float(pooled.max()),
    }


def _topology(n_frames: int, seeds: range) -> Figures:
    truth = sorted((PARENT[k], k) for k in range(1, len(PARENT)))
    found: Figures = {}
    for name, how in (
        ("2mm_1deg", {}),
        ("5mm_2deg", {"position_m": 0.005, "rotation_rad": 2 * _DEGREE}),
        ("wobble_5mm", {"wobble_m": 0.005}),
        ("wobble_8mm", {"wobble_m": 0.008}),
    ):
        wrong = 0
        for seed in seeds:
            made = suit_performer.made_up(seed, n_frames=n_frames, disturbance=suit_performer.Disturbance(**how))
            cleaned = clean(made.recording)
            whole = ~cleaned.is_filled.any(axis=1)
            turned = rotation.to_matrix(np.moveaxis(cleaned.recording.rotation_wxyz[whole], 1, 0))
            place = np.moveaxis(cleaned.recording.position_xyz_m[whole], 1, 0)
            wrong += len(set(spanning_tree(pair_costs(turned, place))) - set(truth))
        found[f"row09_topology_{name}_wrong_edge_count"] = wrong
    return found


def _poses(n_frames: int, seeds: range, context: cl.Context) -> Figures:
    single = TreeGaussNewton(context, parent=PARENT)
    double = TreeGaussNewton(context, parent=PARENT, precision="double")
    joint, sensor, turn, gap_single, gap_double, late = [], [], [], [0.0], [0.0], [0.0]
    ends = [SENSORS.index(name) for name in ("head", "l_hand", "r_hand", "l_foot", "r_foot")]
    for seed in seeds:
        made, cleaned, calibration = _made(seed, n_frames)
        poses = solve_poses(cleaned, calibration, device=single)
        gap_single.append(float(poses.gap_after_m.max()))
        gap_double.append(float(solve_poses(cleaned, calibration, device=double).gap_after_m.max()))
        joint.append(np.linalg.norm(poses.position_xyz_m[:, 1:] - made.joint_xyz_m[:, 1:], axis=-1).ravel())
        turn.append(rotation.angle_between(poses.rotation_wxyz, made.sensor_wxyz).ravel())
        model = body_model(calibration)
        at = poses.position_xyz_m[:, ends] + rotation.apply(poses.rotation_wxyz[:, ends], model.sensor_m[ends])
        sensor.append(np.linalg.norm(at - made.sensor_xyz_m[:, ends], axis=-1).ravel())
        stream = to_stream(cleaned)
        whole = ~cleaned.is_filled.any(axis=1)
        two, ten = (double(model, stream, iterations=n).position_xyz_m[whole] for n in (2, 10))
        late.append(float(np.abs(two - ten).max()))
    joints, sensors, turns = (np.concatenate(part) for part in (joint, sensor, turn))
    return {
        "row10_gap_double_max_m": max(gap_double),
        "row10_gap_single_max_m": max(gap_single),
        "row11_joint_rms_mm": _MM * float(np.sqrt(np.mean(joints**2))),
        "row11_joint_p99_mm": _MM * float(np.quantile(joints, 0.99)),
        "row11_end_sensor_rms_mm": _MM * float(np.sqrt(np.mean(sensors**2))),
        "row11_rotation_rms_deg": float(np.degrees(np.sqrt(np.mean(turns**2)))),
        "row12_step_2_to_10_max_mm": _MM * max(late),
    }


_CHILD = """
import sys
sys.path.insert(0, sys.argv[1]); sys.path.insert(0, sys.argv[1] + "/benchmarks")
from calibration_bars import digest
print(digest(int(sys.argv[2]), sys.argv[3] or None))
"""


def digest(n_frames: int, device: str | None) -> str:
    """Hash what both device kernels make of one recording."""
    context = cl.Context([pick_device(device)])
    _, cleaned, calibration = _made(FIRST_SEED, n_frames)
    model, stream = body_model(calibration), to_stream(cleaned)
    bits = hashlib.sha256()
    for solver, iterations in (
        (TreeGaussNewton(context, parent=PARENT), 2),
        (TreeGaussNewton(context, parent=PARENT, precision="double"), 2),
        (SpringRelaxation(context, parent=PARENT), 30),
    ):
        solved = solver(model, stream, iterations=iterations)
        bits.update(solved.position_xyz_m.tobytes() + solved.rotation_wxyz.tobytes())
    return bits.hexdigest()


def _twins(n_frames: int, context: cl.Context, device: str | None) -> Figures:
    _, cleaned, calibration = _made(FIRST_SEED, n_frames)
    model, stream = body_model(calibration), to_stream(cleaned)
    reference = solve_tree(model, stream, iterations=2)
    found: Figures = {}
    for precision in ("double", "single"):
        solved = TreeGaussNewton(context, parent=PARENT, precision=precision)(model, stream, iterations=2)
        off = np.abs(solved.position_xyz_m - reference.position_xyz_m).max()
        turned = np.abs(rotation.to_matrix(solved.rotation_wxyz) - rotation.to_matrix(reference.rotation_wxyz)).max()
        found |= {f"row13_{precision}_max_mm": _MM * float(off), f"row13_{precision}_rotation_max": float(turned)}
    one = SpringRelaxation(context, parent=PARENT, is_serial=True)(model, stream, iterations=30)
    all_ = SpringRelaxation(context, parent=PARENT)(model, stream, iterations=30)
    is_same = (one.position_xyz_m == all_.position_xyz_m).all() and (one.rotation_wxyz == all_.rotation_wxyz).all()
    root = str(Path(__file__).resolve().parents[1])
    digests = set()
    for threads in ("1", "2", "2"):
        environment = os.environ | {
            "POCL_MAX_PTHREAD_COUNT": threads,
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }
        command = [sys.executable, "-c", _CHILD, root, str(n_frames), device or ""]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        digests.add(done.stdout.split()[-1])
    return found | {"row14_springs_serial_is_parallel": float(is_same), "row14_distinct_digest_count": len(digests)}


def judge(recording: Recording) -> tuple[RecordingFinding, ...]:
    """Everything odori says about a recording's arrays."""
    if recording.sensors != SENSORS:
        return check_recording(recording)
    return calibrate(clean(recording)).findings


def _faults(n_frames: int, seeds: range) -> Figures:
    def is_named(found: tuple[RecordingFinding, ...], severity: str, sensor: str | None, words: str) -> bool:
        return any(one.severity == severity and one.sensor == sensor and words in one.sentence for one in found)

    missed: list[str] = []
    for seed in seeds:
        recording = suit_performer.made_up(seed, n_frames=n_frames).recording
        for name, fault in FAULTS.items():
            if not is_named(judge(fault.spoil(recording)), fault.severity, fault.sensor, fault.words):
                missed.append(f"{name} (seed {seed})")
    false_alarms = 0
    for seed in seeds:
        for wobble_m in (0.0, 0.005, 0.012):
            made = suit_performer.made_up(
                seed, n_frames=n_frames, disturbance=suit_performer.Disturbance(wobble_m=wobble_m)
            )
            false_alarms += len(judge(made.recording))
    return {
        "row18_fault_count": len(FAULTS) * len(seeds),
        "row18_missed_count": len(missed),
        "row18_missed": "; ".join(missed) or "none",
        "row18_false_alarm_count": false_alarms,
    }
