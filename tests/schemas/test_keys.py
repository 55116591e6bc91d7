"""Keys: legal for every name there is, stable, and telling names apart."""

import hashlib
import unicodedata

import numpy as np
import pytest

from schemas.keys import (
    LONGEST_KEY,
    check_key,
    clip_key,
    is_key,
    is_mirrored,
    mirrored,
    part_key,
    part_of,
    parts_in_use,
    seen_label,
    session_key,
    slug,
    song_key,
    source_clip,
)

NAMES = [
    "A b",
    "踊り",
    "踊り 01",
    "Été",
    "__",
    "",
    "..",
    "a" * 300,
    "x-y_z",
    "tab\t",
    'q"q',
    "🕺",
    "\udcff",
    "CON",
    "a.b.c",
]


@pytest.mark.parametrize("name", NAMES)
def test_every_name_has_a_legal_key(name):
    assert is_key(slug(name))
    assert is_key(song_key(name))
    assert is_key(clip_key([name, name], name))
    assert is_key(session_key([name]))


def test_known_keys():
    assert clip_key(["bvh_dance", "cmu_salsa"], "60_01") == "bvh_dance-cmu_salsa-60_01"
    assert slug("Dataset-1 Bow (active)") == "dataset_1_bow_active"
    assert slug("Été") == "ete"
    assert session_key([]) == "clips"


def test_names_that_lose_letters_stay_apart():
    assert slug("踊り") != slug("歌")
    assert slug("踊り 01").startswith("01_")
    assert slug("a" * 300) != slug("a" * 301)


def test_keys_of_many_random_names_are_legal_and_repeat():
    rng = np.random.default_rng(0)
    for _ in range(2000):
        name = "".join(chr(c) for c in rng.integers(32, 0x3100, rng.integers(0, 120)))
        key = clip_key([name[:40]], name)
        assert is_key(key)
        assert len(key) <= LONGEST_KEY
        assert key == clip_key([name[:40]], name)


@pytest.mark.parametrize("text", ["", "A", "a__b", "_a", "a-", "a/b", "a|b", "a\n", "ü", "a" * 81])
def test_illegal_keys_are_refused(text):
    assert not is_key(text)
    with pytest.raises(ValueError, match="key: want"):
        check_key(text)


def test_parts_stay_put_and_are_read_back():
    names = [f"clip_{i}" for i in range(1000)]
    before = {name: part_of(name, 8) for name in names}
    assert {name: part_of(name, 8) for name in names[::3]} == {name: before[name] for name in names[::3]}
    assert set(before.values()) == set(range(8))
    keys = [part_key("big", i, 16) for i in range(16)]
    assert keys[3] == "big-part_03_of_16"
    assert all(is_key(k) for k in keys)
    assert parts_in_use([*keys, "small"]) == {"big": 16}


def test_an_image_has_a_name_of_its_own_that_is_no_key_and_tells_its_clip():
    image = mirrored("ayame-step")
    assert is_mirrored(image)
    assert not is_mirrored("ayame-step")
    assert source_clip(image) == source_clip("ayame-step") == "ayame-step"
    assert not is_key(image)


@pytest.mark.parametrize(
    ("label", "seen"),
    [
        ("wave-right-hand", "wave-left-hand"),
        ("walk_turn_left", "walk_turn_right"),
        ("Left to RIGHT", "Right to LEFT"),
        ("bright", "bright"),
        ("leftover", "leftover"),
        ("", ""),
    ],
)
def test_a_mirrored_clip_shows_the_other_side(label, seen):
    assert seen_label(label, mirrored("a-b")) == seen
    assert seen_label(label, "a-b") == label


@pytest.mark.parametrize("name", ["ガ", "Été ガ", "a" * 200 + "é"])
def test_a_name_has_one_key_however_its_accents_are_put_together(name):
    apart, together = (unicodedata.normalize(form, name) for form in ("NFD", "NFC"))
    assert apart != together
    assert song_key(apart) == song_key(together)
    assert clip_key([apart], apart) == clip_key([together], together)
    assert session_key([apart, apart, "long" * 8]) == session_key([together, together, "long" * 8])
    assert part_of(apart, 64) == part_of(together, 64)


def test_keys_of_names_put_together_are_those_they_always_were():
    assert song_key("踊り") == "x" + hashlib.sha256("踊り".encode()).hexdigest()[:8]
    assert song_key("ガ") == "x" + hashlib.sha256("ガ".encode()).hexdigest()[:8]
