import pytest

from pipelines.studio import stored
from pipelines.studio.files import LakeError
from pipelines.studio.folder import StudioFolder
from pipelines.studio.stored import RememberedTable, StoredTable, TableMemory


@pytest.fixture
def lake(studio):
    return StudioFolder(studio).lake


def test_partitions_are_read_whole_or_by_clip(lake):
    table = StoredTable(lake, "clip", lake.keys("clip"))
    assert table.keys == ["ayame", "kaede"]
    assert table.read("ayame")["clip_id"].to_pylist() == ["ayame-step", "ayame-twist", "ayame-wave"]
    assert table.read("ayame", clip_ids=["ayame-wave"])["clip_id"].to_pylist() == ["ayame-wave"]
    assert set(table.stamp("ayame").clips) == {"ayame-step", "ayame-twist", "ayame-wave"}
    with pytest.raises(LakeError, match="clip: the partition 'tsubaki' is not built"):
        table.stamp("tsubaki")


def test_a_remembered_table_is_read_once_and_again_when_its_file_changed(lake):
    memory = TableMemory()
    table = RememberedTable(lake, "clip", lake.keys("clip"), memory)
    first = table.read("ayame")
    assert table.read("ayame") is first
    assert RememberedTable(lake, "clip", ["ayame"], memory).read("ayame") is first  # the memory is shared
    assert table.read("ayame", clip_ids=["ayame-wave"]).num_rows == 1
    lake.write("clip", "ayame", first.slice(0, 1), lake.stamp("clip", "ayame"))
    assert table.read("ayame").num_rows == 1


def test_what_was_read_longest_ago_goes_first(lake, monkeypatch):
    table = RememberedTable(lake, "clip", lake.keys("clip"), TableMemory())
    first = table.read("ayame")
    second = table.read("kaede")
    assert table.read("ayame") is first  # read again: kaede's is now the older
    monkeypatch.setattr(stored, "REMEMBERED_BYTES", first.nbytes)
    third = table.read("ayame", clip_ids=["ayame-step"])
    assert table.read("ayame", clip_ids=["ayame-step"]) is third
    assert table.read("kaede") is not second
