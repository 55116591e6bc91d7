"""The made-up dancer keeps his promises: beats, planted feet, repeatable."""

import numpy as np
import pytest

from kernels.skeleton.canonical import JOINTS, LEG_LENGTH_M
from kernels.skeleton.contacts import find_contacts, foot_slide
from kernels.synthetic.dancer import MOVES, place, plan_foot, take

ANKLE = [JOINTS.index("leftFoot"), JOINTS.index("rightFoot")]
TOES = [JOINTS.index("leftToes"), JOINTS.index("rightToes")]


@pytest.mark.parametrize("label", MOVES)
def test_body_is_whole_and_on_the_floor(label):
    made = take(label)
    position = place(made)
    assert np.isfinite(position).all()
    assert position[:, ANKLE, 1].min() > 0.06
    assert position[:, TOES, 1].min() > 0.0
    legs = np.linalg.norm(
        position[:, ANKLE] - position[:, [JOINTS.index(f"{s}UpperLeg") for s in ("left", "right")]], axis=-1
    )
    assert legs.max() <= LEG_LENGTH_M + 1e-9


@pytest.mark.parametrize("label", sorted(set(MOVES) - {"kick", "spin"}))
def test_planted_feet_stand_still(label):
    position = place(take(label, frame_rate_hz=60.0))
    contacts = find_contacts(position[:, ANKLE], position[:, TOES], frame_rate_hz=60.0, planted_height_m=(0.08, 0.02))
    assert contacts.foot.mean() > 0.5
    assert foot_slide(position[:, ANKLE], position[:, TOES], contacts, frame_rate_hz=60.0) < 0.06


def test_beats_are_where_they_were_asked_for():
    made = take("step", n_beats=6, interval_s=0.4, first_beat_s=0.3)
    np.testing.assert_allclose(made.beat_s, 0.3 + 0.4 * np.arange(6))
    assert made.clip.duration_s == pytest.approx(2.6, abs=1 / 30)
    assert len(take("idle").beat_s) == 0


def test_same_arguments_same_bytes_and_rate_changes_nothing_else():
    assert take("kick").clip.rotation_wxyz.tobytes() == take("kick").clip.rotation_wxyz.tobytes()
    slow, fast = place(take("rock")), place(take("rock", frame_rate_hz=60.0))
    np.testing.assert_allclose(slow, fast[::2][: len(slow)], atol=1e-9)


def test_foot_moves_between_beats_and_rests_on_them():
    places = np.array([[0, 0.08, 0], [0.3, 0.08, 0], [0.3, 0.08, 0]], float)
    foot = plan_foot(np.array([0.0, 0.5, 0.95, 1.0, 1.5, 9.0]), places)
    np.testing.assert_allclose(foot[[0, 3, 4, 5]], places[[0, 1, 1, 1]])
    assert foot[1, 1] > 0.12
    np.testing.assert_allclose(foot[2], places[1])


def test_unknown_move():
    with pytest.raises(ValueError, match="want one of step"):
        take("moonwalk")
