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


def rows(clip):
    position, _ = kinematics.place(clip)
    still = FootContacts(*(np.zeros(0) for _ in fields(FootContacts)))
    motion = CanonicalMotion(clip.root_xyz_m, clip.rotation_wxyz, position, 1.0, still)
    return from_canonical_pose("a-x", clip.frame_rate_hz, motion)


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
