from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.calibration.body_faults import _loose, _movement, _sides, find_body_faults, move_to_repeat
from kernels.calibration.cleaning import clean
from kernels.calibration.joints import PairSolution, solve_joints
from kernels.calibration.records import JOINTS, PARENT, SENSORS, Cleaned, Recording
from kernels.synthetic import suit_performer


def faults(made):
    cleaned = clean(made.recording)
    return find_body_faults(cleaned, solve_joints(cleaned))


def test_good_bodies_have_none(cleaned, pairs):
    assert find_body_faults(cleaned, pairs) == ()


def test_a_joint_that_does_not_move_is_an_error_with_a_remedy():
    found = faults(suit_performer.made_up(3, n_frames=2500, frozen=("head",)))
    assert [(one.severity, one.sensor) for one in found] == [("error", "head")]
    assert "head rolls" in found[0].sentence


def test_an_exact_hinge_is_a_warning():
    found = faults(suit_performer.made_up(3, n_frames=3000, hinged=("l_shank", "r_shank")))
    assert [(one.severity, one.sensor) for one in found] == [("warning", "l_shank"), ("warning", "r_shank")]


@pytest.mark.parametrize(("one", "other"), [("pelvis", "r_foot"), ("thorax", "head"), ("l_hand", "r_hand")])
def test_exchanged_labels_are_both_named(made, one, other):
    cleaned = clean(suit_performer.swap(made.recording, {one: other}))
    found = find_body_faults(cleaned, solve_joints(cleaned))
    assert found[0].severity == "error"
    assert {one, other} == set(found[0].sentence.split(":")[0].split(", "))


def test_labels_exchanged_in_a_ring_are_told_step_by_step(made):
    ring = suit_performer.swap(
        suit_performer.swap(made.recording, {"l_upper_arm": "l_forearm"}), {"l_forearm": "l_hand"}
    )
    cleaned = clean(ring)
    found = [one for one in find_body_faults(cleaned, solve_joints(cleaned)) if "exchange the labels" in one.sentence]
    assert len(found) == 2
    mended = ring
    for one in found:
        a, b = one.sentence.split(":")[0].split(", ")
        mended = suit_performer.swap(mended, {a: b})
    np.testing.assert_array_equal(mended.is_valid, made.recording.is_valid)


def test_the_world_may_be_turned(made, pairs, cleaned):
    # a rule that used the direction of gravity would fail here
    turn = np.array([0.5, -0.5, 0.5, 0.5])
    turned = replace(
        cleaned,
        recording=replace(
            cleaned.recording,
            position_xyz_m=rotation.apply(turn, cleaned.recording.position_xyz_m),
            rotation_wxyz=rotation.mul(turn, cleaned.recording.rotation_wxyz),
        ),
    )
    assert find_body_faults(turned, pairs) == ()


def test_a_sensor_that_is_not_on_the_body_is_an_error(made):
    recording = made.recording
    position, turned = recording.position_xyz_m.copy(), recording.rotation_wxyz.copy()
    hand = SENSORS.index("l_hand")
    jitter = np.random.default_rng(0).normal(0, 0.001, (len(position), 3))
    position[:, hand] = np.where(recording.is_valid[:, hand, None], np.array([1.0, 0.2, 0.8]) + jitter, np.nan)
    turned[recording.is_valid[:, hand], hand] = [0.6, 0.0, 0.8, 0.0]
    found = faults(replace(made, recording=replace(recording, position_xyz_m=position, rotation_wxyz=turned)))
    assert [(one.severity, one.sensor) for one in found] == [("error", "l_hand")]
    assert "moves with l_forearm" in found[0].sentence


def test_there_is_a_movement_for_every_joint():
    assert len({move_to_repeat(name) for name in SENSORS[1:]}) == 9


@pytest.mark.parametrize(
    ("n_frames", "severity", "want"), [(239, "error", "want at least 240 frames"), (240, "warning", "want 960 frames")]
)
def test_few_good_frames_of_a_joint_are_told(cleaned, pairs, n_frames, severity, want):
    weight = pairs[0].weight.copy()
    weight[np.flatnonzero(weight > 0)[n_frames:]] = 0.0
    found = find_body_faults(cleaned, [replace(pairs[0], weight=weight), *pairs[1:]])
    assert [(one.severity, want in one.sentence, f"got {n_frames}" in one.sentence) for one in found] == [
        (severity, True, True)
    ]


def moved(rank=3, n_good=2000, sigma_m=0.002, degrees=(40.0, 30.0, 20.0)):
    """A joint as solved: how many of its frames are good, and how far it was turned about each direction."""
    weight = (np.arange(2000) < n_good).astype(float)
    spread = np.radians(degrees) ** 2 / 2
    return PairSolution(np.zeros(3), np.zeros(3), spread, np.eye(3), np.eye(3), rank, np.zeros(2000), sigma_m, weight)


