"""`odori search`, from files to hits."""

import gc
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from assets.formats import bvh
from kernels.synthetic.dancer import take
from pipelines.commands import searchable as making
from pipelines.commands.build_studio import build_studio
from pipelines.commands.search_motions import MotionQuery, by_likeness, search
from pipelines.resources import NoProgress
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder
from pipelines.studio.lake import Lake

TAKES = ("step", "twist", "wave")


def ask(root, query="", **more):
    sheet, train = more.pop("sheet", None), more.pop("train", False)
    return search(root, MotionQuery(query=query, **more), sheet=sheet, train=train, progress=NoProgress).facts


def clips_of(outcome):
    return [hit["clip_id"] for hit in outcome["hits"]]


@pytest.fixture(scope="session")
def searchable(tmp_path_factory):
    """Three takes of each of three moves, one of a fourth without a label, one long; searched once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("DAGSTER_HOME", raising=False)
        root = tmp_path_factory.mktemp("search") / "studio"
        (root / "clips" / "day").mkdir(parents=True)
        rows = ["file,label,style,licence"]
        for label in TAKES:
            for number in range(3):
                made = take(label, n_beats=6, interval_s=0.4 + 0.08 * number)
                name = f"{label}_{number}.bvh"
                (root / "clips" / "day" / name).write_bytes(bvh.format(made.clip))
                rows.append(f"{name},{label},style {number},CC0-1.0")
        long = take("wave", n_beats=24, interval_s=0.5)
        (root / "clips" / "day" / "unsaid.bvh").write_bytes(bvh.format(long.clip))
        (root / "clips" / "day" / "clips.csv").write_text("\n".join(rows))
        (root / "clips" / "day" / "broken.bvh").write_text("HIERARCHY\nnonsense")
        (root / "odori.toml").write_text("[search]\ntraining_steps = 25\n")
        ask(root, "day-step_0")
        return root


@pytest.fixture
def own(searchable, tmp_path):
    """A copy to work on."""
    return Path(shutil.copytree(searchable, tmp_path / "studio"))


def table(root, name, key=""):
    return Lake(StudioFolder(root).lake.root).table(name, key)


def test_a_clip_finds_its_like_first_and_not_itself(searchable):
    found = ask(searchable, "day-step_1")
    assert {h["label"] for h in found["hits"][:2]} == {"step"}
    assert "day-step_1" not in clips_of(found)
    assert [h["distance"] for h in found["hits"]] == sorted(h["distance"] for h in found["hits"])
    assert set(found["hits"][0]) >= {"clip_id", "start_s", "end_s", "distance", "label"}
    assert found["is_exact"]


def test_it_answers_at_once_without_dagster(searchable, monkeypatch):
    monkeypatch.setattr("pipelines.commands.searchable.make_searchable", lambda *a, **k: pytest.fail("made something"))
    assert ask(searchable, "day-wave_0", k=1)["hits"]


def test_a_file_from_elsewhere_is_found_in_the_catalogue(searchable, tmp_path):
    copy = tmp_path / "copy.bvh"
    shutil.copy(searchable / "clips" / "day" / "twist_2.bvh", copy)
    hit = ask(searchable, str(copy), k=1)["hits"][0]
    assert (hit["clip_id"], hit["distance"]) == ("day-twist_2", 0.0)


def test_a_part_begun_anywhere_is_found_where_it_lies(searchable, tmp_path):
    text = (searchable / "clips" / "day" / "unsaid.bvh").read_text()
    head, motion = text.split("MOTION")
    lines = motion.strip().splitlines()
    step_s = float(lines[1].split(":")[1])
    first, end = round(5.3 / step_s), round(7.8 / step_s)
    part = tmp_path / "part.bvh"
    body = "\n".join([f"Frames: {end - first}", lines[1], *lines[2 + first : 2 + end]])
    part.write_text(f"{head}MOTION\n{body}\n")
    hit = ask(searchable, str(part), k=1)["hits"][0]
    assert hit["clip_id"] == "day-unsaid"
    assert hit["copy_apart_m"] < 0.01
    # The move comes back every two seconds or so: wherever it is laid, it lies there exactly.
    assert hit["end_s"] - hit["start_s"] == pytest.approx(2.5, abs=0.1)


def test_a_file_of_the_studio_is_its_clip(searchable):
    by_path = ask(searchable, str(searchable / "clips" / "day" / "twist_2.bvh"))
    assert by_path["hits"] == ask(searchable, "day-twist_2")["hits"]


def test_a_file_of_the_studio_is_its_clip_by_whatever_way_it_is_reached(searchable, tmp_path):
    wanted = ask(searchable, "day-twist_2")["hits"]
    (tmp_path / "link").symlink_to(searchable)
    for way in (searchable / "clips" / ".." / "clips" / "day", tmp_path / "link" / "clips" / "day"):
        assert ask(searchable, str(way / "twist_2.bvh"))["hits"] == wanted


def test_a_stretch_is_looked_for_and_hits_are_stretches(searchable):
    found = ask(searchable, "day-unsaid@2.5-4", k=12)
    long = [h for h in found["hits"] if h["clip_id"] == "day-unsaid"]
    assert long
    assert long[0]["start_s"] > 4
    assert all(h["end_s"] - h["start_s"] <= 6 for h in found["hits"])


def test_filters_narrow(searchable):
    assert {h["label"] for h in ask(searchable, "day-step_0", label=("twist", "wave"))["hits"]} == {"twist", "wave"}
    assert {h["style"] for h in ask(searchable, "day-step_0", style=("style 1",))["hits"]} == {"style 1"}
    assert clips_of(ask(searchable, "day-step_0", min_seconds=8)) == ["day-unsaid"]
    assert "day-unsaid" not in clips_of(ask(searchable, "day-step_0", max_seconds=8))
    assert ask(searchable, "day-step_0", min_seconds=100)["hits"] == []


def test_likes_and_dislikes_steer(searchable):
    plain, away = ask(searchable, "day-step_0"), ask(searchable, "day-step_0", unlike=("day-step_1",))
    assert "day-step_1" not in clips_of(away)
    assert clips_of(plain) != clips_of(away)
    liked = ask(searchable, like=("day-wave_0", "day-wave_1"), k=1)
    assert liked["hits"][0]["label"] in ("wave", "day")


def test_a_sheet_is_drawn(searchable, tmp_path):
    ask(searchable, "day-step_0@0.5-1.5", k=2, sheet=tmp_path / "hits.png")
    assert (tmp_path / "hits.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("wish", "said"),
    [
        ({"query": "day-stp_0"}, "near are day-step_0"),
        ({"query": "day-broken"}, "cannot be searched for"),
        ({"query": "nowhere.bvh"}, "want a clip of this studio or a BVH file"),
        ({"query": "day-step_0@3-2"}, "want an end after its start"),
        ({"query": "day-step_0@90-91"}, "begins after its end"),
        ({"query": "day-step_0@1.5"}, "want a stretch in seconds as in day-step_0@2.5-4, got @1.5"),
        ({"query": "day-step_0", "label": ("stp",)}, "near are step"),
        ({}, "got nothing to look for"),
    ],
)
def test_what_cannot_be_looked_for_is_said_in_a_sentence(searchable, wish, said):
    with pytest.raises(StudioError, match=said):
        ask(searchable, **wish)


def test_a_rig_that_is_no_body_is_refused(searchable, tmp_path):
    stick = tmp_path / "stick.bvh"
    stick.write_text(
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
        "End Site\n{\nOFFSET 0 1 0\n}\n}\n"
        "MOTION\nFrames: 1\nFrame Time: 0.033333\n0 0 0\n"
    )
    with pytest.raises(StudioError, match=r"stick\.bvh: "):
        ask(searchable, str(stick))


def test_a_sheet_is_a_png(searchable):
    with pytest.raises(StudioError, match=r"ending in \.png"):
        ask(searchable, "day-step_0", sheet=Path("hits.jpg"))


def test_unlabelled_clips_get_proposals(searchable):
    rows = table(searchable, "label_proposal").to_pylist()
    assert {row["clip_id"] for row in rows} == {"day-unsaid"}
    assert rows[0]["proposed_label"] == "wave"


def test_the_encoder_says_where_it_comes_from(searchable):
    said = json.loads(table(searchable, "motion_encoder").schema.metadata[b"provenance"])
    assert said["kind"] == "labelled"
    assert said["labels"] == ["step", "twist", "wave"]
    assert said["validation"]["queries"] > 0


def test_a_new_clip_is_embedded_by_the_encoder_there_is(own):
    encoder = (own / "lake" / "motion_encoder" / "all.parquet").read_bytes()
    before = {r["clip_id"]: r["embedding"] for r in table(own, "motion_embedding", "day").to_pylist()}
    made = take("step", n_beats=5, interval_s=0.5)
    (own / "clips" / "day" / "new.bvh").write_bytes(bvh.format(made.clip))
    found = ask(own, "day-new")
    assert found["hits"][0]["label"] == "step"
    assert (own / "lake" / "motion_encoder" / "all.parquet").read_bytes() == encoder
    after = {r["clip_id"]: r["embedding"] for r in table(own, "motion_embedding", "day").to_pylist()}
    assert all(after[clip] == vector for clip, vector in before.items())
    assert "day-new" in after


def test_build_makes_nothing_of_it_unasked_and_keeps_it_up_once_asked(own, built):
    assert not (built / "lake" / "motion_embedding").exists()
    shutil.rmtree(own / "lake" / "motion_embedding")
    assert build_studio(own, dances=False, progress=NoProgress).status == 1  # the broken clip
    assert (own / "lake" / "motion_embedding" / "day.parquet").is_file()


def test_no_clip_that_can_be_read_is_said(tmp_path):
    root = tmp_path / "studio"
    (root / "clips").mkdir(parents=True)
    with pytest.raises(StudioError, match="want clips under clips/, got none"):
        ask(root, "any")
    (root / "clips" / "broken.bvh").write_text("nonsense")
    with pytest.raises(StudioError, match=r"want a clip|want clips"):
        ask(root, "any")


@pytest.mark.slow
def test_one_unlabelled_clip_of_one_frame_and_another(tmp_path):
    root = tmp_path / "studio"
    (root / "clips").mkdir(parents=True)
    (root / "odori.toml").write_text("[search]\ntraining_steps = 2\n")
    made = take("step", n_beats=4, interval_s=0.5).clip
    text = bvh.format(made).decode()
    head, motion = text.split("MOTION")
    lines = motion.strip().splitlines()
    still = "\n".join(["Frames: 1", lines[1], lines[2]])
    (root / "clips" / "still.bvh").write_text(f"{head}MOTION\n{still}\n")
    (root / "clips" / "moves.bvh").write_text(text)
    found = ask(root, "clips-still")
    assert clips_of(found) == ["clips-moves"]
    assert np.isfinite(found["hits"][0]["distance"])


def test_a_pin_by_likeness_names_the_clip_and_those_like_it(searchable):
    text = by_likeness(searchable, "12-16=like:day-step_0", progress=NoProgress)
    place, _, wish = text.partition("=clip:")
    assert place == "12-16"
    assert wish.split(",")[0] == "day-step_0"
    assert wish.split(",")[1:] == clips_of(ask(searchable, "day-step_0", k=5))
    assert by_likeness(searchable, "12-16=step", progress=NoProgress) == "12-16=step"


def test_no_file_of_the_index_is_mapped_while_it_is_made_anew(searchable, tmp_path, monkeypatch):
    """Windows replaces no file that is mapped, by whomever."""
    maps = Path("/proc/self/maps")
    if not maps.is_file():
        pytest.skip("what is mapped is told by Linux alone")
    root = Path(shutil.copytree(searchable, tmp_path / "studio"))
    mapped = []
    make = making.make_searchable

    def look_and_make(studio, **options):
        gc.collect()
        mapped.extend(line for line in maps.read_text(encoding="utf-8").splitlines() if str(root) in line)
        make(studio, **options)

    monkeypatch.setattr(making, "make_searchable", look_and_make)
    (root / "clips" / "day" / "clips.csv").write_bytes(b"file,label\nstep_0.bvh,new\n")
    (root / "lake" / "motion_index" / "seen.json").unlink()
    assert ask(root, "day-step_0")["hits"]
    assert mapped == []
