"""The stage contract as rules: what every stage must have, and the sentence for one that has not."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Ar, Usd, UsdGeom, UsdMedia, UsdSkel

from assets.formats import usd_lineage, usd_read
from kernels.skeleton.canonical import JOINTS, REQUIRED_JOINTS
from kernels.types import Float
from schemas import stage_contract as contract

_UNIT_ATOL = 1e-3
_PLACE_ATOL_M = 1e-4
"""How far from 1 lengths and sums of weights may be, and a joint from where its rest pose has it. Chosen by hand."""


@dataclass(frozen=True)
class StageFinding:
    """One thing to say of a stage.

    Parameters
    ----------
    severity : "error", "warning" or "note"
        An error breaks the contract or USD's rules; the stage may fail to open somewhere.
    rule : identifier of the rule
    prim_path : where in the stage; "" for the stage or file as a whole
    sentence : what was wanted, what came
    """

    severity: str
    rule: str
    prim_path: str
    sentence: str


def _stage(stage: Usd.Stage) -> Iterator[StageFinding]:
    """Ask for axis, unit, rate and range."""
    up = UsdGeom.GetStageUpAxis(stage)
    if not stage.HasAuthoredMetadata("upAxis") or up != contract.UP_AXIS:
        yield _error("up-axis", "", f"upAxis: want {contract.UP_AXIS}, got {_authored(stage, 'upAxis')}")
    metres = UsdGeom.GetStageMetersPerUnit(stage)
    if not stage.HasAuthoredMetadata("metersPerUnit") or metres != contract.METERS_PER_UNIT:
        yield _error("unit", "", f"metersPerUnit: want 1, got {_authored(stage, 'metersPerUnit')}")
    rates = [_authored(stage, "timeCodesPerSecond"), _authored(stage, "framesPerSecond")]
    if "nothing" in rates or rates[0] != rates[1] or not stage.GetTimeCodesPerSecond() > 0:
        yield _error(
            "rate", "", f"timeCodesPerSecond, framesPerSecond: want one rate for both, got {' and '.join(rates)}"
        )
    if not stage.HasAuthoredTimeCodeRange():
        yield _error("range", "", "startTimeCode, endTimeCode: want both, got none or one")
    elif stage.GetStartTimeCode() != contract.START_TIME_CODE or stage.GetEndTimeCode() < contract.START_TIME_CODE:
        span = f"{stage.GetStartTimeCode():g} to {stage.GetEndTimeCode():g}"
        yield _error("range", "", f"startTimeCode, endTimeCode: want 0 and not less, got {span}")


def _root(stage: Usd.Stage) -> Iterator[StageFinding]:
    """Ask for a SkelRoot to start from."""
    prim = stage.GetDefaultPrim()
    if not prim or not (prim.IsA(UsdSkel.Root) or _cast(stage)):
        got = f"a {prim.GetTypeName() or 'prim without type'} at {prim.GetPath()}" if prim else "none"
        yield _error("default-prim", str(prim.GetPath()) if prim else "", f"defaultPrim: want a SkelRoot, got {got}")
    root = _skel_root(stage)
    if root is None:
        yield _error("skel-root", "", "SkelRoot: want one, got none; this is no character animation")
        return
    if not root.HasAPI(UsdSkel.BindingAPI):
        yield _error("binding-api", str(root.GetPath()), "SkelBindingAPI: want it applied to the SkelRoot, got it not")
    whole = prim if _cast(stage) else root
    if Usd.ModelAPI(whole).GetKind() != "component":
        got = Usd.ModelAPI(whole).GetKind() or "nothing"
        yield _warning("kind", str(whole.GetPath()), f"kind: want component, got {got}")
    if not UsdGeom.Boundable(root).GetExtentAttr().HasAuthoredValue():
        yield _warning("extent", str(root.GetPath()), "extent: want one over the whole dance, got none")


def _skeleton(stage: Usd.Stage) -> Iterator[StageFinding]:
    """Ask for joints, rest and bind poses, and the animation they are bound to."""
    root = _skel_root(stage)
    if root is None:
        return
    skeletons = [prim for prim in Usd.PrimRange(root) if prim.IsA(UsdSkel.Skeleton)]
    if _cast(stage):
        skeletons = [prim for prim in skeletons if str(prim.GetPath()) == _cast(stage)["skeleton"]]
    if len(skeletons) != 1:
        yield _error("skeleton", str(root.GetPath()), f"Skeleton: want one under the SkelRoot, got {len(skeletons)}")
    if not skeletons:
        return
    skeleton, where = UsdSkel.Skeleton(skeletons[0]), str(skeletons[0].GetPath())
    joints = [str(joint) for joint in skeleton.GetJointsAttr().Get() or ()]
    leaves = [joint.rsplit("/")[-1] for joint in joints]
    cast = _cast(stage)
    missing = [joint for joint in JOINTS if joint not in leaves]
    if cast:
        missing = sorted(name for name in REQUIRED_JOINTS if cast["joints"].get(name) not in joints)
        if missing:
            yield _error("joints", where, f"joints: want the character's own of each part, got no {', '.join(missing)}")
    elif missing:
        got = f"{len(joints)} joints and none of those" if len(missing) == len(JOINTS) else f"no {', '.join(missing)}"
        yield _error("joints", where, f"joints: want the {len(JOINTS)} VRM names, got {got}")
    is_ordered, why = UsdSkel.Topology(joints).Validate()
    if not is_ordered:
        yield _error("joints", where, f"joints: want parents before children, got: {why}")
        return
    if not cast:  # rest and bind pose of a character are its file's own
        yield from _rest(stage, skeleton, joints, where)
    if not skeletons[0].HasAPI(UsdSkel.BindingAPI):
        yield _error(
            "binding-api", where, "SkelBindingAPI: want it applied to the Skeleton, got it not; no reader animates"
        )
    source = _animation_prim(stage)
    if source is None:
        yield _error("animation", where, "skel:animationSource: want a SkelAnimation, got none bound")


def _rest(stage: Usd.Stage, skeleton: UsdSkel.Skeleton, joints: list[str], where: str) -> Iterator[StageFinding]:
    """Ask for a rest pose that is the bind pose, and turns and moves joints only."""
    rest = _matrices(skeleton.GetRestTransformsAttr())
    bind = _matrices(skeleton.GetBindTransformsAttr())
    for name, matrix in (("restTransforms", rest), ("bindTransforms", bind)):
        if matrix.shape != (len(joints), 4, 4) or not _is_rigid(matrix):
            yield _error("rest", where, f"{name}: want a rotation and a place a joint, got {_shape(matrix)}")
            return
    world = rest.copy()
    for k, parent in enumerate(UsdSkel.Topology(joints).GetParentIndices()):
        world[k] = rest[k] @ world[parent] if parent >= 0 else rest[k]
    apart_m = float(np.abs(world - bind).max(initial=0.0)) * UsdGeom.GetStageMetersPerUnit(stage)
    if apart_m > _PLACE_ATOL_M:
        yield _warning("bind", where, f"bindTransforms: want the rest pose in the world, got one {apart_m:.2g} apart")


def _animation(stage: Usd.Stage) -> Iterator[StageFinding]:
    """Ask for the samples of the dance: order, number, times and values."""
    prim, root = _animation_prim(stage), _skel_root(stage)
    if prim is None or root is None:
        return
    animation, where = UsdSkel.Animation(prim), str(prim.GetPath())
    joints = list(animation.GetJointsAttr().Get() or ())
    skeleton = _skeleton_prim(stage)
    if skeleton is None or joints != list(UsdSkel.Skeleton(skeleton).GetJointsAttr().Get() or ()):
        yield _error(
            "joint-order", where, "joints: want those of the Skeleton in its order, got others or another order"
        )
    span = np.arange(stage.GetStartTimeCode(), stage.GetEndTimeCode() + 1)
    for attribute, width in ((animation.GetRotationsAttr(), 4), (animation.GetTranslationsAttr(), 3)):
        name, times = attribute.GetName(), np.array(attribute.GetTimeSamples())
        if not np.array_equal(times, span):
            yield _error("samples", where, f"{name}: want one sample a time code {_span(span)}, got {_span(times)}")
        values = [np.array(attribute.Get(time)) for time in times] or [np.array(attribute.Get())]
        odd = next((k for k, value in enumerate(values) if value.shape != (len(joints), width)), None)
        if odd is not None:
            got = _shape(values[odd])
            yield _error("samples", where, f"{name}: want {len(joints)} values a sample, got {got} in sample {odd}")
            continue
        stacked = np.array(values, np.float64)
        if not np.isfinite(stacked).all():
            yield _error("samples", where, f"{name}: want finite numbers, got a NaN or infinity")
        elif width == 4:
            yield from _rotations(stacked, joints, where)
    scales = np.array(animation.GetScalesAttr().Get(), np.float64)
    if scales.shape != (len(joints), 3) or not (_cast(stage) or (scales == 1).all()):
        yield _warning("scales", where, f"scales: want 1 for every joint, got {_shape(scales)}")


def _rotations(quaternion: Float, joints: list[str], where: str) -> Iterator[StageFinding]:
    """Ask for unit length, and no change of sign from sample to sample."""
    length = np.linalg.norm(quaternion, axis=-1)
    if np.abs(length - 1).max() > _UNIT_ATOL:
        f, j = np.unravel_index(np.abs(length - 1).argmax(), length.shape)
        got = f"length {length[f, j]:.4g} in sample {f}, joint {joints[j]}"
        yield _error("unit-quaternions", where, f"rotations: want unit quaternions, got {got}")
    n_flips = int((np.sum(quaternion[1:] * quaternion[:-1], axis=-1) < 0).sum())
    if n_flips:
        got = f"{n_flips} changes of sign; readers that blend components will spin there"
        yield _warning("hemisphere", where, f"rotations: want each near the one before, got {got}")


def _body(stage: Usd.Stage) -> Iterator[StageFinding]:
    """Ask for a mesh that follows the skeleton; what a character's own file lacks is a warning."""
    for finding in _meshes(stage):
        yield replace(finding, severity="warning") if _cast(stage) else finding


