"""The third way to dance a song, through files: performances, the model, the dance, and what may be lacking."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from assets.formats import bvh, midi
from kernels.music.notes import sorted_notes
from kernels.synthetic import hidden_rules as made_up
from pipelines.collection import freshness
from pipelines.commands.dance_songs import dance_songs
from pipelines.commands.hmm_report import dance_notes, model_facts
from pipelines.resources import NoProgress
from pipelines.studio.folder import StudioFolder

RULES = made_up.hidden_rules(seed=4)
INTERVAL_S, N_MOTIONS = 0.5, 200
HIDDEN = made_up.draw_states(RULES, 40, seed=99)


def dance(root, song, **more):
    return dance_songs(
        root, [song], method="hmm", frame_rate_hz=None, out=None, progress=NoProgress, **{"temperature": None, **more}
    )


def lake(root):
    return StudioFolder(root).lake


def performed():
    return made_up.perform(RULES, n_motions=N_MOTIONS, interval_s=INTERVAL_S, seed=4)


def write_studio(root, *, performed_to="drums.mid", offset_s=0.0, lead_s=0.0):
    """One performance, whose song starts ``lead_s`` before the clip, and a new song by the same rules."""
    made = performed()
    (root / "clips" / "sumire").mkdir(parents=True)
    (root / "songs").mkdir()
    (root / "clips" / "sumire" / "take.bvh").write_bytes(bvh.format(made.clip))
    (root / "clips" / "sumire" / "clips.csv").write_text(
        f"file,label,subject,performed_to,performed_offset_s\ntake.bvh,performance,sumire,{performed_to},{offset_s}\n"
    )
    drums = made_up.draw_notes(RULES, made.state, interval_s=INTERVAL_S, start_s=lead_s, seed=4)
    (root / "songs" / "drums.mid").write_bytes(midi.format(drums, tempo=made.tempo))
    new = made_up.draw_notes(RULES, HIDDEN, interval_s=INTERVAL_S, seed=99)
    (root / "songs" / "new.mid").write_bytes(midi.format(new, tempo=made.tempo))
    return root


@pytest.fixture(scope="module")
def danced(tmp_path_factory):
    """A studio whose new song was danced by the model; not to be changed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("DAGSTER_HOME", raising=False)
        root = write_studio(tmp_path_factory.mktemp("hmm") / "studio")
        outcome = dance(root, "new")
        assert outcome.status == 0, outcome.troubles
        return root, outcome


@pytest.fixture
def studio(danced, tmp_path):
    return Path(shutil.copytree(danced[0], tmp_path / "studio"))


def accuracy(root, song="new"):
    """Share of steps whose recording shows the motion that was hidden in the song."""
    state = performed().state
    steps = lake(root).table("choreography", f"{song}|hmm").to_pylist()
    hits = []
    for step in steps:
        at = int((step["song_start_s"] + step["song_end_s"]) / 2 / INTERVAL_S)
        shown = state[int((step["clip_start_s"] + step["clip_end_s"]) / 2 / INTERVAL_S)]
        hits.append(shown == HIDDEN[min(at, len(HIDDEN) - 1)])
    return np.mean(hits)


def test_the_hidden_motions_are_danced(danced):
    root, outcome = danced
    assert accuracy(root) >= 0.8
    assert outcome.facts["model"]["music_adds"]
    assert outcome.facts["model"]["basic_motions"] == 8
    assert outcome.facts["model"]["notes"] == []
    assert outcome.facts["quality"]["beat_p_probability"] < 0.01
    assert outcome.facts["quality"]["warp_easy_ratio"] >= 0.95


