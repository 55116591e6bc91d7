"""Every example of the front door runs in any folder, as it stands in its docstring."""

import doctest
import importlib
import inspect
import shutil
from pathlib import Path

import pytest

import odori

REPOSITORY = Path(__file__).parents[2]
MODULES = (
    "odori",
    "odori.answers",
    "odori.arrays",
    "odori.exceptions",
    "odori.holdings",
    "odori.made_dances",
    "odori.opened",
    "odori.takes",
    "kernels.assembly.quality",
)


def examples():
    """Docstrings with an example, by name."""
    found = {}
    for name in MODULES:
        for test in doctest.DocTestFinder(exclude_empty=True).find(importlib.import_module(name), name):
            if test.examples:
                found[test.name] = test
    return found


def test_twenty_docstrings_at_least_have_examples_and_say_what_to_see_also():
    found = examples()
    assert len(found) >= 20
    for name, test in found.items():
        assert "See Also\n" in test.docstring or name == "odori", name


def test_whatever_the_front_door_gives_is_documented():
    for name in odori.__all__:
        assert inspect.getdoc(getattr(odori, name)), name


@pytest.mark.slow
@pytest.mark.parametrize("module", MODULES)
def test_examples_run_in_any_folder(module, danced_demo, tmp_path, monkeypatch):
    shutil.copytree(danced_demo, tmp_path / "demo")
    monkeypatch.chdir(tmp_path)
    result = doctest.testmod(importlib.import_module(module))
    assert result.attempted > 0
    assert result.failed == 0  # what was wanted and got is printed


@pytest.mark.slow
def test_the_walk_through_python_runs_in_any_folder(danced_demo, tmp_path, monkeypatch):
    shutil.copytree(danced_demo, tmp_path / "demo")
    monkeypatch.chdir(tmp_path)
    result = doctest.testfile(str(REPOSITORY / "docs" / "python.md"), module_relative=False, encoding="utf-8")
    assert result.attempted > 30
    assert result.failed == 0
    assert (tmp_path / "speed.png").stat().st_size > 10_000
