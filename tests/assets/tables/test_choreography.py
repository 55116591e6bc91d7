"""Dances and their lineage into tables and back."""

import numpy as np
import pytest

from assets.tables.choreography import from_choreography, from_dance_pose, from_frame_lineage, to_choreography, to_dance
from kernels.assembly.blend import assemble
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import take
from kernels.types import Choreography
from schemas.keys import mirrored


def test_mirrored_clips_are_a_name_of_their_own_in_a_dance():
    image = mirrored("s-a")
    two = np.array([0.0, 0.5])
    steps = Choreography(("s-a", image), two, two + 0.5, two, two + 0.5, np.array([False, True]), np.array([0, 0.25]))
    rows = from_choreography("song", "graph", steps, {})
    assert rows["clip_id"].to_pylist() == ["s-a", "s-a"]
    assert rows["is_mirrored"].to_pylist() == [False, True]
    assert to_choreography(rows).clip_id == steps.clip_id


def test_dance_and_lineage_round_trip():
    steps = Choreography(
        ("a", "a", "b", "b"),
        np.array([0.0, 0.5, 1.0, 1.5]),
        np.array([0.5, 1.0, 1.5, 2.0]),
        np.array([0.25, 0.75, 0.75, 1.25]),
        np.array([0.75, 1.25, 1.25, 1.75]),
        np.array([False, False, True, False]),
        np.array([0.0, 0.0, 0.3, 0.0]),
    )
    clips = {"a": take("step").clip, "b": take("wave").clip}
    dance = assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=30.0, duration_s=2.0)
    costs = {f"{n}_cost": np.arange(4.0) for n in ("transition", "warp", "stride", "beat", "repetition")}
    rows = from_choreography("x", "graph", steps, costs)
    back = to_choreography(rows)
    assert back.clip_id == steps.clip_id
    np.testing.assert_allclose(back.blend_s, steps.blend_s, atol=1e-7)
    pose, line = from_dance_pose("x", "graph", dance), from_frame_lineage("x", "graph", dance, steps)
    assert line["frame_index"].to_pylist() == list(range(61))
    assert line["clip_id"].to_pylist() == ["a"] * 30 + ["b"] * 31
    blended = line["blend_clip_id"].to_pylist()
    assert blended[29] == "b"
    assert blended[30] == "a"
    assert blended[0] is None
    assert line["blend_time_s"].to_pylist()[0] is None
    assert line["blend_weight_ratio"].to_numpy().max() == pytest.approx(0.5)
    again = to_dance(pose, line, back)
    np.testing.assert_allclose(again.position_xyz_m, dance.position_xyz_m, atol=1e-6)
    np.testing.assert_array_equal(again.lineage.step_index, dance.lineage.step_index)
    np.testing.assert_array_equal(again.lineage.blend_step_index, dance.lineage.blend_step_index)


def test_partners_are_found_again_in_blends_wider_than_a_step():
    length = np.array([0.5, 0.2, 0.2, 0.2, 0.2, 0.3, 0.5])
    end = np.cumsum(length)
    seam = np.array([False, False, True, False, False, True, False])
    ids = ("a", "a", "b", "b", "b", "a", "a")
    start = 1.0 + end - length
    steps = Choreography(ids, end - length, end, start, start + length, seam, np.where(seam, 0.6, 0.0))
    clips = {"a": take("step").clip, "b": take("wave").clip}
    dance = assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=float(end[-1]))
    pose, line = from_dance_pose("x", "graph", dance), from_frame_lineage("x", "graph", dance, steps)
    again = to_dance(pose, line, steps)
    assert set(dance.lineage.blend_step_index) == {-1, 1, 2, 4, 5}
    np.testing.assert_array_equal(again.lineage.blend_step_index, dance.lineage.blend_step_index)