def told(judge, **changed):
    """Severity and sentence for a joint, the others being in order."""
    at = JOINTS.index("l_hand")
    pairs = [moved(**changed) if k == at else moved() for k in range(len(JOINTS))]
    return [(one.severity, one.sensor, one.sentence) for one in judge(pairs)]


@pytest.mark.parametrize(
    ("changed", "severity", "words"),
    [
        ({"n_good": 239}, "error", "want at least 240 frames with its two sensors good, got 239"),
        ({"n_good": 239, "rank": 1}, "error", "want at least 240 frames"),
        ({"rank": 1}, "error", "want it moved about at least two axes, got 30.0 degrees about the second"),
        ({"rank": 2, "n_good": 300}, "warning", "got 20.0 degrees about the weakest"),
        ({"n_good": 240}, "warning", "want 960 frames or more with its two sensors good, got 240"),
        ({"n_good": 959}, "warning", "lengths will be rough"),
    ],
)
def test_too_little_movement_and_too_few_frames_are_told_the_worst_alone(changed, severity, words):
    ((found, sensor, sentence),) = told(_movement, **changed)
    assert (found, sensor) == (severity, "l_hand")
    assert words in sentence


def test_enough_movement_in_enough_frames_is_not_told():
    assert told(_movement, n_good=960) == []


@pytest.mark.parametrize(
    ("sigma_m", "severity"), [(0.030, None), (0.031, "warning"), (0.060, "warning"), (0.061, "error")]
)
def test_a_loose_sensor_is_doubtful_and_a_strange_one_wrong(sigma_m, severity):
    assert [found for found, _, _ in told(_loose, sigma_m=sigma_m)] == ([] if severity is None else [severity])
    assert told(_loose, sigma_m=np.inf, n_good=0) == []  # where no frame is good nothing is known of it


def test_frames_with_a_filled_sensor_tell_nothing_where_others_are_enough(cleaned, pairs):
    """Two sensors change places in half of the frames: nothing is said of it as long as those frames were filled."""
    one, other = SENSORS.index("pelvis"), SENSORS.index("r_foot")
    recording = cleaned.recording
    position, turned = recording.position_xyz_m.copy(), recording.rotation_wxyz.copy()
    for values in (position, turned):
        values[:1500, [one, other]] = values[:1500, [other, one]]
    is_filled = cleaned.is_filled.copy()
    is_filled[:1500, SENSORS.index("head")] = True
    spoilt = replace(recording, position_xyz_m=position, rotation_wxyz=turned)
    assert find_body_faults(replace(cleaned, recording=spoilt, is_filled=is_filled), pairs) == ()


def on_legs(n_forwards):
    """Cleaned, of ten frames and upright sensors, with both knees bent forwards in some; joints from their sensors."""
    joint = {name: np.zeros(3) for name in JOINTS}
    joint |= {"l_thigh": np.array([0.1, 0.9, 0.0]), "r_thigh": np.array([-0.1, 0.9, 0.0])}
    joint |= {"l_upper_arm": np.array([0.2, 1.4, 0.0]), "r_upper_arm": np.array([-0.2, 1.4, 0.0])}
    joint |= {"l_shank": np.array([0.1, 0.5, 0.0]), "r_shank": np.array([-0.1, 0.5, 0.0])}
    joint |= {"l_foot": np.array([0.1, 0.1, -0.3]), "r_foot": np.array([-0.1, 0.1, -0.3])}
    position = np.tile(np.linspace(-0.5, 0.5, len(SENSORS))[:, None] * [1.0, 0.5, 0.0], (10, 1, 1))
    pairs = [replace(moved(), in_parent_m=joint[name] - position[0, PARENT[SENSORS.index(name)]]) for name in JOINTS]
    for name in ("l_shank", "r_shank"):  # the foot goes with it
        position[:n_forwards, SENSORS.index(name), 2] += 0.6
    turned = np.tile(rotation.IDENTITY, (10, len(SENSORS), 1))
    is_valid = np.ones((10, len(SENSORS)), bool)
    nothing = np.zeros(len(SENSORS))
    recording = Recording(100.0, SENSORS, position, turned, is_valid)
    return Cleaned(recording, ~is_valid, nothing, nothing, 1.0, nothing.astype(np.int64)), pairs


@pytest.mark.parametrize(("n_forwards", "sensors"), [(0, []), (6, []), (7, ["l_shoulder"]), (10, ["l_shoulder"])])
def test_knees_that_bend_forwards_now_and_then_are_no_exchanged_legs(n_forwards, sensors):
    found = _sides(*on_legs(n_forwards), np.arange(10))
    assert [one.sensor for one in found] == sensors
    assert all("both knees bending forwards, arms and legs alike" in one.sentence for one in found)
