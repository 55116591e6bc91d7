"""TOML to settings: defaults, nesting, and one sentence for each slip."""

import pytest

from assets.formats.errors import FormatError
from assets.formats.settings_file import parse, read_brief, read_settings
from schemas.settings import Brief, Settings


def test_nothing_gives_every_default(tmp_path):
    assert parse("", Settings) == Settings()
    assert read_settings(tmp_path / "odori.toml") == Settings()
    assert read_brief(tmp_path / "x.brief.toml") == Brief()


def test_values_of_every_kind():
    text = """
    [motion_beat]
    component = 2
    joints = ["leftFoot", "rightFoot"]
    [dance]
    frame_rate_hz = 60
    [joints]
    "Bip01 Pelvis" = "hips"
    """
    found = parse(text, Settings)
    assert found.motion_beat.component == 2
    assert found.motion_beat.joints == ("leftFoot", "rightFoot")
    assert found.dance.frame_rate_hz == 60.0
    assert found.joints == {"Bip01 Pelvis": "hips"}
    assert parse("[beats]\noctave = 0.5\nnudge_beats = -0.5", Brief).beats.octave == 0.5


def test_file_with_byte_order_mark(tmp_path):
    (tmp_path / "odori.toml").write_bytes(b"\xef\xbb\xbf[dance]\nblend_s = 0.2\n")
    assert read_settings(tmp_path / "odori.toml").dance.blend_s == 0.2


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("[dance", "want TOML"),
        ("[dnace]\n", "got 'dnace'; did you mean 'dance'"),
        ("[dance]\nblnd_s = 1", "got 'dance.blnd_s'; did you mean 'blend_s'"),
        ("[dance]\nzzz = 1", "known are frame_rate_hz, blend_s"),
        ("dance = 3", "want a section \\[dance\\]"),
        ("[dance]\nblend_s = 'long'", "dance.blend_s: want a number, got 'long'"),
        ("[motion_graph]\nneighbours = 1.5", "want a whole number"),
        ("[motion_graph]\nneighbours = true", "want a whole number"),
        ("[motion_beat]\njoints = 'leftFoot'", "want a list of texts"),
        ("[motion_beat]\nmethod = 'fff'", "\\[motion_beat\\] method: want one of pulse"),
        ("[joints]\na = 1", "want a section of"),
    ],
)
def test_each_slip_is_named(text, word):
    with pytest.raises(FormatError, match=word):
        parse(text, Settings)


def test_not_utf8(tmp_path):
    (tmp_path / "odori.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(FormatError, match="want UTF-8, got byte 0xff"):
        read_settings(tmp_path / "odori.toml")
