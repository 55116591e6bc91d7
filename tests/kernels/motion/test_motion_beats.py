"""Motion beats: known tempo and phase, the octave question, and the refusals."""

import numpy as np
import pytest

from kernels import rotation
from kernels.motion.motion_beats import (
    BeatSettings,
    _autocorrelation_interval_s,
    _cosines,
    _refine,
    _spectral_peak,
    component_curve,
    find_extrema,
    motion_beats,
    smooth,
)
from kernels.synthetic.dancer import MOVES, place, take

FRAME_S = 1 / 30
DANCES = sorted(set(MOVES) - {"idle"})


def swing(*, interval_s=0.5, rate_hz=30.0, first_s=0.1, duration_s=8.0, noise_m=0.0, seed=0):
    """Three joints that turn on every beat, (F, 6, 3)."""
    t = np.arange(int(duration_s * rate_hz)) / rate_hz
    position = np.zeros((len(t), 6, 3))
    position[:, :, 1] = 0.3 * np.arange(6)
    turn = np.cos(np.pi * (t - first_s) / interval_s)
    position[:, 3, 0] += 0.3 * turn
    position[:, 4, 0] += 0.5 * turn
    position[:, 5, 2] += 0.2 * turn
    return position + noise_m * np.random.default_rng(seed).normal(size=position.shape)


def worst_error_s(beats, interval_s, first_s):
    """Distance of the worst beat from the known grid."""
    number = np.round((beats.time_s - first_s) / interval_s)
    return np.abs(beats.time_s - first_s - number * interval_s).max()


@pytest.mark.parametrize("method", ["fft", "autocorrelation"])
@pytest.mark.parametrize("rate_hz", [24.0, 30.0, 60.0, 120.0])
@pytest.mark.parametrize("interval_s", [0.35, 0.5, 0.8])
@pytest.mark.parametrize("noise_m", [0.0, 0.02])
def test_swing_has_known_tempo_and_phase(method, rate_hz, interval_s, noise_m):
    position = swing(interval_s=interval_s, rate_hz=rate_hz, noise_m=noise_m)
    beats = motion_beats(position, rate_hz, settings=BeatSettings(method=method, extrema_per_beat=1))
    assert beats.interval_s == pytest.approx(interval_s, rel=0.02)
    assert worst_error_s(beats, interval_s, 0.1) <= FRAME_S


@pytest.mark.parametrize("label", DANCES)
@pytest.mark.parametrize("interval_s", [0.4, 0.5, 0.6])
def test_made_up_dancer_is_heard_on_his_beats(label, interval_s):
    made = take(label, interval_s=interval_s)
    heading = rotation.heading_rad(made.clip.rotation_wxyz[:, 0])
    beats = motion_beats(place(made), 30.0, heading_rad=heading)
    assert beats.interval_s == pytest.approx(interval_s, rel=0.02)
    assert worst_error_s(beats, interval_s, made.beat_s[0]) <= FRAME_S
    assert beats.confidence > 0.5


def test_every_extremum_or_every_second():
    position = swing(interval_s=0.5)
    every = motion_beats(position, 30.0, settings=BeatSettings(extrema_per_beat=1))
    second = motion_beats(position, 30.0, settings=BeatSettings(extrema_per_beat=2))
    assert second.interval_s == pytest.approx(2 * every.interval_s, rel=1e-6)
    assert np.isin(np.round(second.time_s, 6), np.round(every.time_s, 6)).all()


def test_bounce_beats_where_it_is_stopped_not_where_it_is_let_go():
    t = np.arange(240) / 30
    position = np.zeros((240, 3, 3))
    position[:, 1:, 1] -= 0.3 * np.abs(np.sin(np.pi * (t - 0.1) / 0.5))[:, None]  # sharp on the beat, round between
    beats = motion_beats(position, 30.0)
    assert beats.interval_s == pytest.approx(0.5, rel=0.02)
    assert worst_error_s(beats, 0.5, 0.1) <= FRAME_S


