"""Stages read back: the same dance, and one clear sentence for anything else."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from assets.formats import usd, usd_read
from assets.formats.errors import FormatError
from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.types import Clip, Skeleton
from schemas import stage_contract as contract


@pytest.fixture
def written(swaying, tmp_path):
    path = tmp_path / "dance.usdc"
    usd.write_stage(path, swaying)
    return path


def test_what_was_written_comes_back(written, swaying):
    clip = usd_read.read_animation(written)
    assert clip.skeleton.joints == JOINTS
    assert clip.frame_rate_hz == swaying.frame_rate_hz
    assert clip.translation_xyz_m is None
    np.testing.assert_array_equal(clip.skeleton.parent, CANONICAL.parent)
    np.testing.assert_allclose(clip.skeleton.offset_xyz_m, CANONICAL.offset_xyz_m, atol=1e-12)
    np.testing.assert_allclose(clip.root_xyz_m, swaying.root_xyz_m, atol=1e-6)
    assert rotation.angle_between(clip.rotation_wxyz, swaying.rotation_wxyz).max() < 1e-6
    np.testing.assert_allclose(kinematics.place(clip)[0], kinematics.place(swaying)[0], atol=5e-6)


def test_joints_that_move_and_names_that_usd_forbids_come_back(tmp_path):
    skeleton = Skeleton(("rig:Hips", "Left Leg"), np.array([-1, 0]), np.array([[0, 1, 0], [0, -0.5, 0.0]]))
    moving = np.array([[[0, 1, 0], [0, -0.5, 0]], [[0, 1, 0], [0, -0.7, 0.0]]])
    clip = Clip(skeleton, 24.0, moving[:, 0], np.tile(rotation.IDENTITY, (2, 2, 1)), moving)
    usd.write_stage(tmp_path / "a.usdc", clip)
    read = usd_read.read_animation(tmp_path / "a.usdc")
    assert read.skeleton.joints == skeleton.joints
    np.testing.assert_allclose(read.translation_xyz_m, moving, atol=1e-6)


def test_units_become_metres(written, tmp_path, swaying):
    stage = Usd.Stage.Open(str(written))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    stage.Export(str(tmp_path / "centimetres.usda"))
    clip = usd_read.read_animation(tmp_path / "centimetres.usda")
    np.testing.assert_allclose(clip.root_xyz_m, 0.01 * swaying.root_xyz_m, atol=1e-6)
    np.testing.assert_allclose(clip.skeleton.offset_xyz_m, 0.01 * CANONICAL.offset_xyz_m, atol=1e-9)


def test_one_frame(tmp_path, swaying):
    usd.write_stage(tmp_path / "a.usdc", Clip(CANONICAL, 30.0, swaying.root_xyz_m[:1], swaying.rotation_wxyz[:1]))
    assert usd_read.read_animation(tmp_path / "a.usdc").n_frames == 1


def test_a_stage_of_another_hand(data_dir):
    """Partly animated joints get their rest from the Skeleton."""
    clip = usd_read.read_animation(data_dir / "usd" / "doxygen__skinnedArm.usda")
    assert clip.skeleton.joints == ("Shoulder", "Elbow", "Hand")
    assert clip.n_frames == 2
    np.testing.assert_allclose(clip.skeleton.offset_xyz_m[2], [0, 0, 0.02])
    assert rotation.angle_between(clip.rotation_wxyz[0], clip.rotation_wxyz[1]) == pytest.approx(
        [0, np.pi / 2, 0], abs=1e-4
    )


def test_no_provenance_is_an_empty_one(written):
    assert usd_read.read_provenance(written) == {}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "want a file, got none"),
        (b"", "want a USD stage, got an empty file"),
        (b"HIERARCHY\nROOT hips\n", "want a USD stage, got a file USD cannot open"),
        (b"PXR-USDC" + bytes(100), "want a USD stage, got a file USD cannot open"),
    ],
)
@pytest.mark.parametrize("suffix", [".usdc", ".usd", ".usda", ".usdz", ".bvh"])
def test_what_is_no_stage_is_told(tmp_path, content, message, suffix):
    path = tmp_path / f"a{suffix}"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FormatError, match=message):
        usd_read.open_stage(path)


def test_a_folder_is_no_stage(tmp_path):
    with pytest.raises(FormatError, match="want a file, got none"):
        usd_read.open_stage(tmp_path)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.999])
def test_a_truncated_stage_is_told(written, share):
    whole = written.read_bytes()
    written.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(FormatError, match="want a USD stage"):
        usd_read.read_animation(written)


def test_other_axes_and_stages_without_dance_are_told(written, tmp_path):
    stage = Usd.Stage.Open(str(written))
    UsdGeom.SetStageUpAxis(stage, "Z")
    stage.Export(str(tmp_path / "z.usda"))
    with pytest.raises(FormatError, match="upAxis: want Y, got Z"):
        usd_read.read_animation(tmp_path / "z.usda")
    UsdGeom.SetStageUpAxis(stage, "Y")
    stage.RemovePrim(contract.ANIMATION_PATH)
    stage.Export(str(tmp_path / "still.usda"))
    with pytest.raises(FormatError, match="want a skeleton with a bound animation, got none"):
        usd_read.read_animation(tmp_path / "still.usda")


@pytest.mark.parametrize(
    ("text", "is_one_machine"),
    [
        ("/a", True),
        ("~/a", True),
        ("C:\\a", True),
        ("d:/a", True),
        ("file:///a", True),
        ("\\\\host\\a", True),
        ("clips/a.bvh", False),
        ("a", False),
        ("", False),
        ("studio_a-2024_05_11-t03", False),
    ],
)
def test_absolute_paths_are_known(text, is_one_machine):
    assert usd_read.is_absolute(text) == is_one_machine
