"""Pieces that a span of a song may be danced with: where they lie in their clips, and what each costs."""

from dataclasses import replace

import numpy as np
import pytest

from assets.dancing.avoided import AvoidedSpan
from assets.dancing.match_pieces import LoadedMatches, pieces_of, without_touched
from assets.tables.matching import StoredMatches
from kernels.matching.price import ClipFeatures, MatchPiece
from kernels.motion.motion_features import bumps
from kernels.music.segments import Segments
from schemas.settings import MatchPathSettings

RATE_HZ = 120
PLAIN = MatchPathSettings(other_starts=0)
BEAT_S = np.arange(0, 20, 0.5)


def stepping(first_frame, n_frames, *, every=60):
    at = np.arange(first_frame, n_frames, every, dtype=float)
    return bumps(n_frames, at, np.ones(len(at)), width_s=0.05).astype(np.float32)


def clip(n_frames=600, *, first_frame=0, effort=None, beat_s=(), every=60):
    effort = np.ones(n_frames) if effort is None else effort
    return ClipFeatures(stepping(first_frame, n_frames, every=every), effort, np.array(beat_s, float))


def matches(*found):
    """Of one segment: (clip, numerator, first frame) each, all with the same score."""
    n = len(found)
    names, numerator, start = zip(*found, strict=True) if found else ((), (), ())
    half = np.full(n, 0.5)
    return StoredMatches(tuple(names), np.array(numerator, np.int64), np.array(start, np.int64), half, np.ones(n), half)


@pytest.fixture
def song():
    """Make a song of one segment: its matches and clips, and where it starts and ends."""

    def make(found, clips, *, start_s=2.0, end_s=4.0, first=240, n=240, intensity=None, rhythm=None):
        segments = Segments(*(np.array([v]) for v in (start_s, end_s, first, n)), np.zeros(1))
        whole = stepping(0, 600) if rhythm is None else rhythm
        loud = np.ones(600) if intensity is None else intensity
        return LoadedMatches(segments, whole, loud, [matches(*found)], clips)

    return make


def only(found, settings=PLAIN):
    _, (pieces,) = pieces_of(found, BEAT_S, settings)
    return pieces


def test_a_piece_starts_as_far_between_two_frames_of_its_clip_as_its_segment_between_two_of_the_song(song):
    (piece,) = only(song([("a", 55, 60)], {"a": clip()}, start_s=2.004, end_s=4.0))
    assert piece.start_s == pytest.approx(0.5 + 1.1 * 0.004, abs=1e-12)
    assert piece.end_s == pytest.approx(0.5 + 1.1 * 2.0, abs=1e-12)


def test_a_piece_lies_within_its_clip(song):
    (piece,) = only(song([("a", 50, 0)], {"a": clip(240)}, start_s=1.997, end_s=4.0))
    assert (piece.start_s, piece.end_s) == (0.0, 239 / RATE_HZ)


def test_pieces_far_from_their_own_pace_are_kept_back_where_there_are_others(song):
    clips = {"a": clip(), "b": clip()}
    pieces = only(song([("a", 45, 60), ("b", 50, 60)], clips))
    assert [(p.clip_id, p.rank_number, p.is_easy) for p in pieces] == [("b", 2, True)]
    fast = only(song([("a", 55, 60), ("b", 50, 60)], clips))  # a clip shown a tenth faster is easy
    assert [p.clip_id for p in fast] == ["a", "b"]


def test_where_all_are_far_from_their_pace_they_come_nearer_to_it_if_that_costs_little(song):
    lonely = bumps(600, np.array([360.0]), np.ones(1), width_s=0.05).astype(np.float32)
    moving = ClipFeatures(bumps(600, np.array([168.0]), np.ones(1), width_s=0.05), np.ones(600), np.zeros(0))
    found = song([("a", 45, 60)], {"a": moving}, rhythm=lonely)
    (eased,) = only(found)
    assert (eased.end_s - eased.start_s) / 2.0 == pytest.approx(46 / 50)
    assert eased.is_easy
    (kept,) = only(found, MatchPathSettings(other_starts=0, snap_loss_ratio=0.0))
    assert (kept.end_s - kept.start_s) / 2.0 == pytest.approx(45 / 50)
    assert not kept.is_easy  # and is danced all the same, for there is no other