def bounce(interval_s, duration_s=8.0):
    """Two joints that are stopped sharply on the beat, and turn round between."""
    t = np.arange(round(duration_s * 60)) / 60
    position = np.zeros((len(t), 3, 3))
    position[:, 1:, 1] -= 0.3 * np.abs(np.sin(np.pi * (t - 0.1) / interval_s))[:, None]
    return position


def test_steps_faster_than_a_dancers_are_taken_two_to_a_beat():
    assert motion_beats(swing(interval_s=0.26, rate_hz=60.0), 60.0).interval_s == pytest.approx(0.52, rel=0.02)
    assert motion_beats(swing(interval_s=0.3, rate_hz=60.0), 60.0).interval_s == pytest.approx(0.3, rel=0.02)


def test_but_not_where_two_would_be_longer_than_the_longest_beat():
    short = BeatSettings(longest_s=0.5)
    found = motion_beats(swing(interval_s=0.26, rate_hz=60.0), 60.0, settings=short)
    assert found.interval_s == pytest.approx(0.26, rel=0.02)


def test_a_slow_bounce_turns_on_beats():
    """Slower than 0.45 s a turn, each turn is a beat however sharp it is."""
    assert motion_beats(bounce(0.8), 60.0).interval_s == pytest.approx(0.8, rel=0.02)
    assert motion_beats(bounce(1.0), 60.0).interval_s == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize(("bend", "interval_s"), [(0.05, 0.35), (0.2, 0.7)])
def test_turns_alike_are_beats_each_and_of_turns_unlike_every_second(bend, interval_s):
    """A swing whose turns to one side are sharper: one and a half times, and many times."""
    t = np.arange(480) / 60
    position = np.zeros((480, 3, 3))
    angle = np.pi * (t - 0.1) / 0.35
    position[:, 1:, 0] = 0.3 * (np.cos(angle) + bend * np.cos(2 * angle))[:, None]
    assert motion_beats(position, 60.0).interval_s == pytest.approx(interval_s, rel=0.02)


def test_a_beat_is_no_longer_than_its_bound():
    position = swing(interval_s=0.5)
    one = {"extrema_per_beat": 1}
    assert len(motion_beats(position, 30.0, settings=BeatSettings(longest_s=0.4, **one)).time_s) == 0
    assert BeatSettings(shortest_s=0.3, **one).shortest_extremum_s == 0.3
    assert BeatSettings(shortest_s=0.3).shortest_extremum_s == 0.15


def test_travel_is_a_mean_over_joints():
    """Ten joints that move by 4 mm stand still, however much that is together; by 6 mm they move."""
    t = np.arange(240) / 30
    for size_m, moves in ((0.004, False), (0.006, True)):
        position = np.zeros((240, 11, 3))
        position[:, 1:, 0] = size_m * np.sqrt(2) * np.cos(2 * np.pi * t)[:, None]
        assert bool(len(motion_beats(position, 30.0).time_s)) == moves


def test_turns_fewer_than_three_are_no_beats():
    t = np.arange(60) / 30
    position = np.zeros((60, 2, 3))
    position[:, 1, 0] = np.sin(0.9 * np.pi * t)
    assert len(find_extrema(position[:, 1, 0], 30.0)) == 2
    assert len(motion_beats(position, 30.0).time_s) == 0


def test_one_period_of_a_cosine_lies_between_neighbouring_turns_and_nothing_outside():
    found = _cosines(np.array([2.0, 6.0, 8.0]), 11)
    np.testing.assert_allclose(found, [0, 0, 1, 0, -1, 0, 1, -1, 1, 0, 0], atol=1e-12)


@pytest.mark.parametrize("hz", [1.0, 2.0 + 0.5 * 30 / 4096, 3.7])
def test_the_strongest_frequency_is_found_between_those_of_the_transform(hz):
    series = np.cos(2 * np.pi * hz * np.arange(240) / 30)
    found, share = _spectral_peak(series, 30.0, BeatSettings())
    assert found == pytest.approx(hz, abs=5e-4)
    assert share > 0.99


def test_the_share_of_the_peak_falls_with_what_else_there_is():
    t = np.arange(600) / 30
    both = np.cos(2 * np.pi * 1.5 * t) + 0.5 * np.cos(2 * np.pi * 4.0 * t)
    _, share = _spectral_peak(both, 30.0, BeatSettings())
    assert share == pytest.approx(0.8, abs=0.01)


