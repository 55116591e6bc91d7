"""A table checks its own shape."""

import pyarrow as pa
import pytest

from schemas.table import Column, Table

THING = Table(
    name="thing",
    version=3,
    meaning="One thing.",
    key=("clip_id", "beat_index"),
    columns=(
        Column("clip_id", pa.string(), "Clip."),
        Column("beat_index", pa.int32(), "Beat."),
        Column("speed_m_per_s", pa.float32(), "Speed.", is_optional=True),
        Column("state", pa.string(), "State.", values=("read", "refused")),
    ),
)


def rows(**changes):
    columns = {
        "clip_id": pa.array(["a", "a"]),
        "beat_index": pa.array([0, 1], pa.int32()),
        "speed_m_per_s": pa.array([1.0, None], pa.float32()),
        "state": pa.array(["read", "refused"]),
    }
    return pa.table(columns | changes)


def test_good_table_comes_back_with_name_version_units_and_marks():
    table = THING.check(rows())
    assert table.schema.metadata == {b"table": b"thing", b"version": b"3"}
    assert table.schema.field("speed_m_per_s").metadata == {b"meaning": b"Speed.", b"unit": b"m/s"}
    assert not table.schema.field("clip_id").nullable
    assert table.schema.field("speed_m_per_s").nullable
    assert table.num_rows == 2


def test_empty_table_fits_and_extra_metadata_stays():
    assert THING.check(THING.empty()).num_rows == 0
    table = THING.check(THING.with_metadata(THING.check(rows()), {"joints": "hips,spine"}))
    assert table.schema.metadata[b"joints"] == b"hips,spine"


@pytest.mark.parametrize(
    ("table", "word"),
    [
        (rows().drop(["state"]), "want columns"),
        (rows(beat_index=pa.array([0, 1], pa.int64())), "thing.beat_index: want int32, got int64"),
        (rows(clip_id=pa.array(["a", None])), "want no nulls, got 1"),
        (rows(state=pa.array(["read", "lost"])), "want one of .*lost"),
        (rows(beat_index=pa.array([1, 1], pa.int32())), "not unique"),
        (rows().replace_schema_metadata({"table": "other"}), "got the table 'other'"),
    ],
)
def test_refusals(table, word):
    with pytest.raises(ValueError, match=word):
        THING.check(table)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("time_s", "s"),
        ("a_m_per_s", "m/s"),
        ("x_m", "m"),
        ("r_wxyz", "unit quaternion"),
        ("p_xyz_m", "m"),
        ("label", ""),
    ],
)
def test_unit_is_in_the_name(name, unit):
    assert Column(name, pa.float64(), "").unit == unit
