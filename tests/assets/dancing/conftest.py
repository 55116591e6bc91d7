"""Poses as they lie in the lake, without a lake."""

from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pytest

from assets.stamps import ClipStamp, Stamp
from assets.tables.motion import CanonicalClip, from_canonical_pose
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.kinematics import forward


@dataclass(frozen=True)
class _InMemory:
    """Canonical poses of one session, by clip."""

    rows: dict[str, pa.Table]

    @property
    def keys(self):
        return ["day"]

    def read(self, key="", *, clip_ids=None):
        return pa.concat_tables([rows for clip, rows in self.rows.items() if clip_ids is None or clip in clip_ids])

    def stamp(self, key=""):
        return Stamp("1", "", {}, "", {clip: ClipStamp("", "") for clip in self.rows})


@pytest.fixture(scope="session")
def in_memory():
    """Hold the poses of clips, tables by name, as the lake would."""
    return _InMemory


@pytest.fixture(scope="session")
def stored_poses():
    """Store clips whose left arm is raised to given angles, by name: (F,) radians, or with the hips' way (F, 3)."""

    def make(frame_rate_hz, **arms):
        rows = {}
        for name, given in arms.items():
            arm_rad, way = given if isinstance(given, tuple) else (given, np.zeros((len(given), 3)))
            turned = np.zeros((len(arm_rad), len(JOINTS), 4))
            turned[..., 0] = 1.0
            arm = JOINTS.index("leftUpperArm")
            turned[:, arm, 0], turned[:, arm, 3] = np.cos(arm_rad / 2), np.sin(arm_rad / 2)
            root = np.array([0.0, 0.94, 0.0]) + way
            clip = CanonicalClip(
                name, frame_rate_hz, root, turned, forward(CANONICAL, root, turned)[0], np.zeros(len(root), bool)
            )
            rows[name] = from_canonical_pose(name, frame_rate_hz, clip)
        return _InMemory(rows)

    return make
