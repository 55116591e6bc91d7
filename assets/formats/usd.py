"""USD stages of a dance: UsdSkel written, packed with its song, and read back.

Conventions
-----------
Prim paths, axis and units are those of :mod:`schemas.stage_contract`. Quaternions are ``wxyz`` everywhere in odori and
imaginary part first in USD's arrays: this module alone turns them round. Time code = frame index, from 0. Same
arguments, same bytes; files are written beside their place and renamed into it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

import numpy as np
from pxr import Gf, Kind, Sdf, Tf, Usd, UsdGeom, UsdMedia, UsdShade, UsdSkel, Vt

from assets.formats import beside, usd_lineage, usd_read
from kernels import rotation
from kernels.skeleton import kinematics
from kernels.types import Clip, Float, Skeleton
from schemas import stage_contract as contract

if TYPE_CHECKING:
    from assets.formats.mesh import BodyMesh

# Linear colours one can tell apart with any eyes: left vermilion, right blue. Chosen by hand.
SIDE_RGB: dict[str, tuple[float, float, float]] = {
    "middle": (0.55, 0.55, 0.52),
    "left": (0.67, 0.11, 0.01),
    "right": (0.01, 0.17, 0.45),
}
_UNIT_ATOL = 1e-3
"""How far from 1 a quaternion's length may be. Chosen by hand, above what half precision does."""


def write_stage(
    path: str | Path,
    clip: Clip,
    *,
    audio: str | None = None,
    provenance: Mapping[str, object] | None = None,
    title: str = "dance",
    lineage: usd_lineage.Frames | None = None,
) -> None:
    """Write a clip as a USD stage with a body to look at.

    Parameters
    ----------
    path : ends in .usdc; folders are made
    clip : Clip of F >= 1 frames
    audio : path of a WAV relative to the stage, or None
        Only named, not read; it may be written later.
    provenance : mapping of str to what JSON can hold, or None
        Goes to the default prim's customData. Mappings, texts, numbers, truths and lists of one kind are kept as such,
        anything else as its JSON text. No dates, please: the same dance gives the same bytes.
    title : name in assetInfo
    lineage : F values by the names of :data:`schemas.stage_contract.LINEAGE`, or None
        Where each frame comes from.

    Raises
    ------
    ValueError
        If the suffix, the clip, the audio path, the provenance or the lineage does not fit.
    OSError
        If the file cannot be written; what stood at ``path`` before still stands.
    """
    path = Path(path)
    if path.suffix != ".usdc":
        raise ValueError(f"path: want a name ending in .usdc, got {path.name!r}")
    if clip.n_frames < 1:
        raise ValueError("clip: want at least one frame, got none")
    # trimesh brings SciPy and a second of loading, which reading and checking can do without.
    from assets.formats.mesh import body

    layer = Sdf.Layer.CreateAnonymous(".usdc")
    stage = Usd.Stage.Open(layer)
    write_metadata(stage, clip)
    _write_root(stage, clip, provenance or {}, title)
    _write_skeleton(stage, clip.skeleton)
    shape = body(clip.skeleton)
    _write_body(stage, shape)
    _write_extent(stage, clip, shape)
    if audio is not None:
        write_audio(stage, audio)
    if lineage is not None and any(len(values) != clip.n_frames for values in lineage.values()):
        raise ValueError(f"lineage: want a value a frame, {clip.n_frames}, got {[len(v) for v in lineage.values()]}")
    with Sdf.ChangeBlock():
        write_animation(layer, clip)
        if lineage is not None:
            usd_lineage.write_lineage(layer, contract.ANIMATION_PATH, lineage)
    with written_beside(path) as partial:
        save(layer, partial)


def joint_paths(skeleton: Skeleton) -> list[str]:
    """Joint paths as UsdSkel wants them, parents first: ``hips``, ``hips/spine``.

    Names that are no ASCII identifiers get one: other signs become ``_``, and a number tells equal ones apart.

    Parameters
    ----------
    skeleton : Skeleton of J joints

    Returns
    -------
    list of J texts, no two alike
    """
    taken: set[str] = set()
    paths: list[str] = []
    for k, joint in enumerate(skeleton.joints):
        legal = re.sub(r"[^A-Za-z0-9_]", "_", joint) or "_"
        legal = "_" + legal if legal[0].isdigit() else legal
        name, number = legal, 1
        while name in taken:
            number += 1
            name = f"{legal}_{number}"
        taken.add(name)
        paths.append(name if k == 0 else f"{paths[skeleton.parent[k]]}/{name}")
    return paths


