from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.calibration.cleaning import clean, low_pass, noise
from kernels.calibration.records import SENSORS, Recording
from kernels.synthetic import suit


def test_noise_is_measured_under_motion(made, cleaned):
    assert np.abs(cleaned.position_noise_m - 0.002).max() < 2e-4
    assert np.abs(np.degrees(cleaned.rotation_noise_rad) - 1.0).max() < 0.1
    silent = noise(np.zeros((3, 17, 3)), np.zeros((3, 17, 4)), np.ones((3, 17), bool))
    assert (silent[0] == 0).all()


def test_every_outlier_is_found_and_little_else(made, cleaned):
    flagged = cleaned.is_filled & made.recording.is_valid
    assert flagged[made.is_outlier].mean() > 0.99
    assert flagged[~made.is_outlier].mean() < 0.01
    assert cleaned.n_outliers.sum() == flagged.sum()


def test_what_comes_out_is_whole_unit_and_continuous(made, cleaned):
    q = cleaned.recording.rotation_wxyz
    assert np.isfinite(cleaned.recording.position_xyz_m).all()
    np.testing.assert_allclose(np.linalg.norm(q, axis=-1), 1.0, atol=1e-12)
    assert (np.sum(q[1:] * q[:-1], axis=-1) > 0).all()
    np.testing.assert_array_equal(cleaned.recording.is_valid, made.recording.is_valid)
    assert (cleaned.is_filled | made.recording.is_valid).all()
    assert cleaned.findings == ()


def test_filtering_brings_sensors_nearer_to_the_truth(made, cleaned):
    good = ~cleaned.is_filled
    off = np.linalg.norm(cleaned.recording.position_xyz_m - made.sensor_xyz_m, axis=-1)[good]
    received = np.linalg.norm(made.recording.position_xyz_m - made.sensor_xyz_m, axis=-1)[good]
    assert np.sqrt(np.mean(off**2)) < 0.5 * np.sqrt(np.mean(received**2))


def test_signs_of_quaternions_do_not_matter(made, cleaned):
    flip = np.where(np.random.default_rng(1).random(made.recording.is_valid.shape) < 0.5, -1.0, 1.0)
    other = clean(replace(made.recording, rotation_wxyz=made.recording.rotation_wxyz * flip[..., None]))
    apart = rotation.angle_between(other.recording.rotation_wxyz, cleaned.recording.rotation_wxyz)
    assert apart.max() < 1e-6


def test_low_pass_keeps_slow_and_stops_fast():
    time_s = np.arange(1200) / 120
    slow, fast = np.sin(2 * np.pi * time_s), np.sin(2 * np.pi * 40 * time_s)
    got, gain = low_pass(np.stack([slow, fast], 1), 120.0)
    assert np.abs(got[100:-100, 0] - slow[100:-100]).max() < 0.01
    assert np.abs(got[100:-100, 1]).max() < 0.02
    assert gain == pytest.approx(0.167, abs=0.002)  # analytic 0.833 * 12 / 60
    same, gain = low_pass(np.ones((50, 1)), 24.0)
    assert gain == 1.0
    np.testing.assert_array_equal(same, np.ones((50, 1)))


def test_a_sensor_that_says_nothing_is_named():
    made = suit.made_up(1, n_frames=400)
    is_valid = made.recording.is_valid.copy()
    is_valid[:, 4] = False
    found = clean(replace(made.recording, is_valid=is_valid))
    assert [(one.severity, one.sensor) for one in found.findings] == [("error", "l_upper_arm")]
    assert np.isfinite(found.recording.position_xyz_m).all()


def test_no_frames_give_none():
    empty = Recording(120.0, SENSORS, np.zeros((0, 17, 3)), np.zeros((0, 17, 4)), np.zeros((0, 17), bool))
    found = clean(empty)
    assert found.recording.n_frames == 0
    assert found.findings[0].severity == "error"


def test_slow_trackers_raise_no_alarm():
    body = suit.make_body(4)
    made = suit.record(body, suit.range_of_motion(4, n_frames=2000, frame_rate_hz=30.0), seed=4)
    assert clean(made.recording).findings == ()
