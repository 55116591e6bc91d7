"""Motions of a clip from its canonical poses, a jump at its ends left out."""

from dataclasses import fields

import numpy as np

from assets.reading.motion_cuts import cut
from assets.tables.motion import from_canonical_pose
from kernels.skeleton import kinematics
from kernels.skeleton.contacts import FootContacts
from kernels.skeleton.retarget import CanonicalMotion
from kernels.synthetic.hidden_rules import hidden_rules, perform
from schemas.settings import BasicMotionSettings


def rows(clip, is_fenced=None):
    position, _ = kinematics.place(clip)
    still = FootContacts(*(np.zeros(0) for _ in fields(FootContacts)))
    motion = CanonicalMotion(clip.root_xyz_m, clip.rotation_wxyz, position, 1.0, still)
    return from_canonical_pose("a-x", clip.frame_rate_hz, motion, is_fenced)


def test_motions_of_a_performance():
    made = perform(hidden_rules(), n_motions=12, seed=1)
    found = cut(rows(made.clip), BasicMotionSettings())
    assert found.clip_id == "a-x"
    assert found.vectors.shape == (12, 198)
    assert np.abs(found.motions.start_s - made.edge_s[:-1]).max() < 0.05
    assert found.motions.end_s[-1] <= made.clip.duration_s


def test_settings_bound_lengths():
    made = perform(hidden_rules(), n_motions=12, seed=1)
    long = cut(rows(made.clip), BasicMotionSettings(shortest_s=0.8, longest_s=2.0)).motions
    assert (long.end_s - long.start_s).min() >= 0.79


def test_a_motion_that_touches_a_fenced_frame_is_none():
    made = perform(hidden_rules(), n_motions=6, seed=1)
    whole = cut(rows(made.clip), BasicMotionSettings())
    middle = round((whole.motions.start_s[2] + whole.motions.end_s[2]) / 2 * made.clip.frame_rate_hz)
    is_fenced = np.arange(made.clip.n_frames) == middle
    found = cut(rows(made.clip, is_fenced), BasicMotionSettings())
    np.testing.assert_array_equal(found.motions.start_s, np.delete(whole.motions.start_s, 2))
    np.testing.assert_array_equal(found.vectors, np.delete(whole.vectors, 2, axis=0))
