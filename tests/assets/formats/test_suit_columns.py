"""Columns from Parquet and CSV, and every way a table can be broken."""

import io

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from assets.formats import suit_columns
from assets.formats.errors import FormatError
from assets.formats.suit_columns import header_of, parse_csv, read


def test_numbers_names_and_flags():
    columns = parse_csv(b"A,name, ok\n1.5,x,true\n,y,false\n-2e-3,x,true\n")
    assert columns.names == ["a", "name", "ok"]
    np.testing.assert_array_equal(columns.numbers("a"), [1.5, np.nan, -2e-3])
    number, names = columns.texts("name")
    assert ([names[k] for k in number], columns.flags("ok").tolist()) == (["x", "y", "x"], [True, False, True])


@pytest.mark.parametrize(
    "data",
    [
        b"a;b\r\n1,5;2\r\n",
        b"a\tb\n1.5\t2\n",
        b"\xef\xbb\xbfa,b\n1.5,2\n",
        "a,b\n1.5,2\n".encode("utf-16"),
        b"# made by hand\n\na,b\n1.5,2\n",
        b'"a","b"\n"1.5","2"\n',
    ],
)
def test_dialects(data):
    columns = parse_csv(data)
    assert columns.names == ["a", "b"]
    assert (columns.numbers("a")[0], columns.numbers("b")[0]) == (1.5, 2.0)


@pytest.mark.parametrize("word", ["1", "0", "true", "FALSE", "yes", "no"])
def test_words_for_yes_and_no(word):
    flags = parse_csv(f"a,ok\n1,{word}\n2,{word}\n".encode()).flags("ok")
    assert flags.tolist() == [word.lower() in ("1", "true", "yes")] * 2


@pytest.mark.parametrize(
    ("data", "line", "what"),
    [
        (b"a,b\n1,2\n3\n", 3, "want 2 values, got 1; mend the line"),
        (b"a,b\n1,2\n3,4,5\n6,7\n", 3, "want 2 values, got 3"),
        (b"a,b\n1,2\n3", 3, "cut short"),
        (b"a,b\n", 0, "at least one row"),
        (b"nothing here", 0, "want a table"),
        (b"\x00\x01\x02\x03" * 100, 0, "want a table"),
    ],
)
def test_broken_text_is_refused_with_its_line(data, line, what):
    with pytest.raises(FormatError, match=what) as refused:
        parse_csv(data, "x.csv")
    assert (refused.value.path, refused.value.line) == ("x.csv", line)


def test_a_word_for_a_number_is_refused_with_its_line():
    columns = parse_csv(b"# note\na,b\n1,2\nmuch,3\n", "x.csv")
    with pytest.raises(FormatError, match="want a number, got 'much'") as refused:
        columns.numbers("a")
    assert refused.value.line == 4


def test_a_number_for_a_flag_and_a_missing_name():
    columns = parse_csv(b"a,b\n1,x\n2,\n")
    with pytest.raises(FormatError, match="want true or false, got 2"):
        columns.flags("a")
    with pytest.raises(FormatError, match="want the name of a sensor, got nothing"):
        columns.texts("b")


def test_a_column_twice_is_refused_where_it_is_read():
    columns = parse_csv(b"a,b,b\n1,2,3\n")
    assert columns.numbers("a").tolist() == [1.0]
    with pytest.raises(FormatError, match="'b' once"):
        columns.numbers("b")


def test_header_of_nothing():
    assert header_of(b"") == (",", [], 1)


@pytest.fixture
def stored(tmp_path):
    sink = io.BytesIO()
    pq.write_table(pa.table({"A": [1.0, 2.0], "s": ["x", "y"]}), sink)
    place = tmp_path / "a.parquet"
    place.write_bytes(sink.getvalue())
    return place


def test_parquet_by_content(stored, tmp_path):
    other = tmp_path / "a.csv"
    other.write_bytes(stored.read_bytes())
    assert read(other).names == read(stored).names == ["a", "s"]
    with pytest.raises(FormatError, match="row 2: bad"):
        raise read(stored).error(1, "bad")


def test_cut_parquet_empty_file_and_too_large(stored, tmp_path):
    data = stored.read_bytes()
    stored.write_bytes(data[: len(data) // 2])
    with pytest.raises(FormatError, match="ends early"):
        read(stored)
    (tmp_path / "e.csv").write_bytes(b"")
    with pytest.raises(FormatError, match="empty file"):
        read(tmp_path / "e.csv")
    with pytest.raises(FormatError, match="want at most 0 MB"):
        read(stored, max_bytes=10)


def test_a_file_of_two_gigabytes_is_refused_unread(tmp_path):
    place = tmp_path / "huge.csv"
    with place.open("wb") as file:
        file.truncate(2_000_000_000)
    with pytest.raises(FormatError, match="got 2000 MB"):
        read(place)


def test_more_rows_than_any_take_has(stored, monkeypatch):
    monkeypatch.setattr(suit_columns, "MAX_ROWS", 1)
    with pytest.raises(FormatError, match="want at most 1 rows, got 2"):
        read(stored)


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"\x1f\x8b\x08" + bytes(40), "packed by gzip"),
        (b"PK\x03\x04" + bytes(40), "spreadsheet"),
        (b"\x02P6" + bytes(40), "C3D"),
        (b"frame\0\0\0\1", "binary data"),
        (b"# name: ulna\n# type: matrix\n", "'# name: ulna'"),
    ],
)
def test_what_is_no_table_is_called_by_its_name(data, what):
    with pytest.raises(FormatError, match=what):
        parse_csv(data)
