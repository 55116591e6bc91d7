"""``odori calibrate``: alone, without a studio, on made-up recordings whose truth is known."""

import json
import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from assets.formats import bvh, suit
from kernels.calibration.records import JOINTS, SENSORS
from kernels.synthetic.suit_performer import made_up, swap
from pipelines.cli import app


@pytest.fixture(scope="module")
def made():
    return made_up(3, n_frames=1200)


@pytest.fixture
def take(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("ODORI_STUDIO", raising=False)
    place = tmp_path / "in" / "take.parquet"
    place.parent.mkdir()
    place.write_bytes(suit.format_parquet(made.recording))
    return place


def odori(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def test_json_is_exactly_what_is_promised(take, made, tmp_path):
    done = odori("calibrate", take, "--json")
    assert done.exit_code == 0, done.output
    facts = json.loads(done.stdout)
    assert set(facts) == {"joints", "poses", "seconds", "warnings"}
    assert [joint["joint"] for joint in facts["joints"]] == list(JOINTS)
    for joint in facts["joints"]:
        assert set(joint) == {
            *("joint", "parent", "length_m", "in_parent_sensor_m", "in_child_sensor_m", "confidence", "rank")
        }
        assert joint["parent"] in SENSORS
        assert len(joint["in_parent_sensor_m"]) == len(joint["in_child_sensor_m"]) == 3
        assert isinstance(joint["rank"], int)
    truth = made.body.in_child_sensor_m
    found = np.array([joint["in_child_sensor_m"] for joint in facts["joints"]])
    assert np.median(np.linalg.norm(found - truth, axis=-1)) < 0.003
    assert {"read", "total"} <= set(facts["seconds"])


def test_poses_are_one_row_a_frame_and_joint_in_the_recordings_world(take, made):
    facts = json.loads(odori("calibrate", take, "--json").stdout)
    table = pq.read_table(facts["poses"])
    assert table.column_names == ["frame_index", "joint", "x_m", "y_m", "z_m"]
    assert table.num_rows == 1200 * 16
    assert table["joint"].to_pylist()[:16] == list(JOINTS)
    assert table["frame_index"].to_numpy()[::16].tolist() == list(range(1200))
    place = np.stack([table[f"{c}_m"].to_numpy() for c in "xyz"], -1).reshape(1200, 16, 3)
    away = np.linalg.norm(place - made.joint_xyz_m[:, 1:], axis=-1)
    assert np.sqrt(np.mean(away**2)) < 0.004
    assert np.ptp(np.linalg.norm(place[:, 4] - place[:, 3], axis=-1)) < 1e-6  # a bone keeps its length


def test_report_bvh_and_places_to_write(take, tmp_path):
    done = odori("calibrate", take, "--bvh", tmp_path / "o.bvh", "--poses", tmp_path / "p.parquet")
    assert done.exit_code == 0, done.output
    assert "1200 frames, 10.0 s at 120 Hz" in done.stdout
    assert all(joint in done.stdout for joint in JOINTS)
    assert pq.read_table(tmp_path / "p.parquet").num_rows == 1200 * 16
    clip = bvh.to_clip(bvh.read(tmp_path / "o.bvh"))
    assert (clip.clip.n_frames, clip.clip.frame_rate_hz) == (1200, 120.0)
    assert set(SENSORS) <= set(clip.clip.skeleton.joints)
    assert [p.name for p in (tmp_path / "in").iterdir()] == ["take.parquet"]  # inputs are only read


def test_same_recording_same_bytes(take, tmp_path):
    for name in ("a", "b"):
        odori("calibrate", take, "--poses", tmp_path / name, "--bvh", tmp_path / f"{name}.bvh")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert (tmp_path / "a.bvh").read_bytes() == (tmp_path / "b.bvh").read_bytes()


def test_method_and_steps_reach_the_solver(take, tmp_path):
    for steps in (1, 30):
        odori("calibrate", take, "--method", "springs", "--iterations", steps, "--poses", tmp_path / f"{steps}")
    one, thirty = (pq.read_table(tmp_path / f"{steps}")["x_m"].to_numpy() for steps in (1, 30))
    assert np.abs(one - thirty).max() > 1e-4
    done = odori("calibrate", take, "--method", "magic")
    assert done.exit_code == 2
    assert "want one of gauss_newton, springs, got 'magic'" in done.stderr


def test_settings_of_a_studio_count(take, tmp_path):
    (tmp_path / "odori.toml").write_text("[calibration]\nmethod = 'none'\n")
    done = odori("calibrate", take, "--studio", tmp_path)
    assert done.exit_code == 2
    assert "[calibration] method: want one of" in done.stderr


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (lambda r: swap(r, {"l_forearm": "l_hand"}), "l_forearm"),
        (lambda r: swap(r, {a: "r" + a[1:] for a in ("l_thigh", "l_shank", "l_foot")}), "thigh"),
    ],
)
def test_faults_go_to_standard_error_and_end_with_two(take, made, spoil, word):
    take.write_bytes(suit.format_parquet(spoil(made.recording)))
    done = odori("calibrate", take, "--json")
    assert done.exit_code == 2
    assert word in done.stderr
    facts = json.loads(done.stdout)
    assert facts["error"]
    assert any(fault["severity"] == "error" for fault in facts["faults"])


def test_a_joint_that_did_not_move_is_named_and_the_others_are_told(take):
    take.write_bytes(suit.format_parquet(made_up(3, n_frames=1200, frozen=("head",)).recording))
    done = odori("calibrate", take, "--json")
    assert done.exit_code == 2
    assert "head" in done.stderr
    facts = json.loads(done.stdout)
    rank = {joint["joint"]: joint["rank"] for joint in facts["joints"]}
    assert rank["head"] < 2
    assert rank["l_hand"] == 3
    assert facts["poses"] is None


@pytest.mark.parametrize(
    ("name", "data", "word"),
    [
        ("no.csv", None, "cannot be read: No such file"),
        ("empty.csv", b"", "an empty file"),
        ("clips.csv", b"file,label\na.bvh,spin\n", "want a suit recording with the columns"),
        ("cut.parquet", b"PAR1cut", "ends early"),
        ("walk.bvh", b"HIERARCHY\nROOT hips\n", "want a table"),
    ],
)
def test_what_is_no_recording(tmp_path, name, data, word):
    if data is not None:
        (tmp_path / name).write_bytes(data)
    done = odori("calibrate", tmp_path / name)
    assert done.exit_code == 2
    assert word in done.stderr
    assert not done.stdout.strip()


def test_dagster_is_not_loaded_for_it():
    code = "import sys, pipelines.commands.calibrate_recording; sys.exit('dagster' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
