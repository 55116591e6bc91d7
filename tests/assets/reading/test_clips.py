"""Clips by name from a table of several sessions, and their mirror images."""

from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pytest

from assets.reading.clips import image_of, load_clips, load_fences, named_clips, read_clips
from assets.stamps import ClipStamp, Stamp
from assets.tables import pack
from assets.tables.motion import from_canonical_pose, to_canonical_pose
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.synthetic.dancer import take
from kernels.types import Choreography
from schemas.keys import mirrored
from schemas.motion import CLIP


@dataclass(frozen=True)
class InMemory:
    """A table by session and clip."""

    rows: dict[str, dict[str, pa.Table]]

    @property
    def keys(self):
        return list(self.rows)

    def read(self, key="", *, clip_ids=None):
        return pa.concat_tables([t for clip, t in self.rows[key].items() if clip_ids is None or clip in clip_ids])

    def stamp(self, key=""):
        return Stamp("1", "", {}, "", {clip: ClipStamp("", "") for clip in self.rows[key]})


@pytest.fixture(scope="module")
def poses():
    made = {kind: retarget(take(kind, n_beats=4).clip, map_joints(CANONICAL)) for kind in ("step", "wave")}
    names = {"a": {"a-x": "step", "a-y": "wave"}, "b": {"b-z": "wave"}}
    return InMemory(
        {
            key: {c: from_canonical_pose(c, 30.0, made[kind]) for c, kind in clips.items()}
            for key, clips in names.items()
        }
    )


def test_only_clips_named_are_read_in_the_stored_order_and_images_after_their_clips(poses):
    names = ["b-z", mirrored("a-x"), "a-x", "c-gone"]
    assert [c.clip_id for c in named_clips(poses, names)] == ["a-x", mirrored("a-x"), "b-z"]
    assert [c.clip_id for c in named_clips(poses, {mirrored("a-y")})] == [mirrored("a-y")]
    assert list(named_clips(poses, [])) == []


def test_an_image_has_left_for_right_and_its_image_is_the_clip(poses):
    moved = to_canonical_pose(poses.read("a", clip_ids={"a-x"}))
    image = image_of(moved)
    assert image.clip_id == mirrored("a-x")
    left, right = (JOINTS.index(f"{side}Hand") for side in ("left", "right"))
    turned = image.position_xyz_m * np.array([-1, 1, 1])
    np.testing.assert_allclose(turned[:, left], moved.position_xyz_m[:, right], atol=1e-6)
    assert np.abs(image.position_xyz_m[:, left] - moved.position_xyz_m[:, left]).max() > 0.1
    again = image_of(image)
    np.testing.assert_allclose(again.position_xyz_m, moved.position_xyz_m, atol=1e-6)


def test_a_choreography_loads_what_it_dances_and_no_more(poses):
    two = np.array([0.0, 0.5])
    steps = Choreography(
        ("b-z", mirrored("a-x")), two, two + 0.5, two, two + 0.5, np.array([False, True]), np.array([0.0, 0.2])
    )
    found = load_clips(poses, steps)
    assert set(found) == {"b-z", mirrored("a-x")}
    image = image_of(to_canonical_pose(poses.read("a", clip_ids={"a-x"})))
    np.testing.assert_array_equal(found[mirrored("a-x")].rotation_wxyz, image.rotation_wxyz)
    assert found["b-z"].frame_rate_hz == 30.0


def test_rows_of_clips_that_were_read():
    nothing = dict.fromkeys(CLIP.arrow.names, "") | {
        "frame_rate_hz": 30.0,
        "frame_count": 1,
        "duration_s": 1.0,
        "joint_count": 22,
        "is_labelled": False,
        "health": "",
        "danceability_ratio": 1.0,
        "performed_offset_s": 0.0,
        "metres_per_unit": 1.0,
        "reason": None,
    }
    rows = {
        name: pack.from_rows(CLIP, [nothing | {"clip_id": name, "path": name, "state": state}])
        for name, state in (("a-x", "read"), ("a-y", "refused"), ("b-z", "read"))
    }
    stored = InMemory({"a": {n: rows[n] for n in ("a-x", "a-y")}, "b": {"b-z": rows["b-z"]}})
    assert read_clips(stored)["clip_id"].to_list() == ["a-x", "b-z"]
    assert read_clips(InMemory({"a": {"a-y": rows["a-y"]}})).is_empty()
    assert read_clips(InMemory({"a": stored.rows["a"]}), {"a-x"})["clip_id"].to_list() == ["a-x"]


def test_fences_go_by_the_names_of_the_steps(poses):
    moved = retarget(take("step", n_beats=4).clip, map_joints(CANONICAL))
    fence = np.arange(len(moved.root_xyz_m)) < 5
    rows = InMemory({"a": {"a-x": from_canonical_pose("a-x", 30.0, moved, fence)}})
    names = ("a-x", mirrored("a-x"))
    one = np.ones(2)
    steps = Choreography(names, np.arange(2.0), one + np.arange(2), one, one + 1, np.array([False, True]), 0 * one)
    found = load_fences(rows, steps)
    assert set(found) == set(names)
    for mask in found.values():
        np.testing.assert_array_equal(mask, fence)