def test_a_curve_that_never_repeats_itself_has_no_interval():
    assert _autocorrelation_interval_s(np.arange(300.0) ** 2, 30.0, BeatSettings()) == 0.0


def test_of_lags_that_fit_about_as_well_the_shortest_counts():
    t = np.arange(360) / 30
    swell = np.cos(2 * np.pi * t) * (1 + 0.1 * np.cos(np.pi * t))  # every second swing a little larger
    assert _autocorrelation_interval_s(swell, 30.0, BeatSettings()) == pytest.approx(0.5, rel=0.02)


def test_a_grid_is_fitted_to_the_turns_near_it():
    turn_s = 0.3 + 0.52 * np.arange(12)
    strays = np.sort(np.append(turn_s, [1.6, 4.2]))  # two turns between beats
    np.testing.assert_allclose(_refine(strays, 0.5, 0.25)[0], 0.52, rtol=1e-6)
    assert _refine(np.zeros(0), 0.5, 0.1) == (0.5, 0.1)
    assert _refine(np.array([0.1, 0.63]), 0.5, 0.1)[0] == 0.5  # two turns tell no better


def test_the_first_window_says_which_way_is_up():
    position = swing()
    relative = (position - position[:, :1]).reshape(len(position), -1)
    up, _ = component_curve(relative, 60, 1)
    down, _ = component_curve(-relative, 60, 1)
    np.testing.assert_allclose(down, -up, atol=1e-9)
    assert (up * relative[:, 12]).sum() > 0  # the coordinate that moves most rises where the curve does


def test_a_component_beyond_the_last_is_the_last():
    relative = np.random.default_rng(0).normal(size=(40, 2))
    one, other = (component_curve(relative, 20, k) for k in (2, 7))
    np.testing.assert_array_equal(one[0], other[0])
    assert one[1] == other[1]


def test_what_does_not_move_has_no_share():
    curve, share = component_curve(np.ones((30, 3)), 10, 1)
    assert share == 0
    assert not curve.any()


def test_a_curve_too_short_or_too_slowly_sampled_is_not_smoothed():
    rough = np.array([0.0, 1.0, 0.0, 1.0])
    np.testing.assert_array_equal(smooth(rough, 30.0, 5.0), rough)
    longer = np.tile(rough, 10)
    np.testing.assert_array_equal(smooth(longer, 11.0, 5.0), longer)  # 5 Hz is more than 0.45 of it
    assert np.abs(smooth(longer, 12.0, 5.0) - longer).max() > 0.01


def test_tremor_beside_great_turns_is_none():
    t = np.arange(240) / 30
    curve = np.cos(2 * np.pi * 0.5 * t) + 0.05 * np.cos(2 * np.pi * 6 * t)
    assert len(find_extrema(curve, 30.0)) == pytest.approx(8, abs=1)
    assert len(find_extrema(np.ones(50), 30.0)) == len(find_extrema(curve[:4], 30.0)) == 0


def test_turning_dancer_needs_to_be_seen_from_the_body():
    made = take("spin", interval_s=0.5)
    literal = motion_beats(place(made), 30.0)
    seen = motion_beats(place(made), 30.0, heading_rad=rotation.heading_rad(made.clip.rotation_wxyz[:, 0]))
    assert seen.interval_s == pytest.approx(0.5, rel=0.02)
    assert literal.interval_s != pytest.approx(0.5, rel=0.02)


def test_second_component_and_joint_subset_follow_the_smaller_movement():
    position = swing(interval_s=0.8)
    t = np.arange(len(position)) / 30
    position[:, 1, 2] += 0.15 * np.cos(np.pi * (t - 0.1) / 0.37)
    assert motion_beats(position, 30.0).interval_s == pytest.approx(0.8, rel=0.02)
    by_component = motion_beats(position, 30.0, settings=BeatSettings(component=2))
    by_joint = motion_beats(position, 30.0, settings=BeatSettings(joints=(1,)))
    assert by_component.interval_s == pytest.approx(0.37, rel=0.02)
    assert by_joint.interval_s == pytest.approx(0.37, rel=0.02)


