import numpy as np
import pytest

import odori
from kernels.skeleton.canonical import JOINTS
from odori.answers import BeatTimes, CatalogueSong, Listing, PoseSequence


@pytest.fixture
def songs():
    return Listing("a song", [CatalogueSong(key, f"songs/{key}.wav", "read", None) for key in ("air", "waltz")])


def test_a_listing_is_found_by_place_by_key_and_in_order(songs):
    assert [song.key for song in songs] == songs.keys() == ["air", "waltz"]
    assert songs[1] == songs["waltz"] == songs[-1]
    assert songs[:1] == (songs["air"],)
    assert "waltz" in songs
    assert songs[0] in songs
    assert "tango" not in songs
    assert repr(songs) == "<2 listed: air, waltz>"


def test_what_is_not_listed_is_refused_with_the_nearest(songs):
    with pytest.raises(odori.OdoriError, match=r"walz: want a song, got none of that name; near are waltz$"):
        songs["walz"]
    with pytest.raises(odori.OdoriError, match="near are none"):
        Listing("a song", [])["walz"]


def test_a_joint_is_found_by_its_name():
    position = np.arange(2 * 22 * 3, dtype=float).reshape(2, 22, 3)
    poses = PoseSequence("one", 30.0, np.arange(2) / 30, position[:, 0], np.zeros((2, 22, 4)), position)
    assert poses.n_frames == 2
    assert poses.joints == JOINTS
    assert np.array_equal(poses.of("head"), position[:, JOINTS.index("head")])
    assert poses.parents[0] == -1
    assert all(parent < joint for joint, parent in enumerate(poses.parents))
    with pytest.raises(odori.OdoriError, match="leftFot: want a joint, got none of that name; near are leftFoot"):
        poses.of("leftFot")


@pytest.mark.parametrize(
    ("time_s", "tempo_bpm"),
    [([], None), ([1.0], None), ([1.0, 1.5], 120), ([0, 0.5, 1.5], 80), ([0, 0.5, 1.0, 2.0], 120)],
)
def test_tempo_is_that_of_the_median_interval(time_s, tempo_bpm):
    n = len(time_s)
    beats = BeatTimes(np.array(time_s), np.zeros(n, int), np.arange(n) % 2 + 1, np.ones(n))
    assert beats.tempo_bpm == (None if tempo_bpm is None else pytest.approx(tempo_bpm))
    assert beats.downbeat_s.tolist() == time_s[::2]
