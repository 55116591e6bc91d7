"""Arrow columns packed and unpacked: nothing lost, slices included."""

import numpy as np
import pyarrow as pa
import pytest

from assets.tables import pack
from assets.tables.motion import (
    from_canonical_pose,
    from_pose,
    to_canonical_poses,
)
from kernels.types import Clip
from schemas.motion import CANONICAL_POSE, POSE, SKELETON


def test_clips_of_one_table_are_split_and_slices_unpack(canonical):
    parts = [from_canonical_pose(name, 30.0, canonical) for name in ("s-a", "s-b", "s-c")]
    whole = pack.concat(CANONICAL_POSE, parts)
    found = pack.by_clip(whole)
    assert list(found) == ["s-a", "s-b", "s-c"]
    np.testing.assert_array_equal(
        pack.to_array(found["s-b"]["rotation_wxyz"]), pack.to_array(parts[1]["rotation_wxyz"])
    )
    np.testing.assert_array_equal(pack.to_array(found["s-c"]["root_xyz_m"]), pack.to_array(parts[2]["root_xyz_m"]))
    assert [c.clip_id for c in to_canonical_poses(whole)] == ["s-a", "s-b", "s-c"]


def test_scattered_rows_are_refused(canonical):
    one, two = (from_canonical_pose(name, 30.0, canonical) for name in ("s-a", "s-b"))
    with pytest.raises(ValueError, match="together"):
        pack.by_clip(pa.concat_tables([one, two, one]))


def test_nothing_packs_and_unpacks():
    assert pack.by_clip(POSE.empty()) == {}
    assert pack.concat(SKELETON, []).num_rows == 0
    assert pack.to_array(CANONICAL_POSE.empty()["rotation_wxyz"]).shape == (0, 0, 4)
    assert pack.to_array(CANONICAL_POSE.empty()["root_xyz_m"]).shape == (0, 3)


def test_frame_rates_are_read_back_from_times(clip):
    for rate_hz in (23.976, 24.0, 59.94, 120.0):
        one = Clip(clip.skeleton, rate_hz, clip.root_xyz_m, clip.rotation_wxyz)
        assert pack.frame_rate_hz(from_pose("a-b", one)) == pytest.approx(rate_hz, abs=1e-6)


def test_quaternions_one_a_row():
    values = np.arange(12.0).reshape(3, 4)
    np.testing.assert_array_equal(pack.to_array(pack.quaternion(values)), values)
