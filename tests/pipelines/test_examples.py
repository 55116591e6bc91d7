"""The examples do what they say on a built studio."""

import subprocess
import sys
from pathlib import Path

from assets.formats import usd_check

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(name, *arguments):
    return subprocess.run(
        [sys.executable, str(EXAMPLES / name), *map(str, arguments)], capture_output=True, text=True, check=False
    )


def test_where_from(built):
    done = run("where_from.py", built, "beat")
    assert done.returncode == 0, done.stderr
    assert "CC0-1.0" in done.stdout
    assert "mean_warp" in done.stdout


def test_retarget_one(built, tmp_path):
    done = run("retarget_one.py", built / "clips" / "ayame" / "step.bvh", tmp_path / "step.usdc")
    assert done.returncode == 0, done.stderr
    assert "22 joints" in done.stdout
    assert not [f for f in usd_check.check(tmp_path / "step.usdc") if f.severity == "error"]


def test_seam_strips(built, tmp_path):
    done = run("seam_strips.py", built / "dances" / "beat" / "graph.usdc", tmp_path / "strips.png")
    assert done.returncode == 0, done.stderr
    assert "seams; strips in" in done.stdout
    assert (tmp_path / "strips.png").read_bytes().startswith(b"\x89PNG")


def test_without_arguments_they_say_what_they_want():
    assert "STUDIO SONG" in run("where_from.py").stderr
