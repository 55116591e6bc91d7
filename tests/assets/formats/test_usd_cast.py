"""The stage of a dance by somebody else's character: what cannot be written."""

import pytest

from assets.formats import usd_cast, usd_character
from kernels.skeleton.body_fit import fit
from kernels.types import Clip


def test_what_does_not_fit_is_refused(write_hero, swaying, tmp_path):
    hero = write_hero(tmp_path / "hero.usda")
    rig, copy = usd_character.read_rig(hero), usd_character.flat_copy(hero)
    fitted = fit(swaying, rig.character.figure)
    with pytest.raises(ValueError, match=r"want a name ending in \.usdc"):
        usd_cast.write_cast_stage(tmp_path / "a.usda", fitted, rig, copy)
    with pytest.raises(ValueError, match="want a relative path of a WAV file"):
        usd_cast.write_cast_stage(tmp_path / "a.usdc", fitted, rig, copy, audio="/song.wav")
    nothing = Clip(fitted.skeleton, 30.0, fitted.root_xyz_m[:0], fitted.rotation_wxyz[:0])
    with pytest.raises(ValueError, match="want at least one frame"):
        usd_cast.write_cast_stage(tmp_path / "a.usdc", nothing, rig, copy)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["hero.usda"]


def test_another_dance_replaces_the_character_whole(write_hero, swaying, tmp_path):
    for name in ("ann", "bob"):
        hero = write_hero(tmp_path / f"{name}.usda", size=0.8 if name == "ann" else 1.2)
        rig = usd_character.read_rig(hero)
        usd_cast.write_cast_stage(
            tmp_path / "a.usdc", fit(swaying, rig.character.figure), rig, usd_character.flat_copy(hero)
        )
        folder = usd_cast.character_folder(tmp_path / "a.usdc")
        (folder / "left over.png").write_bytes(b"old") if name == "ann" else None
    assert [p.name for p in folder.iterdir()] == ["character.usdc"]
    assert usd_character.read_rig(folder / "character.usdc").character.scale_ratio == pytest.approx(1.32, abs=1e-3)
