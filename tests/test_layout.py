"""The four import names are ours, and the tests shadow none of them."""

import importlib
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]


@pytest.mark.parametrize("name", ["odori", "pipelines", "assets", "kernels", "schemas"])
def test_package_is_ours(name):
    assert Path(importlib.import_module(name).__file__).is_relative_to(REPOSITORY)


def test_no_package_marker_under_tests():
    assert not list((REPOSITORY / "tests").rglob("__init__.py"))


def named_in_contracts(*names):
    """Modules named by the layers or sources of the contracts whose names begin so."""
    held = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    found = set()
    for contract in held["contracts"]:
        if contract["name"].startswith(names):
            entries = [*contract.get("layers", ()), *contract.get("source_modules", ())]
            found |= {part.strip() for entry in entries for part in entry.replace(":", "|").split("|")}
    return found


@pytest.mark.parametrize(
    ("package", "contracts"),
    [
        ("assets", ["down the house"]),
        ("assets", ["only formats and sources", "sources and formats"]),
        ("pipelines", ["down the pipelines"]),
        ("kernels", ["down the kernels"]),
        ("odori", ["down the front door"]),
    ],
)
def test_contracts_name_every_module(package, contracts):
    there = {
        f"{package}.{path.stem}"
        for path in (REPOSITORY / package).iterdir()
        if (path.is_dir() and (path / "__init__.py").is_file()) or (path.suffix == ".py" and path.stem != "__init__")
    }
    assert there - named_in_contracts(*contracts) == set()


PLANTED = [
    ("assets/dancing/refusal.py", "import dagster", "only asset areas and pipelines know Dagster"),
    ("assets/dancing/wishes.py", "import os", "only formats and sources touch files"),
    ("assets/tables/pack.py", "from assets import dance", "down the house"),
    ("odori/exceptions.py", "from odori import opened", "down the front door"),
    ("kernels/ranks.py", "from kernels.hmm import model", "down the kernels"),
    ("kernels/ranks.py", "import pyarrow", "kernels are array code"),
    ("pipelines/studio/lake.py", "from pipelines import cli", "down the pipelines"),
    ("schemas/pins.py", "import numpy", "schemas say shape"),
    ("assets/formats/bvh.py", "import pyopencl", "sources and formats touch no device"),
]


@pytest.mark.slow
def test_each_contract_bites(tmp_path):
    """In a copy of the packages, one import planted for each contract: all are broken, and all are named."""
    for package in ("odori", "pipelines", "assets", "kernels", "schemas"):
        shutil.copytree(REPOSITORY / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(REPOSITORY / "pyproject.toml", tmp_path)
    for path, line, _ in PLANTED:
        place = tmp_path / path
        place.write_text(f"{place.read_text(encoding='utf-8')}\n{line}\n", encoding="utf-8")
    # From the copy's folder, before the checkout: the packages there are the ones looked at.
    code = "import sys; sys.path.insert(0, '.'); from importlinter.cli import lint_imports_command as lint; lint()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 1, done.stdout + done.stderr
    assert f"Contracts: 0 kept, {len({contract for *_, contract in PLANTED})} broken." in done.stdout
    for path, line, _ in PLANTED:
        importer = path.removesuffix(".py").replace("/", ".")
        imported = line.split()[-1] if line.startswith("import") else ".".join(line.split()[1::2])
        assert re.search(rf"{re.escape(importer)}\s*->\s*{re.escape(imported)}", done.stdout), line
