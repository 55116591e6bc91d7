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
