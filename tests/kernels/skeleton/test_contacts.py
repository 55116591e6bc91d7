import numpy as np
import pytest

from kernels.skeleton import contacts

STAND_S, SWING_S = 0.6, 0.4


def walk(frame_rate_hz, *, n_steps=6, noise_m=0.0, seed=0):
    """Feet that stand 0.6 s and swing 0.4 s in turn, 0.5 m a swing; toes 15 cm ahead and 6 cm below the ankles."""
    time_s = np.arange(round(n_steps * (STAND_S + SWING_S) * frame_rate_hz)) / frame_rate_hz
    ankle = np.zeros((len(time_s), 2, 3))
    stands = np.zeros((len(time_s), 2), bool)
    for side in range(2):
        beat = (time_s + 0.5 * side * (STAND_S + SWING_S)) / (STAND_S + SWING_S)
        part = np.clip((beat % 1 * (STAND_S + SWING_S) - STAND_S) / SWING_S, 0, 1)
        ankle[:, side] = np.stack([0.1 - 0.2 * side + 0 * beat, 0.08 + 0.12 * np.sin(np.pi * part), 0 * beat], axis=-1)
        ankle[:, side, 2] = 0.5 * (np.floor(beat) + part * part * (3 - 2 * part))
        stands[:, side] = part == 0
    toes = ankle + np.array([0.0, -0.06, 0.15])
    noise = np.random.default_rng(seed).normal(0, 1, (2, *ankle.shape)) * noise_m
    return ankle + noise[0], toes + noise[1], stands


def agreement(a, b):
    return 2 * (a & b).sum() / max(a.sum() + b.sum(), 1)


@pytest.mark.parametrize("frame_rate_hz", [24, 30, 60, 120, 240])
def test_walk_at_every_rate(frame_rate_hz):
    ankle, toes, stands = walk(frame_rate_hz)
    found = contacts.find_contacts(ankle, toes, frame_rate_hz=frame_rate_hz)
    assert agreement(found.foot, stands) > 0.93
    assert (found.foot | ~stands)[2:-2].all()
    assert found.ankle_height_m == pytest.approx(0.08, abs=0.005)
    assert found.toes_height_m == pytest.approx(0.02, abs=0.005)
    assert found.floor_m == found.toes_height_m


@pytest.mark.parametrize("frame_rate_hz", [30, 120])
def test_walk_with_noise(frame_rate_hz):
    ankle, toes, stands = walk(frame_rate_hz, noise_m=0.002)
    found = contacts.find_contacts(ankle, toes, frame_rate_hz=frame_rate_hz)
    assert agreement(found.foot, stands) > 0.90
    starts = contacts.runs(found.foot[:, 0])[0]
    assert len(starts) == len(contacts.runs(stands[:, 0])[0])


def test_rates_agree_in_time():
    times = []
    for rate in (30, 240):
        ankle, toes, _ = walk(rate)
        found = contacts.find_contacts(ankle, toes, frame_rate_hz=rate)
        times.append(np.concatenate(contacts.runs(found.foot[:, 1])) / rate)
    np.testing.assert_allclose(*times, atol=0.05)


def test_turned_moved_raised_and_played_backwards():
    ankle, toes, _ = walk(60)
    found = contacts.find_contacts(ankle, toes, frame_rate_hz=60).foot
    turn = np.array([[0.6, 0, 0.8], [0, 1, 0], [-0.8, 0, 0.6]])
    moved = [point @ turn.T + np.array([3.0, 0.4, -1.0]) for point in (ankle, toes)]
    np.testing.assert_array_equal(contacts.find_contacts(*moved, frame_rate_hz=60).foot, found)
    back = contacts.find_contacts(ankle[::-1], toes[::-1], frame_rate_hz=60).foot
    np.testing.assert_array_equal(back[::-1], found)
    mirrored = contacts.find_contacts(ankle[:, ::-1], toes[:, ::-1], frame_rate_hz=60).foot
    np.testing.assert_array_equal(mirrored[:, ::-1], found)


def test_a_heel_that_lifts_leaves_the_toes_standing():
    ankle = np.tile([[0.1, 0.08, 0.0], [-0.1, 0.08, 0.0]], (60, 1, 1))
    toes = ankle + np.array([0.0, -0.06, 0.15])
    ankle[30:, 0, 1] += np.linspace(0, 0.15, 30)
    found = contacts.find_contacts(ankle, toes, frame_rate_hz=30)
    assert found.toes.all()
    assert not found.ankle[-10:, 0].any()
    assert found.foot.all()


