"""The form of Polhemus software: bursts, repeats, stations by number; and the real files."""

import numpy as np
import pytest

from assets.formats import suit, suit_wide
from assets.formats.errors import FormatError
from assets.formats.suit_columns import parse_csv
from kernels import rotation
from kernels.calibration.cleaning import clean
from kernels.calibration.records import SENSORS
from kernels.synthetic.suit_performer import Disturbance, made_up


def header(n):
    turned = [f"{c}{s}" for s in range(1, n + 1) for c in "wxyz"]
    return ["Time", *turned, *(f"loc{s}_{c}" for s in range(1, n + 1) for c in "xyz")]


def text(time_s, position, turned, names=None):
    """Write rows as such software does: quaternions of all stations, then their places."""
    f, s = turned.shape[:2]
    rows = np.concatenate([np.asarray(time_s)[:, None], turned.reshape(f, -1), position.reshape(f, -1)], 1)
    lines = [",".join(names or header(s)), *(",".join(repr(float(v)) for v in row) for row in rows)]
    return ("\n".join(lines) + "\n").encode()


def polhemus(recording, *, seed=0, per_unit=1 / 0.0254):
    """Epoch times of arrival in bursts, every row written one to three times."""
    rng = np.random.default_rng(seed)
    taken = 1.686e9 + np.arange(recording.n_frames) / recording.frame_rate_hz
    told = taken.copy()
    for start in range(20, recording.n_frames - 30, 60):  # the computer looked away for a fifth of a second
        told[start : start + 24] = taken[start + 24] + 2e-5 * np.arange(24)
    told = np.maximum.accumulate(told + rng.uniform(0, 1e-4, len(told)))
    again = rng.integers(1, 4, recording.n_frames)
    row = np.repeat(np.arange(recording.n_frames), again)
    within = np.arange(len(row)) - np.repeat(np.cumsum(again) - again, again)
    time_s = np.maximum.accumulate(told[row] + 1e-5 * within)
    return text(time_s, recording.position_xyz_m[row] * per_unit, recording.rotation_wxyz[row])


@pytest.fixture(scope="module")
def recording():
    return made_up(4, n_frames=360, disturbance=Disturbance(1e-4, 1e-4, 0, 0, 0)).recording


def read(data, **how):
    return suit_wide.parse(parse_csv(data, "x.csv"), how.pop("own", None), **how)


def test_bursts_and_repeats_come_back_as_they_were_taken(recording):
    found = read(polhemus(recording))
    assert (found.recording.frame_rate_hz, found.recording.n_frames) == (120.0, recording.n_frames)
    assert found.recording.sensors == SENSORS
    np.testing.assert_allclose(found.recording.position_xyz_m, recording.position_xyz_m, atol=1e-9)
    np.testing.assert_allclose(found.recording.rotation_wxyz, recording.rotation_wxyz, atol=1e-9)
    assert any("repeat" in note for note in found.notes)
    assert any("bursts" in note for note in found.notes)


@pytest.mark.parametrize(("per_unit", "scale"), [(1.0, 1.0), (100.0, 0.01), (1000.0, 0.001), (1 / 0.0254, 0.0254)])
def test_units_are_told_by_the_body(recording, per_unit, scale):
    found = read(polhemus(recording, per_unit=per_unit))
    assert found.metres_per_unit == scale
    np.testing.assert_allclose(found.recording.position_xyz_m, recording.position_xyz_m, atol=1e-9)


def test_units_said_by_the_setting_or_the_column(recording):
    two = text(np.arange(360) / 120, recording.position_xyz_m[:, :2], recording.rotation_wxyz[:, :2])
    assert read(two, unit="cm").metres_per_unit == 0.01
    assert read(two.replace(b"_x", b"_x_mm").replace(b"_y", b"_y_mm").replace(b"_z", b"_z_mm")).metres_per_unit == 0.001
    assumed = read(two)
    assert assumed.metres_per_unit == 0.0254
    assert "taken as inches" in assumed.warnings[0]


def test_stations_by_name(recording):
    names = ["time_s"]
    names += [f"{s}_q{c}" for s in ("LeftHand", "head") for c in "wxyz"]
    names += [f"{s}_p{c}_m" for s in ("LeftHand", "head") for c in "xyz"]
    data = text(np.arange(360) / 120, recording.position_xyz_m[:, :2], recording.rotation_wxyz[:, :2], names)
    found = read(data)
    assert (found.recording.sensors, found.metres_per_unit) == (("l_hand", "head"), 1.0)
    assert (found.notes, found.warnings) == ((), ())


