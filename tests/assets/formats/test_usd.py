"""What a written stage holds, told by USD's own library; same bytes; nothing half-written."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdMedia, UsdShade, UsdSkel

from assets.formats import usd, usd_read
from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.types import Clip, Skeleton
from schemas import stage_contract as contract

REPOSITORY = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def stage(swaying, tmp_path_factory):
    path = tmp_path_factory.mktemp("stage") / "dance.usdc"
    usd.write_stage(path, swaying, audio="song.wav", provenance={"song_id": "song"}, title="a dance")
    return Usd.Stage.Open(str(path))


def still(skeleton=CANONICAL, *, frames=1, rotation_wxyz=None):
    turns = np.tile(rotation.IDENTITY, (frames, len(skeleton.joints), 1)) if rotation_wxyz is None else rotation_wxyz
    return Clip(skeleton, 30.0, np.tile(skeleton.offset_xyz_m[0], (frames, 1)), turns)


def test_quaternions_keep_their_real_part(tmp_path):
    turns = np.tile(rotation.IDENTITY, (1, 22, 1))
    turns[0, 3] = [0.1, 0.3, 0.5, 0.806225774829855]
    usd.write_stage(tmp_path / "a.usdc", still(rotation_wxyz=turns))
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    stored = UsdSkel.Animation(stage.GetPrimAtPath(contract.ANIMATION_PATH)).GetRotationsAttr().Get(0)[3]
    assert stored.GetReal() == pytest.approx(0.1)
    assert tuple(stored.GetImaginary()) == pytest.approx((0.3, 0.5, 0.806225774829855))


def test_axis_unit_rate_and_range(stage, swaying):
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == swaying.frame_rate_hz
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, swaying.n_frames - 1)


def test_default_prim_is_a_component_with_the_title(stage):
    prim = stage.GetDefaultPrim()
    assert prim.GetPath() == contract.ROOT_PATH
    assert prim.IsA(UsdSkel.Root)
    assert Usd.ModelAPI(prim).GetKind() == "component"
    assert Usd.ModelAPI(prim).GetAssetName() == "a dance"


def test_joints_end_in_the_vrm_names_at_rest(stage):
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath(contract.SKELETON_PATH))
    joints = skeleton.GetJointsAttr().Get()
    assert [joint.rsplit("/")[-1] for joint in joints] == list(JOINTS)
    assert joints[JOINTS.index("neck")] == "hips/spine/chest/upperChest/neck"
    assert not skeleton.GetJointNamesAttr().HasAuthoredValue()
    rest, bind = (np.array(a.Get()) for a in (skeleton.GetRestTransformsAttr(), skeleton.GetBindTransformsAttr()))
    np.testing.assert_allclose(rest[:, 3, :3], CANONICAL.offset_xyz_m)
    np.testing.assert_allclose(bind[:, 3, :3], kinematics.rest_position(CANONICAL))
    np.testing.assert_array_equal(rest[:, :3, :3], np.tile(np.eye(3), (22, 1, 1)))


def test_animation_is_in_skeleton_order_with_every_frame_sampled(stage, swaying):
    animation = UsdSkel.Animation(stage.GetPrimAtPath(contract.ANIMATION_PATH))
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath(contract.SKELETON_PATH))
    assert animation.GetJointsAttr().Get() == skeleton.GetJointsAttr().Get()
    for attribute in (animation.GetRotationsAttr(), animation.GetTranslationsAttr()):
        assert attribute.GetTimeSamples() == list(range(swaying.n_frames))
    np.testing.assert_array_equal(np.array(animation.GetScalesAttr().Get()), np.ones((22, 3)))
    moved = np.array(animation.GetTranslationsAttr().Get(17))
    np.testing.assert_allclose(moved[0], swaying.root_xyz_m[17], atol=1e-6)
    np.testing.assert_allclose(moved[1:], CANONICAL.offset_xyz_m[1:], atol=1e-6)


def test_usd_places_every_joint_where_we_do(stage, swaying):
    query = usd_read.animated_skeleton(stage)
    position, _ = kinematics.place(swaying)
    for frame in (0, 13, 40):
        world = np.array(query.ComputeJointSkelTransforms(frame))
        np.testing.assert_allclose(world[:, 3, :3], position[frame], atol=2e-6)


def test_usd_skins_the_body_as_rigid_parts(stage, swaying):
    cache, root = UsdSkel.Cache(), UsdSkel.Root(stage.GetDefaultPrim())
    cache.Populate(root, Usd.PrimDefaultPredicate)
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    (target,) = binding.GetSkinningTargets()
    position, orientation = kinematics.place(swaying)
    rest = np.array(UsdGeom.Mesh(target.GetPrim()).GetPointsAttr().Get(), np.float64)
    carrier = np.array(target.GetJointIndicesPrimvar().Get())
    extent = np.array(root.GetExtentAttr().Get())
    for frame in (0, 20, 40):
        points = UsdGeom.Mesh(target.GetPrim()).GetPointsAttr().Get()
        turned = cache.GetSkelQuery(binding.GetSkeleton()).ComputeSkinningTransforms(frame)
        assert target.ComputeSkinnedPoints(turned, points, frame)
        away = rotation.apply(orientation[frame, carrier], rest - kinematics.rest_position(CANONICAL)[carrier])
        np.testing.assert_allclose(np.array(points), position[frame, carrier] + away, atol=1e-5)
        assert (np.array(points) >= extent[0]).all()
        assert (np.array(points) <= extent[1]).all()


def test_binding_api_is_applied_and_the_animation_bound(stage):
    for path in (contract.ROOT_PATH, contract.SKELETON_PATH, contract.MESH_PATH):
        assert stage.GetPrimAtPath(path).HasAPI(UsdSkel.BindingAPI), path
    source = UsdSkel.BindingAPI(stage.GetPrimAtPath(contract.SKELETON_PATH)).GetAnimationSourceRel().GetTargets()
    assert source == [contract.ANIMATION_PATH]


def test_left_and_right_have_their_own_material_and_colour(stage):
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(contract.MESH_PATH))
    color = np.array(mesh.GetDisplayColorPrimvar().Get())
    point, faces = np.array(mesh.GetPointsAttr().Get()), np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    n_faces = 0
    for side, sign in (("left", 1), ("right", -1), ("middle", 0)):
        prim = stage.GetPrimAtPath(f"{contract.MESH_PATH}/{side}")
        chosen = faces[np.array(UsdGeom.Subset(prim).GetIndicesAttr().Get())].ravel()
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        assert material.GetPath() == f"{contract.LOOKS_PATH}/{side}"
        surface = material.ComputeSurfaceSource()[0]
        np.testing.assert_allclose(surface.GetInput("diffuseColor").Get(), usd.SIDE_RGB[side], rtol=1e-6)
        np.testing.assert_allclose(color[chosen], np.tile(usd.SIDE_RGB[side], (len(chosen), 1)), rtol=1e-6)
        assert sign == 0 or (sign * point[chosen, 0] > 0).all()
        n_faces += len(chosen) // 3
    assert n_faces == len(faces)


def test_song_starts_with_the_stage_and_fills_the_room(stage):
    song = UsdMedia.SpatialAudio(stage.GetPrimAtPath(contract.AUDIO_PATH))
    assert song.GetFilePathAttr().Get().path == "./song.wav"
    assert song.GetAuralModeAttr().Get() == "nonSpatial"
    assert not song.GetStartTimeAttr().HasAuthoredValue()
    assert song.GetStartTimeAttr().Get().GetValue() == 0


def test_no_song_no_prim(tmp_path):
    usd.write_stage(tmp_path / "a.usdc", still())
    assert not Usd.Stage.Open(str(tmp_path / "a.usdc")).GetPrimAtPath(contract.AUDIO_PATH)


def test_names_that_usd_forbids_are_kept_beside_legal_ones(tmp_path):
    names = ("mixamorig:Hips", "Left Hand", "Left_Hand", "腰", "2nd", "")
    skeleton = Skeleton(names, np.array([-1, 0, 0, 0, 1, 4]), np.tile([0.0, 0.1, 0.0], (6, 1)))
    paths = usd.joint_paths(skeleton)
    assert paths == [
        "mixamorig_Hips",
        "mixamorig_Hips/Left_Hand",
        "mixamorig_Hips/Left_Hand_2",
        "mixamorig_Hips/_",
        "mixamorig_Hips/Left_Hand/_2nd",
        "mixamorig_Hips/Left_Hand/_2nd/__2",
    ]
    usd.write_stage(tmp_path / "a.usdc", still(skeleton))
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    written = UsdSkel.Skeleton(stage.GetPrimAtPath(contract.SKELETON_PATH))
    assert list(written.GetJointsAttr().Get()) == paths
    assert list(written.GetJointNamesAttr().Get()) == list(names)


def test_signs_of_quaternions_are_made_continuous(tmp_path, swaying):
    flipped = swaying.rotation_wxyz * np.where(np.arange(41) % 2, 1.0, -1.0)[:, None, None]
    usd.write_stage(tmp_path / "a.usdc", Clip(CANONICAL, 30.0, swaying.root_xyz_m, flipped))
    usd.write_stage(tmp_path / "b.usdc", swaying)
    assert (tmp_path / "a.usdc").read_bytes() == (tmp_path / "b.usdc").read_bytes()


def test_joints_that_move_are_written_as_they_move(tmp_path, swaying):
    local = np.tile(CANONICAL.offset_xyz_m, (41, 1, 1)) * np.linspace(1, 1.1, 41)[:, None, None]
    clip = Clip(CANONICAL, 30.0, swaying.root_xyz_m, swaying.rotation_wxyz, local)
    usd.write_stage(tmp_path / "a.usdc", clip)
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    query = usd_read.animated_skeleton(stage)
    np.testing.assert_allclose(
        np.array(query.ComputeJointSkelTransforms(40))[:, 3, :3], kinematics.place(clip)[0][40], atol=2e-6
    )


@pytest.mark.parametrize("rate_hz", [24.0, 29.97, 60.0, 119.88])
def test_any_rate(tmp_path, rate_hz):
    usd.write_stage(tmp_path / "a.usdc", Clip(CANONICAL, rate_hz, still().root_xyz_m, still().rotation_wxyz))
    assert Usd.Stage.Open(str(tmp_path / "a.usdc")).GetTimeCodesPerSecond() == rate_hz


def test_provenance_is_kept_as_usd_or_as_json(tmp_path):
    provenance = {
        "song_id": "naïve 曲",
        "seed": 3,
        "warp": 0.5,
        "is_pinned": True,
        "clips": ["a", "b"],
        "counts": [1, 2],
        "costs": [0.5, 2],
        "steps": [{"clip_id": "a", "at_s": 1.5}],
        "nothing": None,
        "graph": {"nodes": 7, "method": "graph"},
    }
    usd.write_stage(tmp_path / "a.usdc", still(), provenance=provenance)
    read = usd_read.read_provenance(tmp_path / "a.usdc")
    assert read == provenance | {"steps": '[{"at_s":1.5,"clip_id":"a"}]', "nothing": "null"}


MAKE = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from assets.formats import usd, usd_package
from kernels import rotation
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Clip
turn = np.random.default_rng(1).normal(size=(50, 22, 3))
clip = Clip(CANONICAL, 30.0, turn[:, 0], rotation.exp(turn))
usd.write_stage("a.usdc", clip, audio="song.wav", provenance={"b": {"y": 1, "x": ["q"]}, "a": 2})
usd_package.write_package("a.usdz", "a.usdc")
"""


