"""A rigged character in a USD file: read, danced on, and referenced by the dance's stage with mesh and materials.

Conventions
-----------
*Skeleton space* is the character's own: its units and axes, below its own transforms. The *world* is the dance's:
metres, Y up. The stage references a flat copy of the character's file that lies beside it, turns and scales it as a
whole, and binds its skeleton to the dance's animation: rest and bind pose, joint names, mesh and weights stay its own.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath

import numpy as np
from pxr import Ar, Gf, Sdf, Tf, Usd, UsdGeom, UsdSkel, Vt

from assets.formats import usd_read
from assets.formats.errors import FormatError
from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.body_measure import Character, measure
from kernels.skeleton.naming import JointMapping, NoBodyError, map_joints
from kernels.skeleton.rig_joints import (
    Moves,
    RestPose,
    box_around,
    local_matrices,
    rest_pose,
    resting_clip,
    rig_moves,
    similarity,
    upright,
)
from kernels.types import Clip, Float, Int
from schemas import stage_contract as contract

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
_FILE = re.compile(r"(?P<file>.+?\.usd[acz]?)(?::(?P<prim>/.*))?", re.IGNORECASE)
SHORTEST_M, TALLEST_M = 0.2, 10.0
"""Bodies that are danced on, from lowest joint to head: others are in another unit than their file says. Chosen by
hand."""


@dataclass(frozen=True, eq=False)
class UsdRig:
    """A rig in a USD file.

    Parameters
    ----------
    file : name of the file
    root_path, skel_root_path, skeleton_path : prims, the first at the top of the file
    joints : J joint paths in the skeleton's order
    rest : RestPose of them
    scale, turn_wxyz, shift_xyz_m : from skeleton space to the world
    correction : (4, 4) float, from the file's axes and unit to the world, rows times matrix
    root_ops : names of the transforms of the prim at the top, outermost first; None where it can have none
    skel_root_to_world : (4, 4) float
    mapping : JointMapping of names to those in ``character.skeleton``
    character : Character in the world
    """

    file: str
    root_path: str
    skel_root_path: str
    skeleton_path: str
    joints: tuple[str, ...]
    rest: RestPose
    scale: float
    turn_wxyz: Float
    shift_xyz_m: Float
    correction: Float
    root_ops: tuple[str, ...] | None
    skel_root_to_world: Float
    mapping: JointMapping
    character: Character


def is_file(text: str) -> bool:
    """Whether a character is named by a USD file, and not by a clip."""
    return _FILE.fullmatch(text) is not None


def split(text: str) -> tuple[str, str]:
    """Split ``FILE.usd:/Path/To/Skeleton`` into file and prim; the prim is "" where none is named."""
    found = _FILE.fullmatch(text)
    return (found["file"], found["prim"] or "") if found else (text, "")


def read_rig(path: str | Path, *, prim: str = "", extra: Mapping[str, str] | None = None) -> UsdRig:
    """Read the rig of a character.

    Parameters
    ----------
    path : .usd, .usda, .usdc or .usdz
    prim : path of its Skeleton where there are several; "" for the one that is a human body
    extra : names of joints to canonical ones, where odori cannot tell

    Returns
    -------
    UsdRig

    Raises
    ------
    FormatError
        If there is no skeleton under a SkelRoot, none or more than one is a human body, or a rest pose or transform
        cannot be danced on.
    """
    stage = usd_read.open_stage(path)
    name = Path(path).name
    found = skeletons(stage)
    if not found:
        raise FormatError(name, 0, "want a Skeleton under a SkelRoot, got none; export the character with its rig")
    if prim:
        found = [pair for pair in found if str(pair[1].GetPath()) == prim]
        if not found:
            there = ", ".join(str(s.GetPath()) for _, s in skeletons(stage))
            raise FormatError(name, 0, f"want a Skeleton at {prim}, got none there; it has {there}")
    rigs, refusals = [], []
    for root, skeleton in found:
        try:
            rigs.append(_read(stage, name, root, skeleton, extra))
        except (NoBodyError, ValueError, Tf.ErrorException) as error:
            said = usd_read.reason(error) if isinstance(error, Tf.ErrorException) else str(error)
            refusals.append(f"{skeleton.GetPath()}: {said}")
    if not rigs:
        raise FormatError(name, 0, f"want the skeleton of a human body, got none: {'; '.join(refusals)}")
    if len(rigs) > 1:
        there = ", ".join(rig.skeleton_path for rig in rigs)
        raise FormatError(
            name, 0, f"want one character, got {len(rigs)}: {there}; name one as {name}:{rigs[0].skeleton_path}"
        )
    return rigs[0]


def facts(rig: UsdRig) -> dict[str, object]:
    """Say of a rig what its stage's provenance says: its file, prims below the stage's root, joints by part."""
    first = len(rig.character.skeleton.joints) - len(rig.joints)
    return {
        "file": rig.file,
        "skel_root": "/".join(rig.skel_root_path.split("/")[2:]),
        "skeleton": "/".join(rig.skeleton_path.split("/")[2:]),
        "joints": {name: rig.joints[k - first] for name, k in sorted(rig.character.at.items())},
        "scale_ratio": round(rig.character.scale_ratio, 6),
    }


def _in_stage(path: str) -> str:
    """Path of one of the file's prims in the dance's stage."""
    return "/".join([contract.ROOT_PATH, *path.split("/")[2:]])


def skeletons(stage: Usd.Stage) -> list[tuple[Usd.Prim, Usd.Prim]]:
    """Find the skeletons of a stage, each with the SkelRoot above it."""
    found = []
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdSkel.Skeleton):
            above = prim.GetParent()
            while above and not above.IsA(UsdSkel.Root):
                above = above.GetParent()
            if above:
                found.append((above, prim))
    return found


def _read(stage: Usd.Stage, name: str, root: Usd.Prim, prim: Usd.Prim, extra: Mapping[str, str] | None) -> UsdRig:
    if prim.IsInstanceProxy():
        raise ValueError("want a skeleton that can be bound to an animation, got one inside an instance; unmake it")
    skeleton = UsdSkel.Skeleton(prim)
    joints = [str(joint) for joint in skeleton.GetJointsAttr().Get() or ()]
    if not joints:
        raise ValueError("want joints, got none")
    topology = UsdSkel.Topology(joints)
    is_ordered, why = topology.Validate()
    if not is_ordered:
        raise ValueError(f"want joints with parents before children, got: {why}")
    parent = np.array(topology.GetParentIndices(), np.int64)
    rest = _rest(skeleton, parent, len(joints))
    above = root.GetPath().GetPrefixes()[0]
    correction = _correction(stage)
    cache = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    world = np.array(cache.GetLocalToWorldTransform(prim)) @ correction
    unit, turn = similarity(world[:3, :3], "the skeleton's own transform")
    body = upright(_names(skeleton, joints), parent, unit * rotation.apply(turn, rest.position) + world[3, :3])
    mapping = map_joints(body, extra)
    character = measure(resting_clip(body), mapping, floor_m=0.0)
    height_m = float(np.ptp(kinematics.rest_position(character.figure)[:, 1]))
    if not SHORTEST_M <= height_m <= TALLEST_M:
        raise ValueError(
            f"want a body of {SHORTEST_M:g} to {TALLEST_M:g} m, got {height_m:.3g} m; say in the file what its unit is "
            "(metersPerUnit), or scale the character"
        )
    return UsdRig(
        name,
        str(above),
        str(root.GetPath()),
        str(prim.GetPath()),
        tuple(joints),
        rest,
        unit,
        turn,
        world[3, :3],
        correction,
        _ops(stage.GetPrimAtPath(above)),
        np.array(cache.GetLocalToWorldTransform(root)) @ correction,
        mapping,
        character,
    )


def _correction(stage: Usd.Stage) -> Float:
    """From the file's axes and unit to metres with Y up, (4, 4)."""
    matrix = np.eye(4)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        matrix[:3, :3] = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    matrix[:3, :3] *= UsdGeom.GetStageMetersPerUnit(stage)
    return matrix


