"""Beats files: what people write, and where they err."""

import numpy as np
import pytest

from assets.formats import beats_file
from assets.formats.errors import FormatError


def test_seconds_alone():
    grid = beats_file.parse("# made by hand\n0.5\n1.0  # clap\n\n1.5\n")
    assert grid.time_s.tolist() == [0.5, 1.0, 1.5]
    assert grid.beat_in_bar_number.tolist() == [0, 0, 0]
    assert grid.bar_number.tolist() == [0, 0, 0]
    assert grid.confidence.tolist() == [1, 1, 1]


def test_bars_are_counted_after_a_pick_up():
    grid = beats_file.parse("0.1\t3\n0.6\t4\n1.1\t1\n1.6\t2\n2.1\t3\n2.6\t1\n")
    assert grid.beat_in_bar_number.tolist() == [3, 4, 1, 2, 3, 1]
    assert grid.bar_number.tolist() == [1, 1, 2, 2, 2, 3]


def test_commas_carriage_returns_and_marks(tmp_path):
    path = tmp_path / "a.beats"
    path.write_bytes("\ufeff0.5,1\r\n1,2\r\n1.5e0 , 1\r\n".encode())
    grid = beats_file.read(path)
    assert grid.time_s.tolist() == [0.5, 1.0, 1.5]
    assert grid.bar_number.tolist() == [1, 1, 2]


@pytest.mark.parametrize("text", ["0.5000\n1.2500\n", "0.5000\t1\n1.2500\t2\n1.7500\t1\n"])
def test_round_trip(text):
    assert beats_file.format(beats_file.parse(text)) == text


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("0.5\n\nhello\n", 3, "hello"),
        ("0.5 1 2\n", 1, "3 columns"),
        ("-0.5\n1\n", 1, ">= 0"),
        ("0.5\nnan\n", 2, ">= 0"),
        ("0.5\n0.5\n", 2, "after 0.5"),
        ("1\n2\n1.5\n", 3, "after 2"),
        ("1 1\n2 3\n", 2, "beat 2 or 1"),
        ("1 1.5\n2 2\n", 1, "whole beat"),
        ("1 0\n2 1\n", 1, "whole beat"),
        ("1 1\n2\n", 2, "second column"),
        ("1\n2 2\n", 2, "second column"),
        ("# nothing\n1.0\n", 0, "at least two beats, got 1"),
        ("", 0, "got 0"),
    ],
)
def test_refusals_name_the_line(text, line, said):
    with pytest.raises(FormatError) as caught:
        beats_file.parse(text, name="a.beats")
    assert caught.value.line == line
    assert said in caught.value.what


def test_unreadable_files(tmp_path):
    with pytest.raises(FormatError, match="readable"):
        beats_file.read(tmp_path / "none.beats")
    (tmp_path / "a.beats").write_bytes(b"0.5\n\xff\xfe\n")
    with pytest.raises(FormatError, match="UTF-8"):
        beats_file.read(tmp_path / "a.beats")


def test_real_beats(data_dir):
    """Every file of true beats reads; the sample annotated by hand has a bar of four."""
    files = sorted((data_dir / "audio_beats").glob("*.beats"))
    assert len(files) >= 16
    for path in files:
        assert (np.diff(beats_file.read(path).time_s) > 0.2).all()
    assert beats_file.read(data_dir / "audio_beats/madmom_sample.beats").beat_in_bar_number.tolist() == [1, 2, 3, 4]