def _meshes(stage: Usd.Stage) -> Iterator[StageFinding]:
    root = _skel_root(stage)
    if root is None:
        return
    cache = UsdSkel.Cache()
    cache.Populate(UsdSkel.Root(root), Usd.PrimDefaultPredicate)
    bindings = cache.ComputeSkelBindings(UsdSkel.Root(root), Usd.PrimDefaultPredicate)
    targets = [(target, binding) for binding in bindings for target in binding.GetSkinningTargets()]
    if not targets:
        yield _error(
            "body", str(root.GetPath()), "mesh: want one bound to the Skeleton, with SkelBindingAPI applied, got none"
        )
    for target, binding in targets:
        prim, where = target.GetPrim(), str(target.GetPrim().GetPath())
        if not prim.IsA(UsdGeom.Mesh):
            continue
        mesh = UsdGeom.Mesh(prim)
        points = np.array(mesh.GetPointsAttr().Get() or np.zeros((0, 3)), np.float64)
        counts, indices = mesh.GetFaceVertexCountsAttr().Get() or (), mesh.GetFaceVertexIndicesAttr().Get() or ()
        is_sound, why = UsdGeom.Mesh.ValidateTopology(indices, counts, len(points))
        if not is_sound or not np.isfinite(points).all():
            yield _error("mesh", where, f"mesh: want faces over finite points, got: {why or 'a NaN or infinity'}")
        for name, attribute in (("normals", mesh.GetNormalsAttr()), ("extent", mesh.GetExtentAttr())):
            if not attribute.HasAuthoredValue():
                yield _warning("mesh", where, f"{name}: want it written, got none")
        yield from _weights(target, binding, len(points), where)


