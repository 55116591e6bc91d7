"""``odori calibrate``: one suit recording, without a studio, to joints, poses and BVH.

Loads no Dagster: the answer shall not wait for what it does not need.
"""

import io
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from assets.formats import bvh
from assets.formats.errors import FormatError
from assets.formats.settings_file import read_settings
from assets.sources.calibration import Calibrated, CalibrationError, calibrate_file
from assets.sources.scan import POSES_ENDING
from kernels.calibration.records import JOINTS, Calibration
from pipelines.commands.outcome import DONE, NOTHING_DONE, Outcome
from pipelines.device_fallback import Devices
from pipelines.solvers import PoseSolvers
from pipelines.studio.files import write_beside
from schemas.settings import Settings


def calibrate(
    recording: Path,
    *,
    studio: Path | None,
    bvh_out: Path | None = None,
    poses_out: Path | None = None,
    method: str | None = None,
    iterations: int | None = None,
) -> Outcome:
    """Calibrate one recording.

    Parameters
    ----------
    recording : file
    studio : folder whose ``odori.toml`` counts; None for every default
    bvh_out, poses_out : where to write; None for no BVH, and for a file named after the recording in this folder
    method, iterations : in place of the settings'

    Returns
    -------
    Outcome
        With the faults of a recording among its troubles, and status 2, where there are any.

    Raises
    ------
    FormatError
        If the file is no recording or cannot be opened, or the settings are none.
    LakeError
        If the results cannot be written.
    """
    start_s, cpu_s = time.perf_counter(), time.process_time()
    settings = read_settings(studio / "odori.toml") if studio else Settings()
    chosen = _chosen(settings, method, iterations)
    poses_path = (poses_out or Path(f"{recording.stem}{POSES_ENDING}")).absolute()
    try:
        found = calibrate_file(
            recording,
            settings=chosen.calibration,
            sensors=settings.sensors,
            solvers=PoseSolvers(Devices(settings.opencl.device)),
            max_bytes=int(settings.limits.largest_clip_mb * 1e6),
        )
    except CalibrationError as error:
        return _refusal(recording, error)
    except OSError as error:
        raise FormatError(str(recording), 0, f"cannot be read: {error.strerror or error}; see to the file") from error
    begun_s = time.perf_counter()
    table = poses_table(found)
    write_beside(poses_path, lambda file: file.write(parquet(table)))
    if bvh_out is not None:
        data = bvh.format(found.clip)
        write_beside(bvh_out, lambda file: file.write(data))
    seconds = {
        **found.seconds,
        "write": round(time.perf_counter() - begun_s, 4),
        "total": round(time.perf_counter() - start_s, 4),
        "total_cpu": round(time.process_time() - cpu_s, 4),
    }
    facts: dict[str, Any] = {
        "joints": joint_facts(found.calibration),
        "poses": str(poses_path),
        "seconds": seconds,
        "warnings": list(found.warnings),
    }
    report = _report(recording, found, seconds, poses_path, bvh_out)
    return Outcome(DONE, facts, report, [f"warning: {sentence}" for sentence in found.warnings])


def _chosen(settings: Settings, method: str | None, iterations: int | None) -> Settings:
    said: dict[str, Any] = {}
    if method is not None:
        said["method"] = method
    if iterations is not None:
        said["iterations"] = iterations
    try:
        return replace(settings, calibration=replace(settings.calibration, **said))
    except ValueError as error:
        raise FormatError("odori calibrate", 0, f"--{error}") from error


def _refusal(recording: Path, error: CalibrationError) -> Outcome:
    """Report every fault; facts have what was found of the other joints."""
    faults = [
        {"severity": f.severity, "sensor": f.sensor, "frame_index": f.frame_index, "sentence": f.sentence}
        for f in error.findings
    ]
    facts: dict[str, Any] = {
        "error": str(error),
        "faults": faults,
        "warnings": [f.sentence for f in error.findings if f.severity == "warning"],
    }
    if error.calibration is not None:
        facts |= {"joints": joint_facts(error.calibration), "poses": None, "seconds": error.seconds}
    report = ""
    if error.calibration is not None:
        report = "\n".join(_joint_lines(error.calibration))
    return Outcome(NOTHING_DONE, facts, report, [f"{f['severity']}: {recording.name}: {f['sentence']}" for f in faults])


