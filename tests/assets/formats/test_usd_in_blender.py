"""Blender opens our stages and puts every joint where our own kinematics does, within a tenth of a millimetre.

Blender's Python module lives in an environment of its own: ``make blender``, or name an interpreter that can import
``bpy`` in ODORI_BLENDER_PYTHON.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from assets.formats import usd, usd_package
from assets.formats.mesh import body
from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.types import Clip, Skeleton
from schemas import stage_contract as contract

REPOSITORY = Path(__file__).parents[3]
SCRIPT = Path(__file__).with_name("blender_joints.py")
ATOL_M = 1e-4

pytestmark = pytest.mark.blender


@pytest.fixture(scope="module")
def blender():
    """Interpreter that can import bpy."""
    python = Path(os.environ.get("ODORI_BLENDER_PYTHON", REPOSITORY / ".venv-blender" / "bin" / "python"))
    if not python.is_file():
        pytest.skip(f"no Blender at {python}; run 'make blender' or name an interpreter in ODORI_BLENDER_PYTHON")
    return python


def opened(blender, stage, frames, tmp_path):
    """What Blender says of a stage."""
    out = tmp_path / "blender.json"
    command = [blender, SCRIPT, stage, out, *map(str, frames)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(out.read_text())


def dance(*, frames, rate_hz, seed):
    """Wide turns of every joint about all axes, hips that travel and spin more than once."""
    time_s = np.arange(frames) / rate_hz
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0.2, 1.2, (22, 3)) * np.sin(2 * np.pi * time_s[:, None, None] + rng.uniform(0, 6, (22, 3)))
    turns = rotation.exp(turn)
    turns[:, 0] = rotation.mul(rotation.from_heading(5 * time_s), turns[:, 0])
    root = np.stack([2 * np.sin(time_s), 0.94 + 0.3 * np.cos(5 * time_s), 3 * time_s], -1)
    return Clip(CANONICAL, rate_hz, root, turns)


@pytest.mark.parametrize("suffix", [".usdc", ".usdz"])
def test_every_joint_stands_where_we_put_it(blender, suffix, song_wav, tmp_path):
    clip = dance(frames=91, rate_hz=60.0, seed=2)
    frames = [0, 1, 9, 17, 30, 44, 45, 60, 77, 90]
    usd.write_stage(tmp_path / "dance.usdc", clip, audio="song.wav", provenance={"song_id": "song"})
    usd_package.write_package(tmp_path / "dance.usdz", tmp_path / "dance.usdc")
    told = opened(blender, tmp_path / f"dance{suffix}", frames, tmp_path)

    assert told["status"] == ["FINISHED"]
    assert (told["frame_start"], told["frame_end"]) == (0, 90)
    parent = CANONICAL.parent
    assert told["parents"] == {joint: JOINTS[parent[k]] if k else None for k, joint in enumerate(JOINTS)}
    np.testing.assert_allclose(told["scale"], 1, atol=1e-6)

    position, orientation = kinematics.place(clip)
    got = np.array([[told["joints"][str(frame)][joint] for joint in JOINTS] for frame in frames])
    assert np.linalg.norm(got - position[frames], axis=-1).max() < ATOL_M

    shape, rest = body(CANONICAL), kinematics.rest_position(CANONICAL)
    carrier = shape.joint_index
    skinned = np.array([told["vertices"][str(frame)] for frame in frames])
    away = rotation.apply(orientation[frames][:, carrier], shape.point_xyz_m - rest[carrier])
    assert np.linalg.norm(skinned - position[frames][:, carrier] - away, axis=-1).max() < ATOL_M

    sides = [contract.SIDES[index] for index in shape.side_index]
    assert told["side_of_polygon"] == sides
    for side, color in told["materials"].items():
        np.testing.assert_allclose(color, usd.SIDE_RGB[side], atol=1e-6)


def test_a_standing_dancer_is_upright_and_looks_at_the_viewer(blender, tmp_path):
    """Told by Blender's own front view, along +Y: head up, left hand on the viewer's right, toes towards us."""
    clip = Clip(CANONICAL, 30.0, CANONICAL.offset_xyz_m[:1], np.tile(rotation.IDENTITY, (1, 22, 1)))
    usd.write_stage(tmp_path / "dance.usdc", clip)
    joints = opened(blender, tmp_path / "dance.usdc", [0], tmp_path)["joints"]["0"]
    assert joints["head"][1] > 1.5
    assert joints["leftHand"][0] > 0.6 > -0.6 > joints["rightHand"][0]
    assert joints["leftToes"][2] > joints["leftFoot"][2] + 0.1


def test_a_rig_with_names_that_usd_forbids(blender, tmp_path):
    skeleton = Skeleton(
        ("mixamorig:Hips", "Left Arm", "Left_Arm", "頭"),
        np.array([-1, 0, 1, 0]),
        np.array([[0, 1.0, 0], [0.2, 0.3, 0], [0.3, 0.1, 0.2], [0, 0.6, 0]]),
    )
    rng = np.random.default_rng(3)
    clip = Clip(skeleton, 24.0, rng.normal(size=(12, 3)), rotation.exp(rng.normal(size=(12, 4, 3))))
    usd.write_stage(tmp_path / "rig.usdc", clip)
    told = opened(blender, tmp_path / "rig.usdc", range(10), tmp_path)
    names = [path.rsplit("/")[-1] for path in usd.joint_paths(skeleton)]
    got = np.array([[told["joints"][str(frame)][name] for name in names] for frame in range(10)])
    assert np.linalg.norm(got - kinematics.place(clip)[0][:10], axis=-1).max() < ATOL_M


def test_an_interpreter_without_blender_fails_loudly(tmp_path):
    done = subprocess.run([sys.executable, SCRIPT, "a", "b"], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "bpy" in done.stderr