def test_two_processes_write_the_same_bytes(tmp_path, song_wav):
    written = []
    for seed in ("1", "2"):
        folder = tmp_path / f"run {seed}"
        folder.mkdir()
        (folder / "song.wav").write_bytes(song_wav.read_bytes())
        subprocess.run(
            [sys.executable, "-c", MAKE, str(REPOSITORY)], cwd=folder, env={"PYTHONHASHSEED": seed}, check=True
        )
        written.append([(folder / name).read_bytes() for name in ("a.usdc", "a.usdz")])
        assert str(tmp_path).encode() not in b"".join(written[-1])
        assert sorted(path.name for path in folder.iterdir()) == ["a.usdc", "a.usdz", "song.wav"]
    assert written[0] == written[1]


FILL = """
import resource, signal, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from assets.formats import usd
from kernels import rotation
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Clip
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000))
turn = np.random.default_rng(1).normal(size=(50, 22, 3))
try:
    usd.write_stage("a.usdc", Clip(CANONICAL, 30.0, turn[:, 0], rotation.exp(turn)))
except OSError as error:
    sys.stdout.write(str(error))
"""


def test_a_full_disk_leaves_the_old_file_and_one_sentence(tmp_path):
    (tmp_path / "a.usdc").write_bytes(b"old")
    done = subprocess.run(
        [sys.executable, "-c", FILL, str(REPOSITORY)], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("a.usdc: want a place to write, got: ")
    assert "File too large" in done.stdout
    assert "\n" not in done.stdout
    assert (tmp_path / "a.usdc").read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.usdc"]


def test_a_folder_that_is_a_file_is_told(tmp_path):
    (tmp_path / "dances").write_bytes(b"")
    with pytest.raises(OSError, match=r"a\.usdc: want a place to write, got: "):
        usd.write_stage(tmp_path / "dances" / "a.usdc", still())


def test_folders_are_made(tmp_path):
    usd.write_stage(tmp_path / "dances" / "song" / "graph.usdc", still())
    assert [path.name for path in (tmp_path / "dances" / "song").iterdir()] == ["graph.usdc"]


@pytest.mark.parametrize("audio", ["/songs/a.wav", "C:\\a.wav", "song.mp3", "~/a.wav", "file:///a.wav", ""])
def test_songs_are_named_relative_and_as_wave(tmp_path, audio):
    with pytest.raises(ValueError, match="audio: want a relative path of a WAV file"):
        usd.write_stage(tmp_path / "a.usdc", still(), audio=audio)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("provenance", "message"),
    [
        ({"clip": "/data/a.bvh"}, "provenance.clip: want nothing that names one machine"),
        ({"a": {"clips": ["x", "D:\\a.bvh"]}}, "provenance.a.clips: want nothing that names one machine"),
        ({"steps": [{"path": "/data/a.bvh"}]}, "provenance.steps.path: want nothing that names one machine"),
        ({"when": object()}, "provenance.when: want what JSON can hold, got object"),
    ],
)
def test_provenance_that_means_nothing_elsewhere_is_refused(tmp_path, provenance, message):
    with pytest.raises(ValueError, match=message):
        usd.write_stage(tmp_path / "a.usdc", still(), provenance=provenance)


def test_what_cannot_be_a_stage_is_refused(tmp_path, swaying):
    with pytest.raises(ValueError, match=r"path: want a name ending in \.usdc, got 'a\.usda'"):
        usd.write_stage(tmp_path / "a.usda", swaying)
    with pytest.raises(ValueError, match="clip: want at least one frame"):
        usd.write_stage(tmp_path / "a.usdc", still(frames=0))
    turns = np.array(swaying.rotation_wxyz)
    turns[4, 2] *= 2
    with pytest.raises(ValueError, match="got length 2 at frame 4, joint chest"):
        usd.write_stage(tmp_path / "a.usdc", Clip(CANONICAL, 30.0, swaying.root_xyz_m, turns))
    assert not list(tmp_path.iterdir())
