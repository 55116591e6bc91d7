"""Pins as directors write them."""

import pytest

from schemas.pins import PinWish, parse_pin


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("42=spin", PinWish(at=42.0, label="spin")),
        ("0=spin", PinWish(at=0.0, label="spin")),
        ("12.5-16=clip:ayame-step_01", PinWish(at=12.5, until=16.0, clip="ayame-step_01")),
        ("beat:8-16=not:walk", PinWish(beat=8, until_beat=16, not_label="walk")),
        ("bar:3=style:hip hop", PinWish(bar=3, style="hip hop")),
        ("bar:3-3=label:a:b", PinWish(bar=3, until_bar=3, label="a:b")),
        ("start=clip:x", PinWish(place="start", clip="x")),
        (" 42 = spin = turn ", PinWish(at=42.0, label="spin = turn")),
        ("1=踊り", PinWish(at=1.0, label="踊り")),
        ("start=pose:day-a@2.5", PinWish(place="start", pose="day-a@2.5")),
        ("bar:3=pose:day-a@2", PinWish(bar=3, pose="day-a@2")),
    ],
)
def test_read_and_written_back(text, wanted):
    assert parse_pin(text) == wanted
    assert parse_pin(wanted.text) == wanted


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("spin", "want PLACE=WISH"),
        ("=spin", "want PLACE=WISH"),
        ("x=spin", "want PLACE=WISH"),
        ("-3=spin", "want PLACE=WISH"),
        ("42=", "want one wish"),
        ("42=clip:", "want one wish"),
        ("16-12=spin", "until after at"),
        ("16-16=spin", "until after at"),
        ("beat:0=spin", "want beats counted from 1"),
        ("beat:5-5=spin", "until_beat after beat"),
        ("bar:4-3=spin", "until_bar after bar"),
        ("1=pose:", "want one wish"),
        ("1=pose:day-a", "KEY@SECONDS"),
        ("1=pose:day-a@-1", "KEY@SECONDS"),
        ("1=pose:@3", "KEY@SECONDS"),
    ],
)
def test_what_is_no_pin_says_why(text, word):
    with pytest.raises(ValueError, match=word):
        parse_pin(text)


def test_one_place_and_one_wish():
    with pytest.raises(ValueError, match="got more"):
        PinWish(at=1.0, beat=2, label="x")
    with pytest.raises(ValueError, match="label and style"):
        PinWish(at=1.0, label="x", style="y")


def test_of_several_clips_any_keeps_the_pin():
    pin = parse_pin("42=clip:day-a,day-b")
    assert pin.clips == ["day-a", "day-b"]
    assert [pin.is_kept_by(clip_id=c, label="x", style="") for c in ("day-b", "day-c")] == [True, False]
    assert parse_pin(pin.text) == pin


def test_a_pose_is_a_moment_of_a_clip():
    assert parse_pin("end=pose:day-a@7.25").pose_moment == ("day-a", 7.25)
    assert parse_pin("end=spin").pose_moment == ("", 0.0)
