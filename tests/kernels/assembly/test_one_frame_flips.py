"""Flips: planted ones are counted where they are, spins and slow turns are none; how far joints may move."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.assembly.one_frame_flips import (
    FASTEST_TURN_RAD_PER_S,
    find_flips,
    flip_measure,
    furthest_move,
    move_measure,
)
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS

PARENT = CANONICAL.parent
HAND, HEAD, TOES, ARM = (JOINTS.index(name) for name in ("leftHand", "head", "rightToes", "leftUpperArm"))


def still(n=20):
    """A body at rest, (n, 22, 4)."""
    return np.tile(rotation.IDENTITY, (n, len(JOINTS), 1))


def about(axis, degrees):
    return rotation.from_axis_angle(np.array(axis, float), np.radians(degrees))


@pytest.mark.parametrize("joint", [HAND, HEAD, TOES, ARM])
def test_a_joint_that_jumps_is_counted_once_where_it_jumps(joint):
    pose = still()
    pose[8:, joint] = about([0, 1, 0], 60)
    (flip,) = find_flips(pose, PARENT, 30.0)
    assert (flip.frame, flip.joint, flip.is_of_body) == (8, joint, False)
    assert flip.turn_rad == pytest.approx(np.radians(60))


def test_one_wrong_frame_jumps_there_and_back():
    pose = still()
    pose[8, HAND] = about([1, 0, 0], 120)
    assert [(f.frame, f.joint) for f in find_flips(pose, PARENT, 30.0)] == [(8, HAND), (9, HAND)]


@pytest.mark.parametrize(("rate_hz", "degrees"), [(30.0, 45), (60.0, 22.5), (120.0, 11.25), (24.0, 56.25)])
def test_how_far_a_joint_may_turn_goes_by_the_rate(rate_hz, degrees):
    assert np.degrees(FASTEST_TURN_RAD_PER_S / rate_hz) == pytest.approx(degrees)
    for turn, wanted in ((degrees - 0.5, 0), (degrees + 0.5, 1)):
        pose = still()
        pose[8:, HAND] = about([1, 0, 0], turn)
        assert len(find_flips(pose, PARENT, rate_hz)) == wanted


def test_a_spin_of_the_whole_body_is_none():
    turned = np.cumsum([0, 0, 0, 40, 75, 90, 93, 80, 45, 10, 0, 0])
    pose = still(len(turned))
    pose[:, 0] = about([0, 1, 0], turned)
    assert find_flips(pose, PARENT, 30.0) == []


def test_a_body_that_jumps_is_counted_once_at_its_root():
    pose = still()
    pose[8:, 0] = about([0, 1, 0], 131)
    (flip,) = find_flips(pose, PARENT, 30.0)
    assert (flip.frame, flip.joint, flip.is_of_body) == (8, 0, True)
    assert flip.turn_rad == pytest.approx(np.radians(131))
    pose[9:, 0] = rotation.IDENTITY  # there and back again: nothing carries it on
    assert [f.frame for f in find_flips(pose, PARENT, 30.0)] == [8, 9]


def test_parts_that_add_up_in_the_world_flip_there():
    pose = still()
    chest, spine = JOINTS.index("chest"), JOINTS.index("spine")
    pose[8:, [spine, chest]] = about([0, 1, 0], 30)
    assert [(f.frame, f.joint, f.is_of_body) for f in find_flips(pose, PARENT, 30.0)] == [(8, chest, True)]


def test_signs_of_quaternions_are_no_turns():
    pose = still() * np.where(np.arange(20) % 2, -1.0, 1.0)[:, None, None]
    assert find_flips(pose, PARENT, 30.0) == []


def test_too_short_and_wrong_motions():
    assert find_flips(still(1), PARENT, 30.0) == []
    assert find_flips(still(0), PARENT, 30.0) == []
    with pytest.raises(ValueError, match=r"rotation_wxyz: want \(F, 22, 4\), got \(20, 4\)"):
        find_flips(still()[:, 0], PARENT, 30.0)
    with pytest.raises(ValueError, match="frame_rate_hz: want > 0, got 0"):
        find_flips(still(), PARENT, 0.0)


def test_a_dance_is_as_wanted_without_flips(dance, phrases):
    made = dance(phrases(("step", 1.0, 4, 0.5, 0.5), ("wave", 1.0, 4, 0.5, 0.5)))
    measure = flip_measure(find_flips(made.rotation_wxyz, PARENT, 60.0))
    assert (measure.name, measure.value, measure.wanted, measure.is_passed) == ("one_frame_flip_count", 0.0, "0", True)
    pose = made.rotation_wxyz.copy()
    pose[30:, HAND] = rotation.mul(pose[30:, HAND], about([1, 0, 0], 100))
    measure = flip_measure(find_flips(pose, PARENT, 60.0))
    assert (measure.value, measure.is_passed) == (1.0, False)


def test_no_joint_moves_further_than_the_clips_do(dance, clips, phrases):
    steps = phrases(("step", 1.0, 8, 0.5, 0.5))
    made = dance(steps)
    found = furthest_move(made, steps, clips, skeleton=CANONICAL)
    assert 0.2 < found.ratio <= 1.1
    assert move_measure(found).is_passed
    root = made.root_xyz_m.copy()
    root[31:, 0] += 1.0
    position, _ = kinematics.forward(CANONICAL, root, made.rotation_wxyz)
    leapt = furthest_move(replace(made, root_xyz_m=root, position_xyz_m=position), steps, clips, skeleton=CANONICAL)
    assert leapt.frame == 31
    assert leapt.speed_m_per_s == pytest.approx(60.0, rel=0.1)
    measure = move_measure(leapt)
    assert measure.name == "fastest_joint_ratio"
    assert measure.value > 5
    assert not measure.is_passed


def test_fenced_frames_do_not_say_how_fast_a_clip_is(dance, clips, phrases):
    steps = phrases(("step", 1.0, 4, 0.5, 0.5))
    burst = clips["step"].root_xyz_m.copy()
    burst[200:, 2] += 2.0  # long after what is danced
    others = {"step": replace(clips["step"], root_xyz_m=burst)}
    made = dance(steps, others)
    plain = furthest_move(dance(steps), steps, clips, skeleton=CANONICAL).ratio
    fence = np.zeros(len(burst), bool)
    fence[195:205] = True
    assert furthest_move(made, steps, others, skeleton=CANONICAL).ratio < 0.2 * plain
    found = furthest_move(made, steps, others, skeleton=CANONICAL, fenced={"step": fence})
    assert found.ratio == pytest.approx(plain, rel=0.05)


def test_a_faster_pace_allows_faster_joints(dance, clips, phrases):
    own, hurried = (phrases(("step", 1.0, 4, 0.5, step_s)) for step_s in (0.5, 0.4))
    first, second = (furthest_move(dance(s), s, clips, skeleton=CANONICAL) for s in (own, hurried))
    assert second.speed_m_per_s > 1.1 * first.speed_m_per_s
    assert second.ratio == pytest.approx(first.ratio, rel=0.1)


def test_a_dance_of_one_frame_moves_nothing(dance, clips, phrases):
    steps = phrases(("step", 1.0, 4, 0.5, 0.5))
    made = dance(steps)
    short = replace(
        made,
        root_xyz_m=made.root_xyz_m[:1],
        rotation_wxyz=made.rotation_wxyz[:1],
        position_xyz_m=made.position_xyz_m[:1],
    )
    assert furthest_move(short, steps, clips, skeleton=CANONICAL) is None
    assert move_measure(None).value == 0.0
