"""What is read, refused, fresh and stale, as a person reads it and as a machine does."""

import json
import subprocess
import sys

from pipelines.commands.status import studio_status


def test_status_says_every_file_and_asset(built):
    done = subprocess.run(
        [sys.executable, "-m", "pipelines.cli", "status", "--json"],
        capture_output=True,
        text=True,
        check=False,
        env={"ODORI_STUDIO": str(built), "PATH": "/usr/bin:/bin"},
    )
    assert done.returncode == 0
    facts = json.loads(done.stdout)
    assert {c["path"] for c in facts["clips"]} == {str(p.relative_to(built)) for p in built.rglob("*.bvh")}
    assert set(facts["clips"][0]) == {"path", "key", "session", "state", "reason"}
    assert set(facts["songs"][0]) == {"path", "key", "state", "reason"}
    assert {a["state"] for a in facts["assets"]} == {"fresh"}
    assert facts["clips"][0]["reason"] is None


def test_status_before_the_first_build(fresh_studio):
    found = studio_status(fresh_studio)
    assert {c["state"] for c in found.facts["clips"]} == {"new"}
    assert "missing" in found.report


def test_status_after_a_change(studio):
    (studio / "clips" / "ayame" / "step.bvh").write_bytes((studio / "clips" / "ayame" / "wave.bvh").read_bytes())
    found = studio_status(studio)
    assert {c["state"] for c in found.facts["clips"] if "step" in c["path"]} == {"changed"}
    assert "stale: clip[ayame]: sources changed" in found.report


def test_partitions_stale_for_one_reason_are_one_line(studio):
    for folder in (studio / "clips").iterdir():
        if folder.is_dir():
            (folder / "more.bvh").write_bytes((studio / "clips" / "ayame" / "wave.bvh").read_bytes())
    unfresh = [line for line in studio_status(studio).report.splitlines() if "stale: clip[" in line]
    n_sessions = sum(folder.is_dir() for folder in (studio / "clips").iterdir())
    assert n_sessions > 1
    assert len(unfresh) == 1
    assert unfresh[0].count(", ") == n_sessions - 1