def test_hysteresis_keeps_a_contact_that_flickers():
    ankle = walk(60)[0]
    wobble = 0.03 + 0.012 * np.sin(np.arange(len(ankle)) * 0.9)
    tight = contacts.ContactThresholds(tight_height_m=0.03, loose_height_m=0.03)
    still = np.zeros_like(ankle)
    still[..., 1] = wobble[:, None]
    one = contacts.find_contacts(still, still, frame_rate_hz=60, planted_height_m=(0.0, 0.0), thresholds=tight)
    two = contacts.find_contacts(still, still, frame_rate_hz=60, planted_height_m=(0.0, 0.0))
    assert two.foot.all()
    assert not one.foot.all()


def test_short_contacts_are_dropped_and_short_gaps_closed():
    up = np.zeros((120, 2, 3))
    up[..., 1] = 0.5
    up[40:44, :, 1] = 0.0
    found = contacts.find_contacts(up, up, frame_rate_hz=120, planted_height_m=(0.0, 0.0))
    assert not found.foot.any()
    down = np.zeros((120, 2, 3))
    down[60:63, :, 1] = 0.07
    assert contacts.find_contacts(down, down, frame_rate_hz=120, planted_height_m=(0.0, 0.0)).foot.all()


def test_never_on_the_floor():
    flying = np.zeros((90, 2, 3))
    flying[..., 2] = np.linspace(0, 9, 90)[:, None]
    flying[..., 1] = 1.0 + 0.5 * np.sin(np.arange(90) / 5)[:, None]
    found = contacts.find_contacts(flying, flying, frame_rate_hz=30)
    assert not found.foot.any()
    assert contacts.foot_slide(flying, flying, found, frame_rate_hz=30) == 0.0


def test_one_frame_and_none():
    ankle, toes, _ = walk(30)
    one = contacts.find_contacts(ankle[:1], toes[:1], frame_rate_hz=30)
    assert one.foot.shape == (1, 2)
    assert one.foot.any()
    none = contacts.find_contacts(ankle[:0], toes[:0], frame_rate_hz=30)
    assert none.foot.shape == (0, 2)
    assert contacts.foot_slide(ankle[:0], toes[:0], none, frame_rate_hz=30) == 0.0
    assert contacts.planted_heights(ankle[:0], toes[:0], frame_rate_hz=30) == (0.0, 0.0)


def test_slide_is_the_way_of_planted_feet_over_time():
    ankle = np.zeros((31, 2, 3))
    ankle[:, 0, 0] = np.linspace(0, 0.3, 31)
    stands = np.zeros((31, 2), bool)
    stands[:, 0] = True
    planted = contacts.FootContacts(stands, stands, 0.0, 0.0, 0.0)
    assert contacts.foot_slide(ankle, ankle, planted, frame_rate_hz=30) == pytest.approx(0.3)
    there_and_back = ankle.copy()
    there_and_back[16:, 0] = there_and_back[14::-1, 0]
    assert contacts.foot_slide(there_and_back, there_and_back, planted, frame_rate_hz=30) == pytest.approx(0.3)
    assert contacts.foot_slide(ankle[::2], ankle[::2], _every_second(planted), frame_rate_hz=15) == pytest.approx(0.3)


def _every_second(planted):
    return contacts.FootContacts(planted.ankle[::2], planted.toes[::2], 0.0, 0.0, 0.0)


def test_a_rolling_foot_does_not_slide():
    ankle, toes = np.zeros((30, 2, 3)), np.zeros((30, 2, 3))
    ankle[..., 2] = np.linspace(0, 0.1, 30)[:, None]
    planted = contacts.FootContacts(np.ones((30, 2), bool), np.ones((30, 2), bool), 0.0, 0.0, 0.0)
    assert contacts.foot_slide(ankle, toes, planted, frame_rate_hz=30) == 0.0


@pytest.mark.parametrize(("ankle_m", "toes_m"), [(0.02, 0.01), (0.01, 0.02)])
def test_of_ankle_and_toes_the_one_that_moves_less_slides(ankle_m, toes_m):
    ankle, toes = (size * np.arange(31.0)[:, None, None] * np.array([[[1.0, 0, 0]] * 2]) for size in (ankle_m, toes_m))
    both = contacts.FootContacts(np.ones((31, 2), bool), np.ones((31, 2), bool), 0.0, 0.0, 0.0)
    assert contacts.foot_slide(ankle, toes, both, frame_rate_hz=30) == pytest.approx(0.3)


def test_a_point_that_is_not_in_contact_does_not_slide():
    ankle, toes = np.zeros((31, 2, 3)), np.zeros((31, 2, 3))
    ankle[..., 0] = 0.01 * np.arange(31)[:, None]
    toes[..., 0] = 0.001 * np.arange(31)[:, None]
    heels = contacts.FootContacts(np.ones((31, 2), bool), np.zeros((31, 2), bool), 0.0, 0.0, 0.0)
    assert contacts.foot_slide(ankle, toes, heels, frame_rate_hz=30) == pytest.approx(0.3)


