"""The even grid behind the times of a stream."""

import numpy as np
import pytest

from kernels import rotation
from kernels.calibration.timeline import Timeline, collapse, onto_grid, timeline


def bursts(n, rate_hz, *, every=50, held=20):
    """Times of arrival of n samples of which now and then some come all at once."""
    taken = np.arange(n) / rate_hz
    told = taken.copy()
    for start in range(5, n - held - 1, every):
        told[start : start + held] = taken[start + held] + 1e-5 * np.arange(held)
    return np.maximum.accumulate(told)


@pytest.mark.parametrize("rate_hz", [24.0, 60.0, 119.7, 240.0])
def test_even_times(rate_hz):
    line = timeline(1.7e9 + np.arange(200) / rate_hz)
    assert (line.kind, line.n_places, line.n_lost) == ("even", 200, 0)
    assert line.rate_hz == pytest.approx(rate_hz, rel=3e-3)


def test_rounded_times_are_even_and_a_rate_near_a_common_one_is_that():
    line = timeline(np.round(np.arange(300) / 59.94, 3))
    assert (line.kind, line.rate_hz) == ("even", 60.0)


def test_a_hole_is_counted():
    time_s = np.delete(np.arange(100) / 50, [30, 31, 32])
    line = timeline(time_s)
    assert (line.kind, line.n_places, line.n_lost) == ("even", 100, 3)
    assert line.place[30] == 33


@pytest.mark.parametrize("rate_hz", [60.0, 120.0])
def test_bursts_are_counted_out(rate_hz):
    line = timeline(bursts(600, rate_hz))
    assert (line.kind, line.rate_hz, line.n_lost) == ("burst", rate_hz, 0)
    np.testing.assert_array_equal(line.place, np.arange(600))


def test_samples_lost_between_bursts_are_found():
    time_s = np.delete(bursts(600, 120.0), np.arange(302, 309))
    line = timeline(time_s)
    assert (line.kind, line.n_places, line.n_lost) == ("burst", 600, 7)
    assert line.place[-1] == 599


def test_times_that_waver_are_uneven():
    time_s = np.cumsum(np.random.default_rng(2).uniform(0.006, 0.028, 300))
    line = timeline(time_s)
    assert line.kind == "uneven"
    assert line.n_places / line.rate_hz == pytest.approx(time_s[-1] - time_s[0], rel=0.01)


@pytest.mark.parametrize(
    ("time_s", "what"),
    [
        ([], "got 0"),
        ([1.0], "got 1"),
        ([1.0, 1.0], "different times"),
        ([0.0, 0.1, 0.05, 0.2], "got 0.05 after 0.1 at sample 2"),
        ([0.0, 0.1, 0.2, 9.0, 9.1], "a pause of 8.8 s after 0.2 s"),
    ],
)
def test_each_error(time_s, what):
    with pytest.raises(ValueError, match=what):
        timeline(np.array(time_s))


def test_uneven_streams_are_interpolated_along_the_shortest_arc():
    rng = np.random.default_rng(4)
    time_s = np.append(0, np.cumsum(rng.uniform(0.006, 0.028, 199)))
    angle = 2.0 * time_s
    turned = rotation.from_axis_angle(np.array([0.0, 0.0, 1.0]), angle)
    turned[::2] *= -1  # the same rotations
    line = timeline(time_s)
    position, found, valid = onto_grid(
        line, time_s, time_s[:, None, None] * [1.0, 2.0, 3.0], turned[:, None], np.ones((200, 1), bool)
    )
    at_s = np.arange(line.n_places) / line.rate_hz
    assert valid.all()
    np.testing.assert_allclose(position[:, 0, 1], 2 * at_s, atol=1e-12)
    expected = rotation.from_axis_angle(np.array([0.0, 0.0, 1.0]), 2.0 * at_s)
    np.testing.assert_allclose(rotation.angle_between(found[:, 0], expected), 0, atol=1e-6)


def test_a_long_gap_of_an_uneven_stream_is_not_bridged():
    time_s = np.append(0, np.cumsum(np.random.default_rng(4).uniform(0.006, 0.028, 199)))
    heard = np.ones((200, 2), bool)
    heard[80:100, 1] = False
    line = timeline(time_s)
    _, _, valid = onto_grid(line, time_s, np.zeros((200, 2, 3)), np.ones((200, 2, 4)), heard)
    assert valid[:, 0].all()
    n_gap = (~valid[:, 1]).sum() / line.rate_hz
    assert n_gap == pytest.approx(time_s[100] - time_s[79], abs=2.5 / line.rate_hz)


def test_holes_stay_empty():
    line = timeline(np.delete(np.arange(50) / 50, 20))
    position, turned, valid = onto_grid(
        line, np.zeros(49), np.ones((49, 1, 3)), np.ones((49, 1, 4)), np.ones((49, 1), bool)
    )
    assert np.flatnonzero(~valid[:, 0]).tolist() == [20]
    assert np.isnan(position[20]).all()
    assert np.isnan(turned[20]).all()


