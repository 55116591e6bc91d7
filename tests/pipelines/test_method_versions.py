"""A method that changed makes its own dances anew, and no others."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pipelines.collection import freshness
from pipelines.studio.folder import StudioFolder
from schemas.keys import base_method

# The version is raised in the record, before anything reads it; then states are told, and all is made that is to be.
RAISE = """
import dataclasses, importlib, json, sys
from pathlib import Path

root, name = Path(sys.argv[1]), sys.argv[2]
of = importlib.import_module(f"assets.dancing.by_{name}")
of.METHOD = dataclasses.replace(of.METHOD, version=of.METHOD.version + ".1")

from pipelines.collection import freshness
from pipelines.commands.build_studio import build_studio
from pipelines.resources import NoProgress
from pipelines.studio.folder import StudioFolder

states = [[f.asset, f.key, f.state, f.why] for f in freshness(StudioFolder(root)).findings() if f.state != "fresh"]
made = build_studio(root, dances=True, progress=NoProgress)
left = [f.asset for f in freshness(StudioFolder(root)).findings() if f.state != "fresh"]
print(json.dumps([states, made.status, made.facts["ran"], left]))
"""

AFTER = ["dance_pose", "frame_lineage", "dance_quality", "usd_animation"]


@pytest.mark.parametrize("name", ["graph", "matching"])
def test_a_raised_version_makes_the_dances_of_its_method_stale_and_no_others(matched, tmp_path, name):
    studio = Path(shutil.copytree(matched, tmp_path / "studio"))
    findings = freshness(StudioFolder(studio)).findings()
    assert {f.state for f in findings} == {"fresh"}
    dances = {f.key for f in findings if f.asset == "choreography"}
    assert {base_method(key.split("|")[1]) for key in dances} == {"graph", "matching"}
    stages = {path: path.stat().st_mtime_ns for path in (studio / "dances" / "beat").glob("*.usd*")}
    done = subprocess.run(
        [sys.executable, "-c", RAISE, str(studio), name], capture_output=True, text=True, check=False, env=os.environ
    )
    assert done.returncode == 0, done.stderr[-3000:]
    states, status, ran, left = json.loads(done.stdout.splitlines()[-1])
    key = f"beat|{name}"
    assert len(states) == 1 + len(AFTER)
    assert states[0][:3] == ["choreography", key, "stale"]
    assert states[0][3].startswith("code version ")
    assert sorted(row[:3] for row in states[1:]) == sorted([asset, key, "waiting"] for asset in AFTER)
    assert (status, left) == (0, [])
    assert {tuple(batch["partitions"]) for batch in ran} == {(key,)}
    assert {asset for batch in ran for asset in batch["assets"]} >= {"choreography"}
    others = {path for path in stages if not path.name.startswith(name)}
    assert others
    assert all(path.stat().st_mtime_ns == stages[path] for path in others)
