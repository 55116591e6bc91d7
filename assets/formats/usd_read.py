"""USD stages opened and read back: the dance and where it came from."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from pxr import Tf, Usd, UsdGeom, UsdSkel, Vt

from assets.formats.errors import FormatError
from kernels import rotation
from kernels.types import Clip, Skeleton
from schemas import stage_contract as contract


def read_animation(path: str | Path) -> Clip:
    """Read the dance of a stage back.

    Parameters
    ----------
    path : .usd, .usda, .usdc or .usdz with one animated skeleton, Y up

    Returns
    -------
    Clip
        In metres, on the stage's own joints; one frame a time sample of the rotations.

    Raises
    ------
    FormatError
        If there is no such stage, no bound animation, or the skeleton has no single root.
    """
    stage = open_stage(path)
    if UsdGeom.GetStageUpAxis(stage) != contract.UP_AXIS:
        raise FormatError(str(path), 0, f"upAxis: want {contract.UP_AXIS}, got {UsdGeom.GetStageUpAxis(stage)}")
    query = animated_skeleton(stage)
    if query is None:
        raise FormatError(str(path), 0, "want a skeleton with a bound animation, got none; check skel:animationSource")
    metres = UsdGeom.GetStageMetersPerUnit(stage)
    try:
        skeleton = _read_skeleton(query, metres)
        times = query.GetAnimQuery().GetJointTransformTimeSamples() or [Usd.TimeCode.Default()]
        local = np.array([np.array(query.ComputeJointLocalTransforms(time)) for time in times], np.float64)
        scale = np.linalg.norm(local[..., :3, :3], axis=-1, keepdims=True)
        translation = local[..., 3, :3] * metres
        is_rigid = np.allclose(translation[:, 1:], skeleton.offset_xyz_m[1:], atol=1e-6)
        # USD multiplies rows by matrices: its rotations are the transposes of ours.
        quaternion = rotation.from_matrix(np.swapaxes(local[..., :3, :3] / scale, -1, -2))
        return Clip(
            skeleton,
            stage.GetTimeCodesPerSecond(),
            translation[:, 0],
            rotation.continuous(quaternion),
            None if is_rigid else translation,
        )
    except Tf.ErrorException as error:
        raise FormatError(str(path), 0, f"want an animation, got one USD cannot read: {reason(error)}") from error
    except ValueError as error:
        raise FormatError(str(path), 0, str(error)) from error


def read_provenance(path: str | Path) -> dict[str, object]:
    """Read the provenance of a stage, {} where there is none; lists come back as lists.

    Parameters
    ----------
    path : of a stage

    Raises
    ------
    FormatError
        If the stage cannot be opened.
    """
    stage = open_stage(path)
    root = stage.GetDefaultPrim()
    stored = root.GetCustomDataByKey(contract.PROVENANCE_KEY) if root else None
    return {key: _from_usd(value) for key, value in stored.items()} if isinstance(stored, dict) else {}


def open_stage(path: str | Path) -> Usd.Stage:
    """Open a stage, whatever the file is.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    FormatError
        If it is missing, empty, or not USD.
    """
    if not Path(path).is_file():
        raise FormatError(str(path), 0, "want a file, got none")
    if Path(path).stat().st_size == 0:
        raise FormatError(str(path), 0, "want a USD stage, got an empty file")
    try:
        return Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise FormatError(str(path), 0, f"want a USD stage, got a file USD cannot open: {reason(error)}") from error


def animated_skeleton(stage: Usd.Stage) -> UsdSkel.SkeletonQuery | None:
    """Find the first skeleton under a SkelRoot whose animation can be evaluated.

    Parameters
    ----------
    stage : Usd.Stage

    Returns
    -------
    UsdSkel.SkeletonQuery or None
        None where no skeleton is animated.
    """
    cache = UsdSkel.Cache()
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if not prim.IsA(UsdSkel.Root):
            continue
        root = UsdSkel.Root(prim)
        cache.Populate(root, Usd.TraverseInstanceProxies())
        for binding in cache.ComputeSkelBindings(root, Usd.TraverseInstanceProxies()):
            query = cache.GetSkelQuery(binding.GetSkeleton())
            if query and query.GetAnimQuery():
                return query
    return None


def is_absolute(text: str) -> bool:
    """Whether a text names a place on one machine."""
    return bool(re.match(r"(/|~|\\\\|[A-Za-z]:[\\/]|file:)", text))


def _read_skeleton(query: UsdSkel.SkeletonQuery, metres: float) -> Skeleton:
    """Read joints, parents and rest offsets."""
    paths = [str(path) for path in query.GetJointOrder()]
    names = [str(name) for name in query.GetSkeleton().GetJointNamesAttr().Get() or ()]
    leaves = [path.rsplit("/")[-1] for path in paths]
    if len(names) != len(paths):
        names = leaves if len(set(leaves)) == len(leaves) else paths
    rest = np.array(query.ComputeJointLocalTransforms(Usd.TimeCode.Default(), True), np.float64)
    parent = np.array(query.GetTopology().GetParentIndices(), np.int64)
    return Skeleton(tuple(names), parent, rest[:, 3, :3] * metres)


def _from_usd(value: object) -> object:
    """Turn customData into plain Python."""
    if isinstance(value, dict):
        return {key: _from_usd(item) for key, item in value.items()}
    if isinstance(value, Vt.StringArray | Vt.IntArray | Vt.DoubleArray):
        return list(value)
    return value


def reason(error: Exception) -> str:
    """Return the first thing USD says, without where in USD it says it.

    Parameters
    ----------
    error : of USD

    Returns
    -------
    str
        One line; ``no reason given`` for an error without a word.
    """
    first = next((line for line in str(error).splitlines() if line.strip()), "no reason given")
    return first.split(" : ", 1)[-1].strip().strip("'")