def write_animation(layer: Sdf.Layer, clip: Clip) -> None:
    """Write the SkelAnimation of a clip into a layer; call it inside a change block, where it is ten times as fast.

    Parameters
    ----------
    layer : Sdf.Layer
    clip : Clip of F >= 1 frames

    Raises
    ------
    ValueError
        If a quaternion is not unit.
    """
    length = np.linalg.norm(clip.rotation_wxyz, axis=-1)
    if np.abs(length - 1).max() > _UNIT_ATOL:
        f, j = np.unravel_index(np.abs(length - 1).argmax(), length.shape)
        raise ValueError(
            f"rotation_wxyz: want unit quaternions, got length {length[f, j]:.6g} at frame {f}, "
            f"joint {clip.skeleton.joints[j]}; normalise them"
        )
    unit = rotation.continuous(clip.rotation_wxyz / length[..., None])
    if clip.translation_xyz_m is None:
        translation = np.repeat(clip.skeleton.offset_xyz_m[None], clip.n_frames, axis=0)
    else:
        translation = clip.translation_xyz_m.copy()
    translation[:, 0] = clip.root_xyz_m
    write_samples(layer, contract.ANIMATION_PATH, joint_paths(clip.skeleton), unit, translation)


def write_samples(
    layer: Sdf.Layer,
    path: str,
    joint_names: Sequence[str],
    rotation_wxyz: Float,
    translation: Float,
    scale: Float | None = None,
) -> None:
    """Write a SkelAnimation, a sample a time code from the first on; call it inside a change block.

    Parameters
    ----------
    layer : Sdf.Layer
    path : of the SkelAnimation
    joint_names : J joint paths
    rotation_wxyz : (F, J, 4) float, unit, local, in one hemisphere from frame to frame
    translation : (F, J, 3) float, local, in the skeleton's unit
    scale : (J,) float, or None for 1
    """
    prim = Sdf.CreatePrimInLayer(layer, path)
    prim.specifier, prim.typeName = Sdf.SpecifierDef, "SkelAnimation"
    joints = Sdf.AttributeSpec(prim, "joints", Sdf.ValueTypeNames.TokenArray, Sdf.VariabilityUniform)
    joints.default = Vt.TokenArray(list(joint_names))
    scales = Sdf.AttributeSpec(prim, "scales", Sdf.ValueTypeNames.Half3Array)
    each = np.ones(len(joint_names)) if scale is None else scale
    scales.default = Vt.Vec3hArray([Gf.Vec3h(s, s, s) for s in each.tolist()])
    imaginary_first = np.ascontiguousarray(np.roll(rotation_wxyz, -1, axis=-1), np.float32)
    place = np.ascontiguousarray(translation, np.float32)
    rotations = Sdf.AttributeSpec(prim, "rotations", Sdf.ValueTypeNames.QuatfArray).path
    translations = Sdf.AttributeSpec(prim, "translations", Sdf.ValueTypeNames.Float3Array).path
    for frame in range(len(place)):
        time = contract.START_TIME_CODE + frame
        layer.SetTimeSample(rotations, time, Vt.QuatfArray.FromNumpy(imaginary_first[frame]))
        layer.SetTimeSample(translations, time, Vt.Vec3fArray.FromNumpy(place[frame]))


def write_metadata(stage: Usd.Stage, clip: Clip) -> None:
    """Write axis, unit, rate and range.

    Parameters
    ----------
    stage : Usd.Stage
    clip : Clip of F >= 1 frames
        Its rate becomes the stage's; time codes go from 0 to F - 1.
    """
    UsdGeom.SetStageUpAxis(stage, contract.UP_AXIS)
    UsdGeom.SetStageMetersPerUnit(stage, contract.METERS_PER_UNIT)
    stage.SetTimeCodesPerSecond(clip.frame_rate_hz)
    stage.SetFramesPerSecond(clip.frame_rate_hz)
    stage.SetStartTimeCode(contract.START_TIME_CODE)
    stage.SetEndTimeCode(contract.START_TIME_CODE + clip.n_frames - 1)


