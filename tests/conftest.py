"""Fixtures shared by all tests."""

import os
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdSkel, Vt

from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.types import Skeleton

REPOSITORY = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder of real recordings and songs; the test is skipped where there is none."""
    folder = Path(os.environ.get("ODORI_TEST_DATA") or REPOSITORY.parent / "shared" / "data")
    if not (folder / "README.md").is_file():
        pytest.skip(f"no real test data at {folder}; name a folder in ODORI_TEST_DATA")
    return folder


@pytest.fixture
def write_hero():
    """Write a rigged human character as other programs do: (path, ...) to a USD file."""

    def write(
        path: Path,
        *,
        metres: float = 0.01,
        up: str = "Z",
        size: float = 0.8,
        arm_rad: float = 0.7,
        rigs: tuple[str, ...] = ("Rig",),
        inner_scale: float = 1.0,
        texture: str = "",
    ) -> Path:
        from assets.formats.mesh import body

        stage = Usd.Stage.CreateNew(str(path))
        UsdGeom.SetStageUpAxis(stage, up)
        UsdGeom.SetStageMetersPerUnit(stage, metres)
        top = UsdGeom.Xform.Define(stage, "/Hero")
        stage.SetDefaultPrim(top.GetPrim())
        top.AddTranslateOp().Set(Gf.Vec3d(0.3 / metres, 0, 0))
        # The body in the world, metres, Y up: bones of its own, arms lowered, any joint frames.
        bones = CANONICAL.offset_xyz_m * size
        for side in ("left", "right"):
            bones[JOINTS.index(f"{side}LowerLeg")] *= 1.2
        skeleton = Skeleton(JOINTS, CANONICAL.parent, bones)
        turned = np.tile(rotation.IDENTITY, (22, 1))
        for sign, side in ((-1, "left"), (1, "right")):
            turned[JOINTS.index(f"{side}UpperArm")] = rotation.from_axis_angle(np.array([0, 0, 1.0]), sign * arm_rad)
        place, pose = (values[0] for values in kinematics.forward(skeleton, bones[:1], turned[None]))
        feet = [JOINTS.index(side + part) for side in ("left", "right") for part in ("Foot", "Toes")]
        place[:, 1] -= place[feet, 1].min() - 0.02 * size
        frame = rotation.exp(np.random.default_rng(3).normal(size=(22, 3)))
        lift = rotation.from_axis_angle(np.array([1.0, 0, 0]), np.pi / 2 if up == "Z" else 0.0)

        def to_file(xyz):
            return rotation.apply(lift, xyz) / metres / inner_scale

        bind = np.tile(np.eye(4), (22, 1, 1))
        bind[:, :3, :3] = np.swapaxes(rotation.to_matrix(rotation.mul(lift, frame)), -1, -2)
        bind[:, 3, :3] = to_file(place)
        rest = [bind[k] @ np.linalg.inv(bind[p]) if p >= 0 else bind[k] for k, p in enumerate(CANONICAL.parent)]
        names = [f"hero_{name}" for name in JOINTS]
        joints: list[str] = []
        for k, p in enumerate(CANONICAL.parent):
            joints.append(names[k] if p < 0 else f"{joints[p]}/{names[k]}")
        shape = body(skeleton)
        local = shape.point_xyz_m - kinematics.rest_position(skeleton)[shape.joint_index]
        point = place[shape.joint_index] + rotation.apply(pose[shape.joint_index], local)
        for rig in rigs:
            root = UsdSkel.Root.Define(stage, f"/Hero/{rig}")
            if inner_scale != 1:
                root.AddScaleOp().Set(Gf.Vec3f(inner_scale))
            skel = UsdSkel.Skeleton.Define(stage, f"/Hero/{rig}/Skel")
            skel.CreateJointsAttr(joints)
            skel.CreateRestTransformsAttr(Vt.Matrix4dArray.FromNumpy(np.array(rest)))
            skel.CreateBindTransformsAttr(Vt.Matrix4dArray.FromNumpy(bind))
            mesh = UsdGeom.Mesh.Define(stage, f"/Hero/{rig}/Geo")
            mesh.CreateSubdivisionSchemeAttr("none")
            mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(to_file(point).astype(np.float32)))
            mesh.CreateFaceVertexCountsAttr([3] * len(shape.triangle))
            mesh.CreateFaceVertexIndicesAttr(shape.triangle.ravel().tolist())
            binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
            binding.CreateSkeletonRel().SetTargets([skel.GetPath()])
            binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1))
            binding.CreateJointIndicesPrimvar(False, 1).Set(Vt.IntArray(shape.joint_index.tolist()))
            binding.CreateJointWeightsPrimvar(False, 1).Set(Vt.FloatArray([1.0] * len(point)))
        if texture:
            shader = UsdShade.Shader.Define(stage, "/Hero/Looks/Skin")
            shader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(texture))
        stage.Save()
        return path

    return write
