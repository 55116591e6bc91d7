"""What Dagster loads: the graph as it was agreed, jobs, sensor, schedule."""

import subprocess
import sys
from pathlib import Path

import dagster as dg
import pytest

from pipelines.collection import ASSETS, freshness
from pipelines.definitions import build_definitions
from pipelines.freshness import nodes
from pipelines.jobs import JOBS
from pipelines.studio.folder import StudioFolder
from schemas.catalog import TABLES

SNAPSHOT = Path(__file__).with_name("asset_graph.txt")


def graph_text():
    """One line an asset: name, group, partitions, code version, inputs."""
    lines = [
        f"{n.name:<20} {n.group:<8} {n.kind:<8} v{n.code_version:<3} <- {', '.join(n.inputs) or n.sources or '-'}"
        for n in nodes(ASSETS).values()
    ]
    return "\n".join(lines) + "\n"


def test_asset_graph_is_as_agreed():
    """When this fails on purpose, write what it got into the snapshot and say why in the commit."""
    assert graph_text() == SNAPSHOT.read_text()


def test_every_table_is_an_asset_and_every_asset_a_table():
    assert set(nodes(ASSETS)) == set(TABLES)


def test_every_asset_has_a_job_and_shows_its_columns():
    definitions = build_definitions(StudioFolder(Path("nowhere")))
    selected = {
        key.to_user_string() for job in JOBS for key in job.selection.resolve(definitions.resolve_asset_graph())
    }
    assert selected == set(TABLES)
    for asset in ASSETS:
        for spec in asset.specs:
            schema = spec.metadata["dagster/column_schema"]
            assert [c.name for c in schema.columns] == TABLES[spec.key.to_user_string()].arrow.names


def test_definitions_validate_as_dagster_does_it(built):
    done = subprocess.run(
        [sys.executable, "-m", "dagster", "definitions", "validate", "-m", "pipelines.definitions"],
        env={"ODORI_STUDIO": str(built), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
        cwd=built,
    )
    assert done.returncode == 0, done.stderr
    assert "Validation successful" in done.stdout + done.stderr


@pytest.mark.slow
def test_plain_dagster_works_on_the_same_studio(studio):
    """The command is a convenience: Dagster alone does the same."""
    (studio / "lake" / "motion_beat" / "kaede.parquet").unlink()
    done = subprocess.run(
        [
            *(sys.executable, "-m", "dagster", "asset", "materialize", "-m", "pipelines.definitions"),
            *("--select", "motion_beat,motion_tempo", "--partition", "kaede"),
        ],
        env={"ODORI_STUDIO": str(studio), "DAGSTER_HOME": str(studio / ".dagster"), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
        cwd=studio,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    state = freshness(StudioFolder(studio))
    assert all(f.state == "fresh" for f in state.findings())


def test_overrides_take_the_place_of_resources(built):
    class Told:
        def __init__(self):
            self.heard = []

        def begin(self, what, total):
            self.heard.append((what, total))

        def step(self):
            pass

    told = Told()
    definitions = build_definitions(StudioFolder(built), progress=told)
    assert isinstance(definitions, dg.Definitions)
    assert definitions.resources["progress"] is told
