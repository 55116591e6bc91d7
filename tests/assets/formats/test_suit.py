"""Which files are recordings, and both forms through one door."""

import numpy as np
import pytest

from assets.formats import suit
from assets.formats.errors import FormatError
from kernels.synthetic.suit_performer import made_up


@pytest.fixture(scope="module")
def recording():
    return made_up(2, n_frames=30).recording


@pytest.mark.parametrize("form", [suit.format_parquet, suit.format_csv])
def test_written_and_read_back(recording, tmp_path, form):
    place = tmp_path / "take"
    place.write_bytes(form(recording))
    found = suit.read(place).recording
    np.testing.assert_array_equal(found.position_xyz_m, recording.position_xyz_m)
    np.testing.assert_array_equal(found.rotation_wxyz, recording.rotation_wxyz)
    np.testing.assert_array_equal(found.is_valid, recording.is_valid)
    assert form(recording) == form(recording)


@pytest.mark.parametrize(
    ("head", "is_one"),
    [
        ("frame,time_s,sensor,px_m,py_m,pz_m,qw,qx,qy,qz,is_valid", True),
        ("frame,sensor,qw", True),  # meant for one: refused with what is missing, not passed over
        ("Time,w1,x1,y1,z1,loc1_x", True),
        ("file,label,style,subject,licence", False),
        ("time,x,y,z,w", False),
        ("sensor,price", False),
        ("", False),
    ],
)
def test_a_recording_is_known_by_its_first_line(tmp_path, head, is_one):
    place = tmp_path / "a.csv"
    place.write_text(head + "\n")
    assert suit.is_recording(place) == is_one
    place.write_bytes((head + "\n").encode("utf-16"))
    assert suit.is_recording(place) == is_one


def test_a_file_that_is_not_there_is_none(tmp_path):
    assert not suit.is_recording(tmp_path / "no.csv")
    assert suit.is_recording(tmp_path / "any.parquet")


def test_a_table_of_something_else_is_refused(tmp_path):
    place = tmp_path / "clips.csv"
    place.write_text("file,label\na.bvh,spin\n")
    with pytest.raises(FormatError, match=r"want a suit recording with the columns frame, time_s.*got file, label"):
        suit.read(place)
