"""Whole files or none: written beside, renamed, nothing left."""

import errno
from pathlib import Path

import numpy as np
import pytest
from upath import UPath

from assets.formats import audio, beside, usd
from assets.formats.audio import Audio
from assets.formats.beside import MARK, sweep, written_beside
from assets.formats.tree import File, HashCache
from pipelines.studio.files import LakeError, write_beside


def test_the_file_is_whole_and_alone(tmp_path):
    path = tmp_path / "new" / "folder" / "a.bin"
    with written_beside(path, suffix=".usdc") as partial:
        assert partial.parent == path.parent
        assert partial.name.startswith(MARK)
        assert partial.suffix == ".usdc"
        partial.write_bytes(b"whole")
        assert not path.exists()
    assert path.read_bytes() == b"whole"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("trouble", [OSError(errno.ENOSPC, "full"), ValueError("no"), KeyboardInterrupt()])
def test_whatever_goes_wrong_the_old_file_stays_and_nothing_else(tmp_path, trouble):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")

    def write():
        with written_beside(path) as partial:
            partial.write_bytes(b"half")
            raise trouble

    with pytest.raises(type(trouble)):
        write()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_that_is_a_folder_is_refused_and_left(tmp_path):
    (tmp_path / "a.bin").mkdir()
    with pytest.raises(OSError, match="directory"), written_beside(tmp_path / "a.bin") as partial:
        partial.write_bytes(b"x")
    assert [p.name for p in tmp_path.iterdir()] == ["a.bin"]


def test_places_that_are_no_local_disk():
    path = UPath("memory://beside/a.bin")
    with written_beside(path) as partial:
        partial.write_bytes(b"far")
    assert path.read_bytes() == b"far"


def test_every_writer_marks_its_unfinished_files(tmp_path, monkeypatch, swaying):
    """A sweep knows leftovers by their names alone."""
    seen = []
    replace = Path.replace
    monkeypatch.setattr(Path, "replace", lambda self, target: seen.append(self.name) or replace(self, target))
    write_beside(tmp_path / "a.parquet", lambda file: file.write(b"x"))
    audio.write_wav(tmp_path / "a.wav", Audio(np.zeros((8, 1), np.float32), 8000))
    usd.write_stage(tmp_path / "a.usdc", swaying)
    (tmp_path / "source").write_bytes(b"x")
    cache = HashCache(tmp_path / "hashes.json")
    cache.sha256(tmp_path, File("source", 1, 0), 10**10)
    cache.save()
    assert len(seen) == 4
    assert all(name.startswith(MARK) for name in seen)


def test_sweep_takes_leftovers_of_two_levels_and_nothing_else(tmp_path):
    assert sweep(tmp_path / "nowhere") == 0
    for name in (".tmp-1", "a/.tmp-2.usdc", "a/b.parquet", "c.json", "a/.hidden"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"x")
    assert sweep(tmp_path) == 2
    assert sorted(p.name for p in tmp_path.rglob("*") if p.is_file()) == [".hidden", "b.parquet", "c.json"]


def held(errno_, winerror):
    """An error as Windows raises it."""
    error = PermissionError(errno_, "Access is denied")
    error.winerror = winerror
    return error


@pytest.mark.parametrize("winerror", [5, 32, 1224])
def test_a_file_that_a_reader_holds_open_for_a_moment_is_waited_for(tmp_path, monkeypatch, winerror):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    replace, refused = Path.replace, iter([held(errno.EACCES, winerror)] * 3)

    def replace_later(self, target):
        if error := next(refused, None):
            raise error
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", replace_later)
    with written_beside(path) as partial:
        partial.write_bytes(b"new")
    assert path.read_bytes() == b"new"
    assert next(refused, None) is None


def test_what_is_held_for_good_is_an_error_and_the_old_file_stays(tmp_path, monkeypatch):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    tries = []

    def refuse(self, target):
        tries.append(target)
        raise held(errno.EACCES, 32)

    monkeypatch.setattr(Path, "replace", refuse)
    monkeypatch.setattr(beside, "_PATIENCE_S", 0.12)
    with pytest.raises(LakeError, match="another program has it open"):
        write_beside(path, lambda file: file.write(b"new"))
    assert len(tries) > 1
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_no_waiting_mends_is_not_waited_for(tmp_path, monkeypatch):
    tries = []

    def refuse(self, target):
        tries.append(target)
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(LakeError, match="mend the folder's permissions"):
        write_beside(tmp_path / "a.bin", lambda file: file.write(b"new"))
    assert len(tries) == 1