def _weights(
    target: UsdSkel.SkinningQuery, binding: UsdSkel.Binding, n_points: int, where: str
) -> Iterator[StageFinding]:
    """Ask for skinning weights: joints that exist, shares that sum to one."""
    if not target.HasJointInfluences():
        yield _error("weights", where, "jointIndices, jointWeights: want both, got none or one")
        return
    own = target.GetJointOrder()
    order = own if own is not None else binding.GetSkeleton().GetJointsAttr().Get()
    n_joints, width = len(order or ()), target.GetNumInfluencesPerComponent()
    index = np.array(target.GetJointIndicesPrimvar().Get() or (), np.int64)
    weight = np.array(target.GetJointWeightsPrimvar().Get() or (), np.float64)
    want = width if target.IsRigidlyDeformed() else width * n_points
    if len(index) != want or len(weight) != want:
        got = f"{len(index)} and {len(weight)}"
        yield _error("weights", where, f"jointIndices, jointWeights: want {want} each, got {got}")
        return
    if len(index) and not (index.min() >= 0 and index.max() < n_joints):
        got = f"{index.min()} to {index.max()}"
        yield _error("weights", where, f"jointIndices: want 0 to {n_joints - 1}, got {got}")
    total = weight.reshape(-1, width).sum(-1)
    if len(total) and np.abs(total - 1).max() > _UNIT_ATOL:
        yield _error(
            "weights", where, f"jointWeights: want a sum of 1 a point, got {total.min():.4g} to {total.max():.4g}"
        )


