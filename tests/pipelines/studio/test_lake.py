"""The lake: whole files or none, stamps in the footer, bytes that repeat."""

import errno

import pyarrow.parquet as pq
import pytest
from upath import UPath

from assets.stamps import ClipStamp, Stamp
from assets.tables import pack
from assets.tables.motion import from_motion_beat
from kernels.motion.motion_beats import motion_beats
from kernels.synthetic.dancer import place, take
from pipelines.studio.files import LakeError, why, write_beside
from pipelines.studio.lake import Lake
from schemas.motion import MOTION_BEAT

STAMP = Stamp("1", "s", {"pose": "v"}, "c", {"s-step": ClipStamp("a", "b")})


@pytest.fixture
def lake(tmp_path):
    return Lake(UPath(tmp_path / "lake"))


@pytest.fixture(scope="module")
def beats():
    return pack.concat(
        MOTION_BEAT,
        [from_motion_beat(f"s-{n}", motion_beats(place(take(n)), 30.0), 30.0) for n in ("step", "wave")],
    )


def test_write_and_read_back(lake, beats):
    lake.write("motion_beat", "s", beats, STAMP)
    assert lake.table("motion_beat", "s").equals(beats)
    assert lake.stamp("motion_beat", "s") == STAMP
    assert lake.keys("motion_beat") == ["s"]


def test_only_some_clips(lake, beats):
    lake.write("motion_beat", "s", beats, STAMP)
    assert set(lake.table("motion_beat", "s", clip_ids=["s-wave"])["clip_id"].to_pylist()) == {"s-wave"}
    assert lake.table("motion_beat", "s", clip_ids=[]).num_rows == 0


def test_same_table_same_bytes(lake, beats):
    lake.write("motion_beat", "one", beats, STAMP)
    lake.write("motion_beat", "two", beats, STAMP)
    assert lake.path("motion_beat", "one").read_bytes() == lake.path("motion_beat", "two").read_bytes()


def test_units_and_meanings_are_in_the_file(lake, beats):
    lake.write("motion_beat", "s", beats, STAMP)
    field = pq.read_schema(lake.path("motion_beat", "s").path).field("time_s")
    assert field.metadata[b"unit"] == b"s"
    assert not field.nullable


def test_frames_of_one_clip_lie_in_one_row_group(built):
    file = pq.ParquetFile(built / "lake" / "canonical_pose" / "ayame.parquet")
    assert file.num_row_groups == 3
    assert {file.metadata.row_group(i).column(0).statistics.min for i in range(3)} == {
        "ayame-step",
        "ayame-twist",
        "ayame-wave",
    }


def test_missing_and_foreign_files(lake):
    assert lake.stamp("motion_beat", "s") is None
    assert lake.keys("motion_beat") == []
    with pytest.raises(LakeError, match="not built for it; run 'odori build'"):
        lake.table("motion_beat", "s")
    place = lake.path("motion_beat", "s")
    place.parent.mkdir(parents=True)
    place.write_bytes(b"no parquet")
    assert lake.stamp("motion_beat", "s") is None
    with pytest.raises(LakeError, match="delete the file"):
        lake.table("motion_beat", "s")


def test_another_version_of_the_table_is_not_taken(lake, beats):
    old = beats.replace_schema_metadata({"table": "motion_beat", "version": "0", "odori": STAMP.to_json()})
    place = lake.path("motion_beat", "s")
    place.parent.mkdir(parents=True)
    pq.write_table(old, place.path)
    assert lake.stamp("motion_beat", "s") is None


def test_failed_write_keeps_the_old_file_and_leaves_nothing_beside(lake, beats):
    lake.write("motion_beat", "s", beats, STAMP)
    before = lake.path("motion_beat", "s").read_bytes()

    def fail(file):
        file.write(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(LakeError, match="the disk is full; free some space"):
        write_beside(lake.path("motion_beat", "s"), fail)
    assert lake.path("motion_beat", "s").read_bytes() == before
    assert [p.name for p in lake.path("motion_beat", "s").parent.iterdir()] == ["s.parquet"]


def test_sweep_takes_only_what_was_left_beside(lake, beats):
    lake.write("motion_beat", "s", beats, STAMP)
    (lake.root / "motion_beat" / ".tmp-abc").write_bytes(b"half")
    assert lake.sweep() == 1
    assert lake.keys("motion_beat") == ["s"]


def test_forgetting_twice_is_no_error(lake, beats):
    lake.write("motion_beat", "s", beats, STAMP)
    lake.remove("motion_beat", "s")
    lake.remove("motion_beat", "s")
    assert lake.keys("motion_beat") == []


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EIO])
def test_every_refusal_of_a_disk_has_a_remedy(number):
    assert ";" in why(OSError(number, "whatever"))


def test_on_windows_names_have_no_bar_and_keys_have(tmp_path, beats):
    lake = Lake(UPath(tmp_path / "lake"), windows=True)
    for key in ("waltz|graph", "con", "waltz"):
        lake.write("motion_beat", key, beats, STAMP)
        assert lake.table("motion_beat", key).equals(beats)
    assert {p.name for p in (tmp_path / "lake" / "motion_beat").iterdir()} == {
        "waltz%7Cgraph.parquet",
        "con_.parquet",
        "waltz.parquet",
    }
    assert lake.keys("motion_beat") == ["con", "waltz", "waltz|graph"]
    lake.remove("motion_beat", "waltz|graph")
    assert lake.keys("motion_beat") == ["con", "waltz"]


def test_a_lake_of_windows_is_read_elsewhere_once_it_is_named_anew(tmp_path, beats):
    Lake(UPath(tmp_path / "lake"), windows=True).write("motion_beat", "waltz|graph", beats, STAMP)
    lake = Lake(UPath(tmp_path / "lake"), windows=False)
    assert lake.stamp("motion_beat", "waltz|graph") is None
    assert lake.name_anew() == 1
    assert lake.stamp("motion_beat", "waltz|graph") == STAMP
    assert lake.name_anew() == 0
