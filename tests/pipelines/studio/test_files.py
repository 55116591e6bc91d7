"""Whole files or none; see also the tests of the lake."""

import pytest

from assets.formats.beside import MARK
from pipelines.studio.files import LakeError, write_beside


def test_written_whole_with_its_folder(tmp_path):
    place = tmp_path / "new" / "a.bin"
    write_beside(place, lambda file: file.write(b"x"))
    assert place.read_bytes() == b"x"


def test_what_fails_leaves_the_old_file_and_nothing_beside(tmp_path):
    place = tmp_path / "a.bin"
    place.write_bytes(b"old")

    def fail(file):
        file.write(b"new")
        raise OSError(28, "No space left on device")

    with pytest.raises(LakeError, match="the disk is full"):
        write_beside(place, fail)
    assert place.read_bytes() == b"old"
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(MARK)]
