"""Steps become poses: at the rate asked for or the setting's, feet locked where the settings say so."""

from dataclasses import replace

import numpy as np
import pytest

from assets.dancing.assembled import assemble_steps
from assets.tables.motion import from_canonical_pose
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.synthetic.dancer import take
from kernels.types import Choreography
from schemas.settings import DanceSettings


@pytest.fixture(scope="module")
def poses(in_memory):
    tables = {}
    for label in ("step", "kick"):
        clip = take(label, n_beats=8, interval_s=0.5).clip
        tables[label] = from_canonical_pose(label, clip.frame_rate_hz, retarget(clip, map_joints(clip.skeleton)))
    return in_memory(tables)


@pytest.fixture
def steps():
    return Choreography(
        ("step", "kick"),
        *(np.array(times) for times in ([0.0, 1.0], [1.0, 2.0], [0.5, 1.0], [1.5, 2.0])),
        has_seam=np.array([False, True]),
        blend_s=np.array([0.0, 0.3]),
    )


def test_the_rate_is_the_one_asked_for_else_the_settings(poses, steps):
    settings = DanceSettings(frame_rate_hz=24)
    assert assemble_steps(steps, poses, settings, frame_rate_hz=60).frame_rate_hz == 60
    for nothing in (None, 0.0):
        dance = assemble_steps(steps, poses, settings, frame_rate_hz=nothing)
        assert dance.frame_rate_hz == 24
        assert len(dance.time_s) == 49


def test_feet_are_locked_where_the_settings_say_so(poses, steps):
    settings = DanceSettings()
    locked = assemble_steps(steps, poses, replace(settings, lock_feet=True))
    loose = assemble_steps(steps, poses, replace(settings, lock_feet=False))
    assert not np.array_equal(locked.position_xyz_m, loose.position_xyz_m)
    assert np.array_equal(locked.time_s, loose.time_s)
