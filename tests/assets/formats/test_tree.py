"""Listing and hashing a folder of files."""

import hashlib
import os
import time

from assets.formats.tree import File, HashCache, sha256, walk

LONG_AGO_NS = 1_000_000_000 * 10**9


def age(path):
    os.utime(path, ns=(LONG_AGO_NS, LONG_AGO_NS))


def test_walk_is_sorted_and_leaves_hidden_names_out(tmp_path):
    for name in ("b/two.bvh", "a/one.BVH", "a/.hidden.bvh", ".git/x.bvh", "top.bvh"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"x")
    found = walk(tmp_path)
    assert [f.path for f in found] == ["a/one.BVH", "b/two.bvh", "top.bvh"]
    assert (found[0].folders, found[0].name, found[0].stem, found[0].suffix) == (("a",), "one.BVH", "one", ".bvh")


def test_missing_folder_lists_nothing(tmp_path):
    assert walk(tmp_path / "nowhere") == []
    (tmp_path / "file").write_bytes(b"")
    assert walk(tmp_path / "file") == []


def test_links_are_followed_but_no_loop(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "x.bvh").write_bytes(b"x")
    (tmp_path / "real" / "loop").symlink_to(tmp_path / "real")
    (tmp_path / "studio").mkdir()
    (tmp_path / "studio" / "link").symlink_to(tmp_path / "real")
    (tmp_path / "studio" / "dangling.bvh").symlink_to(tmp_path / "gone")
    assert [f.path for f in walk(tmp_path / "studio")] == ["link/x.bvh"]


def test_names_without_suffix_and_with_dots():
    assert File("a/README", 1, 1).suffix == ""
    assert File("a/x.brief.toml", 1, 1).suffix == ".toml"
    assert File("a/x.brief.toml", 1, 1).stem == "x.brief"


def test_hash_is_of_the_bytes(tmp_path):
    (tmp_path / "f").write_bytes(b"odori")
    assert sha256(tmp_path / "f") == hashlib.sha256(b"odori").hexdigest()


def test_unchanged_file_is_not_read_again(tmp_path, monkeypatch):
    place = tmp_path / "clips" / "f.bvh"
    place.parent.mkdir()
    place.write_bytes(b"one")
    age(place)
    cache = HashCache(tmp_path / "hashes.json")
    first = cache.sha256(place.parent, walk(place.parent)[0], time.time_ns())
    cache.save()
    place.write_bytes(b"two")  # same size; put back to the same time, as no editor would
    age(place)
    assert HashCache(tmp_path / "hashes.json").sha256(place.parent, walk(place.parent)[0], time.time_ns()) == first


def test_changed_size_or_time_is_read_again(tmp_path):
    place = tmp_path / "clips" / "f.bvh"
    place.parent.mkdir()
    place.write_bytes(b"one")
    age(place)
    cache = HashCache(tmp_path / "hashes.json")
    first = cache.sha256(place.parent, walk(place.parent)[0], time.time_ns())
    place.write_bytes(b"two")
    assert cache.sha256(place.parent, walk(place.parent)[0], time.time_ns()) != first


def test_a_file_just_written_is_not_trusted(tmp_path):
    place = tmp_path / "clips" / "f.bvh"
    place.parent.mkdir()
    place.write_bytes(b"one")
    now_ns = place.stat().st_mtime_ns + 1
    cache = HashCache(tmp_path / "hashes.json")
    first = cache.sha256(place.parent, walk(place.parent)[0], now_ns)
    written_ns = place.stat().st_mtime_ns
    place.write_bytes(b"two")
    os.utime(place, ns=(written_ns, written_ns))
    assert cache.sha256(place.parent, walk(place.parent)[0], now_ns) != first


def test_broken_or_missing_memory_is_started_anew(tmp_path):
    place = tmp_path / "clips" / "f.bvh"
    place.parent.mkdir()
    place.write_bytes(b"one")
    (tmp_path / "hashes.json").write_text("[broken")
    digest = HashCache(tmp_path / "hashes.json").sha256(place.parent, walk(place.parent)[0], time.time_ns())
    assert digest == hashlib.sha256(b"one").hexdigest()


def test_what_windows_and_macos_leave_in_folders_is_left_out(tmp_path):
    for name in ("Thumbs.db", "a/desktop.ini", "a/Desktop.ini", ".DS_Store", "a/._one.bvh", "a/one.bvh"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"x")
    assert [f.path for f in walk(tmp_path)] == ["a/one.bvh"]
