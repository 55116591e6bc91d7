"""Copies, told from other takes by laying one motion over another."""

import numpy as np
import pytest

from kernels.search.aligned import N_TRACK, QUERY_HZ, TRACK_HZ, align, room, track
from kernels.skeleton import kinematics
from kernels.synthetic.dancer import take


@pytest.fixture(scope="module")
def moves():
    """Canonical positions, (F, 22, 3), and rate of a take of each of four moves."""
    clips = [take(label, n_beats=16, interval_s=0.5).clip for label in ("step", "twist", "wave", "kick")]
    return [(kinematics.place(clip)[0], clip.frame_rate_hz) for clip in clips]


@pytest.fixture(scope="module")
def tracks(moves):
    return [track(*move) for move in moves]


def walk(seed, n):
    """A motion that never comes back: smooth steps of the joints."""
    step = np.random.default_rng(seed).normal(size=(n, N_TRACK))
    return (0.3 * np.apply_along_axis(np.convolve, 0, step, np.hanning(31), "same") / 4).astype(np.float32)


def query_of(full, first_s, end_s):
    return full[round(first_s * QUERY_HZ) : round(end_s * QUERY_HZ) + 1]


@pytest.fixture(scope="module")
def full():
    """Five motions of 9 s at the rate of queries."""
    return [walk(seed, 271) for seed in range(5)]


@pytest.fixture(scope="module")
def thin(full):
    return [each[:: int(QUERY_HZ / TRACK_HZ)] for each in full]


@pytest.mark.parametrize(("first_s", "end_s"), [(0.0, 9.0), (0.4, 9.0), (0.0, 8.1), (3.37, 5.37), (6.5, 7.2)])
def test_a_part_is_found_where_it_lies(full, thin, first_s, end_s):
    found = align(query_of(full[3], first_s, end_s), thin)
    assert np.argmin([a.distance_m for a in found]) == 3
    assert found[3].distance_m < 0.008
    np.testing.assert_allclose((found[3].start_s, found[3].end_s), (first_s, end_s), atol=1.5 / QUERY_HZ)


@pytest.mark.parametrize("pace", [0.85, 1.1])
def test_a_faster_or_slower_copy_is_one(full, thin, pace):
    at = np.arange(0, 180, pace)
    low = at.astype(int)
    query = (full[1][low].T * (1 - at + low) + full[1][low + 1].T * (at - low)).T.astype(np.float32)
    found = align(query, thin)
    assert found[1].distance_m < 0.02 < min(found[c].distance_m for c in (0, 2, 3, 4))
    assert found[1].end_s == pytest.approx(6.0, abs=0.15)


def test_the_other_may_be_the_shorter_but_has_to_hold_half(full, thin):
    held = align(full[2], [thin[2][10:45]])[0]
    assert held.distance_m < 0.008
    assert np.isinf(align(full[2], [thin[2][10:25]])[0].distance_m)


def test_where_it_stands_and_faces_does_not_count(moves, tracks):
    position, rate = moves[0]
    turned = position[:, :, [2, 1, 0]] * np.array([1.0, 1.0, -1.0]) + np.array([3.0, 0.0, 1.0])
    np.testing.assert_allclose(track(turned, rate), tracks[0], atol=1e-5)


def test_moves_tell_themselves(moves, tracks):
    for number, (position, rate) in enumerate(moves):
        found = align(track(position[7:], rate, rate_hz=QUERY_HZ), tracks)
        assert np.argmin([a.distance_m for a in found]) == number
        assert found[number].distance_m < 0.02


def test_one_frame_and_none(thin):
    assert align(thin[0][:1], []) == []
    found = align(thin[0][5:6], thin)
    assert found[0].distance_m == pytest.approx(0.0, abs=1e-3)
    assert found[0].start_s == pytest.approx(5 / TRACK_HZ, abs=1 / TRACK_HZ)
    assert np.isfinite(align(thin[0][5:6], [thin[0][5:6]])[0].distance_m)


def test_room_grows_with_both(full):
    count = np.array([10, 20])
    assert np.diff(room(full[0], count)).tolist() == [10]
    assert (room(full[0], count) > room(full[0][:30], count)).all()


def test_copies_beyond_the_nearest_eight_are_laid_at_other_paces_too(full, thin):
    query = full[1][np.rint(np.arange(0, 180, 1.22)).astype(int)]
    found = align(query, [thin[1]] * 12)
    assert max(one.distance_m for one in found) < 0.02
