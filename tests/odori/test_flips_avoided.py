"""A flip in the poses of a clip is danced by no method: planted in the lake, where no examination sees it."""

import numpy as np
import polars as pl
import pyarrow.parquet as pq
import pytest

from assets.tables.pack import to_array, vectors
from kernels import rotation
from kernels.assembly.one_frame_flips import find_flips
from kernels.skeleton.canonical import CANONICAL, JOINTS

HAND = JOINTS.index("leftHand")


def flips_of(draft):
    return find_flips(draft.poses.rotation_wxyz, CANONICAL.parent, draft.poses.frame_rate_hz)


def plant(root, clip_id, time_s):
    """Turn a hand by 100 degrees for one frame of a clip, as it is stored."""
    for path in sorted((root / "lake" / "canonical_pose").glob("*.parquet")):
        rows = pq.read_table(path)
        at = pl.from_arrow(rows.select(["clip_id", "time_s"])).with_row_index()
        here = at.filter(pl.col("clip_id") == clip_id)
        if here.is_empty():
            continue
        row = here["index"][int((here["time_s"] - time_s).abs().arg_min())]
        pose = to_array(rows["rotation_wxyz"])
        pose[row, HAND] = rotation.mul(
            pose[row, HAND], rotation.from_axis_angle(np.array([1.0, 0, 0]), np.radians(100))
        )
        column = rows.schema.get_field_index("rotation_wxyz")
        pq.write_table(rows.set_column(column, rows.schema.field(column), vectors(pose)), path)
        return
    raise AssertionError(clip_id)


@pytest.mark.parametrize(
    "method", ["graph", pytest.param("matching", marks=pytest.mark.slow), pytest.param("hmm", marks=pytest.mark.slow)]
)
def test_what_flips_is_danced_by_no_method(studio, method):
    first = studio.draft("drum_machine", method=method)
    assert flips_of(first) == []
    step = first.steps.row(first.steps.height // 2, named=True)
    at_s = (step["clip_start_s"] + step["clip_end_s"]) / 2
    plant(studio.root, step["clip_id"], at_s)
    again = studio.draft("drum_machine", method=method)
    assert flips_of(again) == []
    shown = again.steps.filter(pl.col("clip_id") == step["clip_id"])
    assert shown.filter((pl.col("clip_start_s") <= at_s) & (pl.col("clip_end_s") >= at_s)).is_empty()
    assert not again.steps.equals(first.steps)
