"""What is locked has a wheel on every platform, for every Python; asked of the registry that installs it."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from assets.formats.file_names import WINDOWS

REPOSITORY = Path(__file__).parents[1]
LOCK = REPOSITORY / "requirements.lock"
PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PLATFORMS = {
    "Linux x86-64": "x86_64-manylinux_2_28",
    "Linux aarch64": "aarch64-manylinux_2_28",
    "macOS arm64": "aarch64-apple-darwin",
    "Windows x86-64": "x86_64-pc-windows-msvc",
}
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
# Built from its source there, which wants Apple's command line tools: dagster asks for it and has no other.
FROM_SOURCE = {("macOS arm64", "3.14"): {"watchdog"}}
TIME_LIMIT_S = 300
# What uv says where nobody answers; whatever else it says is a failure of the lock.
UNREACHABLE = ("dns error", "tcp connect error", "operation timed out", "error sending request", "Could not connect")


_silent = []


def uv(*arguments, **options):
    """Run the uv of this environment; the test is skipped where no registry answers, the rest then without asking."""
    from uv import find_uv_bin

    command = [find_uv_bin(), *map(str, arguments)]
    if not _silent:
        done = subprocess.run(
            command, capture_output=True, encoding="utf-8", timeout=TIME_LIMIT_S, check=False, **options
        )
        if not done.returncode or not any(said in done.stderr for said in UNREACHABLE):
            return done
        _silent.append(done.stderr.strip().splitlines()[-1].strip())
    pytest.skip(f"the registry of packages cannot be reached: {_silent[0]}")


def locked():
    """Split the lock into requirements, each with its marker and hashes, by name."""
    text = LOCK.read_text(encoding="utf-8")
    blocks = re.split(r"^(?=[a-zA-Z0-9])", text, flags=re.MULTILINE)
    return [(block.split("==")[0], block) for block in blocks if block.strip()]


def resolve(requirements, platform, python, folder):
    """Ask what would be installed, from wheels alone, each with a hash of the lock."""
    return uv(
        *("pip", "install", "--dry-run", "--no-deps", "--require-hashes", "--only-binary", ":all:"),
        *("--python", sys.executable, "--python-platform", PLATFORMS[platform], "--python-version", python),
        *("--target", folder, "--requirements", "-"),
        input=requirements,
    )


@pytest.mark.registry
@pytest.mark.parametrize("python", PYTHONS)
@pytest.mark.parametrize("platform", PLATFORMS)
def test_every_locked_package_has_a_wheel(platform, python, tmp_path):
    built = FROM_SOURCE.get((platform, python), set())
    wheels = "".join(block for name, block in locked() if name not in built)
    done = resolve(wheels, platform, python, tmp_path)
    assert done.returncode == 0, done.stderr
    would = set(re.findall(r"^ \+ ([a-z0-9-]+)==", done.stderr, re.MULTILINE))
    assert {"dagster", "dagster-webserver", "pyopencl", "usd-core", "pytest"} <= would
    assert ("pocl-binary-distribution" in would) == (platform == "Linux x86-64")
    for name in built:  # what has a wheel after all need not be built
        alone = resolve(next(block for n, block in locked() if n == name), platform, python, tmp_path)
        assert alone.returncode != 0, (
            f"{name} has a wheel on {platform} for Python {python}: take it out of FROM_SOURCE"
        )


@pytest.mark.registry
def test_the_lock_is_what_the_project_asks_for(tmp_path):
    """What is declared and not locked, or locked otherwise than ``make lock`` would, changes the lock."""
    copy = tmp_path / "requirements.lock"
    copy.write_bytes(LOCK.read_bytes())
    recipe = (
        (REPOSITORY / "Makefile").read_text(encoding="utf-8").partition("\nlock:")[2].partition("pyproject.toml")[0]
    )
    options = [word for word in recipe.split() if word.startswith("--") or re.fullmatch(r"3\.\d+|dev", word)]
    done = uv("pip", "compile", *options, REPOSITORY / "pyproject.toml", "-o", copy, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    # Hashes may grow: a wheel for one more system may be uploaded later.
    assert [line for line in copy.read_text(encoding="utf-8").splitlines() if "==" in line] == [
        line for line in LOCK.read_text(encoding="utf-8").splitlines() if "==" in line
    ]


def test_the_lock_has_hashes_and_no_host():
    assert len(locked()) > 100
    assert [name for name, block in locked() if "--hash=sha256:" not in block] == []
    assert "://" not in LOCK.read_text(encoding="utf-8")


def test_dagster_and_its_page_are_of_one_version():
    pinned = {
        name: block.split()[0].split("==")[1] for name, block in locked() if name in ("dagster", "dagster-webserver")
    }
    assert len(pinned) == 2
    assert len(set(pinned.values())) == 1
    assert {f"{name}=={version}" for name, version in pinned.items()} <= set(PROJECT["dependencies"])


def test_the_pythons_resolved_are_those_the_project_allows():
    low, high = (int(v) for v in re.fullmatch(r">=3\.(\d+),<3\.(\d+)", PROJECT["requires-python"]).groups())
    assert [f"3.{minor}" for minor in range(low, high)] == list(PYTHONS)


@pytest.mark.skipif(not shutil.which("make") or WINDOWS, reason="no make here")
def test_make_refuses_other_pythons_and_names_those_it_takes(tmp_path):
    """The Makefile reads what is allowed from the project file, before anything is installed."""
    python = tmp_path / "python"
    python.write_text('#!/bin/sh\n[ "$1" = --version ] && echo Python 3.9.1 || exit 1\n', encoding="utf-8")
    python.chmod(0o755)
    done = subprocess.run(
        ["make", "install", f"PYTHON={python}", f"VENV={tmp_path / 'venv'}"],
        capture_output=True,
        encoding="utf-8",
        cwd=REPOSITORY,
        check=False,
    )
    assert done.returncode != 0
    assert f"want a Python that is {PROJECT['requires-python']}, got Python 3.9.1" in done.stderr + done.stdout
    assert not (tmp_path / "venv").exists()


def test_the_lines_for_windows_install_what_make_installs():
    readme = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    makefile = (REPOSITORY / "Makefile").read_text(encoding="utf-8")
    lines = readme.partition("in PowerShell:")[2].partition("\n```\n\n")[0]
    pinned = re.findall(r"uv==[\d.]+", makefile)
    assert re.findall(r"uv==[\d.]+", lines) == pinned[:1]
    for options in ("--require-hashes -r requirements.lock", "--no-build-isolation --no-deps --editable .", "-n auto"):
        assert options in makefile
        assert options in lines
