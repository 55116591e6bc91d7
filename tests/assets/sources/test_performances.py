"""Who danced to what: by clips.csv, by name, and what cannot be paired."""

import unicodedata

from assets.sources.performances import DancedClip, NamedSong, Performance, pair

SONGS = [
    NamedSong("alpha", "songs/Alpha.wav", "audio"),
    NamedSong("alpha_mid", "songs/Alpha.mid", "midi"),
    NamedSong("beta", "songs/beta.ogg", "audio"),
]


def test_one_stem_belongs_together_and_midi_comes_first():
    found, troubles = pair(
        [DancedClip("a-alpha", "clips/a/alpha.bvh"), DancedClip("a-gamma", "clips/a/gamma.bvh")], SONGS
    )
    assert found == [Performance("a-alpha", "alpha_mid", 0.0, "name")]
    assert troubles == []


def test_clips_csv_says_otherwise_by_key_file_or_stem():
    for text in ("beta", "beta.ogg", "songs/beta.ogg", "BETA"):
        found, _ = pair([DancedClip("x", "clips/alpha.bvh", text, 1.5)], SONGS)
        assert found == [Performance("x", "beta", 1.5, "clips.csv")]
    assert pair([DancedClip("x", "clips/x.bvh", "Alpha.wav")], SONGS)[0][0].song_id == "alpha"
    assert pair([DancedClip("x", "clips/alpha.bvh", "none")], SONGS) == ([], [])


def test_a_song_that_is_not_there_is_told():
    found, troubles = pair([DancedClip("x", "clips/x.bvh", "delta")], SONGS)
    assert found == []
    assert "clips/x.bvh: performed to 'delta'" in troubles[0]
    assert pair([], []) == ([], [])


def test_accents_may_be_put_together_or_apart():
    apart, together = (unicodedata.normalize(form, "Été.mid") for form in ("NFD", "NFC"))
    assert apart != together
    for here, there in ((apart, together), (together, apart)):
        found, troubles = pair([DancedClip("x", "clips/x.bvh", here)], [NamedSong("ete", f"songs/{there}", "midi")])
        assert [f.song_id for f in found] == ["ete"]
        assert troubles == []