def test_what_is_stored(danced):
    store = lake(danced[0])
    model = store.table("choreography_model").to_pylist()
    for name, n in (("initial", 8), ("transition", 64), ("emission", 8 * 47), ("melody", 8 * 5)):
        rows = [r for r in model if r["parameter_name"] == name]
        assert len(rows) == n
        assert sum(r["probability"] for r in rows) == pytest.approx(1 if name == "initial" else 8)
    motions = store.table("key_pose", "sumire").to_pylist()
    assert len(motions) == N_MOTIONS
    assert all(r["start_s"] < r["peak_s"] < r["end_s"] and 0 <= r["state_index"] < 8 for r in motions)
    hits = store.table("percussion", "new").to_pylist()
    assert {r["heard_as"] for r in hits} == {"drums"}
    assert all(35 <= r["key_number"] <= 81 for r in hits)
    steps = store.table("choreography", "new|hmm").to_pylist()
    assert all(0 <= r["state_index"] < 8 for r in steps)
    assert sum(r["music_cost"] for r in steps) > 0
    performances = store.table("performance").to_pylist()
    assert [(r["song_id"], r["paired_by"]) for r in performances] == [("drums", "clips.csv")]


def test_everything_is_fresh_and_the_same_bytes_come_again(studio):
    findings = freshness(StudioFolder(studio)).findings()
    made = {"performance", "basic_motion", "key_pose", "choreography_model", "choreography", "usd_animation"}
    assert {f.asset for f in findings} >= made
    assert [f for f in findings if f.asset in made and f.state != "fresh"] == []
    before = (studio / "dances" / "new" / "hmm.usdc").read_bytes()
    for table in ("basic_motion", "choreography_model", "choreography"):
        shutil.rmtree(studio / "lake" / table)
    assert dance(studio, "new").status == 0
    assert (studio / "dances" / "new" / "hmm.usdc").read_bytes() == before


@pytest.mark.slow
def test_temperature_draws_another_dance_and_a_seed_repeats_it(studio):
    def steps():
        return lake(studio).table("choreography", "new|hmm")["clip_start_s"].to_pylist()

    probable = steps()
    assert dance(studio, "new", temperature=10.0, seed=1).status == 0
    one = steps()
    assert one != probable
    assert dance(studio, "new", temperature=10.0, seed=2).status == 0
    assert steps() != one
    assert dance(studio, "new", temperature=10.0, seed=1).status == 0
    assert steps() == one


@pytest.mark.slow
def test_a_clip_that_starts_late_in_its_song(tmp_path):
    root = write_studio(tmp_path / "studio", offset_s=2.0, lead_s=2.0)
    assert dance(root, "new").status == 0
    assert accuracy(root) >= 0.8


def test_where_nobody_danced_to_a_song_the_user_is_told(tmp_path):
    root = write_studio(tmp_path / "studio", performed_to="none")
    outcome = dance(root, "new")
    assert outcome.status == 0, outcome.troubles
    assert "performed_to" in outcome.facts["model"]["notes"][0]
    assert not outcome.facts["model"]["music_adds"]
    assert "no clip was danced to a song" in outcome.report


def test_what_one_subject_performed_is_counted_and_nobody_is_told(danced):
    store = lake(danced[0])
    assert model_facts(store, subject="sumire")["performances"] == 1
    nobody = model_facts(store, subject="kaede")
    assert nobody["performances"] == 0
    assert "no clip of kaede was danced to a song" in nobody["notes"][0]


def test_build_makes_the_model_only_where_it_is_used(tmp_path, build):
    root = write_studio(tmp_path / "studio", performed_to="none")
    assert build(root).status == 0
    assert lake(root).keys("key_pose") == []
    assert lake(root).keys("percussion") == ["drums", "new"]
    (root / "clips" / "sumire" / "clips.csv").write_text("file,performed_to\ntake.bvh,drums\n")
    assert build(root).status == 0
    assert lake(root).keys("key_pose") == ["sumire"]
    assert lake(root).table("choreography_model").num_rows > 0
    assert [f for f in freshness(StudioFolder(root)).findings() if f.state != "fresh"] == []


@pytest.mark.slow
def test_a_midi_without_drums_is_heard_as_audio_is(studio):
    rows = [(0.5 * i, 0.4, 60 + i % 5, 90, 1, 0) for i in range(40)]
    (studio / "songs" / "tune.mid").write_bytes(midi.format(sorted_notes(rows), tempo=((0.0, 120.0),)))
    assert dance(studio, "tune").status == 0
    assert {r["heard_as"] for r in lake(studio).table("percussion", "tune").to_pylist()} <= {"bands"}


