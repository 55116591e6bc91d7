"""What a segment of a song may be danced with, and what each choice costs."""

import numpy as np
import pytest

from assets.dancing.by_matching import by_matching, directions_of
from assets.dancing.match_pieces import LoadedMatches, places_of
from assets.dancing.refusal import RefusalError
from assets.tables.matching import StoredMatches
from kernels.matching.piece_joints import joints_of
from kernels.matching.price import ClipFeatures, MatchPiece
from kernels.motion.motion_features import bumps, link_weights
from kernels.music.segments import Segments
from kernels.skeleton.canonical import CANONICAL, JOINTS
from schemas.settings import MatchPathSettings, Settings

PART = bumps(240, np.array([0.0, 60, 120, 180]), np.ones(4), width_s=0.05).astype(np.float32)
STEPS = bumps(600, 60.0 * np.arange(10), np.ones(10), width_s=0.05).astype(np.float32)
CLIPS = {name: ClipFeatures(STEPS, np.ones(600), np.zeros(0)) for name in ("a", "b")}


def matches(score, mutual):
    n = len(score)
    return StoredMatches(
        ("a", "b")[:n], np.full(n, 50), np.zeros(n, np.int64), np.array(score), np.ones(n), np.array(mutual)
    )


def test_other_starts_stand_beside_their_match():
    score = float(PART.sum()) / 2
    places = places_of(matches([score, score], [1.0, 1.0]), PART, CLIPS, most=3)
    assert [(p.clip_id, p.rank_number) for p in places] == [("a", 1), ("b", 2), *[("a", 1)] * 3, *[("b", 2)] * 3]
    assert all(p.start_frame_index % 60 in (0, 1, 58, 59) and p.numerator == 50 for p in places)
    assert len({(p.clip_id, p.start_frame_index) for p in places}) == len(places)
    assert all(0 <= p.cost <= 1 for p in places)
    assert [p.start_frame_index for p in places_of(matches([score], [1.0]), PART, CLIPS, most=0)] == [0]


def test_nothing_stands_beside_a_match_with_silence():
    assert len(places_of(matches([0.0, 0.0], [0.0, 0.0]), np.zeros_like(PART), CLIPS, most=4)) == 2


RATE_HZ = 30.0
STILL = np.zeros(121)  # 4 s
TURN = np.linspace(0, 2.0, 121)  # half a radian a second


def piece(clip, start_s, end_s):
    return MatchPiece(clip, start_s, end_s, 1, 0.0, 0.0, 0.0)


def joint(poses, before, after, *, span_s=(2.0, 2.0), blend_s=0.4, weight=0.5):
    """What lies between one piece of the first span and one of the second."""
    spans = np.cumsum(np.append(0.0, span_s))
    clips = directions_of(poses, {before.clip_id, after.clip_id})
    limits, (one,) = joints_of([[before], [after]], spans, clips, blend_s=blend_s, seam_weight=weight)
    return limits, one.cost[0, 0], one.is_connected[0, 0]


@pytest.mark.parametrize(
    ("before", "after", "cost"),
    [
        ((1.0, 3.0), (1.0, 3.0), 0.0),
        ((1.8, 3.8), (1.0, 3.0), 0.0),  # just half a blend is left
        ((1.9, 3.9), (1.0, 3.0), 0.25),  # half of that is left
        ((2.0, 4.0), (1.0, 3.0), 0.5),  # none is
        ((1.0, 3.0), (0.2, 2.2), 0.0),
        ((1.0, 3.0), (0.1, 2.1), 0.25),
        ((2.0, 4.0), (0.0, 2.0), 1.0),
    ],
)
def test_a_blend_that_reaches_past_an_end_of_its_clip_costs(stored_poses, before, after, cost):
    poses = stored_poses(RATE_HZ, a=STILL)
    _, found, _ = joint(poses, piece("a", *before), piece("a", *after))
    assert found == pytest.approx(cost)


