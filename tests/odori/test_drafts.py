"""A draft is the dance that would be made, and a proposal a pin that would be kept; neither loads Dagster."""

import subprocess
import sys

import numpy as np
import polars.testing
import pytest

import odori


def test_a_draft_is_the_dance_without_its_stage(shown):
    draft, dance = shown.draft("drum_machine"), shown.dances["drum_machine|graph"]
    polars.testing.assert_frame_equal(draft.steps, dance.steps)
    assert np.array_equal(draft.poses.position_xyz_m, dance.poses.position_xyz_m)
    assert np.array_equal(draft.poses.rotation_wxyz, dance.poses.rotation_wxyz)


def test_a_draft_keeps_its_pins_and_its_rate(shown):
    draft = shown.draft("drum_machine", pins="8-12=kick", frame_rate_hz=60)
    inside = draft.steps.filter((polars.col("song_start_s") > 8.5) & (polars.col("song_end_s") < 11.5))
    labels = {clip: shown.clips[clip].label for clip in inside["clip_id"]}
    assert set(labels.values()) == {"kick"}
    assert draft.poses.frame_rate_hz == 60
    assert shown.dances["drum_machine|graph"].pins == []  # nothing was written


def test_drafts_and_proposals_load_no_dagster(danced_demo):
    code = (
        "import sys, odori; s = odori.open(sys.argv[1]); s.draft('drum_machine'); s.propose('drum_machine', 12);"
        "s.poses(s.clips[0]); print('dagster' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(danced_demo)], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_what_is_proposed_is_kept_at_that_cost(shown):
    proposals = shown.propose("drum_machine", 12)
    costs = [(p.steps_outside_warp_bounds, p.extra_cost) for p in proposals if p.is_within_reach]
    assert costs == sorted(costs)
    assert {p.kind for p in proposals} == {"label", "style", "clip"}
    best = next(p for p in proposals if p.kind == "label" and p.name == "spin")
    assert best.pin == "12=spin"
    draft = shown.draft("drum_machine", pins=[best.pin])
    moment = draft.steps.filter((polars.col("song_start_s") <= 12) & (polars.col("song_end_s") > 12))
    assert shown.clips[moment["clip_id"][0]].label == "spin"


def test_pins_places_and_methods_that_are_none_are_refused(shown):
    with pytest.raises(odori.DanceRefusedError) as caught:
        shown.draft("drum_machine", pins=["12=spin", "12.4=kick"])
    assert caught.value.conflict == ["12=spin", "12.4=kick"]
    with pytest.raises(odori.OdoriError, match="method: want one of graph, matching, hmm, got 'tango'"):
        shown.draft("drum_machine", method="tango")
    with pytest.raises(odori.DanceRefusedError, match="pins are kept by the methods graph and hmm"):
        shown.draft("drum_machine", method="matching", pins=["12=spin"])
    with pytest.raises(odori.OdoriError, match="1000"):
        shown.propose("drum_machine", 1000)


@pytest.mark.slow
def test_what_is_not_there_at_all_is_built_first(studio):
    assert studio.table("match").num_rows == 0
    draft = studio.draft("drum_machine", method="matching")
    assert draft.method == "matching"
    assert studio.table("match").num_rows > 0
    assert studio.dances.keys() == ["drum_machine|graph"]


def test_a_table_is_read_again_when_its_file_changed(studio):
    first = studio.draft("drum_machine")
    path = studio.root / "songs" / "drum_machine.brief.toml"
    path.write_text('allow = ["none-such"]\n', encoding="utf-8")
    with pytest.raises(odori.OdoriError):
        studio.draft("drum_machine")
    path.unlink()
    assert studio.draft("drum_machine").steps.equals(first.steps)


def test_a_song_that_is_refused_is_refused_by_its_own_reason(studio):
    brief = studio.root / "songs" / "drum_machine.brief.toml"
    brief.write_text('method = "hmmm"\n', encoding="utf-8")
    for ask in (lambda: studio.draft("drum_machine"), lambda: studio.propose("drum_machine", 12)):
        with pytest.raises(odori.OdoriError, match="method: want one of"):
            ask()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"frame_rate_hz": 0.5}, "frame_rate_hz: want a number from 1 to 240, got 0.5"),
        ({"frame_rate_hz": "30"}, "frame_rate_hz: want a number"),
        ({"temperature": -1}, "temperature: want a number from 0 to 10, got -1"),
        ({"temperature": float("nan")}, "temperature: want a number from 0 to 10, got nan"),
        ({"seed": 1.5}, "seed: want a whole number >= 0, got 1.5"),
        ({"pins": [12]}, "pins: want text, as it is typed, got 12"),
    ],
)
def test_what_cannot_be_meant_is_refused_by_drafts_and_dances_alike(shown, more, words):
    for ask in (shown.draft, shown.dance):
        with pytest.raises(odori.InputError, match=words):
            ask("drum_machine", **more)
