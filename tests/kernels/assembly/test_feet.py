"""Planted feet: found through the lineage, held, and nothing else moved."""

import numpy as np
import pytest

from kernels.assembly.blend import Dance, Lineage, assemble
from kernels.assembly.feet import clip_contacts, lock_feet, planted_feet
from kernels.assembly.foot_quality import foot_measures
from kernels.assembly.seam_quality import seam_measures
from kernels.motion.contacts import FootContacts
from kernels.skeleton import grounding, kinematics
from kernels.skeleton.canonical import CANONICAL


@pytest.fixture
def hops(phrases):
    """Five phrases of different clips, sped up and slowed down."""
    return phrases(
        ("step", 1.0, 4, 0.5, 0.46),
        ("twist", 1.0, 4, 0.55, 0.5),
        ("wave", 2.0, 4, 0.5, 0.53),
        ("step", 2.5, 4, 0.5, 0.5),
    )


@pytest.fixture
def dance(hops, clips):
    return assemble(hops, clips, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=float(hops.song_end_s[-1]))


def slide(dance, steps, clips):
    found = {m.name: m.value for m in foot_measures(dance, steps, clips)}
    return found["foot_slide_cm_per_s"], found["source_foot_slide_cm_per_s"]


def test_contacts_come_from_the_clips(dance, hops, clips):
    planted = planted_feet(dance, hops, clips)
    position, _ = kinematics.place(clips["step"])
    own = clip_contacts(clips["step"], position)
    frame = 30
    at = round(dance.lineage.clip_time_s[frame] * clips["step"].frame_rate_hz)
    np.testing.assert_array_equal(planted.toes[frame], own.toes[at])
    np.testing.assert_array_equal(planted.ankle[frame], own.ankle[at])
    assert planted.foot.any()


def test_locked_feet_slide_less(dance, hops, clips):
    planted = planted_feet(dance, hops, clips)
    before, source = slide(dance, hops, clips)
    after, _ = slide(lock_feet(dance, planted), hops, clips)
    assert before > 1.2 * source
    assert after < before / 3
    assert after < source + 0.5


def test_bones_keep_their_lengths_and_seams_stay_smooth(dance, hops, clips):
    locked = lock_feet(dance, planted_feet(dance, hops, clips))
    bone = np.linalg.norm(locked.position_xyz_m[:, 1:] - locked.position_xyz_m[:, CANONICAL.parent[1:]], axis=-1)
    np.testing.assert_allclose(
        bone, np.linalg.norm(CANONICAL.offset_xyz_m[1:], axis=-1)[None].repeat(len(bone), 0), atol=1e-9
    )
    np.testing.assert_allclose(np.linalg.norm(locked.rotation_wxyz, axis=-1), 1, atol=1e-9)
    rough, free = (
        {m.name: m.value for m in seam_measures(made, hops, clips, skeleton=CANONICAL)} for made in (locked, dance)
    )
    assert rough["seam_jerk_ratio"] < 1.1 * free["seam_jerk_ratio"]
    assert rough["seam_jerk_worst_ratio"] < 1.1 * free["seam_jerk_worst_ratio"]
    assert locked.lineage is dance.lineage


def test_a_dragged_foot_is_held():
    """A standing body pushed sideways at 10 cm/s: the planted feet stay behind, as far as creep allows."""
    n, rate = 120, 60.0
    rest = np.tile([1.0, 0.0, 0.0, 0.0], (n, 22, 1))
    root = np.tile(CANONICAL.offset_xyz_m[0], (n, 1))
    root[:, 0] += 0.1 * np.arange(n) / rate
    position, _ = kinematics.forward(CANONICAL, root, rest)
    none = np.zeros(n, int)
    pushed = Dance(
        rate, root, rest, position, Lineage(none, np.arange(n) / rate, none - 1, np.full(n, np.nan), np.zeros(n))
    )
    stands = np.zeros((n, 2), bool)
    stands[30:60] = True
    planted = FootContacts(stands, stands, 0.0, grounding.ANKLE_HEIGHT_M, grounding.TOES_HEIGHT_M)
    held = lock_feet(pushed, planted)
    feet = held.position_xyz_m[30:60][:, grounding.ANKLES]
    assert np.ptp(feet[..., 0], axis=0).max() < 0.012
    assert np.ptp(pushed.position_xyz_m[30:60][:, grounding.ANKLES][..., 0], axis=0).min() > 0.045
    nothing = FootContacts(
        np.zeros_like(stands), np.zeros_like(stands), 0.0, grounding.ANKLE_HEIGHT_M, grounding.TOES_HEIGHT_M
    )
    np.testing.assert_allclose(lock_feet(pushed, nothing).position_xyz_m, position, atol=1e-3)