def test_moving_and_turning_the_whole_clip_changes_nothing():
    position = swing(noise_m=0.005)
    q = rotation.from_heading(1.1)
    moved = rotation.apply(q, position) + np.array([3.0, 0.0, -2.0])
    a, b = motion_beats(position, 30.0), motion_beats(moved, 30.0)
    np.testing.assert_allclose(a.time_s, b.time_s, atol=1e-6)


def test_later_start_moves_beats_by_as_much():
    position = swing(duration_s=9.0)
    a, b = motion_beats(position[:240], 30.0), motion_beats(position[6:246], 30.0)
    phase = (a.time_s[0] - b.time_s[0] - 6 / 30) / a.interval_s
    assert abs(phase - round(phase)) < 0.02


def test_confidence_falls_with_noise():
    calm = motion_beats(swing(), 30.0)
    noisy = motion_beats(swing(noise_m=0.1), 30.0)
    assert calm.confidence > 0.9 > noisy.confidence


def test_joined_curve_has_no_steps_between_windows():
    position = swing(duration_s=12.0)
    relative = (position - position[:, :1]).reshape(len(position), -1)
    curve, share = component_curve(relative, 60, 1)
    assert share == pytest.approx(1.0, abs=1e-9)
    assert np.abs(np.diff(curve)).max() < 1.05 * np.pi / 0.5 / 30 * np.sqrt(0.3**2 + 0.5**2 + 0.2**2)


@pytest.mark.parametrize("n_frames", [0, 1, 4, 7])
def test_too_short_has_no_beats(n_frames):
    beats = motion_beats(np.zeros((n_frames, 3, 3)), 30.0)
    assert len(beats.time_s) == 0
    assert beats.confidence == 0
    assert len(beats.curve) == n_frames


def test_standing_still_has_no_beats():
    tremor = 0.001 * np.random.default_rng(1).normal(size=(300, 5, 3))
    assert len(motion_beats(tremor, 30.0).time_s) == 0
    assert len(motion_beats(place(take("idle")), 30.0).time_s) == 0


def test_one_joint_is_its_own_root():
    assert motion_beats(swing()[:, 4:5], 30.0).interval_s == pytest.approx(0.5, rel=0.02)


def test_extrema_fall_between_frames():
    t = np.arange(90) / 30
    found_s = find_extrema(np.cos(np.pi * (t - 0.11) / 0.5), 30.0)
    np.testing.assert_allclose(found_s, 0.61 + 0.5 * np.arange(len(found_s)), atol=2e-3)
    assert len(found_s) >= 4


def test_smoothing_has_no_lag_and_may_be_left_out():
    t = np.arange(300) / 30
    wave = np.sin(2 * np.pi * 0.5 * t)
    np.testing.assert_allclose(smooth(wave, 30.0, 5.0)[30:-30], wave[30:-30], atol=0.01)
    np.testing.assert_array_equal(smooth(wave, 30.0, 0.0), wave)


@pytest.mark.parametrize(
    ("position", "rate_hz", "word"),
    [
        (np.zeros((9, 3)), 30.0, "want \\(F, J, 3\\)"),
        (np.full((9, 2, 3), np.nan), 30.0, "not finite"),
        (np.zeros((9, 2, 3)), 0.0, "want > 0"),
    ],
)
def test_refusals(position, rate_hz, word):
    with pytest.raises(ValueError, match=word):
        motion_beats(position, rate_hz)


def test_refuses_a_joint_or_heading_that_does_not_fit():
    with pytest.raises(ValueError, match="joints: want 0 to 5"):
        motion_beats(swing(), 30.0, settings=BeatSettings(joints=(6,)))
    with pytest.raises(ValueError, match="heading_rad"):
        motion_beats(swing(), 30.0, heading_rad=np.zeros(3))


@pytest.mark.parametrize(
    "wrong", [{"component": 0}, {"method": "guess"}, {"extrema_per_beat": 3}, {"shortest_s": 3.0}, {"window_s": 0.0}]
)
def test_settings_are_checked(wrong):
    with pytest.raises(ValueError, match="want"):
        BeatSettings(**wrong)
