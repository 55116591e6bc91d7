"""Characters of a studio: which is asked for, and the dance on it."""

from types import SimpleNamespace

import pytest

from assets.dancing import characters
from assets.dancing.characters import CharacterError
from assets.sources.sources import Request, Sources, fingerprint
from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.synthetic.dancer import take
from kernels.types import Clip
from schemas.settings import Settings


@pytest.fixture
def studio(tmp_path):
    """A studio without songs in which one dance was asked for with a hero."""
    return SimpleNamespace(
        file=lambda path: tmp_path / path,
        settings=Settings,
        sources=lambda: Sources((), ()),
        requests=lambda: {"waltz|graph": Request(character="hero.usda"), "waltz|matching": Request()},
    )


def test_versions_follow_the_file(studio, write_hero, tmp_path):
    missing = characters.character_version(studio, "waltz|graph")
    write_hero(tmp_path / "hero.usda")
    first = characters.character_version(studio, "waltz|graph")
    (tmp_path / "hero.usda").unlink()
    write_hero(tmp_path / "hero.usda", size=1.1)
    assert len({missing, first, characters.character_version(studio, "waltz|graph")}) == 3
    assert characters.character_of(studio, "waltz|matching") == ""


def test_files_are_found_in_the_studio_and_beside_songs(studio, write_hero, tmp_path):
    (tmp_path / "songs").mkdir()
    place = write_hero(tmp_path / "songs" / "hero.usda")
    assert characters.find_file(studio, "hero.usda:/Hero/Rig/Skel") == place
    assert characters.find_file(studio, str(place)) == place
    assert characters.find_file(studio, "nobody.usda") is None
    with pytest.raises(CharacterError, match=r"nobody\.usda: want the USD file of a character, got no such file"):
        characters.read_file(studio, "nobody.usda")
    (tmp_path / "text.usda").write_text("x")
    with pytest.raises(CharacterError, match="want a USD stage"):
        characters.read_file(studio, "text.usda")


def test_a_dance_is_dressed_and_its_feet_are_measured(studio, write_hero, tmp_path):
    write_hero(tmp_path / "hero.usda")
    cast = characters.read_file(studio, "hero.usda")
    made = take("step", n_beats=8, interval_s=0.5).clip
    moved = retarget(made, map_joints(made.skeleton))
    dance = Clip(CANONICAL, made.frame_rate_hz, moved.root_xyz_m, moved.rotation_wxyz)
    fitted, facts = characters.dress(dance, cast)
    assert fitted.skeleton is cast.figure
    assert facts["scale_ratio"] == pytest.approx(0.88, abs=1e-4)
    assert facts["foot_slide_cm_per_s"] < 2
    assert abs(facts["added_foot_slide_cm_per_s"]) < 0.1
    assert facts["penetration_cm"] < 0.5
    assert facts["joints"]["hips"] == "hero_hips"


def test_a_character_without_a_file_has_the_version_of_its_name(studio):
    studio.requests = lambda: {"waltz|graph": Request(character="robot"), "waltz|hmm": Request()}
    assert characters.character_version(studio, "waltz|graph") == fingerprint("robot")
    assert characters.character_version(studio, "waltz|hmm") == fingerprint("")
