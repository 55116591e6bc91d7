import numpy as np
import pytest

from kernels.matching.score import (
    SCALES,
    Match,
    merge_matches,
    numerators,
    reference_matches,
    similarity,
    start_count,
    sums,
    sums_of_candidates,
)


def test_half_the_harmonic_mean():
    np.testing.assert_array_equal(
        similarity(np.array([1.0, 2.0, 0.0, 3.0]), np.array([1.0, 6.0, 0.0, 0.0])), [0.5, 1.5, 0, 0]
    )


def test_scores_by_hand():
    # scale 1.1 reads frames 0, 1.1, 2.2
    segment, clip = np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 4.0, 0.0])
    b = np.array([1.0, 0.9 * 2 + 0.1 * 4, 0.8 * 4])
    score, motion_sum = sums(segment, clip, numerator=55, starts=np.array([0]))
    np.testing.assert_allclose(score, [(segment * b / (segment + b)).sum()], rtol=1e-15)
    np.testing.assert_allclose(motion_sum, [b.sum()], rtol=1e-15)


def test_starts_are_counted_in_integers():
    for numerator in range(45, 56):
        for n_segment in (1, 2, 51, 101, 360):
            for n_clip in (0, 1, 50, 90, 91, 110, 111, 400):
                fitting = [f0 for f0 in range(n_clip) if numerator * (n_segment - 1) + 50 * f0 <= 50 * (n_clip - 1)]
                assert start_count(n_segment, n_clip, numerator) == len(fitting)


def test_a_segment_cut_from_a_clip_is_found():
    rng = np.random.default_rng(3)
    clips = [rng.random(200) for _ in range(4)]
    (best, second), *_ = reference_matches([clips[2][31:131]], clips, k=2)
    assert (best.clip_index, best.scale_index, best.start_frame_index, best.rank_number) == (2, 5, 31, 1)
    assert best.music_ratio == pytest.approx(1)
    assert best.mutual_ratio == pytest.approx(1)
    assert second.score < best.score
    assert second.rank_number == 2


def test_scores_scale_with_both_features():
    rng = np.random.default_rng(0)
    clips, segment = [rng.random(60) for _ in range(3)], rng.random(30)
    one, four = (reference_matches([s * segment], [s * c for c in clips], k=3)[0] for s in (1.0, 4.0))
    for a, b in zip(one, four, strict=True):
        assert (a.clip_index, a.scale_index, a.start_frame_index) == (b.clip_index, b.scale_index, b.start_frame_index)
        assert b.score == 4 * a.score
        assert b.mutual_ratio == a.mutual_ratio


def test_equal_scores_go_by_clip_scale_and_start():
    constant = [np.ones(80) for _ in range(3)]
    found = reference_matches([np.ones(40), np.zeros(40)], constant, k=2)
    for matches in found:
        assert [(m.clip_index, m.scale_index, m.start_frame_index) for m in matches] == [(0, 0, 0), (1, 0, 0)]
    assert found[0][0].score == 20
    assert found[1][0].music_ratio == 0
    assert found[1][0].score == 0


def test_short_clips_are_candidates_only_where_they_fit():
    segment = np.ones(101)
    clips = [np.ones(90), np.ones(91), np.zeros(0), np.ones(1)]
    (matches,) = reference_matches([segment], clips, k=9)
    assert [(m.clip_index, m.scale_index) for m in matches] == [(1, 0)]
    (one_frame,) = reference_matches([np.ones(1)], clips, k=9)
    assert [m.clip_index for m in one_frame] == [0, 1, 3]


def test_ratios_of_two_silences_are_zero():
    ((match,),) = reference_matches([np.zeros(5)], [np.zeros(9)], k=1)
    assert (match.score, match.music_ratio, match.mutual_ratio) == (0, 0, 0)


@pytest.mark.parametrize(("bad", "words"), [(np.nan, "not finite"), (np.inf, "not finite"), (-1.0, "negative")])
def test_features_no_score_is_defined_for_are_refused_by_name(bad, words):
    good, wrong = np.ones(9), np.array([1.0, bad, 1.0])
    with pytest.raises(ValueError, match=f"segment 1: .*{words}"):
        reference_matches([good, wrong], [good], k=1)
    with pytest.raises(ValueError, match=f"clip 2: .*{words}"):
        reference_matches([good], [good, good, wrong], k=1)


def test_what_cannot_be_asked():
    good = [np.ones(9)]
    with pytest.raises(ValueError, match="k: want >= 1"):
        reference_matches(good, good, k=0)
    with pytest.raises(ValueError, match="segment 0: want"):
        reference_matches([np.zeros(0)], good, k=1)
    with pytest.raises(ValueError, match="clip 0: want"):
        reference_matches(good, [np.ones((2, 2))], k=1)
    for scales in ((), (0.905,), (1.0, 0.9), (0.0,), (1.0, 1.0)):
        with pytest.raises(ValueError, match="scales: want"):
            reference_matches(good, good, k=1, scales=scales)


def test_scales_are_fiftieths():
    assert numerators(SCALES) == tuple(range(45, 56))


def test_parts_of_a_catalogue_merge_to_the_whole():
    rng = np.random.default_rng(1)
    clips = [rng.random(50) for _ in range(9)]
    clips[7] = clips[1]  # a tie across parts
    segments = [rng.random(20), rng.random(30)]
    whole = reference_matches(segments, clips, k=4)
    parts = []
    for first in (0, 3, 6):
        part = reference_matches(segments, clips[first : first + 3], k=4)
        parts.append([[Match(**{**vars(m), "clip_index": m.clip_index + first}) for m in matches] for matches in part])
    assert merge_matches(parts, k=4) == whole
    assert merge_matches(parts[::-1], k=4) == whole
    assert merge_matches([], k=1) == []
    with pytest.raises(ValueError, match="one number of segments"):
        merge_matches([whole, whole[:1]], k=1)
    with pytest.raises(ValueError, match="k: want"):
        merge_matches(parts, k=0)


def test_candidates_of_many_segments_score_as_each_alone_to_the_bit():
    rng = np.random.default_rng(5)
    clip, lengths = rng.random(40), np.array([9, 6])
    segments = np.zeros((2, 9))
    for row, n in enumerate(lengths):
        segments[row, :n] = rng.random(n)
    segment, numerator, first = np.array([0, 1, 1, 0]), np.array([45, 50, 55, 55]), np.array([0, 34, 3, 30])
    score, motion_sum = sums_of_candidates(
        segments, clip, n_frames=lengths, segment=segment, first=first, numerator=numerator
    )
    for k in range(4):
        alone = sums(
            segments[segment[k], : lengths[segment[k]]], clip, numerator=int(numerator[k]), starts=first[k : k + 1]
        )
        assert (score[k], motion_sum[k]) == (alone[0][0], alone[1][0])
