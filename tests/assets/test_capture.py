"""Reading sessions within the studio's limits."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from assets.capture import _Reader
from assets.formats import bvh
from assets.formats.clips_csv import Facts
from assets.sources.sources import ClipFile, session_version
from assets.stamps import Stamp
from kernels.synthetic.dancer import take
from pipelines.resources import NoProgress
from schemas.settings import Limits, Settings


@pytest.mark.parametrize("largest_clip_mb", [0.01, 10.0, 4000.0])
def test_the_largest_clip_is_the_settings_not_the_readers(tmp_path, monkeypatch, largest_clip_mb):
    """What the folder's scan lets in is read, however large: the reader has no limit of its own."""
    (tmp_path / "step.bvh").write_bytes(bvh.format(take("step", n_beats=4).clip))
    asked = []
    read = bvh.read
    monkeypatch.setattr(bvh, "read", lambda path, **limits: asked.append(limits) or read(path, **limits))
    settings = Settings(limits=Limits(largest_clip_mb=largest_clip_mb))
    studio = SimpleNamespace(settings=lambda: settings, file=lambda path: tmp_path / path)
    reader = _Reader(
        studio, SimpleNamespace(), SimpleNamespace(stamp=lambda *_: None, table=lambda *_: None), NoProgress(), "1"
    )
    parts = reader.read("s", (ClipFile("s-step", "s", "step.bvh", "0", Facts()),))
    assert asked == [{"max_bytes": round(largest_clip_mb * 1e6)}]
    (row,) = parts["clip"].table.to_pylist()
    assert row["state"] == ("refused" if largest_clip_mb < 0.1 else "read")


class Stored:
    """What earlier readings stored, in memory, table by table as a killed run may leave them."""

    def __init__(self, **parts):
        self.parts = parts

    def table(self, asset, _):
        return self.parts[asset].table if asset in self.parts else None

    def stamp(self, asset, _):
        return Stamp("1", "", {}, "", self.parts[asset].clips) if asset in self.parts else None


@pytest.fixture
def read_as(tmp_path):
    """Read one clip, of so many beats, by its hash, beside what is stored: its four tables."""

    def read(n_beats, sha256, stored=None, **facts):
        (tmp_path / "step.bvh").write_bytes(bvh.format(take("step", n_beats=n_beats).clip))
        studio = SimpleNamespace(settings=Settings, file=lambda path: tmp_path / path)
        reader = _Reader(studio, SimpleNamespace(), stored or Stored(), NoProgress(), "1")
        return reader.read("s", (ClipFile("s-step", "s", "step.bvh", sha256, Facts(**facts)),))

    return read


def test_a_file_with_the_same_bytes_is_carried_over_with_the_facts_of_today(read_as):
    first = read_as(4, "one", label="step")
    second = read_as(6, "one", Stored(**first), label="walk")  # by its hash the same file
    assert second["pose"].metadata == {"computed_clips": 0, "carried_clips": 1}
    for name in ("pose", "skeleton", "calibration"):
        assert second[name].table.equals(first[name].table)
    (row,) = second["clip"].table.to_pylist()
    assert row["label"] == "walk"


def test_another_file_is_read_anew(read_as):
    first = read_as(4, "one")
    second = read_as(6, "two", Stored(**first))
    assert second["pose"].metadata["computed_clips"] == 1
    assert second["pose"].table.num_rows > first["pose"].table.num_rows


@pytest.mark.parametrize("late", ["clip", "skeleton", "pose"])
def test_tables_that_a_killed_run_left_of_different_readings_are_not_mixed(read_as, late):
    """One table is of the file as it was for a while; the others of the file as it is."""
    now, meanwhile = read_as(4, "one"), read_as(6, "two")
    again = read_as(4, "one", Stored(**{**now, late: meanwhile[late]}))
    assert again["pose"].metadata["computed_clips"] == 1
    for name in ("clip", "skeleton", "pose"):
        assert again[name].table.equals(now[name].table), name
        assert again[name].clips == now[name].clips


@pytest.mark.parametrize("lost", ["clip", "skeleton", "pose", "calibration"])
def test_nothing_is_carried_over_where_a_table_is_not_there(read_as, lost):
    first = read_as(4, "one")
    left = {name: part for name, part in first.items() if name != lost}
    assert read_as(4, "one", Stored(**left))["pose"].metadata["computed_clips"] == 1


