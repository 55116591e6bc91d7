"""Poses of clips on the beats of a song, at its very start and end, and as a finished dance shows them."""

import numpy as np
import polars as pl
import pytest

from assets.dancing.pose_pins import ClipPoses, moment_of, shown_pose, to_pose_pins
from assets.dancing.wishes import DirectionError
from assets.reading.songs import PlayedSong
from assets.tables.motion import CanonicalClip, from_canonical_pose
from kernels.graph.costs import PathCosts
from kernels.graph.nodes import beat_nodes
from kernels.graph.path import STEPS, find_path
from kernels.graph.pin_conflicts import Reach, admitted, step_price
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.kinematics import forward
from kernels.types import BeatGrid, MotionGraph
from schemas.pins import parse_pin

RATE_HZ, N_FRAMES = 30.0, 151
NOTHING_FENCED = np.zeros(N_FRAMES, bool)
ONE, TWO, HALF = (STEPS.index(step) for step in ((1, 1), (2, 1), (1, 2)))


def swinging(amplitude_rad, turns_hz):
    """A body on the spot whose arms swing: five seconds."""
    time_s = np.arange(N_FRAMES) / RATE_HZ
    half = amplitude_rad * np.sin(2 * np.pi * turns_hz * time_s) / 2
    turned = np.zeros((N_FRAMES, len(JOINTS), 4))
    turned[..., 0] = 1.0
    for name in ("leftUpperArm", "rightUpperArm"):
        turned[:, JOINTS.index(name), 0], turned[:, JOINTS.index(name), 3] = np.cos(half), np.sin(half)
    root = np.tile([0.0, 0.9, 0.0], (N_FRAMES, 1))
    return root, turned, forward(CANONICAL, root, turned)[0]


CLIPS = {"day-a": (1.2, 0.31), "day-b": (1.2, 0.23), "day-c": (0.02, 0.5)}


@pytest.fixture(scope="module")
def poses(in_memory):
    rows = {}
    for name, how in CLIPS.items():
        rows[name] = from_canonical_pose(name, RATE_HZ, CanonicalClip(name, RATE_HZ, *swinging(*how), NOTHING_FENCED))
    return ClipPoses(in_memory(rows))


