"""Fixtures shared by all tests."""

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder of real recordings and songs; the test is skipped where there is none."""
    folder = Path(os.environ.get("ODORI_TEST_DATA", REPOSITORY.parent / "shared" / "data"))
    if not (folder / "README.md").is_file():
        pytest.skip(f"no real test data at {folder}; name a folder in ODORI_TEST_DATA")
    return folder