def _song(stage: Usd.Stage) -> Iterator[StageFinding]:
    """Ask for music that can be found, and that every reader can open."""
    songs = [UsdMedia.SpatialAudio(prim) for prim in stage.Traverse() if prim.IsA(UsdMedia.SpatialAudio)]
    if not songs:
        yield _warning("song", "", "SpatialAudio: want the song the dance is danced to, got none")
    package = stage.GetRootLayer().realPath
    for song in songs:
        where, asset = str(song.GetPath()), song.GetFilePathAttr().Get()
        if asset is None or not asset.path:
            yield _error("song", where, "filePath: want a song, got none")
            continue
        if usd_read.is_absolute(asset.path):
            yield _error("song", where, f"filePath: want a path relative to the stage, got {asset.path}")
        if not asset.resolvedPath:
            yield _error("song", where, f"filePath: want a file that is there, got {asset.path}, which is not")
            continue
        if package.endswith(".usdz") and not asset.resolvedPath.startswith(f"{package}["):
            yield _error("song", where, f"filePath: want the song inside the package, got {asset.resolvedPath}")
        opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(asset.resolvedPath))
        head = bytes(opened.Read(12, 0)) if opened and opened.GetSize() >= 12 else b""
        if head[:4] not in (b"RIFF", b"RF64") or head[8:] != b"WAVE":
            yield _error("song", where, f"filePath: want a WAV file, got something else in {asset.path}")
        if song.GetAuralModeAttr().Get() != UsdMedia.Tokens.nonSpatial:
            yield _warning("song", where, f"auralMode: want nonSpatial, got {song.GetAuralModeAttr().Get()}")
        if song.GetStartTimeAttr().HasAuthoredValue():
            yield _warning("song", where, "startTime: want it left out, since one reader refuses it, got it written")


def _provenance(stage: Usd.Stage) -> Iterator[StageFinding]:
    """Ask where the dance came from, in words that mean the same on every machine."""
    prim = stage.GetDefaultPrim()
    stored = prim.GetCustomDataByKey(contract.PROVENANCE_KEY) if prim else None
    where = str(prim.GetPath()) if prim else ""
    if not isinstance(stored, dict) or not stored:
        key = contract.PROVENANCE_KEY
        yield _error("provenance", where, f"customData: want a dictionary {key!r} with the provenance, got none")
        return
    for key, value in _texts(stored, contract.PROVENANCE_KEY):
        if usd_read.is_absolute(value):
            yield _error("provenance", where, f"{key}: want nothing that names one machine, got {value}")


def _lineage(stage: Usd.Stage) -> Iterator[StageFinding]:
    """Ask where each frame comes from: none at all in a dance of clips is a warning, half of it an error."""
    prim, root = _animation_prim(stage), stage.GetDefaultPrim()
    if prim is None or not stage.GetEndTimeCode() >= stage.GetStartTimeCode():
        return
    stored = root.GetCustomDataByKey(contract.PROVENANCE_KEY) if root else None
    told = stored.get("clips") if isinstance(stored, dict) else None
    try:
        clips = [clip["clip_id"] for clip in json.loads(told)] if isinstance(told, str) else None
    except (ValueError, KeyError, TypeError):
        clips = None
    is_there = any(prim.GetAttribute(name) for name in contract.LINEAGE)
    if not is_there and told is None:  # made of no clips: there is nothing to ask for
        return
    span = np.arange(stage.GetStartTimeCode(), stage.GetEndTimeCode() + 1)
    say = _error if is_there else _warning
    for sentence in usd_lineage.troubles(prim, span, clips) if is_there else ["odori:clip: want lineage, got none"]:
        yield say("lineage", str(prim.GetPath()), sentence)