def _rest(skeleton: UsdSkel.Skeleton, parent: Int, n: int) -> RestPose:
    """Local rest pose of the n joints; from the bind pose where the skeleton has none."""
    local = np.array(skeleton.GetRestTransformsAttr().Get() or np.zeros((0, 4, 4)), np.float64)
    if local.shape != (n, 4, 4):
        bind = np.array(skeleton.GetBindTransformsAttr().Get() or np.zeros((0, 4, 4)), np.float64)
        if bind.shape != (n, 4, 4):
            raise ValueError(f"want a rest or bind transform for each of {n} joints, got {len(local)} and {len(bind)}")
        local = local_matrices(bind, parent)
    return rest_pose(local, parent)


def _names(skeleton: UsdSkel.Skeleton, joints: list[str]) -> list[str]:
    """Names to tell joints by: the file's own, else the ends of their paths, else the paths."""
    own = [str(name) for name in skeleton.GetJointNamesAttr().Get() or ()]
    leaves = [joint.rsplit("/")[-1] for joint in joints]
    for names in (own, leaves):
        if len(names) == len(joints) == len(set(names)):
            return names
    return joints


def moves(rig: UsdRig, fitted: Clip) -> Moves:
    """Put a dance that fits a rig's figure on its joints.

    Parameters
    ----------
    rig : UsdRig
    fitted : Clip on ``rig.character.figure``

    Returns
    -------
    Moves
        As :func:`kernels.skeleton.rig_joints.rig_moves` has them.
    """
    return rig_moves(
        fitted, rig.character, rig.rest, scale=rig.scale, turn_wxyz=rig.turn_wxyz, shift_xyz_m=rig.shift_xyz_m
    )


