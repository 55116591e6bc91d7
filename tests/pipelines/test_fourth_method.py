"""A fourth method of dancing is one file and one line."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]

TOY = '''"""A dance by a toy, which chooses as the graph does."""

from dataclasses import replace

from assets.dancing import by_graph
from assets.dancing.method import Method


def choose(inputs, order):
    return by_graph.choose(inputs, order)


METHOD = replace(by_graph.METHOD, name="toy", version="1", choose=choose, has_alternatives=False)
'''

ASK = """
import sys
from pipelines.commands.dance_songs import dance_songs
from pipelines.resources import NoProgress
done = dance_songs(sys.argv[1], ["beat"], method="toy", frame_rate_hz=None, out=None, progress=NoProgress)
print(done.status, done.facts.get("method"), done.troubles)
"""


@pytest.mark.slow
def test_a_fourth_method_is_one_file_and_one_line(built, tmp_path):
    """In a copy of the packages: nothing else is touched, and the command dances by it."""
    code = tmp_path / "code"
    for package in ("pipelines", "assets", "kernels", "schemas"):
        shutil.copytree(REPOSITORY / package, code / package, ignore=shutil.ignore_patterns("__pycache__"))
    (code / "assets" / "dancing" / "by_toy.py").write_text(TOY, encoding="utf-8")
    place = code / "schemas" / "settings.py"
    text = place.read_text(encoding="utf-8")
    line = 'METHODS = ("graph", "matching", "hmm")'
    assert line in text
    place.write_text(text.replace(line, 'METHODS = ("graph", "matching", "hmm", "toy")'), encoding="utf-8")
    studio = shutil.copytree(built, tmp_path / "studio")
    environment = os.environ | {"PYTHONPATH": str(code)}
    ask = ASK.replace("sys.argv[1]", "__import__('pathlib').Path(sys.argv[1])")
    done = subprocess.run(
        [sys.executable, "-c", ask, str(studio)],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        cwd=tmp_path,
    )
    assert done.stdout.startswith("0 toy"), done.stdout + done.stderr[-3000:]
    assert (Path(studio) / "lake" / "choreography" / "beat|toy.parquet").is_file()
    assert (Path(studio) / "dances" / "beat" / "toy.usdz").is_file()