def test_steps_into_and_out_of_a_contact_are_no_slide():
    ankle = np.zeros((30, 2, 3))
    ankle[10:, :, 0] += 1.0
    ankle[20:, :, 0] += 1.0
    stands = np.zeros((30, 2), bool)
    stands[10:20] = True
    planted = contacts.FootContacts(stands, stands, 0.0, 0.0, 0.0)
    assert contacts.foot_slide(ankle, ankle, planted, frame_rate_hz=30) == 0.0


EACH_FRAME = contacts.ContactThresholds(window_s=0.0)


def standing(is_low, frame_rate_hz):
    """Contacts of a foot that is on the floor in some frames and high up in the others, each frame by itself."""
    foot = np.zeros((len(is_low), 2, 3))
    foot[~np.array(is_low, bool), :, 1] = 0.5
    found = contacts.find_contacts(
        foot, foot, frame_rate_hz=frame_rate_hz, planted_height_m=(0.0, 0.0), thresholds=EACH_FRAME
    )
    return found.ankle[:, 0].tolist()


def test_gaps_of_up_to_50_ms_are_closed_and_longer_ones_are_not():
    assert all(standing([1] * 20 + [0] * 6 + [1] * 20, 120))
    longer = [1] * 20 + [0] * 7 + [1] * 20
    assert standing(longer, 120) == [bool(low) for low in longer]


def test_a_gap_at_an_end_of_the_clip_is_none():
    for low in ([0] * 3 + [1] * 20, [1] * 20 + [0] * 3):
        assert standing(low, 120) == [bool(v) for v in low]


def test_contacts_of_80_ms_are_kept_and_shorter_ones_dropped():
    kept = [0] * 20 + [1] * 12 + [0] * 20
    assert standing(kept, 150) == [bool(low) for low in kept]
    assert not any(standing([0] * 20 + [1] * 11 + [0] * 20, 150))


def test_a_clip_shorter_than_a_contact_keeps_its_contact():
    assert standing([1, 1], 120) == [True, True]


def test_one_frame_is_judged_by_its_height():
    assert standing([1], 30) == [True]
    assert standing([0], 30) == [False]


@pytest.mark.parametrize(("height_m", "stands"), [(0.02, False), (0.06, True), (0.10, True), (0.14, False)])
def test_a_foot_stands_no_further_below_its_planted_height_than_above_it(height_m, stands):
    foot = np.zeros((30, 2, 3))
    foot[..., 1] = height_m
    found = contacts.find_contacts(foot, foot, frame_rate_hz=30, planted_height_m=(0.08, 0.08)).foot
    assert found.all() == found.any() == stands


def test_a_stretch_that_is_never_near_enough_is_no_contact():
    foot = np.zeros((60, 2, 3))
    foot[..., 1] = 0.04  # within the loose limit throughout
    assert not contacts.find_contacts(foot, foot, frame_rate_hz=60, planted_height_m=(0.0, 0.0)).foot.any()
    foot[30, :, 1] = 0.0
    foot[29:32, :, 1] = 0.02
    assert contacts.find_contacts(foot, foot, frame_rate_hz=60, planted_height_m=(0.0, 0.0)).foot.all()


def test_a_short_contact_between_two_swings_is_seen():
    """Frames at its ends are slow on one side only."""
    foot = np.zeros((60, 2, 3))
    foot[:25, :, 0] = -np.arange(25, 0, -1.0)[:, None] * 0.2
    foot[35:, :, 0] = np.arange(1, 26.0)[:, None] * 0.2
    found = contacts.find_contacts(foot, foot, frame_rate_hz=60, planted_height_m=(0.0, 0.0)).foot[:, 0]
    assert found[26:34].all()
    assert not found[:23].any()
    assert not found[37:].any()


def heights(height_m, speed_m_per_s=0.0, *, frame_rate_hz=30):
    """Planted heights of feet at given heights, which move on at a given speed."""
    foot = np.zeros((len(height_m), 2, 3))
    foot[..., 1] = np.array(height_m)[:, None]
    foot[..., 0] = np.cumsum(np.broadcast_to(speed_m_per_s, len(height_m)))[:, None] / frame_rate_hz
    return contacts.planted_heights(foot, foot, frame_rate_hz=frame_rate_hz)


def test_where_nothing_is_slow_the_lowest_heights_count():
    assert heights([0.4] * 60 + [0.5] * 40, 2.0) == pytest.approx((0.4, 0.4))


