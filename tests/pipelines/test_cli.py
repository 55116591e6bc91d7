"""What the command prints on consoles of any encoding, and its version."""

import json
import os
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
# What pipes of Windows are in Western Europe, and a C locale that stays one: there Python reads no file's name either.
KEPT = "C locale, kept"
CONSOLES = {
    "C locale": {"LC_ALL": "C", "LANG": "C"},
    KEPT: {"LC_ALL": "C", "LANG": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
    "ASCII": {"PYTHONIOENCODING": "ascii"},
    "latin-1": {"PYTHONIOENCODING": "latin-1"},
    "cp1252": {"PYTHONIOENCODING": "cp1252"},
    "UTF-16": {"PYTHONIOENCODING": "utf-16"},
    "UTF-8": {"PYTHONIOENCODING": "utf-8"},
}


def odori(console, *arguments):
    """Run the command; standard output and error as bytes."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("LC_", "LANG", "PYTHONIO", "ODORI"))}
    return subprocess.run(
        [sys.executable, "-m", "pipelines.cli", *map(str, arguments)],
        capture_output=True,
        check=False,
        env=environment | CONSOLES[console],
    )


@pytest.fixture
def odd_studio(tmp_path):
    """A studio in a folder, with files, that no single byte can spell."""
    root = tmp_path / "踊り 🕺"
    (root / "clips").mkdir(parents=True)
    (root / "songs").mkdir()
    (root / "clips" / "歌 Été.xyz").write_bytes(b"no clip")
    return root


@pytest.mark.parametrize("console", ["C locale", KEPT, "cp1252"])
def test_json_is_utf8_and_no_sign_ends_a_report(odd_studio, console):
    done = odori(console, "status", "--json", "--studio", odd_studio)
    facts = json.loads(done.stdout.decode("utf-8"))
    assert done.stdout.count(b"\n") == 1
    assert done.returncode == 1
    assert len(facts["clips"]) == 1
    report = odori(console, "status", "--studio", odd_studio)
    assert report.returncode == 1
    assert b"Traceback" not in report.stderr
    if console != KEPT:
        assert facts["clips"][0]["path"] == "clips/歌 Été.xyz"
        assert "歌 Été".encode() in done.stdout
        assert ("歌".encode() if console == "C locale" else rb"\u6b4c") in report.stdout


@pytest.mark.parametrize("console", CONSOLES)
def test_no_sign_ends_a_page_of_help(console):
    done = odori(console, "dance", "--help")
    assert done.returncode == 0
    assert b"Traceback" not in done.stderr


@pytest.mark.parametrize("console", [KEPT, "cp1252"])
def test_no_sign_ends_an_error(tmp_path, console):
    done = odori(console, "calibrate", tmp_path / "踊り.csv", "--json")
    assert done.returncode == 2
    assert "踊り" in json.loads(done.stdout.decode("utf-8"))["error"] or console == KEPT
    assert b"Traceback" not in done.stderr


def test_a_wrong_command_line_is_one_object_too():
    done = odori("cp1252", "dance", "--json", "--no-such-踊り")
    assert done.returncode == 2
    assert "command line is wrong" in json.loads(done.stdout)["error"]


@pytest.mark.skipif(sys.platform == "win32", reason="there every name of a file is text")
def test_a_name_that_is_no_text_is_told_all_the_same(tmp_path):
    (tmp_path / "clips").mkdir()
    try:
        Path(os.fsdecode(os.fsencode(tmp_path / "clips") + b"/x\xe9.xyz")).write_bytes(b"")
    except OSError:
        pytest.skip("this disk takes no such name")
    done = odori("UTF-8", "status", "--json", "--studio", tmp_path)
    (clip,) = json.loads(done.stdout.decode("utf-8"))["clips"]
    assert clip["path"].startswith("clips/x")


def test_the_version_is_said_once():
    said = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert version("odori") == said
    done = odori("ASCII", "--version")
    assert (done.returncode, done.stdout.decode().strip()) == (0, f"odori {said}")
    packages = [REPOSITORY / name for name in ("pipelines", "assets", "kernels", "schemas")]
    sources = [path.read_text(encoding="utf-8") for package in packages for path in package.rglob("*.py")]
    assert not [text for text in sources if f'"{said}"' in text or "__version__ =" in text]