def joint_facts(calibration: Calibration) -> list[dict[str, Any]]:
    """List the joints as ``--json`` prints them."""
    return [
        {
            "joint": joint.joint,
            "parent": joint.parent,
            "length_m": float(joint.length_m),
            "in_parent_sensor_m": [float(x) for x in joint.in_parent_sensor_m],
            "in_child_sensor_m": [float(x) for x in joint.in_child_sensor_m],
            "confidence": joint.confidence,
            "rank": int(joint.rank),
        }
        for joint in calibration.joints
    ]


def poses_table(found: Calibrated) -> pa.Table:
    """Lay out joint centres in the recording's own world, one row a frame and joint, frames as numbered in the file."""
    place = found.poses.position_xyz_m[:, 1:]
    f, j = place.shape[:2]
    frame = np.repeat(np.arange(f, dtype=np.int32) + found.suit.first_frame_index, j)
    names = pa.DictionaryArray.from_arrays(pa.array(np.tile(np.arange(j, dtype=np.int32), f)), pa.array(JOINTS))
    flat = place.reshape(-1, 3)
    columns = {"frame_index": pa.array(frame, pa.int32()), "joint": names.cast(pa.string())}
    return pa.table(columns | {f"{axis}_m": pa.array(flat[:, k]) for k, axis in enumerate("xyz")})


def parquet(table: pa.Table) -> bytes:
    """Write a table as Parquet."""
    sink = io.BytesIO()
    pq.write_table(table, sink, compression="zstd", use_dictionary=["frame_index", "joint"])
    return sink.getvalue()


def _report(recording: Path, found: Calibrated, seconds: dict[str, float], poses: Path, bvh_out: Path | None) -> str:
    own, cleaned = found.suit.recording, found.cleaned
    before = 1000 * float(np.sqrt(np.mean(found.poses.gap_before_m**2)))
    after = 1000 * float(found.poses.gap_after_m.max(initial=0.0))
    n_outliers, n_missing = int(cleaned.n_outliers.sum()), int((~own.is_valid).sum())
    n = max(own.is_valid.size, 1)
    lines = [
        f"{recording.name}: {own.n_frames} frames, {own.n_frames / own.frame_rate_hz:.1f} s at "
        f"{own.frame_rate_hz:g} Hz; {100 * n_missing / n:.1f} % missing, {100 * n_outliers / n:.1f} % outliers; noise "
        f"{1000 * float(np.median(cleaned.position_noise_m)):.1f} mm, "
        f"{np.degrees(float(np.median(cleaned.rotation_noise_rad))):.2f} deg",
        *(f"  {note}" for note in found.suit.notes),
        *_joint_lines(found.calibration),
        f"gaps at the joints: {before:.1f} mm before, at most {after:.2g} mm after",
        f"poses: {poses}" + (f"; BVH: {bvh_out}" if bvh_out else ""),
        f"{seconds['total']:.1f} s",
    ]
    return "\n".join(lines)


def _joint_lines(calibration: Calibration) -> list[str]:
    lines = [f"  {'joint':<12} {'parent':<12} {'bone, mm':>8}  {'residual, mm':>12}  confidence"]
    for joint in calibration.joints:
        length_mm, residual_mm = 1000 * joint.length_m, 1000 * joint.residual_rms_m
        line = f"  {joint.joint:<12} {joint.parent:<12} {length_mm:8.1f}  {residual_mm:12.1f}  {joint.confidence}"
        lines.append(f"{line}: {joint.advice}" if joint.advice else line)
    return lines