def _texts(value: object, name: str) -> Iterator[tuple[str, str]]:
    """Find every text in customData with its key."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _texts(item, f"{name}:{key}")
    elif isinstance(value, str):
        yield name, value
    elif not isinstance(value, bool | int | float) and hasattr(value, "__iter__"):
        for item in value:
            yield from _texts(item, name)


def _skel_root(stage: Usd.Stage) -> Usd.Prim | None:
    """Find the character's, the default prim if it is a SkelRoot, else the first SkelRoot."""
    cast, prim = _cast(stage), stage.GetDefaultPrim()
    if cast and stage.GetPrimAtPath(cast["skel_root"]):
        prim = stage.GetPrimAtPath(cast["skel_root"])
    if prim and prim.IsA(UsdSkel.Root):
        return prim
    return next((prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)), None)


def _cast(stage: Usd.Stage) -> dict[str, Any]:
    """Read what the provenance says of a character from another file; {} where the body is odori's own."""
    prim = stage.GetDefaultPrim()
    stored = prim.GetCustomDataByKey(f"{contract.PROVENANCE_KEY}:character") if prim else None
    is_whole = isinstance(stored, dict) and all(
        isinstance(stored.get(key), kind) for key, kind in (("skel_root", str), ("skeleton", str), ("joints", dict))
    )
    if stored is None or not is_whole:
        return {}
    below = {key: f"{contract.ROOT_PATH}/{stored[key]}".rstrip("/") for key in ("skel_root", "skeleton")}
    return {**stored, **below}


def _skeleton_prim(stage: Usd.Stage) -> Usd.Prim | None:
    """Find the character's Skeleton, else the first under the SkelRoot."""
    root, cast = _skel_root(stage), _cast(stage)
    found = [prim for prim in Usd.PrimRange(root) if prim.IsA(UsdSkel.Skeleton)] if root else []
    return next((prim for prim in found if str(prim.GetPath()) == cast.get("skeleton")), found[0] if found else None)


def _animation_prim(stage: Usd.Stage) -> Usd.Prim | None:
    """Find the SkelAnimation bound to that Skeleton."""
    prim = _skeleton_prim(stage)
    source = UsdSkel.BindingAPI(prim).GetInheritedAnimationSource() if prim else None
    return source if source and source.IsA(UsdSkel.Animation) else None


def _error(rule: str, prim_path: str, sentence: str) -> StageFinding:
    return StageFinding("error", f"odori:{rule}", prim_path, sentence)


def _warning(rule: str, prim_path: str, sentence: str) -> StageFinding:
    return StageFinding("warning", f"odori:{rule}", prim_path, sentence)


def _authored(stage: Usd.Stage, key: str) -> str:
    """Report what the stage says of itself, or that it says nothing."""
    return f"{stage.GetMetadata(key)}" if stage.HasAuthoredMetadata(key) else "nothing"


def _matrices(attribute: Usd.Attribute) -> Float:
    """Read a matrix array, (J, 4, 4); empty where there are none."""
    value = attribute.Get()
    return np.array(value, np.float64) if value is not None and len(value) else np.zeros((0, 4, 4))


def _is_rigid(matrix: Float) -> bool:
    """Whether each matrix turns and moves and does nothing else."""
    turn = matrix[:, :3, :3]
    square = turn @ np.swapaxes(turn, -1, -2)
    is_turn = np.allclose(square, np.eye(3), atol=1e-4) and (np.linalg.det(turn) > 0).all()
    return bool(is_turn and np.isfinite(matrix).all() and np.allclose(matrix[:, :, 3], [0, 0, 0, 1]))


def _shape(value: NDArray[np.float64]) -> str:
    """Say how many values came."""
    return f"{len(value)} values" if value.ndim and len(value) else "none"


def _span(times: NDArray[np.float64]) -> str:
    """Say the first and last of a row of time codes."""
    return f"{times[0]:g} to {times[-1]:g} ({len(times)})" if len(times) else "none"


RULES: tuple[Callable[[Usd.Stage], Iterator[StageFinding]], ...] = (
    _stage,
    _root,
    _skeleton,
    _animation,
    _body,
    _song,
    _provenance,
    _lineage,
)
