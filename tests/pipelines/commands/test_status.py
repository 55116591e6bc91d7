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


def test_dances_are_listed_with_what_keeps_them_from_being_as_wanted(studio):
    (dance,) = studio_status(studio).facts["dances"]
    assert dance == {"song": "beat", "method": "graph", "as_wanted": True, "not_as_wanted": []}
    place = studio / "dances" / "beat" / "graph.json"
    report = json.loads(place.read_text())
    report["wanted"]["one_frame_flip_count"] |= {"is_passed": False, "reasons": ["head flips at 3.2 s"]}
    place.write_text(json.dumps(report))
    found = studio_status(studio)
    assert found.facts["dances"][0]["not_as_wanted"] == ["head flips at 3.2 s"]
    assert "not as wanted: beat|graph: head flips at 3.2 s" in found.report
    assert found.status == 1
    place.unlink()
    (lost,) = studio_status(studio).facts["dances"]
    assert not lost["as_wanted"]
    assert lost["not_as_wanted"][0].startswith("its report graph.json cannot be read")