def test_a_foot_that_hardly_ever_rests_is_never_slow():
    # 3 frames of 100 at rest, high up: fewer than a twentieth
    speed = np.full(100, 2.0)
    speed[51:53] = 0.0
    height = np.full(100, 0.1)
    height[49:54] = 1.0
    assert heights(height, speed) == pytest.approx((0.1, 0.1))
    speed[45:60] = 0.0
    height[40:65] = 1.0
    assert heights(height, speed) == pytest.approx((1.0, 1.0))


def test_the_lowest_height_held_for_half_as_long_as_the_longest_counts():
    assert heights([0.02] * 40 + [0.5] * 60) == pytest.approx((0.02, 0.02))
    assert heights([0.02] * 20 + [0.5] * 80) == pytest.approx((0.5, 0.5))


def test_a_planted_height_is_the_median_of_its_cluster():
    held = np.repeat([0.02, 0.03, 0.04, 0.5], [30, 30, 30, 10])
    ankle, _ = heights(held, frame_rate_hz=240)
    assert ankle == pytest.approx(0.03)


def test_the_lower_foot_of_each_frame_counts():
    foot = np.zeros((90, 2, 3))
    foot[:, 0, 1], foot[:, 1, 1] = 0.3, 0.1
    assert contacts.planted_heights(foot, foot, frame_rate_hz=30) == pytest.approx((0.1, 0.1))


def test_heights_are_means_over_half_the_window():
    foot = np.zeros((61, 2, 3))
    foot[..., 1] = 0.04 * (np.arange(61) % 2)[:, None]  # a tremor up to beyond the tight limit
    slow = contacts.ContactThresholds(
        tight_speed_m_per_s=9, loose_speed_m_per_s=9, tight_height_m=0.03, loose_height_m=0.03, widest_gap_s=0.0
    )
    found = contacts.find_contacts(foot, foot, frame_rate_hz=120, planted_height_m=(0.0, 0.0), thresholds=slow)
    assert found.foot[5:-5].all()


def test_the_floor_is_the_lower_of_planted_ankles_and_toes():
    foot = np.zeros((30, 2, 3))
    for planted in ((0.08, 0.02), (0.02, 0.08)):
        assert contacts.find_contacts(foot, foot, frame_rate_hz=30, planted_height_m=planted).floor_m == 0.02


def test_height_is_of_no_account_for_slide():
    ankle = np.zeros((30, 2, 3))
    ankle[..., 1] = np.linspace(0, 0.1, 30)[:, None]
    planted = contacts.FootContacts(np.ones((30, 2), bool), np.ones((30, 2), bool), 0.0, 0.0, 0.0)
    assert contacts.foot_slide(ankle, ankle, planted, frame_rate_hz=30) == 0.0


def test_both_feet_in_one_array():
    ankle, toes, _ = walk(30)
    feet = np.stack([ankle[:, 0], toes[:, 0], ankle[:, 1], toes[:, 1]], axis=1)
    found = contacts.find_contacts(ankle, toes, frame_rate_hz=30)
    np.testing.assert_array_equal(contacts.foot_contacts(feet, 30), found.foot)
    with pytest.raises(ValueError, match="foot_xyz_m"):
        contacts.foot_contacts(ankle, 30)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"ankle_xyz_m": np.zeros((4, 3, 3))}, "ankle_xyz_m: want"),
        ({"toes_xyz_m": np.zeros((5, 2, 3))}, "toes_xyz_m: want"),
        ({"toes_xyz_m": np.full((4, 2, 3), np.nan)}, "toes_xyz_m: not finite"),
        ({"frame_rate_hz": 0.0}, "frame_rate_hz"),
    ],
)
def test_refusals(change, what):
    good = {"ankle_xyz_m": np.zeros((4, 2, 3)), "toes_xyz_m": np.zeros((4, 2, 3)), "frame_rate_hz": 30.0}
    with pytest.raises(ValueError, match=what):
        contacts.find_contacts(**{**good, **change})


def test_runs():
    mask = np.array([True, True, False, True, False, False, True])
    np.testing.assert_array_equal(contacts.runs(mask), [[0, 3, 6], [2, 4, 7]])
    np.testing.assert_array_equal(contacts.runs(np.zeros(0, bool)), np.zeros((2, 0)))


def test_a_few_frames_lower_than_the_floor_are_not_its_height():
    foot = np.zeros((200, 2, 3))
    foot[..., 1] = 0.1
    foot[150:, :, 1] = 0.4
    foot[60:70, :, 1] = -0.2
    assert contacts.planted_heights(foot, foot, frame_rate_hz=30) == pytest.approx((0.1, 0.1))
    foot[60:130, :, 1] = -0.2  # now it is a good part of the clip
    assert contacts.planted_heights(foot, foot, frame_rate_hz=30) == pytest.approx((-0.2, -0.2))