@pytest.fixture(scope="module")
def graph():
    """Clips a and b, a beat every half second from 0.2 s; c has poses, and no beats. All ways from one to the other."""
    nodes = beat_nodes([0.2 + 0.5 * np.arange(10)] * 2, [5.0] * 2)
    pairs = [(s, t) for s in range(1, 20) for t in range(19) if s // 10 != t // 10 and t % 10 < 9]
    source, target = np.array(pairs).T
    return MotionGraph(nodes.clip_index, nodes.time_s, nodes.next_node, source, target, np.full(len(pairs), 0.5))


NAMES = ("day-a", "day-b")


def song_of(first_s, duration_s=4.0):
    """Beats every half second; the grid begins a beat before the first where that is after 0."""
    time_s = np.arange(first_s, duration_s + 0.5, 0.5)
    grid_s = np.append(first_s - 0.5, time_s) if first_s > 0 else time_s
    number = np.arange(len(time_s))
    return PlayedSong(grid_s, BeatGrid(time_s, number // 4 + 1, number % 4 + 1, np.ones(len(time_s))), duration_s)


def pins(text, song, graph, poses, weight=1.0):
    wish = parse_pin(text)
    return to_pose_pins([wish], song, graph, NAMES, poses, weight=weight)[wish.text]


def test_the_pose_itself_is_free_and_others_pay_by_their_distance(graph, poses):
    song = song_of(0.0)
    pin = pins("2=pose:day-a@1.7", song, graph, poses)
    assert (pin.first, pin.last) == (4, 5)
    price = pin.steps[4, ONE]
    assert price[3] == pytest.approx(0.0, abs=1e-9)  # the beat at 1.7 s
    near = np.flatnonzero(np.isfinite(price))
    assert 1 < len(near) < 20
    assert (price[near] < 0.5).all()
    assert np.isinf(pin.steps[3, HALF]).all()
    dearer = pins("2=pose:day-a@1.7", song, graph, poses, weight=3.0).steps[4, ONE]
    np.testing.assert_allclose(dearer[near], 3 * price[near])


@pytest.mark.parametrize(("wished_s", "beat_s"), [(1.8, 1.7), (1.99, 2.2), (0.0, 0.2)])
def test_between_beats_the_nearest_of_its_own_clip_is_admitted(graph, poses, wished_s, beat_s):
    price = pins(f"2=pose:day-a@{wished_s}", song_of(0.0), graph, ClipPoses(poses.stored, 1e-9)).steps[4, ONE]
    assert graph.time_s[np.flatnonzero(np.isfinite(price))].tolist() == pytest.approx([beat_s])


def test_where_nothing_is_near_the_nearest_are_admitted(graph, poses):
    price = pins("2=pose:day-c@1.0", song_of(0.0), graph, ClipPoses(poses.stored, 1e-9)).steps[4, ONE]
    assert np.isfinite(price).sum() == 20


@pytest.mark.parametrize(
    ("place", "at_s"), [("start", 0.0), ("end", 4.0), ("1.6", 1.5), ("beat:3", 1.0), ("bar:2", 2.0)]
)
def test_moments(place, at_s):
    assert moment_of(parse_pin(f"{place}=pose:day-a@1"), song_of(0.0)) == at_s


def test_the_first_and_the_last_frame_lie_between_beats(graph, poses):
    """The song's first beat is at 0.2 s: the dance begins three fifths into a step, and ends two fifths... into one."""
    song = song_of(0.2)
    start = pins("start=pose:day-a@2.0", song, graph, poses, weight=1.0)
    assert set(start.steps) == {(0, ONE), (0, TWO), (0, HALF)}
    # 0.3 of the 0.5 s from the beat at 1.7 are over when the song begins
    assert start.steps[0, ONE][3] == pytest.approx(0.0, abs=1e-9)
    assert start.steps[0, HALF][3] > 0
    end = pins("end=pose:day-b@1.0", song, graph, poses)
    last = len(song.grid_s) - 1
    assert set(end.steps) == {(last - 1, ONE), (last - 1, TWO), (last - 2, HALF)}
    part = (4.0 - song.grid_s[-2]) / 0.5
    shown = graph.time_s + part * 0.5
    best = int(np.nanargmin(np.where(graph.clip_index == 1, np.abs(shown - 1.0), np.nan)))
    assert np.isfinite(end.steps[last - 1, ONE][best])


def test_a_dance_keeps_them_and_shows_them(graph, poses):
    song = song_of(0.0)
    texts = ("start=pose:day-a@0.7", "2=pose:day-b@1.7", "end=pose:day-a@4.2")
    wishes = [parse_pin(text) for text in texts]
    made = [to_pose_pins(wishes, song, graph, NAMES, poses, weight=9.0)[text] for text in texts]
    reach = Reach(graph, song.grid_s, costs=PathCosts(), starts=np.arange(20))
    assert reach.keeps(made)
    path = find_path(
        graph,
        song.grid_s,
        starts="any",
        admissible=admitted(made, len(song.grid_s) - 1, 20),
        step_price=step_price(made),
    )
    begin = {int(k): int(u) for k, u in zip(path.beat_index, path.source_node, strict=True)}
    assert (begin[0], begin[4], int(path.end_node[-1])) == (1, 13, 8)
    assert path.wish_cost.sum() == pytest.approx(0.0, abs=1e-9)


def test_what_is_not_there(graph, poses):
    unknown = pins("2=pose:day-z@1", song_of(0.0), graph, poses)
    assert not unknown.nodes.any()
    with pytest.raises(DirectionError, match=r"2=pose:day-a@9: want a moment of day-a, 0 to 5\.00 s, got 9"):
        pins("2=pose:day-a@9", song_of(0.0), graph, poses)
    with pytest.raises(DirectionError, match="seconds within the song"):
        pins("99=pose:day-a@1", song_of(0.0), graph, poses)
    assert to_pose_pins([parse_pin("2=spin")], song_of(0.0), graph, NAMES, poses, weight=1.0) == {}


def test_a_pin_moved_is_the_pin_on_another_beat(graph, poses):
    song = song_of(0.2)
    moved = pins("start=pose:day-a@2.0", song, graph, poses).moved(3)
    there = pins(f"{song.grid_s[3]:.2f}=pose:day-a@2.0", song, graph, poses)
    assert (moved.first, moved.last) == (there.first, there.last)
    assert set(moved.steps) == set(there.steps)
    for place, price in moved.steps.items():
        np.testing.assert_allclose(price, there.steps[place])


def lineage(clip, clip_time_s, mirrored=False):
    """One frame at 2 s of the song that shows a moment of a clip."""
    return pl.DataFrame(
        {
            "time_s": [2.0],
            "clip_id": [clip],
            "clip_time_s": [clip_time_s],
            "is_mirrored": [mirrored],
            "warp_ratio": [1.0],
        }
    )


@pytest.mark.parametrize(
    ("clip", "at_s", "is_kept"), [("day-a", 1.7, True), ("day-a", 1.75, True), ("day-b", 4.2, False)]
)
def test_told_of_a_finished_dance(graph, poses, clip, at_s, is_kept):
    """Kept where the frame shows the clip's own moment or one as near; with the distance of the finished joints."""
    nodes = pl.DataFrame(
        {
            "clip_id": [NAMES[c] for c in graph.clip_index],
            "time_s": graph.time_s,
            "is_mirrored": [False] * 20,
            "is_kept": [True] * 20,
        }
    )
    shown = CanonicalClip("dance", RATE_HZ, *swinging(*CLIPS[clip]), NOTHING_FENCED)
    shift = round((at_s - 2.0) * RATE_HZ)
    frame = np.clip(np.arange(N_FRAMES) + shift, 0, N_FRAMES - 1)
    dance = CanonicalClip(
        "dance",
        RATE_HZ,
        shown.root_xyz_m[frame],
        shown.rotation_wxyz[frame],
        shown.position_xyz_m[frame],
        NOTHING_FENCED,
    )
    wish = parse_pin("2=pose:day-a@1.7")
    told = shown_pose(wish, 2.0, lineage(clip, at_s), dance, ClipPoses(poses.stored, 0.3), nodes)
    assert told["is_kept"] is is_kept
    assert (told["shown_clip_id"], told["at_s"], told["is_mirrored"]) == (clip, 2.0, False)
    assert told["shown_time_s"] == pytest.approx(at_s)
    if (clip, at_s) == ("day-a", 1.7):
        assert told["distance_m"] == pytest.approx(0.0, abs=1e-6)
    else:
        assert told["distance_m"] > 0.005


@pytest.mark.parametrize(("at_s", "is_kept"), [(1.2, True), (0.8, False)])
def test_of_a_clip_without_beats_what_is_no_further_than_the_twentieth_nearest_beat_is_kept(
    graph, poses, at_s, is_kept
):
    """Clip c stands almost still: the arms of a are further up between its beats than on any of them."""
    nodes = pl.DataFrame(
        {
            "clip_id": [NAMES[c] for c in graph.clip_index],
            "time_s": graph.time_s,
            "is_mirrored": [False] * 20,
            "is_kept": [True] * 20,
        }
    )
    dance = CanonicalClip("dance", RATE_HZ, *swinging(*CLIPS["day-a"]), NOTHING_FENCED)
    wish = parse_pin("2=pose:day-c@1.0")
    told = shown_pose(wish, 2.0, lineage("day-a", at_s), dance, ClipPoses(poses.stored, 1e-9), nodes)
    assert told["is_kept"] is is_kept


def test_a_moment_that_is_never_shown_is_no_wish(in_memory):
    is_fenced = np.zeros(N_FRAMES, bool)
    is_fenced[30:36] = True
    made = CanonicalClip("day-a", RATE_HZ, *swinging(*CLIPS["day-a"]), is_fenced)
    poses = ClipPoses(in_memory({"day-a": from_canonical_pose("day-a", RATE_HZ, made, is_fenced)}))
    with pytest.raises(DirectionError, match=r"day-a is never shown at 1.1 s, .*; 1.20 s is the nearest that is"):
        poses.wanted(parse_pin("2=pose:day-a@1.1"))
    assert poses.wanted(parse_pin("2=pose:day-a@1.2")) is not None