def test_a_song_far_from_any_tempo_danced_is_refused_with_the_reason(studio):
    notes = made_up.draw_notes(RULES, HIDDEN, interval_s=0.36, seed=1)
    (studio / "songs" / "fast.mid").write_bytes(midi.format(notes, tempo=((0.0, 60 / 0.36),)))
    outcome = dance(studio, "fast")
    assert outcome.status == 2
    assert "add clips near that tempo" in outcome.facts["error"]


@pytest.mark.slow
def test_a_performance_of_one_motion(tmp_path):
    root = tmp_path / "studio"
    write_studio(root)
    short = made_up.perform(RULES, n_motions=1, interval_s=INTERVAL_S, seed=1)
    (root / "clips" / "sumire" / "take.bvh").write_bytes(bvh.format(short.clip))
    outcome = dance(root, "new")
    assert outcome.status in (0, 2)
    text = outcome.facts["model"]["notes"][0] if outcome.status == 0 else outcome.facts["error"]
    assert "add" in text


def pinned(root, *pins):
    return dance(root, "new", pins=pins)


def test_pins_are_kept_and_named_by_the_steps_that_serve_them(studio):
    (studio / "clips" / "sumire" / "short.bvh").write_bytes(
        bvh.format(made_up.perform(RULES, n_motions=60, interval_s=INTERVAL_S, seed=8).clip)
    )
    outcome = pinned(studio, "6-9=clip:sumire-short", "15=not:performance")
    assert outcome.status == 0, outcome.troubles
    assert [p["is_kept"] for p in outcome.facts["pins"]] == [True, True]
    steps = lake(studio).table("choreography", "new|hmm").to_pylist()
    inside = [s for s in steps if s["song_end_s"] > 6.0 + 1e-6 and s["song_start_s"] < 9.0 - 1e-6]
    assert {s["clip_id"] for s in inside} == {"sumire-short"}
    assert {s["pin_id"] for s in inside} == {"6-9=clip:sumire-short"}
    assert {s["pin_id"] for s in steps} == {None, "6-9=clip:sumire-short", "15=not:performance"}


def test_pins_that_cannot_be_kept_are_refused_with_the_fewest_of_them(studio):
    outcome = pinned(studio, "2=performance", "5=spin")
    assert outcome.status == 2
    assert outcome.facts["conflict"] == ["5=spin"]
    assert outcome.facts["ways_out"] == ["5=performance in place of 5=spin"]
    outcome = pinned(studio, "2-4=performance", "3-6=not:performance", "8=performance")
    assert outcome.facts["conflict"] == ["3-6=not:performance"]
    outcome = pinned(studio, "900=performance")
    assert outcome.status == 2
    assert "want seconds within the song" in outcome.facts["error"]


def test_soft_pins_never_refuse(studio):
    (studio / "songs" / "new.brief.toml").write_text('pins = "soft"\n[[pin]]\nat = 1.0\nuntil = 2.0\nlabel = "spin"\n')
    outcome = dance(studio, "new")
    assert outcome.status == 0, outcome.troubles
    assert [p["is_kept"] for p in outcome.facts["pins"]] == [False]
    assert outcome.facts["costs"]["wish"] > 0


def test_what_is_not_as_wanted_has_a_reason():
    def notes(**failed):
        return dance_notes({"wanted": {name: {"value": v, "is_passed": False} for name, v in failed.items()}})

    assert notes() == []
    assert "cannot improve" in notes(seam_jerk_ratio=1.2)[0]
    assert "join only roughly" in notes(seam_jerk_ratio=1.7)[0]
    assert "join only roughly" in notes(seam_jerk_worst_ratio=2.3)[0]
    assert "stand differently" in notes(knee_pop_ratio=1.3)[0]
    assert "too short" in notes(beat_p_probability=0.2)[0]


def test_temperature_is_bounded(studio):
    from pipelines.studio.files import StudioError

    with pytest.raises(StudioError, match="--temperature: want 0 to 10"):
        dance(studio, "new", temperature=-1.0)
    with pytest.raises(StudioError, match="want the method hmm"):
        dance_songs(studio, ["new"], method="graph", frame_rate_hz=None, out=None, progress=NoProgress, temperature=1.0)
