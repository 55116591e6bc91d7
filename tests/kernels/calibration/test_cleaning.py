from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.calibration.cleaning import clean, low_pass, noise
from kernels.calibration.records import SENSORS, Recording
from kernels.synthetic import suit_performer


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
    made = suit_performer.made_up(1, n_frames=400)
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
    body = suit_performer.make_body(4)
    made = suit_performer.record(body, suit_performer.range_of_motion(4, n_frames=2000, frame_rate_hz=30.0), seed=4)
    assert clean(made.recording).findings == ()


def test_a_filter_acts_up_to_four_tenths_of_the_rate_and_from_sixteen_frames_on():
    rough = np.tile([0.0, 1.0], 20)
    for rate_hz, n, acts in ((30.0, 40, True), (29.9, 40, False), (120.0, 16, True), (120.0, 15, False)):
        got, gain = low_pass(rough[:n], rate_hz)
        assert (gain < 1) == acts
        assert (got != rough[:n]).any() == acts


def test_noise_is_measured_where_four_good_frames_follow_each_other():
    rng = np.random.default_rng(0)
    position, turned = rng.normal(0, 0.002, (400, 1, 3)), np.tile([1.0, 0, 0, 0], (400, 1, 1))
    position[2::4] += 5.0
    is_good = np.ones((400, 1), bool)
    is_good[2::4] = False
    assert noise(position, turned, is_good)[0][0] == 0  # never more than three
    position[:200:4] = rng.normal(0, 0.002, (50, 1, 3))
    position[2:200:4] -= 5.0
    is_good[:200] = True
    assert noise(position, turned, is_good)[0][0] == pytest.approx(0.002, rel=0.2)


def spoilt(made, **changed):
    return clean(replace(made.recording, **changed))


def test_valid_entries_without_numbers_or_without_a_direction_are_filled(perfect):
    position, turned = perfect.recording.position_xyz_m.copy(), perfect.recording.rotation_wxyz.copy()
    position[700, 3, 1] = np.nan
    turned[800, 4] = 0.0
    found = spoilt(perfect, position_xyz_m=position, rotation_wxyz=turned)
    assert found.is_filled[700, 3]
    assert found.is_filled[800, 4]
    assert np.isfinite(found.recording.position_xyz_m).all()
    np.testing.assert_allclose(found.recording.position_xyz_m[700, 3], perfect.sensor_xyz_m[700, 3], atol=0.002)


def test_many_outliers_of_a_sensor_are_told_and_few_are_not(perfect):
    rng = np.random.default_rng(0)
    for share, told in ((0.04, False), (0.08, True)):
        position = perfect.recording.position_xyz_m.copy()
        wrong = 300 + 25 * np.arange(100) if share < 0.05 else 300 + 10 * np.arange(240)
        position[wrong, 9] += 0.4 * np.sign(rng.normal(size=(len(wrong), 3)))
        found = spoilt(perfect, position_xyz_m=position).findings
        assert any("outliers" in one.sentence and one.sensor == SENSORS[9] for one in found) == told


def test_in_another_unit_outliers_are_not_judged(perfect):
    found = spoilt(perfect, position_xyz_m=100.0 * perfect.recording.position_xyz_m).findings
    assert ["multiply by" in one.sentence for one in found] == [True]
