"""What a studio says of its clips, in our columns and in those of data sets."""

import re
import unicodedata

import pytest

from assets.formats.clips_csv import Facts, is_clips_csv, misspelt_columns, parse, row_of
from assets.formats.errors import FormatError


def test_our_columns():
    facts = parse(b"file,label,style,subject,licence\nspin.bvh,spin,calm,ayame,CC0-1.0\n")
    assert facts == {"spin.bvh": Facts("spin", "calm", "ayame", "CC0-1.0")}


def test_columns_of_a_labelled_data_set():
    facts = parse(
        b"path,dataset,content,style,suggested_class,frames,fps\nset/walk_1.bvh,d,walk,angry,Locomotion,90,30\n"
    )
    assert facts == {"set/walk_1.bvh": Facts("walk", "angry", "", "")}
    assert parse(b"path,class,kind,person\na/b.bvh,Idle,acted,007\n") == {"a/b.bvh": Facts("Idle", "acted", "007", "")}


def test_byte_order_mark_spaces_quotes_and_backslashes():
    facts = parse('\ufeffFile, Label\r\n"a, b\\c.bvh", "two ""words"""\r\n\r\n'.encode())
    assert facts == {"a, b/c.bvh": Facts('two "words"')}


def test_header_alone_says_nothing():
    assert parse(b"file,label\n") == {}


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (b"", "want a column 'file', got nothing"),
        (b"name;label\na;b\n", "want a column 'file'"),
        (b"file,label\n\xff,b\n", "want UTF-8, got byte 0xff"),
        (b"file,label\na,b\na,c\n", "want each file once, got 'a'"),
    ],
)
def test_refusals(data, word):
    with pytest.raises(FormatError, match=word):
        parse(data)


def test_same_row_twice_is_no_quarrel():
    assert len(parse(b"file,label\na,b\na,b\n")) == 1


def test_longest_ending_counts():
    facts = {"spin.bvh": Facts("any"), "day/spin.bvh": Facts("day"), "elsewhere/kick.bvh": Facts("kick")}
    assert row_of(facts, ["studio", "day"], "spin.bvh") == "day/spin.bvh"
    assert row_of(facts, ["studio", "night"], "spin.bvh") == "spin.bvh"
    assert row_of(facts, ["studio"], "kick.bvh") == "elsewhere/kick.bvh"
    assert row_of(facts, [], "lost.bvh") is None


def test_a_name_that_is_in_two_folders_elsewhere_is_not_guessed():
    assert row_of({"a/x.bvh": Facts("1"), "b/x.bvh": Facts("2")}, ["c"], "x.bvh") is None


def test_a_column_misspelt_is_told_from_one_that_is_another_s():
    assert misspelt_columns(b"file,lable,License,frames\n") == {"lable": "label"}
    assert misspelt_columns(b"path,content,class,dataset,suggested_class,fps\n") == {}
    assert misspelt_columns(b"") == {}


def test_which_files_are_read():
    assert [
        n for n in ("clips.csv", "Labels.CSV", "labels_extra.csv", "index.csv", "clips.txt") if is_clips_csv(n)
    ] == [
        "clips.csv",
        "Labels.CSV",
        "labels_extra.csv",
    ]


@pytest.mark.parametrize("forms", [("NFC", "NFD"), ("NFD", "NFC"), ("NFD", "NFD")])
def test_accents_may_be_put_together_or_apart(forms):
    said, stored = (unicodedata.normalize(form, "ガ/Été.bvh") for form in forms)
    facts = parse(f"file,label\n{said},spin\n".encode())
    for folders, name in ((stored.split("/")[:1], stored.split("/")[1]), ([], stored.split("/")[1])):
        assert facts[row_of(facts, folders, name)].label == "spin"


def test_a_take_within_a_file_and_what_is_answered_for():
    said = parse(b"file,health,start_s,end_s\na.bvh,OK,1.5,4\nb.bvh,,,2\nc.bvh,,,\n")
    assert [(f.health, f.start_s, f.end_s) for f in said.values()] == [
        ("ok", 1.5, 4.0),
        ("", None, 2.0),
        ("", None, None),
    ]


@pytest.mark.parametrize(
    ("row", "word"),
    [
        ("a.bvh,fine,,", "want health 'ok' or nothing, got 'fine'"),
        ("a.bvh,,4,4", "want end_s after start_s, got 4 to 4"),
        ("a.bvh,,,0", "want end_s after start_s, got 0 to 0"),
        ("a.bvh,,soon,", "want start_s in seconds, got 'soon'"),
    ],
)
def test_a_take_that_cannot_be_is_refused_by_its_line(row, word):
    with pytest.raises(FormatError, match=re.escape(f"clips.csv:2: {word}")):
        parse(f"file,health,start_s,end_s\n{row}\n".encode())
