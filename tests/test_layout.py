"""The four import names are ours, and the tests shadow none of them."""

import importlib
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]


@pytest.mark.parametrize("name", ["pipelines", "assets", "kernels", "schemas"])
def test_package_is_ours(name):
    assert Path(importlib.import_module(name).__file__).is_relative_to(REPOSITORY)


def test_no_package_marker_under_tests():
    assert not list((REPOSITORY / "tests").rglob("__init__.py"))