def _write_root(stage: Usd.Stage, clip: Clip, provenance: Mapping[str, object], title: str) -> None:
    """Define the default prim: a SkelRoot that tells where the dance came from."""
    prim = UsdSkel.Root.Define(stage, contract.ROOT_PATH).GetPrim()
    UsdSkel.BindingAPI.Apply(prim)
    tell_root(stage, prim, provenance, title)


def tell_root(stage: Usd.Stage, prim: Usd.Prim, provenance: Mapping[str, object], title: str) -> None:
    """Make a prim the one a stage is about, and write down where the dance came from.

    Parameters
    ----------
    stage : Usd.Stage
    prim : its prim
    provenance : as for :func:`write_stage`; nothing is written for an empty one
    title : name in assetInfo

    Raises
    ------
    ValueError
        If the provenance holds what JSON cannot, or an absolute path.
    """
    stage.SetDefaultPrim(prim)
    Usd.ModelAPI(prim).SetKind(Kind.Tokens.component)
    Usd.ModelAPI(prim).SetAssetName(title)
    if provenance:
        prim.SetCustomDataByKey(contract.PROVENANCE_KEY, _to_usd(provenance, "provenance"))


def _write_skeleton(stage: Usd.Stage, skeleton: Skeleton) -> None:
    """Define the skeleton at rest; all rest rotations are identity."""
    skel = UsdSkel.Skeleton.Define(stage, contract.SKELETON_PATH)
    paths = joint_paths(skeleton)
    skel.CreateJointsAttr(paths)
    if [path.rsplit("/")[-1] for path in paths] != list(skeleton.joints):
        skel.CreateJointNamesAttr(list(skeleton.joints))
    for attribute, position in (
        (skel.CreateRestTransformsAttr(), skeleton.offset_xyz_m),
        (skel.CreateBindTransformsAttr(), kinematics.rest_position(skeleton)),
    ):
        matrix = np.tile(np.eye(4), (len(position), 1, 1))
        matrix[:, 3, :3] = position
        attribute.Set(Vt.Matrix4dArray.FromNumpy(matrix))
    UsdSkel.BindingAPI.Apply(skel.GetPrim()).CreateAnimationSourceRel().SetTargets([contract.ANIMATION_PATH])


def _write_body(stage: Usd.Stage, shape: BodyMesh) -> None:
    """Define the mesh, its skinning and one material a side."""
    mesh = UsdGeom.Mesh.Define(stage, contract.MESH_PATH)
    point = shape.point_xyz_m.astype(np.float32)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(point))
    mesh.CreateExtentAttr([Gf.Vec3f(*map(float, point.min(0))), Gf.Vec3f(*map(float, point.max(0)))])
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(shape.normal_xyz.astype(np.float32)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(shape.triangle), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(shape.triangle.ravel().astype(np.int32)))

    skinning = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    skinning.CreateSkeletonRel().SetTargets([contract.SKELETON_PATH])
    skinning.CreateGeomBindTransformAttr(Gf.Matrix4d(1))
    skinning.CreateJointIndicesPrimvar(constant=False, elementSize=1).Set(
        Vt.IntArray.FromNumpy(shape.joint_index.astype(np.int32))
    )
    skinning.CreateJointWeightsPrimvar(constant=False, elementSize=1).Set(
        Vt.FloatArray.FromNumpy(np.ones(len(point), np.float32))
    )

    side_of_point = np.zeros(len(point), np.int64)
    side_of_point[shape.triangle] = shape.side_index[:, None]
    color = np.array([SIDE_RGB[side] for side in contract.SIDES], np.float32)[side_of_point]
    mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex).Set(Vt.Vec3fArray.FromNumpy(color))
    UsdGeom.Scope.Define(stage, contract.LOOKS_PATH)
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).SetMaterialBindSubsetsFamilyType(UsdGeom.Tokens.partition)
    for index, side in enumerate(contract.SIDES):
        faces = np.flatnonzero(shape.side_index == index)
        if len(faces) == 0:
            continue
        material = UsdShade.Material.Define(stage, f"{contract.LOOKS_PATH}/{side}")
        surface = UsdShade.Shader.Define(stage, f"{contract.LOOKS_PATH}/{side}/Surface")
        surface.CreateIdAttr("UsdPreviewSurface")
        surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*SIDE_RGB[side]))
        surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.6)
        material.CreateSurfaceOutput().ConnectToSource(
            surface.CreateOutput(UsdShade.Tokens.surface, Sdf.ValueTypeNames.Token)
        )
        subset = UsdGeom.Subset.Define(stage, f"{contract.MESH_PATH}/{side}")
        subset.CreateElementTypeAttr(UsdGeom.Tokens.face)
        subset.CreateFamilyNameAttr(UsdShade.Tokens.materialBind)
        subset.CreateIndicesAttr(Vt.IntArray.FromNumpy(faces.astype(np.int32)))
        UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(material)


