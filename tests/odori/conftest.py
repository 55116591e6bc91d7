"""The made-up studio of `odori.demo`, built and danced once for all workers; tests that change it work on a copy."""

import os
import shutil
from pathlib import Path

import pytest
from filelock import FileLock

import odori


@pytest.fixture(autouse=True)
def own_instance(monkeypatch):
    """Each studio keeps its own Dagster storage; the machine's is left alone."""
    monkeypatch.delenv("DAGSTER_HOME", raising=False)
    monkeypatch.delenv("ODORI_STUDIO", raising=False)


@pytest.fixture(scope="session")
def danced_demo(tmp_path_factory):
    """Folder of the made-up studio with one dance; not to be changed."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    with pytest.MonkeyPatch.context() as patch, FileLock(shared / "odori-demo.lock"):
        patch.delenv("DAGSTER_HOME", raising=False)
        root = shared / "odori-demo" / "demo"
        if not (root / ".done").exists():
            odori.demo(root).dance("drum_machine")
            (root / ".done").touch()
        return root


@pytest.fixture
def studio(danced_demo, tmp_path):
    """A copy of the made-up studio to work on."""
    return odori.open(shutil.copytree(danced_demo, tmp_path / "demo"))


@pytest.fixture
def shown(danced_demo):
    """The made-up studio, only to be looked at."""
    return odori.open(Path(danced_demo))