def test_stations_heard_one_after_the_other_are_one_sample(recording):
    """Each device frame is written row by row: first one station's news, then the other's, then nothing new."""
    position, turned = recording.position_xyz_m[:200, :2], recording.rotation_wxyz[:200, :2]
    rows_p, rows_q, time_s = [], [], []
    for k in range(1, 200):
        for step, (a, b) in enumerate(((k, k - 1), (k, k), (k, k))):
            rows_p.append([position[a, 0], position[b, 1]])
            rows_q.append([turned[a, 0], turned[b, 1]])
            time_s.append(k / 120 + 4e-5 * step)
    found = read(text(time_s, np.array(rows_p), np.array(rows_q)), unit="m").recording
    assert found.is_valid.all()
    np.testing.assert_allclose(found.position_xyz_m, position[1:], atol=1e-12)


def test_stillness_at_even_times_is_no_repeat(recording):
    position, turned = recording.position_xyz_m[:, :2].copy(), recording.rotation_wxyz[:, :2].copy()
    position[100:200], turned[100:200] = position[100], turned[100]
    found = read(text(np.arange(360) / 120, position, turned), unit="m")
    assert found.recording.is_valid.all()
    np.testing.assert_array_equal(found.recording.position_xyz_m, position)
    assert found.notes == ()


def test_a_station_out_of_reach_holds_its_last_word_and_is_not_valid(recording):
    position, turned = recording.position_xyz_m[:, :3].copy(), recording.rotation_wxyz[:, :3].copy()
    position[100:120, 1], turned[100:120, 1] = position[99, 1], turned[99, 1]
    twice = np.repeat(np.arange(360), 2)
    data = text(np.arange(720) / 240, position[twice], turned[twice])
    found = read(data, unit="m").recording
    assert not found.is_valid[100:120, 1].any()
    assert found.is_valid.sum() == found.is_valid.size - 20


@pytest.mark.parametrize(
    ("change", "line", "what"),
    [
        (lambda t: t.replace(b"loc2_y", b"other"), 0, "want the columns loc2_y, got none"),
        (lambda t: t.replace(b"x2", b"other"), 0, "want the columns x2, got none"),
        (lambda t: t.replace(b"w1,x1,y1,z1", b"a,b,c,d"), 0, "want the columns w1, x1, y1, z1"),
        (lambda t: b"\n".join([*t.split(b"\n")[:3], t.split(b"\n")[1], b""]), 4, "want a time not before"),
    ],
)
def test_each_fault(recording, change, line, what):
    data = text(np.arange(360) / 120, recording.position_xyz_m[:, :2], recording.rotation_wxyz[:, :2])
    with pytest.raises(FormatError, match=what) as refused:
        read(change(data))
    assert refused.value.line == line


@pytest.mark.parametrize("name", ["Polhemus_90degY_2data.csv", "Polhemus_90degZ_1data.csv"])
def test_real_files_become_even(data_dir, name):
    found = suit.read(data_dir / "sensor" / "polhemus" / name)
    assert (found.recording.frame_rate_hz, found.recording.sensors) == (120.0, ("1", "2"))
    assert 850 < found.recording.n_frames < 920
    assert found.recording.is_valid.mean() > 0.99
    # A hand moving two sensors through 90 degrees is smooth once samples lie where they were taken.
    step = np.diff(found.recording.position_xyz_m, axis=0)
    assert np.nanmax(np.abs(np.diff(step, axis=0))) < 5e-4
    cleaned = clean(found.recording)
    assert np.isfinite(cleaned.recording.position_xyz_m).all()
    np.testing.assert_allclose(np.linalg.norm(cleaned.recording.rotation_wxyz, axis=-1), 1, atol=1e-9)
    assert rotation.angle_between(*cleaned.recording.rotation_wxyz[[0, -1], 1]) > 0.05


def test_orientations_alone_are_refused(data_dir):
    with pytest.raises(FormatError, match="want the columns loc1_x"):
        suit.read(data_dir / "sensor" / "imu" / "90deg_x.csv")
