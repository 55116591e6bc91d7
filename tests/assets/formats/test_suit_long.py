"""The long form: every column, order and fault of it."""

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pytest

from assets.formats import suit_long
from assets.formats.errors import FormatError
from assets.formats.suit_columns import Columns, parse_csv
from kernels.calibration.records import SENSORS
from kernels.synthetic.suit_performer import made_up

TWO = """frame,time_s,sensor,px_m,py_m,pz_m,qw,qx,qy,qz,is_valid
0,0.00,head,1,2,3,1,0,0,0,1
0,0.00,pelvis,4,5,6,0,1,0,0,1
1,0.02,head,1,2,3.5,1,0,0,0,1
1,0.02,pelvis,,,,,,,,0
"""


def read(text, own=None):
    return suit_long.parse(parse_csv(text.encode(), "x.csv"), own)


@pytest.fixture(scope="module")
def recording():
    return made_up(2, n_frames=40).recording


@pytest.fixture(scope="module")
def table(recording):
    return suit_long.to_table(recording)


def parse(table):
    return suit_long.parse(Columns("x.parquet", table, 0, {}))


def test_known_answer():
    suit = read(TWO)
    found = suit.recording
    assert (found.frame_rate_hz, found.sensors, found.n_frames) == (50.0, ("head", "pelvis"), 2)
    np.testing.assert_array_equal(found.position_xyz_m[1, 0], [1, 2, 3.5])
    np.testing.assert_array_equal(found.rotation_wxyz[0, 1], [0, 1, 0, 0])
    assert found.is_valid.tolist() == [[True, True], [True, False]]
    assert np.isnan(found.position_xyz_m[1, 1]).all()
    assert (suit.first_frame_index, suit.metres_per_unit, suit.notes, suit.warnings) == (0, 1.0, (), ())


def test_round_trip_of_the_whole_suit(recording, table):
    found = parse(table).recording
    assert found.sensors == SENSORS
    assert found.frame_rate_hz == recording.frame_rate_hz
    np.testing.assert_array_equal(found.is_valid, recording.is_valid)
    np.testing.assert_array_equal(found.position_xyz_m, recording.position_xyz_m)
    np.testing.assert_array_equal(found.rotation_wxyz, recording.rotation_wxyz)


def test_order_of_rows_means_nothing(recording, table):
    shuffled = table.take(pa.array(np.random.default_rng(1).permutation(table.num_rows)))
    found = parse(shuffled).recording
    order = [found.sensors.index(name) for name in SENSORS]
    np.testing.assert_array_equal(found.position_xyz_m[:, order], recording.position_xyz_m)


def test_epoch_times_frames_from_a_hundred_and_other_spellings(recording, table):
    moved = {
        "Frame_Index": pc.add(table["frame"], 100),
        "timestamp": pc.add(table["time_s"], 1.7e9),
        "segment": table["sensor"],
        **{f"pos_{c}_mm": pc.multiply(table[f"p{c}_m"], 1000.0) for c in "xyz"},
        **{f"quat_{c}": table[f"q{c}"] for c in "zyxw"},
        "valid": table["is_valid"],
    }
    suit = parse(pa.table({name.lower(): column for name, column in moved.items()}))
    assert (suit.first_frame_index, suit.metres_per_unit, suit.recording.frame_rate_hz) == (100, 0.001, 120.0)
    np.testing.assert_allclose(suit.recording.position_xyz_m, recording.position_xyz_m, atol=1e-12)
    np.testing.assert_array_equal(suit.recording.rotation_wxyz, recording.rotation_wxyz)


def test_without_a_valid_column_nothing_means_not_heard(recording, table):
    found = parse(table.drop_columns(["is_valid"])).recording
    np.testing.assert_array_equal(found.is_valid, recording.is_valid)


def test_nan_that_claims_to_be_valid_is_kept_for_the_judge():
    found = read(TWO.replace("1,2,3,1,0,0,0,1", "nan,2,3,1,0,0,0,1")).recording
    assert found.is_valid[0, 0]
    assert np.isnan(found.position_xyz_m[0, 0, 0])


def test_missing_rows_are_counted_and_not_valid(recording, table):
    suit = parse(table.slice(0, table.num_rows - 3))
    assert not suit.recording.is_valid[-1, -3:].any()
    assert suit.recording.is_valid[:-1].sum() == recording.is_valid[:-1].sum()
    assert "3 of 680 rows are missing" in suit.warnings[0]


def test_missing_frames_leave_a_gap(recording, table):
    frame = table["frame"].to_numpy()
    suit = parse(table.filter(pa.array((frame < 10) | (frame >= 14))))
    assert suit.recording.n_frames == recording.n_frames
    assert not suit.recording.is_valid[10:14].any()
    np.testing.assert_array_equal(suit.recording.position_xyz_m[14:], recording.position_xyz_m[14:])
    assert "4 frames are missing" in suit.warnings[0]


def test_uneven_times_are_interpolated():
    time_s = [0.0, 0.013, 0.030, 0.035, 0.052, 0.070, 0.079, 0.100]
    rows = [f"{k},{t},head,{t},0,0,1,0,0,0,1" for k, t in enumerate(time_s)]
    suit = read("\n".join([TWO.splitlines()[0], *rows]) + "\n")
    assert "uneven" in suit.warnings[0]
    found = suit.recording
    np.testing.assert_allclose(
        found.position_xyz_m[:, 0, 0], np.arange(found.n_frames) / found.frame_rate_hz, atol=1e-12
    )


@pytest.mark.parametrize(
    ("broken", "line", "what"),
    [
        (TWO.replace("0.02,head", "0.00,head").replace("0.02,pelvis", "0.00,pelvis"), 4, "frame 1.*repeated"),
        (TWO.replace("0.02,head", "-1,head").replace("0.02,pelvis", "-1,pelvis"), 4, "frame 1.*not rising"),
        (TWO + "1,0.02,head,1,2,3,1,0,0,0,1\n", 6, "frame 1, sensor head: want one row"),
        (TWO.replace("1,0.02,pelvis", "1,0.50,pelvis"), 5, "frame 1: want one time for all its sensors"),
        (TWO.replace("0,0.00,pelvis", "0.5,0.00,pelvis"), 3, "want a whole number, got 0.5"),
        (TWO.replace("0,0.00,pelvis", "0,,pelvis"), 3, "'time_s': want a number, got none"),
        (TWO.replace("4,5,6", "4,five,6"), 3, "want a number, got 'five'"),
        (TWO.replace(",qw,", ",w1,").replace("pz_m", "depth"), 0, "got none of pz_m, qw; got frame, time_s"),
        (TWO.replace("time_s", "when"), 0, "got none of time_s"),
        (TWO.replace("pelvis", "Skull"), 0, "both head"),
        ("\n".join(TWO.splitlines()[:3]) + "\n", 0, "want at least two samples"),
    ],
)
def test_each_fault_names_its_line(broken, line, what):
    with pytest.raises(FormatError, match=what) as refused:
        read(broken)
    assert (refused.value.path, refused.value.line) == ("x.csv", line)


def test_a_sensor_named_to_nothing_is_left_out():
    assert read(TWO, {"pelvis": ""}).recording.sensors == ("head",)
    assert read(TWO, {"pelvis": "thorax"}).recording.sensors == ("head", "thorax")