def test_a_slow_clip_needs_less_room_for_a_blend(stored_poses):
    poses = stored_poses(RATE_HZ, a=STILL)
    _, cost, _ = joint(poses, piece("a", 2.95, 3.95), piece("a", 1.0, 3.0))  # at half its pace: 0.1 s
    assert cost == pytest.approx(0.25)


def test_without_a_blend_no_room_is_needed(stored_poses):
    poses = stored_poses(RATE_HZ, a=STILL)
    assert joint(poses, piece("a", 2.0, 4.0), piece("a", 0.0, 2.0), blend_s=0.0)[1] == 0


def test_a_pose_that_no_body_moves_to_is_not_blended_over(stored_poses):
    way = np.zeros((121, 3))
    way[0] = [3.0, 0, 0]  # a pose elsewhere before the take
    poses = stored_poses(RATE_HZ, a=(STILL, way))
    _, cost, _ = joint(poses, piece("a", 1.0, 3.0), piece("a", 0.2, 2.2))
    assert cost == pytest.approx(0.5 / 30 / 0.2)


def test_a_seam_costs_how_unlike_poses_and_velocities_are_by_the_limits(stored_poses):
    poses = stored_poses(RATE_HZ, a=TURN, b=STILL)
    limits, cost, _ = joint(poses, piece("a", 1.0, 3.0), piece("b", 1.0, 3.0))
    _, other, _ = joint(poses, piece("a", 1.0, 3.0), piece("b", 1.0, 3.0), weight=1.0)
    assert cost > 0
    assert other == pytest.approx(2 * cost)
    # the end of a at its own pace, half a radian a second, and at half of it
    pose, speed = one_link(1.5), one_link(0.5)
    assert cost == pytest.approx(0.5 * (pose / limits.pose_rad + speed / limits.speed_rad_per_s) / 2, rel=0.02)
    _, slow, _ = joint(poses, piece("a", 2.0, 3.0), piece("b", 1.0, 3.0))
    half = 0.5 * (pose / limits.pose_rad + speed / 2 / limits.speed_rad_per_s) / 2
    assert slow == pytest.approx(half, rel=0.02)


def one_link(size):
    """What a turn of the left arm by so much is in the mean over links: both of its links have its direction."""
    weight = link_weights(CANONICAL.offset_xyz_m, CANONICAL.parent)
    return size * weight[[JOINTS.index(f"left{part}") - 1 for part in ("LowerArm", "Hand")]].sum()


def test_poses_beyond_the_limits_do_not_connect_and_near_ones_do(stored_poses):
    poses = stored_poses(RATE_HZ, a=TURN)
    assert joint(poses, piece("a", 1.0, 2.0), piece("a", 2.05, 3.0), span_s=(1.0, 0.95))[2]
    assert not joint(poses, piece("a", 0.3, 1.3), piece("a", 3.0, 3.8), span_s=(1.0, 0.8))[2]


def test_without_a_clip_longer_than_a_frame_there_is_no_dance(stored_poses):
    still = ClipFeatures(np.zeros(1, np.float32), np.zeros(1), np.zeros(0))
    segments = Segments(*(np.array([v]) for v in (0.0, 2.0, 0, 240)), np.zeros(1))
    found = LoadedMatches(segments, STEPS, np.ones(600), [matches([], [])], {"a": still})
    with pytest.raises(RefusalError, match="none is longer than one frame"):
        by_matching(found, stored_poses(RATE_HZ, a=STILL[:1]), np.arange(0, 3, 0.5), Settings())


@pytest.fixture
def two_spans(stored_poses):
    """A song of two segments danced by two clips, and what was chosen for it."""
    segments = Segments(*(np.array(v) for v in ([0.0, 2.0], [2.0, 4.0], [0, 240], [240, 240])), np.zeros(2))
    of_segment = matches([3.0, 2.0], [0.8, 0.6])
    found = LoadedMatches(segments, STEPS, np.ones(600), [of_segment, of_segment], CLIPS)
    poses = stored_poses(RATE_HZ, a=np.tile(STILL, 2), b=np.tile(TURN, 2))
    return by_matching(found, poses, np.arange(0, 4.5, 0.5), Settings(match_path=MatchPathSettings(other_starts=0)))


