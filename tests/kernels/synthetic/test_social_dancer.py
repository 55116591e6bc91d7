"""Made-up dancers with beats of their own, and bodies without: what each promises."""

import numpy as np
import pytest

from kernels.motion.velocity import mean_speed
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import JOINTS
from kernels.synthetic.social_dancer import STEPS, aimless, breathing_beats, danced, uneven_beats

EVEN = breathing_beats(8.0, interval_s=0.6, depth_ratio=0.0, first_s=0.3)


def placed(clip):
    return kinematics.place(clip)[0]


@pytest.mark.parametrize("label", sorted(STEPS))
def test_every_move_is_slow_on_its_beats(label):
    speed = mean_speed(placed(danced([label], EVEN, frame_rate_hz=60.0, duration_s=8.0)), 60.0, smoothing_s=0.03)
    on = speed[np.round(EVEN[1:-1] * 60).astype(int)]
    assert np.median(on) < 0.7 * np.median(speed)


def test_salsa_steps_three_times_in_two_beats():
    position = placed(danced(["salsa"], EVEN, frame_rate_hz=60.0, duration_s=8.0))
    feet = [JOINTS.index("leftFoot"), JOINTS.index("rightFoot")]
    height = position[:, feet, 1]
    count_s = EVEN[2] + 0.3 * np.arange(4)  # a figure of four counts begins on every second beat
    lifted = [height[int((t - 0.22) * 60) : int((t - 0.05) * 60)].max() > 0.1 for t in count_s + 0.0]
    assert sum(lifted) == 3


def test_uneven_beats_are_uneven_and_breathing_ones_breathe():
    step = np.diff(uneven_beats(60.0, interval_s=0.6, spread_ratio=0.3, seed=1))
    assert 0.2 < np.log(step).std() < 0.4
    step = np.diff(breathing_beats(60.0, interval_s=0.6, depth_ratio=0.04))
    assert step.max() == pytest.approx(0.624, abs=1e-3)
    assert step.min() == pytest.approx(0.576, abs=1e-3)
    assert np.abs(np.diff(step)).max() < 0.02


def test_aimless_motion_moves_and_repeats_with_its_seed():
    made = placed(aimless(6.0, frame_rate_hz=30.0, seed=4))
    assert np.array_equal(made, placed(aimless(6.0, frame_rate_hz=30.0, seed=4)))
    assert not np.allclose(made, placed(aimless(6.0, frame_rate_hz=30.0, seed=5)))
    assert mean_speed(made, 30.0).mean() > 0.1


def test_looseness_and_distraction_change_the_dance_and_not_its_length():
    plain, loose, lost = (
        placed(danced(["step", "hit"], EVEN, frame_rate_hz=30.0, duration_s=8.0, seed=2, **more))
        for more in ({}, {"looseness_beats": 0.1}, {"distraction": 1.0})
    )
    assert plain.shape == loose.shape == lost.shape == (241, 22, 3)
    assert np.abs(plain - loose).max() > 0.02
    assert np.abs(plain - lost).max() > 0.05


def test_refusals():
    with pytest.raises(ValueError, match="labels: want some of"):
        danced(["moonwalk"], EVEN, frame_rate_hz=30.0, duration_s=2.0)
    with pytest.raises(ValueError, match="beat_s"):
        danced(["step"], np.array([1.0, 1.0]), frame_rate_hz=30.0, duration_s=2.0)