def write_cast(layer: Sdf.Layer, rig: UsdRig, reference: str, moved: Moves) -> None:
    """Make the dance's root prim the character: referenced, stood up in metres, its skeleton bound to the dance.

    Parameters
    ----------
    layer : Sdf.Layer of the dance's stage
    rig : UsdRig
    reference : path of the character's copy, relative to the stage; it need not be there yet
    moved : Moves
    """
    root = Sdf.CreatePrimInLayer(layer, contract.ROOT_PATH)
    root.specifier = Sdf.SpecifierDef
    root.referenceList.Prepend(Sdf.Reference(f"./{reference}", rig.root_path))
    if rig.root_ops is None:
        root.typeName = "Xform"
    ours = Sdf.AttributeSpec(root, "xformOp:transform:odori", Sdf.ValueTypeNames.Matrix4d)
    ours.default = Gf.Matrix4d(*rig.correction.ravel().tolist())
    order = Sdf.AttributeSpec(root, "xformOpOrder", Sdf.ValueTypeNames.TokenArray, Sdf.VariabilityUniform)
    order.default = Vt.TokenArray([ours.name, *(rig.root_ops or ())])
    skeleton = _bound(layer, rig.skeleton_path)
    source = Sdf.RelationshipSpec(skeleton, "skel:animationSource", custom=False)
    source.targetPathList.explicitItems = [Sdf.Path(ANIMATION_PATH)]
    skel_root = _bound(layer, rig.skel_root_path)
    size = float(np.ptp(kinematics.rest_position(rig.character.figure), axis=0).max()) / 2
    low, high = moved.position_xyz_m.min(axis=(0, 1)) - size, moved.position_xyz_m.max(axis=(0, 1)) + size
    box = box_around(low, high, rig.skel_root_to_world)
    extent = Sdf.AttributeSpec(skel_root, "extent", Sdf.ValueTypeNames.Float3Array)
    extent.default = Vt.Vec3fArray([Gf.Vec3f(*map(float, edge)) for edge in box])


def _bound(layer: Sdf.Layer, path: str) -> Sdf.PrimSpec:
    """Opinion on a prim of the character, with SkelBindingAPI beside what it applies itself."""
    spec = Sdf.CreatePrimInLayer(layer, _in_stage(path))
    spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=["SkelBindingAPI"]))
    return spec


def _ops(prim: Usd.Prim) -> tuple[str, ...] | None:
    """Names of a prim's own transforms, outermost first; None where it can have none."""
    if not prim.IsA(UsdGeom.Xformable):
        return None
    return tuple(str(name) for name in UsdGeom.Xformable(prim).GetXformOpOrderAttr().Get() or ())


ANIMATION_PATH = f"{contract.ROOT_PATH}/OdoriAnimation"


@dataclass(frozen=True, eq=False)
class Copy:
    """A character's file made flat: its layer, and the files its materials name, by path relative to it."""

    layer: Sdf.Layer
    files: Mapping[str, bytes]


def flat_copy(path: str | Path) -> Copy:
    """Bring all that a character's file is made of into one layer, and gather its textures.

    Parameters
    ----------
    path : .usd, .usda, .usdc or .usdz

    Returns
    -------
    Copy
        Textures are named ``textures/0_name.png``; a texture that is not there keeps its name and is missing there too.

    Raises
    ------
    FormatError
        If the file cannot be opened or flattened.
    """
    stage = usd_read.open_stage(path)
    try:
        layer = stage.Flatten(addSourceFileComment=False)
    except Tf.ErrorException as error:
        raise FormatError(str(path), 0, f"want a whole character, got: {usd_read.reason(error)}") from error
    files: dict[str, bytes] = {}
    names: dict[str, str] = {}
    for prim in stage.Traverse(Usd.PrimAllPrimsPredicate):
        for attribute in prim.GetAttributes():
            if attribute.GetTypeName() != Sdf.ValueTypeNames.Asset or not attribute.HasAuthoredValue():
                continue
            value = attribute.Get()
            spec = layer.GetAttributeAtPath(attribute.GetPath())
            if spec is None or not isinstance(value, Sdf.AssetPath) or not value.path:
                continue
            data = _bytes(value.resolvedPath)
            if data is None:
                spec.default = Sdf.AssetPath(f"./{_legal(value.path)}")
                continue
            if value.resolvedPath not in names:
                inner = value.resolvedPath.rstrip("]").replace("[", "/")
                names[value.resolvedPath] = f"textures/{len(names)}_{_legal(inner)}"
                files[names[value.resolvedPath]] = data
            spec.default = Sdf.AssetPath(f"./{names[value.resolvedPath]}")
    layer.documentation = ""
    return Copy(layer, files)


def _legal(path: str) -> str:
    """Name the file of a path of any system, in letters that every system takes."""
    return re.sub(r"[^A-Za-z0-9._-]", "_", PureWindowsPath(path).name)


def _bytes(resolved: str) -> bytes | None:
    """Read a file that a stage names, also inside a package; None where it is not there."""
    opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved)) if resolved else None
    return bytes(opened.Read(opened.GetSize(), 0)) if opened else None
