"""Which file a key stands for, and what a version is a version of."""

from dataclasses import replace
from pathlib import Path

import pytest

from assets.formats.clips_csv import Facts
from assets.formats.errors import FormatError
from assets.sources.sources import (
    ClipFile,
    Request,
    SongFile,
    Sources,
    brief_of,
    brief_version,
    fingerprint,
    request_of,
    request_version,
    session_version,
    song_version,
)
from pipelines.studio.folder import StudioFolder
from schemas.settings import Brief

CLIP = ClipFile("s-a", "s", "clips/s/a.bvh", "ab", Facts(label="spin"))
SONG = SongFile("waltz", "songs/waltz.wav", "cd", "audio", "songs/waltz.brief.toml")


@pytest.fixture
def studio(tmp_path):
    (tmp_path / "songs").mkdir()
    (tmp_path / "songs/waltz.wav").write_bytes(b"x")
    return StudioFolder(tmp_path)


def say(studio, text):
    (studio.root / "songs/waltz.brief.toml").write_text(text)


def test_readable_file_stands_for_a_key_that_two_want():
    refused = replace(SONG, path="songs/a.wav", problem="want its own key")
    found = Sources((), (refused, SONG))
    assert found.song("waltz") == SONG
    assert found.songs_by_key() == {"waltz": (refused, SONG)}
    with pytest.raises(KeyError):
        found.song("polka")


def test_clips_by_session_in_order_of_sessions():
    other = replace(CLIP, key="r-a", session="r")
    assert list(Sources((CLIP, other), ()).sessions().items()) == [("r", (other,)), ("s", (CLIP,))]


def test_session_version_follows_bytes_labels_and_refusals():
    others = [replace(CLIP, sha256="ef"), replace(CLIP, facts=Facts(label="kick")), replace(CLIP, problem="no")]
    versions = {session_version([clip]) for clip in [CLIP, *others]} | {session_version([])}
    assert len(versions) == 5
    assert session_version([replace(CLIP)]) == session_version([CLIP])


def test_song_version_leaves_the_brief_out():
    assert song_version([SONG]) == song_version([replace(SONG, brief="")])
    assert song_version([SONG]) != song_version([replace(SONG, sha256="ef")])


def test_fingerprint_knows_no_order_of_keys():
    assert fingerprint({"a": 1, "b": 2}) == fingerprint({"b": 2, "a": 1}) != fingerprint({"a": 2, "b": 1})
    with pytest.raises(TypeError):
        fingerprint({"a": Path("a")})


def test_brief_version_follows_beats_alone_and_their_file(studio):
    say(studio, '[beats]\nfile = "waltz.beats"\n')
    without = brief_version(studio, [SONG])
    (studio.root / "songs/waltz.beats").write_text("0.5\n")
    first = brief_version(studio, [SONG])
    (studio.root / "songs/waltz.beats").write_text("0.6\n")
    second = brief_version(studio, [SONG])
    say(studio, 'allow = ["MIT"]\n[beats]\nfile = "waltz.beats"\n')
    assert len({without, first, second, brief_version(studio, [replace(SONG, brief="")])}) == 4
    assert brief_version(studio, [SONG]) == second


def test_brief_that_cannot_be_read_counts_by_its_bytes_and_says_nothing(studio):
    say(studio, "allow = [")
    broken = brief_version(studio, [SONG])
    say(studio, "allow = [[")
    assert brief_version(studio, [SONG]) != broken
    assert brief_of(studio, "waltz", Sources((), (SONG,))) == Brief()
    with pytest.raises(FormatError):
        studio.brief(SONG)


def test_brief_of_a_song_is_that_of_the_file_that_is_not_refused(studio):
    say(studio, 'allow = ["MIT"]\n')
    sources = Sources((), (replace(SONG, problem="no"), SONG))
    assert brief_of(studio, "waltz", sources).allow == ("MIT",)
    assert brief_of(studio, "polka", sources) == Brief()


def test_request_version_follows_command_and_brief_but_not_the_character(studio):
    sources = Sources((), (SONG,))
    assert request_of(studio, "waltz|graph") == Request()
    plain = request_version(studio, "waltz|graph", sources)
    studio.remember("waltz|graph", Request(character="s-a"))
    assert request_of(studio, "waltz|graph") == Request(character="s-a")
    assert request_version(studio, "waltz|graph", sources) == plain
    studio.remember("waltz|graph", Request(seed=1))
    asked = request_version(studio, "waltz|graph", sources)
    say(studio, 'allow = ["MIT"]\n')
    assert len({plain, asked, request_version(studio, "waltz|graph", sources)}) == 3