@pytest.mark.parametrize("numerator", [46, 50, 55])
def test_pace_costs_by_its_ratio_whichever_way(song, numerator):
    (piece,) = only(song([("a", numerator, 60)], {"a": clip()}))
    assert piece.warp_cost == pytest.approx(0.1 * (np.log(50 / numerator) / np.log(1.1)) ** 2)


def rising(n):
    return np.repeat(np.arange(1.0, 5.0), n // 4)


def test_a_clip_that_rises_with_the_music_costs_less_than_one_that_falls(song):
    loud = np.concatenate([np.full(240, 2.0), rising(240), np.full(120, 2.0)])
    clips = {"rise": clip(240, effort=rising(240)), "fall": clip(240, effort=rising(240)[::-1])}
    rise, fall = only(song([("rise", 50, 0), ("fall", 50, 0)], clips, intensity=loud))
    assert rise.intensity_cost + 0.5 == pytest.approx(fall.intensity_cost)
    heavy = MatchPathSettings(other_starts=0, intensity_weight=3.0)
    dear = only(song([("rise", 50, 0), ("fall", 50, 0)], clips, intensity=loud), heavy)
    assert [p.intensity_cost for p in dear] == pytest.approx([3 * rise.intensity_cost, 3 * fall.intensity_cost])


def test_equal_curves_of_intensity_cost_nothing(song):
    loud = np.tile(rising(120), 5)
    (piece,) = only(song([("a", 50, 0)], {"a": clip(600, effort=loud)}, intensity=loud))
    assert piece.intensity_cost == pytest.approx(0, abs=1e-12)


def test_intensities_are_compared_within_music_and_within_clips_whatever_their_units(song):
    loud = np.tile(rising(120), 5)
    (piece,) = only(song([("a", 50, 0)], {"a": clip(600, effort=loud / 64)}, intensity=loud))
    assert piece.intensity_cost == pytest.approx(0, abs=1e-12)


def test_a_start_near_a_beat_of_the_clip_is_brought_to_it(song):
    (piece,) = only(song([("a", 50, 60)], {"a": clip(first_frame=2, beat_s=[62 / RATE_HZ])}))
    assert piece.is_snapped
    assert piece.start_s == pytest.approx(62 / RATE_HZ)
    (piece,) = only(song([("a", 50, 60)], {"a": clip(beat_s=[90 / RATE_HZ])}))
    assert not piece.is_snapped
    assert piece.start_s == pytest.approx(0.5)


def test_weights_multiply_costs_and_their_sum_counts(song):
    weighed = MatchPathSettings(other_starts=0, match_weight=3.0, intensity_weight=0.0)
    found = song([("a", 55, 60)], {"a": clip()})
    (plain,), (heavy,) = only(found), only(found, weighed)
    assert plain.match_cost == pytest.approx(0.25)  # the only one: no rank, half of what lacks
    assert heavy.match_cost == pytest.approx(0.75)
    assert heavy.intensity_cost == 0
    assert heavy.cost == heavy.match_cost + heavy.warp_cost


def test_a_segment_without_a_match_is_cut_at_beats_for_the_longest_clip(song):
    clips = {"long": clip(181), "short": clip(121), "shortest": clip(61)}  # 1.5, 1 and 0.5 s
    found = song([], clips, start_s=0.0, end_s=4.0, first=0, n=480)
    edges, spans = pieces_of(found, BEAT_S, PLAIN)
    np.testing.assert_allclose(edges, [0, 1.5, 3.0, 4.0])
    assert [[p.clip_id for p in span] for span in spans] == [["long"], ["long"], ["long", "short"]]
    assert all(p.start_s == 0 and p.rank_number == 0 and p.is_easy and p.warp_cost == 0 for s in spans for p in s)
    assert [p.end_s for p in spans[2]] == pytest.approx([1.0, 1.0])


def test_what_fills_a_segment_costs_as_the_worst_match(song):
    settings = MatchPathSettings(match_weight=0.7, intensity_weight=0.3)
    _, spans = pieces_of(song([], {"a": clip()}), BEAT_S, settings)
    assert [(p.match_cost, p.intensity_cost) for p in spans[0]] == [(0.7, 0.3)]


def test_pieces_that_show_what_is_to_be_avoided_are_left_out_but_never_all():
    pieces = [MatchPiece(name, start_s, start_s + 2, 1, cost, 0.0, 0.0) for name, start_s, cost in PIECES]
    span = AvoidedSpan("a", 2.5, 2.6)
    assert without_touched(pieces, [span], blend_s=0.4) == [pieces[1], pieces[3]]
    assert without_touched(pieces, [span], blend_s=0.0) == [pieces[1], pieces[2], pieces[3]]
    both = [span, AvoidedSpan("a", 7.0, 7.0), AvoidedSpan("b", 0.0, 9.0)]
    assert without_touched(pieces, both, blend_s=0.4) == [pieces[2]]  # the cheapest stays
    assert without_touched(pieces, [], blend_s=0.4) == pieces


PIECES = [("a", 1.0, 0.5), ("a", 6.0, 0.7), ("a", 2.75, 0.1), ("b", 1.0, 0.9)]


def fenced(n_frames, *frames):
    """Make a clip of which some frames are never shown."""
    is_fenced = np.zeros(n_frames, bool)
    is_fenced[list(frames)] = True
    return replace(clip(n_frames), is_fenced=is_fenced)


def test_a_piece_of_which_something_is_fenced_is_left_out_where_there_are_others(song):
    found = song([("a", 50, 60), ("b", 50, 60)], {"a": fenced(600, 200), "b": fenced(600, 400)})
    assert [p.clip_id for p in only(found)] == ["b"]


def test_where_all_pieces_hold_something_fenced_the_longest_stretch_beside_it_is_danced(song):
    alone = song([("a", 50, 60)], {"a": fenced(600, 200)})
    (piece,) = only(alone)
    assert (piece.start_s, piece.rank_number) == (201 / RATE_HZ, 0)


def test_half_a_blend_is_kept_between_a_piece_and_a_fence(song):
    found = song([("a", 50, 60)], {"a": fenced(600, 40)})  # shown from 0.5 to 2.5 s, fenced at 0.33 s
    _, (near,) = pieces_of(found, BEAT_S, PLAIN, blend_s=0.2)
    assert near[0].rank_number == 1
    _, (far,) = pieces_of(found, BEAT_S, PLAIN, blend_s=0.6)
    assert (far[0].rank_number, far[0].start_s) == (0, pytest.approx(41 / RATE_HZ + 0.3))


def test_where_nothing_matches_the_longest_stretch_that_may_be_shown_is_danced(song):
    found = song([], {"a": fenced(600, 200), "b": fenced(600, 10)}, start_s=0.0, end_s=4.0)
    edges, every = pieces_of(found, BEAT_S, PLAIN)
    assert edges[-1] == 4.0
    for pieces in every:
        assert all(not found.clips[p.clip_id].is_fenced[int(p.start_s * RATE_HZ) :][:2].any() for p in pieces)
    assert {p.start_s for pieces in every for p in pieces if p.clip_id == "b"} == {11 / RATE_HZ}


def test_the_longest_stretch_is_the_first_of_equals_and_none_where_all_is_fenced():
    assert fenced(601, 300).stretch_s() == (0.0, 299 / RATE_HZ)
    assert fenced(600, *range(600)).stretch_s() == (0.0, 0.0)
    assert fenced(600, *range(0, 600, 5)).stretch_s(apart_s=0.2) == (0.0, 0.0)
    assert clip(601).stretch_s(apart_s=0.2) == (0.0, 5.0)