def _write_extent(stage: Usd.Stage, clip: Clip, shape: BodyMesh) -> None:
    """Write a box onto the SkelRoot that holds the body at every frame."""
    rest = kinematics.rest_position(clip.skeleton)
    reach = float(np.linalg.norm(shape.point_xyz_m - rest[shape.joint_index], axis=-1).max())
    position, _ = kinematics.place(clip)
    low: Float = position.min(axis=(0, 1)) - reach
    high: Float = position.max(axis=(0, 1)) + reach
    UsdSkel.Root.Get(stage, contract.ROOT_PATH).CreateExtentAttr(
        [Gf.Vec3f(*map(float, low)), Gf.Vec3f(*map(float, high))]
    )


def write_audio(stage: Usd.Stage, audio: str) -> None:
    """Define the song. It starts with the stage: no startTime, since one importer refuses it.

    Parameters
    ----------
    stage : Usd.Stage
    audio : path of a WAV relative to the stage, with ``/``; the file is not looked at

    Raises
    ------
    ValueError
        If the path is absolute or not that of a WAV.
    """
    relative = PurePosixPath(audio)
    if usd_read.is_absolute(audio) or relative.suffix.lower() != contract.PACKAGE_AUDIO_SUFFIX:
        raise ValueError(f"audio: want a relative path of a WAV file, got {audio!r}")
    song = UsdMedia.SpatialAudio.Define(stage, contract.AUDIO_PATH)
    song.CreateFilePathAttr(Sdf.AssetPath(f"./{relative}"))
    song.CreateAuralModeAttr(UsdMedia.Tokens.nonSpatial)
    song.CreatePlaybackModeAttr(UsdMedia.Tokens.onceFromStart)


def _to_usd(value: object, name: str) -> object:
    """Turn what JSON can hold into what customData can hold."""
    if isinstance(value, Mapping):
        return {str(key): _to_usd(value[key], f"{name}.{key}") for key in sorted(value)}
    if isinstance(value, str) and usd_read.is_absolute(value):
        raise ValueError(f"{name}: want nothing that names one machine, got {value!r}; give a path inside the studio")
    if isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, list | tuple) and value:
        if all(isinstance(item, str) for item in value):
            return Vt.StringArray([str(_to_usd(item, name)) for item in value])
        if all(isinstance(item, int) and not isinstance(item, bool) and abs(item) < 2**31 for item in value):
            return Vt.IntArray(list(value))
        if all(isinstance(item, int | float) and not isinstance(item, bool) for item in value):
            return Vt.DoubleArray(list(value))
    for item in value if isinstance(value, list | tuple) else ():
        _to_usd(item, name)
    try:
        return json.dumps(value, ensure_ascii=False, sort_keys=True, separators=(",", ":"))
    except TypeError as error:
        raise ValueError(f"{name}: want what JSON can hold, got {type(value).__name__}") from error


@contextmanager
def written_beside(path: Path) -> Iterator[Path]:
    """Give a place to write as :func:`assets.formats.beside.written_beside`, which refuses in a sentence.

    Parameters
    ----------
    path : Path

    Yields
    ------
    Path of the same suffix, in the same folder

    Raises
    ------
    OSError
        One sentence with the reason; what stood at ``path`` before still stands.
    """
    try:
        with beside.written_beside(path, suffix=path.suffix) as partial:
            yield partial
    except OSError as error:
        raise OSError(
            f"{path}: want a place to write, got: {error.strerror or error}; nothing was changed there"
        ) from error


def save(layer: Sdf.Layer, path: Path) -> None:
    """Write a layer in the format of the suffix.

    Parameters
    ----------
    layer : Sdf.Layer
    path : with a suffix of USD

    Raises
    ------
    OSError
        If it cannot be written whole.
    """
    try:
        is_written = layer.Export(str(path))
    except Tf.ErrorException as error:
        raise OSError(usd_read.reason(error)) from error
    if not is_written:
        raise OSError("USD wrote nothing")
