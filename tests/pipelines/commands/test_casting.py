"""odori dance --character: on a clip's bones, on somebody's rig, and back on our own body."""

import json

import numpy as np
import pytest

from assets.formats import usd_check, usd_read
from pipelines.commands.build_studio import build_studio
from pipelines.commands.dance_songs import dance_songs
from pipelines.commands.why import explain_dance
from pipelines.resources import NoProgress
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder


@pytest.fixture
def dance(studio):
    def run(**asked):
        return dance_songs(studio, ["beat"], frame_rate_hz=None, out=None, progress=NoProgress, **asked)

    return run


def errors(path):
    return [f for f in usd_check.inspect(path) if f.severity == "error"]


def test_somebody_elses_rig_and_back(studio, dance, write_hero):
    hero = write_hero(studio / "hero.usda")
    before = (studio / "lake" / "choreography" / "beat|graph.parquet").stat().st_mtime_ns
    outcome = dance(character=str(hero))
    assert outcome.status == 0, outcome.troubles
    character = outcome.facts["character"]
    assert character["file"] == "hero.usda"
    assert character["scale_ratio"] == pytest.approx(0.88, abs=1e-3)
    assert character["penetration_cm"] < 1
    folder = studio / "dances" / "beat"
    assert (folder / "graph_character" / "character.usdc").is_file()
    assert errors(folder / "graph.usdc") == errors(folder / "graph.usdz") == []
    assert "danced by hero.usda" in outcome.report
    # Only the stage was made again, and it is remembered for the next build.
    assert (studio / "lake" / "choreography" / "beat|graph.parquet").stat().st_mtime_ns == before
    assert StudioFolder(studio).requests()["beat|graph"].character == "hero.usda"
    assert explain_dance(studio, str(folder / "graph.usdz"), at_s=3.0).facts["clip_id"]
    (folder / "graph_character" / "character.usdc").unlink()
    assert build_studio(studio, dances=True, progress=NoProgress).status == 0
    assert (folder / "graph_character" / "character.usdc").is_file()
    assert dance().facts["character"] is None
    assert not (folder / "graph_character").exists()


def test_the_bones_of_a_clip_by_the_brief(studio, dance):
    brief = studio / "songs" / "beat.brief.toml"
    brief.write_text('character = "kaede-kick"\n')
    outcome = dance()
    assert outcome.status == 0, outcome.troubles
    assert outcome.facts["character"]["clip_id"] == "kaede-kick"
    stage = studio / "dances" / "beat" / "graph.usdc"
    assert errors(stage) == []
    moved = usd_read.read_animation(stage)
    rows = StudioFolder(studio).lake.table("skeleton", "kaede", clip_ids={"kaede-kick"}).to_pylist()
    for row in rows:
        part = row["canonical_joint"]
        if part and part.endswith(("LowerArm", "Hand", "LowerLeg", "Foot")):
            wanted = np.linalg.norm(row["offset_xyz_m"])
            assert np.linalg.norm(moved.skeleton.offset_xyz_m[moved.skeleton.index(part)]) == pytest.approx(
                wanted, abs=1e-4
            )
    told = json.loads((studio / "dances" / "beat" / "graph.json").read_text())["provenance"]["character"]
    assert told == outcome.facts["character"]


def test_what_cannot_be_cast(studio, dance, tmp_path):
    with pytest.raises(StudioError, match="--character: want a clip of this studio or a USD file, got 'kaede-kik'"):
        dance(character="kaede-kik")
    with pytest.raises(StudioError, match=r"got '\?'; there are ayame-step, ayame-twist, "):
        dance(character="?")
    with pytest.raises(StudioError, match=r"--character: .*want the USD file of a character, got no such file"):
        dance(character="nobody.usdz")
    assert dance(character="kick.bvh").facts["character"]["clip_id"] == "kaede-kick"
    brief = studio / "songs" / "beat.brief.toml"
    brief.write_text('character = "nobody"\n')
    refused = dance()
    assert refused.status == 2
    assert "nobody: want a clip that was read, or a USD file" in "; ".join(refused.troubles)
