import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipelines import caches
from pipelines.caches import FOLDERS, is_writable, settle, usual_folder


@pytest.fixture
def nowhere():
    """A folder nobody can make, root least of all."""
    if not Path("/proc/self").is_dir():
        pytest.skip("no /proc to stand for a disk that cannot be written")
    return Path("/proc/no such folder")


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The one folder for temporary files."""
    folder = tmp_path / "temporary files"
    folder.mkdir()
    monkeypatch.setattr(caches, "_temporary_folders", lambda: [folder])
    return folder


@pytest.mark.parametrize(
    ("environment", "system", "folder"),
    [
        ({"HOME": "/home/aki"}, "linux", "/home/aki/.cache"),
        ({"HOME": "/home/aki", "XDG_CACHE_HOME": "/fast"}, "linux", "/fast"),
        ({"HOME": "/Users/aki"}, "darwin", "/Users/aki/Library/Caches"),
        ({"LOCALAPPDATA": "/c/aki"}, "win32", "/c/aki"),
    ],
)
def test_the_usual_folder_is_the_systems(environment, system, folder):
    assert usual_folder(environment, system=system) == Path(folder)


def test_windows_without_a_profile_has_none():
    assert usual_folder({}, system="win32") is None


def test_a_usual_folder_that_can_be_written_changes_nothing(tmp_path, temporary):
    environment = {"HOME": str(tmp_path / "踊り home")}
    assert settle(environment) == tmp_path / "踊り home" / ".cache"
    assert environment == {"HOME": str(tmp_path / "踊り home")}
    assert not list(temporary.iterdir())


def test_else_every_library_is_pointed_at_a_folder_of_our_own(nowhere, temporary):
    environment = {"HOME": str(nowhere), "NUMBA_CACHE_DIR": "/chosen"}
    spare = settle(environment)
    assert spare.parent == temporary
    assert spare.stat().st_mode & 0o777 == 0o700
    assert environment["XDG_CACHE_HOME"] == str(spare)
    assert environment["POCL_CACHE_DIR"] == str(spare / "pocl")
    assert environment["NUMBA_CACHE_DIR"] == "/chosen"
    assert set(FOLDERS) <= set(environment)
    assert settle(environment) == spare  # a second process, or a second look, finds the same


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners are a matter of POSIX")
@pytest.mark.parametrize("how", ["link", "open to all", "file"])
def test_a_folder_that_others_could_fill_is_not_used(nowhere, temporary, tmp_path, how):
    place = temporary / f"odori-cache-{os.getuid()}"
    if how == "link":
        (tmp_path / "theirs").mkdir()
        place.symlink_to(tmp_path / "theirs")
    elif how == "file":
        place.write_text("")
    else:
        place.mkdir()
        place.chmod(0o777)
    environment = {"HOME": str(nowhere)}
    assert settle(environment) is None
    assert environment == {"HOME": str(nowhere)}


def test_where_nothing_can_be_written_there_is_none(nowhere, monkeypatch):
    monkeypatch.setattr(caches, "_temporary_folders", lambda: [nowhere])
    assert settle({"HOME": str(nowhere)}) is None


def test_a_folder_is_writable_when_a_file_fits(tmp_path, nowhere):
    assert is_writable(tmp_path / "new" / "deep")
    assert not is_writable(nowhere)
    (tmp_path / "file").write_text("")
    assert not is_writable(tmp_path / "file" / "below")


@pytest.mark.opencl
@pytest.mark.parametrize("home", ["/proc/no such home", None])
def test_devices_are_found_without_a_home(home, tmp_path):
    code = "from pipelines.device_fallback import found_devices; print(len(found_devices()))"
    environment = {k: v for k, v in os.environ.items() if k not in ("HOME", "XDG_CACHE_HOME", *FOLDERS)}
    environment |= {"TMPDIR": str(tmp_path)} | ({"HOME": home} if home else {})
    usual = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert found.stdout == usual.stdout