def test_collapse_begins_a_sample_at_the_station_that_was_waited_for():
    """Stations A then B of each sample, then a row of nothing new."""
    a = np.repeat(np.arange(1, 11), 3)
    b = np.concatenate([[0], np.repeat(np.arange(1, 11), 3)])[:30]
    time_s = np.repeat(np.arange(10) / 100, 3) + np.tile([0, 1e-4, 2e-4], 10)
    seen = collapse(time_s, np.stack([a, b], 1)[..., None].astype(float))
    np.testing.assert_array_equal(seen.row, np.arange(2, 30, 3))
    np.testing.assert_array_equal(seen.arrived_row, np.arange(0, 30, 3))
    assert seen.is_new.all()


def test_collapse_of_rows_that_are_all_new_changes_nothing():
    seen = collapse(np.arange(5.0), np.arange(10.0).reshape(5, 1, 2))
    np.testing.assert_array_equal(seen.row, np.arange(5))


def test_rounds_go_on_while_their_opener_is_not_heard():
    a, b = np.repeat(np.arange(1.0, 13.0), 2), np.repeat(np.arange(1.0, 13.0), 2)
    a[8:14] = np.nan
    seen = collapse(np.arange(24) / 240, np.stack([a, b], 1)[..., None])
    np.testing.assert_array_equal(seen.row, np.arange(1, 24, 2))
    assert seen.is_new[:, 1].all()
    assert np.flatnonzero(~seen.is_new[:, 0]).tolist() == [5, 6]  # the first row of nothing is news too


def test_nothing_said_again_is_no_news():
    values = np.array([[[1.0], [np.nan]], [[2.0], [np.nan]], [[3.0], [np.nan]]])
    seen = collapse(np.arange(3.0), values)
    assert seen.is_new[:, 0].all()
    assert len(seen.row) == 3


@pytest.mark.parametrize(("scale", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")])
def test_times_in_a_finer_unit_are_named(scale, unit):
    with pytest.raises(ValueError, match=unit):
        timeline(np.arange(100) / 120 * scale)


def test_a_grid_ends_with_the_last_sample_that_has_a_place():
    rng = np.random.default_rng(0)
    time_s = np.append(0.0, np.cumsum(rng.uniform(0.6, 1.4, 120))) / 60
    line = timeline(time_s)
    assert line.kind == "uneven"
    assert (line.n_places - 1) / line.rate_hz <= time_s[-1] < line.n_places / line.rate_hz


@pytest.mark.parametrize(("off", "common"), [(0.004, True), (0.006, False)])
def test_an_even_rate_within_half_a_hundredth_of_a_common_one_is_that(off, common):
    rate_hz = timeline(np.arange(400) / (60.0 * (1 - off))).rate_hz
    assert (rate_hz == 60.0) == common
    assert rate_hz == pytest.approx(60.0, rel=0.007)


@pytest.mark.parametrize(("pause_s", "refused"), [(4.9, False), (5.1, True)])
def test_a_pause_of_more_than_five_seconds_ends_a_take(pause_s, refused):
    time_s = np.append(np.arange(200) / 50, 199 / 50 + pause_s + np.arange(200) / 50)
    if refused:
        with pytest.raises(ValueError, match=r"got a pause of 5\.1 s after 4\.0 s; cut the recording there"):
            timeline(time_s)
    else:
        assert timeline(time_s).n_lost == pytest.approx(4.9 * 50 - 1, abs=1)


def test_samples_are_interpolated_between_neighbours_near_enough():
    time_s = np.array([0.0, 0.13, 0.2, 0.31, 0.4, 0.71, 0.8, 0.9, 1.0])
    line = Timeline(10.0, "uneven", np.rint(10 * time_s).astype(int), 11)
    position = time_s[:, None, None] * np.ones((1, 1, 3))
    turned = np.tile(rotation.IDENTITY, (9, 1, 1))
    place, _, valid = onto_grid(line, time_s, position, turned, np.ones((9, 1), bool))
    assert valid[:, 0].tolist() == [True] * 5 + [False] * 2 + [False, True, True, True]
    np.testing.assert_allclose(place[valid[:, 0], 0, 0], np.arange(11)[valid[:, 0]] / 10)


def test_a_sensor_heard_once_is_not_on_an_uneven_grid():
    time_s = np.array([0.0, 0.13, 0.2, 0.31])
    line = Timeline(10.0, "uneven", np.array([0, 1, 2, 3]), 4)
    is_valid = np.array([[True], [False], [False], [False]])
    turned = np.tile(rotation.IDENTITY, (4, 1, 1))
    assert not onto_grid(line, time_s, np.zeros((4, 1, 3)), turned, is_valid)[2].any()


def test_where_the_opener_falls_silent_another_opens_the_round_when_it_speaks_again():
    """Stations a, then b, of sixty samples; a is waited for, and says nothing new in two of them."""
    a, b = np.repeat(np.arange(1.0, 61.0), 2), np.repeat(np.arange(1.0, 61.0), 2)
    b = np.concatenate([[0.0], b[:-1]])
    a[60:64] = a[59]
    time_s = np.repeat(np.arange(60) / 100, 2) + np.tile([0, 1e-4], 60)
    seen = collapse(time_s, np.stack([a, b], 1)[..., None])
    expected = np.arange(0, 120, 2)
    expected[[30, 31]] += 1
    np.testing.assert_array_equal(seen.arrived_row, expected)
    assert np.flatnonzero(~seen.is_new[:, 0]).tolist() == [30, 31]
    assert seen.is_new[:, 1].all()
