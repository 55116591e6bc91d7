"""Lineage inside a stage: read back as written, small, and checked."""

import numpy as np
import pytest
from pxr import Usd

from assets.formats import usd, usd_check, usd_lineage, usd_read
from schemas import stage_contract as contract


def frames(n):
    """Lineage of a dance of two clips with a blend in the middle."""
    first = np.arange(n) < n // 2
    is_blended = np.abs(np.arange(n) - n // 2) < 3
    return {
        "odori:clip": ["walk" if one else "spin" for one in first],
        "odori:clipTime": np.where(first, np.arange(n) / 30, 5 + np.arange(n) / 33),
        "odori:mirrored": [not one for one in first.tolist()],
        "odori:blendMirrored": [bool(b) and one for one, b in zip(first.tolist(), is_blended.tolist(), strict=True)],
        "odori:blendClip": [
            "" if not b else "spin" if one else "walk" for one, b in zip(first, is_blended, strict=True)
        ],
        "odori:blendTime": np.where(is_blended, 2.5, 0.0),
        "odori:blendWeight": np.where(is_blended, 0.25, 0.0),
        "odori:warp": np.where(first, 1.0, 1.1),
        "odori:step": ['{"step_index": 0}' if one else '{"step_index": 1}' for one in first],
    }


@pytest.fixture
def stage(swaying, tmp_path):
    clips = [{"clip_id": "walk"}, {"clip_id": "spin"}]
    path = tmp_path / "dance.usdc"
    usd.write_stage(path, swaying, provenance={"clips": clips}, lineage=frames(swaying.n_frames))
    return path


def test_every_frame_reads_back(stage, swaying):
    opened = usd_read.open_stage(stage)
    animation = usd_lineage.animation_with_lineage(opened)
    assert str(animation.GetPath()) == contract.ANIMATION_PATH
    back = usd_lineage.read_lineage(animation, np.arange(swaying.n_frames, dtype=float))
    for name, values in frames(swaying.n_frames).items():
        if isinstance(values, np.ndarray):
            np.testing.assert_allclose(back[name], values, atol=1e-5)
        else:
            assert back[name] == values


def test_samples_lie_where_values_change(stage, swaying):
    opened = Usd.Stage.Open(str(stage))
    animation = opened.GetPrimAtPath(contract.ANIMATION_PATH)
    n = swaying.n_frames
    assert animation.GetAttribute("odori:clip").GetTimeSamples() == [0, n // 2]
    assert animation.GetAttribute("odori:mirrored").GetTimeSamples() == [0, n // 2]
    assert animation.GetAttribute("odori:warp").GetTimeSamples() == [0, n // 2 - 1, n // 2, n - 1]
    assert len(animation.GetAttribute("odori:clipTime").GetTimeSamples()) == n


def test_the_check_knows_it(stage, swaying, tmp_path):
    def found(path):
        return [(f.severity, f.sentence) for f in usd_check.inspect(path) if f.rule == "odori:lineage"]

    assert found(stage) == []
    usd.write_stage(tmp_path / "none.usdc", swaying, provenance={"clips": [{"clip_id": "walk"}]})
    assert found(tmp_path / "none.usdc") == [("warning", "odori:clip: want lineage, got none")]
    edited = Usd.Stage.Open(str(stage))
    animation = edited.GetPrimAtPath(contract.ANIMATION_PATH)
    animation.GetAttribute("odori:clip").Set("jump", 3.0)
    animation.GetAttribute("odori:blendWeight").Set(0.8, 4.0)
    animation.GetAttribute("odori:step").Set("because", 5.0)
    animation.GetAttribute("odori:warp").Clear()
    edited.Save()
    severities, sentences = zip(*found(stage), strict=True)
    assert set(severities) == {"error"}
    told = "\n".join(sentences)
    assert "want clips that the provenance names, got 'jump'" in told
    assert "odori:blendWeight: want 0 to 0.5, got 0 to 0.8" in told
    assert "odori:step: want a JSON object" in told
    assert "odori:warp: want where each frame comes from, got none" in told


def test_what_does_not_fit_is_refused(swaying, tmp_path):
    with pytest.raises(ValueError, match="want a value a frame"):
        usd.write_stage(tmp_path / "a.usdc", swaying, lineage=frames(swaying.n_frames + 1))
    lacking = frames(swaying.n_frames)
    del lacking["odori:warp"]
    with pytest.raises(ValueError, match="lineage: want as many values of"):
        usd.write_stage(tmp_path / "a.usdc", swaying, lineage=lacking)
    plain = Usd.Stage.CreateInMemory()
    assert usd_lineage.read_lineage(plain.DefinePrim("/a"), np.zeros(1)) == {}