def test_costs_stand_at_the_first_step_of_their_span_and_sum_to_the_whole(two_spans):
    first = np.isin(np.arange(8), [0, 4])
    for name, values in two_spans.costs.items():
        assert not np.any(values[~first]), name
    assert sum(values.sum() for values in two_spans.costs.values()) == pytest.approx(two_spans.metadata["cost"])
    assert (two_spans.costs["match_cost"][first] > 0).all()


def one_place(*found):
    """Matches of one segment: (clip, first frame, score, mutual ratio) each, at their own pace."""
    clip, start, score, mutual = zip(*found, strict=True)
    n = len(found)
    at = np.array(start, np.int64)
    return StoredMatches(clip, np.full(n, 50), at, np.array(score), np.ones(n), np.array(mutual))


@pytest.mark.parametrize(("price", "clips"), [(0.0, {"a"}), (0.01, {"a", "b"}), (5.0, {"a"})])
def test_poses_connect_before_anything_else_unless_a_seam_has_a_price(stored_poses, price, clips):
    """The second segment's better match does not connect; its worse one goes on in the first one's clip."""
    segments = Segments(*(np.array(v) for v in ([0.0, 2.0], [2.0, 4.0], [0, 240], [240, 240])), np.zeros(2))
    found = LoadedMatches(
        segments,
        STEPS,
        np.ones(600),
        [one_place(("a", 0, 3.0, 0.8)), one_place(("b", 0, 3.0, 0.8), ("a", 240, 2.0, 0.2))],
        CLIPS,
    )
    poses = stored_poses(RATE_HZ, a=np.tile(STILL, 2), b=1.0 + np.tile(TURN, 2))
    weights = MatchPathSettings(other_starts=0, seam_weight=0.0, unconnected_cost=price)
    danced = by_matching(found, poses, np.arange(0, 4.5, 0.5), Settings(match_path=weights))
    assert set(danced.steps.clip_id) == clips
    assert danced.metadata["seams_beyond_thresholds"] == len(clips) - 1


def test_a_segment_that_is_licensed_to_no_clip_is_danced_by_others(stored_poses):
    segments = Segments(*(np.array(v) for v in ([0.0, 2.0], [2.0, 4.0], [0, 240], [240, 240])), np.zeros(2))
    none = StoredMatches((), *(np.zeros(0, np.int64) for _ in range(2)), *(np.zeros(0) for _ in range(3)))
    found = LoadedMatches(segments, STEPS, np.ones(600), [one_place(("a", 0, 3.0, 0.8)), none], CLIPS)
    poses = stored_poses(RATE_HZ, a=np.tile(STILL, 2), b=np.tile(STILL, 2))
    danced = by_matching(found, poses, np.arange(0, 4.5, 0.5), Settings())
    assert danced.metadata["spans_without_a_match"] == 1
    assert danced.steps.song_end_s[-1] == 4.0


def test_of_pairs_of_pieces_it_is_told_which_share_connects(stored_poses):
    """One piece before two: the other clip's pose is a radian off, the own clip's goes on."""
    segments = Segments(*(np.array(v) for v in ([0.0, 2.0], [2.0, 4.0], [0, 240], [240, 240])), np.zeros(2))
    of_segment = [one_place(("a", 0, 3.0, 0.8)), one_place(("b", 0, 3.0, 0.8), ("a", 240, 2.0, 0.2))]
    found = LoadedMatches(segments, STEPS, np.ones(600), of_segment, CLIPS)
    poses = stored_poses(RATE_HZ, a=np.tile(STILL, 2), b=1.0 + np.tile(TURN, 2))
    settings = Settings(match_path=MatchPathSettings(other_starts=0))
    assert by_matching(found, poses, np.arange(0, 4.5, 0.5), settings).metadata["share_of_pairs_that_connect"] == 0.5