def test_a_refused_file_has_its_reason_and_is_not_read_again(tmp_path, read_as):
    first = read_as(4, "one")
    studio = SimpleNamespace(settings=Settings, file=lambda path: tmp_path / "broken.bvh")
    (tmp_path / "broken.bvh").write_text("HIERARCHY nonsense")
    clip = ClipFile("s-step", "s", "broken.bvh", "two", Facts())
    parts = _Reader(studio, SimpleNamespace(), Stored(**first), NoProgress(), "1").read("s", (clip,))
    (row,) = parts["clip"].table.to_pylist()
    assert row["state"] == "refused"
    assert row["reason"].startswith("line 1")
    assert parts["clip"].metadata["refused_clips"] == 1
    again = _Reader(studio, SimpleNamespace(), Stored(**parts), NoProgress(), "1").read("s", (clip,))
    assert again["pose"].metadata == {"computed_clips": 0, "carried_clips": 1}
    assert again["clip"].table.equals(parts["clip"].table)


def test_what_the_disk_refused_is_never_taken_for_fresh(tmp_path, read_as):
    stored = read_as(4, "one")
    studio = SimpleNamespace(settings=Settings, file=lambda path: tmp_path / "not_there.bvh")
    clip = ClipFile("s-step", "s", "not_there.bvh", "two", Facts())
    parts = _Reader(studio, SimpleNamespace(), Stored(), NoProgress(), "1").read("s", (clip,))
    (row,) = parts["clip"].table.to_pylist()
    assert row["reason"].startswith("cannot be read: ")
    assert parts["clip"].clips == {}
    again = _Reader(studio, SimpleNamespace(), Stored(**parts), NoProgress(), "1").read("s", (clip,))
    assert again["pose"].metadata["computed_clips"] == 1
    assert stored["pose"].sources == session_version((replace(clip, path="step.bvh", sha256="one"),))
    assert parts["pose"].sources != session_version((clip,))


def test_a_clip_refused_by_its_folder_is_not_opened(tmp_path):
    studio = SimpleNamespace(settings=Settings, file=lambda path: tmp_path / path)
    clip = ClipFile("s-step", "s", "step.bvh", "", Facts(), problem="too large")
    parts = _Reader(studio, SimpleNamespace(), Stored(), NoProgress(), "1").read("s", (clip,))
    (row,) = parts["clip"].table.to_pylist()
    assert (row["state"], row["reason"], row["source_format"]) == ("refused", "too large", "")
    assert parts["pose"].metadata["computed_clips"] == 0


@pytest.mark.parametrize(
    ("facts", "first", "last"),
    [({"start_s": 0.5}, 0.5, None), ({"end_s": 1.0}, 0.0, 1.0), ({"start_s": 0.5, "end_s": 1.0}, 0.5, 1.0)],
)
def test_what_clips_csv_cuts_off_is_fenced_and_said(read_as, facts, first, last):
    parts = read_as(4, "0", **facts)
    pose = parts["pose"].table.to_pydict()
    shown = [t for t, is_fenced in zip(pose["time_s"], pose["is_fenced"], strict=True) if not is_fenced]
    assert shown[0] == pytest.approx(first)
    assert shown[-1] == pytest.approx(pose["time_s"][-1] if last is None else last)
    faults = parts["clip_fault"].table.to_pylist()
    assert {(f["fault_kind"], f["verdict"]) for f in faults} == {("trimmed", "fenced")}
    assert len(faults) == len(facts)
    (row,) = parts["clip"].table.to_pylist()
    assert row["danceability_ratio"] == pytest.approx(len(shown) / len(pose["time_s"]))


def test_a_take_cut_down_to_nothing_is_refused(read_as):
    parts = read_as(4, "0", start_s=99.0)
    (row,) = parts["clip"].table.to_pylist()
    assert row["state"] == "refused"
    assert "start_s and end_s leave nothing" in row["reason"]
    assert parts["clip_fault"].table["verdict"].to_pylist() == ["refused"]
    assert parts["pose"].table.num_rows == 0


def test_a_clip_is_examined_anew_when_its_facts_of_health_change_and_only_then(read_as):
    first = read_as(4, "0")
    again = read_as(4, "0", Stored(**first), style="other")
    cut = read_as(4, "0", Stored(**first), end_s=1.0)
    answered = read_as(4, "0", Stored(**first), health="ok")
    counted = [parts["pose"].metadata["computed_clips"] for parts in (again, cut, answered)]
    assert counted == [0, 1, 1]
    assert answered["clip"].table["health"].to_pylist() == ["ok"]
