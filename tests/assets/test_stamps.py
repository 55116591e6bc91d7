"""Content versions, stamps, and rows carried over instead of computed again."""

import numpy as np
import pyarrow as pa

from assets import stamps
from assets.stamps import ClipStamp, Stamp, content_version
from assets.tables import pack
from assets.tables.motion import from_motion_beat, from_pose, from_skeleton
from kernels.motion.motion_beats import motion_beats
from kernels.synthetic.dancer import place, take
from schemas.motion import MOTION_BEAT


class Kept:
    """What an earlier run stored, in memory."""

    def __init__(self):
        self.tables, self.stamps = {}, {}

    def keep(self, part, table):
        self.tables[table.name, part.key] = part.table
        self.stamps[table.name, part.key] = Stamp("1", "", {}, "", part.clips)

    def table(self, asset, key):
        return self.tables.get((asset, key))

    def stamp(self, asset, key):
        return self.stamps.get((asset, key))


def beats_of(clip_id):
    label = clip_id.rsplit("-", 1)[-1]
    return from_motion_beat(clip_id, motion_beats(place(take(label, n_beats=6)), 30.0), 30.0)


def make(kept, made_from):
    asked = []

    def compute(clip_id):
        asked.append(clip_id)
        return beats_of(clip_id)

    part = stamps.per_clip(MOTION_BEAT, "s", made_from, compute, earlier=kept)
    kept.keep(part, MOTION_BEAT)
    return part, asked


def test_first_run_computes_all_second_none_third_the_changed_one():
    kept = Kept()
    first, asked = make(kept, {"s-step": "1", "s-idle": "1", "s-wave": "1"})
    assert asked == ["s-step", "s-idle", "s-wave"]
    second, asked = make(kept, {"s-step": "1", "s-idle": "1", "s-wave": "1"})
    assert asked == []
    assert second.table.equals(first.table)
    assert second.clips == first.clips
    assert second.metadata == {"computed_clips": 0, "carried_clips": 3}
    _, asked = make(kept, {"s-step": "1", "s-idle": "1", "s-wave": "2"})
    assert asked == ["s-wave"]


def test_clips_come_go_and_change_places():
    kept = Kept()
    make(kept, {"s-step": "1", "s-wave": "1"})
    part, asked = make(kept, {"s-wave": "1", "s-kick": "1"})
    assert asked == ["s-kick"]
    assert list(pack.by_clip(part.table)) == ["s-wave", "s-kick"]
    assert part.table.equals(pack.concat(MOTION_BEAT, [beats_of("s-wave"), beats_of("s-kick")]))


def test_a_clip_of_no_rows_is_carried_too():
    kept = Kept()
    make(kept, {"s-idle": "1"})
    part, asked = make(kept, {"s-idle": "1"})
    assert asked == []
    assert part.table.num_rows == 0


def test_lost_rows_are_computed_again():
    kept = Kept()
    make(kept, {"s-step": "1"})
    kept.tables.clear()
    assert make(kept, {"s-step": "1"})[1] == ["s-step"]


def test_content_version_is_of_rows_not_of_metadata_or_chunks():
    table = beats_of("s-step")
    version = stamps.content_version(table)
    assert stamps.content_version(table.replace_schema_metadata({"a": "b"})) == version
    halves = pa.concat_tables([table.slice(0, 2), table.slice(2)])
    assert halves["time_s"].num_chunks == 2
    assert stamps.content_version(halves) == version
    assert stamps.content_version(beats_of("s-wave")) != version
    assert stamps.content_version(table.slice(1)) != version
    assert stamps.content_version(MOTION_BEAT.empty()) != version


def test_content_version_sees_the_last_bit():
    table = pa.table({"x": np.array([1.0, 2.0])})
    other = pa.table({"x": np.array([1.0, np.nextafter(2.0, 3.0)])})
    assert stamps.content_version(table) != stamps.content_version(other)


def test_stamp_survives_json():
    stamp = Stamp("1", "abc", {"pose": "def"}, "123", {"s-a": ClipStamp("x", "y")})
    assert Stamp.from_json(stamp.to_json()) == stamp
    assert Stamp.from_json(stamp.to_json()).to_json() == stamp.to_json()


def test_version_of_depends_on_order_and_parts():
    assert stamps.version_of("a", "b") != stamps.version_of("b", "a")
    assert stamps.version_of("a", "b") == stamps.version_of("a", "b")


def test_content_does_not_depend_on_the_layout_in_memory(tmp_path):
    """Rows made now, rows read back, and rows sliced out of more are the same content."""
    import pyarrow.parquet as pq

    from kernels.skeleton.naming import map_joints
    from kernels.synthetic.dancer import take

    clips = {name: take(name, n_beats=4).clip for name in ("step", "wave")}
    for make in (
        lambda name, clip: from_pose(name, clip),
        lambda name, clip: from_skeleton(name, clip.skeleton, map_joints(clip.skeleton)),
    ):
        fresh = {name: make(name, clip) for name, clip in clips.items()}
        pq.write_table(pa.concat_tables(list(fresh.values())), tmp_path / "both.parquet")
        again = pack.by_clip(pq.read_table(tmp_path / "both.parquet"))
        for name, table in fresh.items():
            assert content_version(again[name]) == content_version(table)
        assert content_version(fresh["step"]) != content_version(fresh["wave"])


def test_content_sees_nulls_and_list_lengths():
    def of(values, kind):
        return content_version(pa.table({"x": pa.array(values, kind)}))

    assert of([None, 0.0], pa.float64()) != of([0.0, None], pa.float64())
    assert of([[1], [2, 3]], pa.list_(pa.int32())) != of([[1, 2], [3]], pa.list_(pa.int32()))
    assert of([None, ""], pa.string()) != of(["", None], pa.string())
    assert of([[1], None], pa.list_(pa.int32())) != of([[1], []], pa.list_(pa.int32()))
    assert of([True, False], pa.bool_()) != of([False, True], pa.bool_())
    assert of([], pa.float64()) != of([0.0], pa.float64())
