"""A clip's own body in the world: what every part of the examination looks at.

Conventions
-----------
Only joints that are retargeted are looked at: the mapped ones and all above them. *Points* of the feet are both ankles
and, where the rig has them, both toes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kernels import rotation
from kernels.health.verdicts import ClipFault
from kernels.skeleton import canonical, kinematics
from kernels.skeleton.naming import JointMapping
from kernels.types import Clip, Float

SIDES = ("left", "right")

SPIN_REACH_M = 0.12
"""How far beside the points of its feet the axis of a spin may stand, on the canonical body. Chosen by hand: half
a foot's length."""

_SLOWEST_SPIN_RAD_PER_S = np.pi
"""Slower, a turn is none of a spin: half a turn a second. Chosen by hand."""

FARTHEST_M = 1e5
"""From the origin. Chosen by hand: farther away no place has millimetres in single precision, and nobody dances."""


@dataclass(frozen=True, eq=False)
class BodyInMotion:
    """A clip of F >= 1 frames with its body's joints placed.

    Parameters
    ----------
    clip : Clip
    mapping : JointMapping
    """

    clip: Clip
    mapping: JointMapping

    @cached_property
    def at(self) -> dict[str, int]:
        """Index of the rig's joint for each canonical name that has one."""
        return {name: self.clip.skeleton.index(joint) for name, joint in self.mapping.joint.items()}

    @cached_property
    def needed(self) -> list[int]:
        """Joints that move the body: the mapped ones and all above them, in order."""
        needed = {0}
        for joint in self.at.values():
            k = joint
            while k not in needed:
                needed.add(k)
                k = int(self.clip.skeleton.parent[k])
        return sorted(needed)

    @cached_property
    def step_deg(self) -> Float:
        """Turn of each needed joint from frame to frame: axis times angle, (F - 1, N, 3), degrees."""
        turn = self.clip.rotation_wxyz[:, self.needed]
        return np.degrees(rotation.log(rotation.mul(rotation.inv(turn[:-1]), turn[1:])))

    @cached_property
    def step_size_deg(self) -> Float:
        """Angles of :attr:`step_deg`, (F - 1, N), degrees."""
        return np.asarray(np.sqrt(np.sum(self.step_deg * self.step_deg, axis=-1)), np.float64)

    @cached_property
    def _placed(self) -> tuple[Float, Float]:
        clip = self.clip
        return kinematics.forward_some(
            clip.skeleton,
            clip.root_xyz_m,
            clip.rotation_wxyz,
            self.needed,
            translation_xyz_m=clip.translation_xyz_m,
        )

    @property
    def position_xyz_m(self) -> Float:
        """World positions (F, J, 3), metres; zero for joints that are not needed."""
        return self._placed[0]

    @property
    def orientation_wxyz(self) -> Float:
        """World orientations (F, J, 4); zero for joints that are not needed."""
        return self._placed[1]

    def place(self, *names: str) -> Float:
        """Find the mean place of joints.

        Parameters
        ----------
        names : canonical names that the rig has

        Returns
        -------
        (F, 3) float64, metres, world
        """
        if len(names) == 1:
            return self.position_xyz_m[:, self.at[names[0]]]
        return np.asarray(self.position_xyz_m[:, [self.at[name] for name in names]].mean(axis=1), np.float64)

    @cached_property
    def hips(self) -> Float:
        """Middle of both hip joints, (F, 3), metres."""
        return self.place("leftUpperLeg", "rightUpperLeg")

    @cached_property
    def feet(self) -> Float:
        """Ankles and toes, (F, 2 to 4, 3), metres."""
        names = [side + part for part in ("Foot", "Toes") for side in SIDES]
        return self.position_xyz_m[:, [self.at[name] for name in names if name in self.at]]

    @cached_property
    def leg_m(self) -> float:
        """Usual length of thigh and shin, mean of both sides, metres; at least a millimetre."""
        length = 0.0
        for side in SIDES:
            for a, b in (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot")):
                bone = self.place(side + b) - self.place(side + a)
                length += float(np.median(np.linalg.norm(bone, axis=-1))) / 2
        return max(length, 1e-3)

    @cached_property
    def scale(self) -> float:
        """Size of the body against the canonical one: lengths that are chosen for that are multiplied by it."""
        return self.leg_m / canonical.LEG_LENGTH_M

    @cached_property
    def trunk(self) -> Float:
        """From the hips to the neck, or the head where the rig has no neck; (F, 3), metres."""
        return self.place("neck" if "neck" in self.at else "head") - self.hips

    @cached_property
    def forward(self) -> Float:
        """Where the hips face, (F, 3), unit: the line from right to left hip crossed with the trunk."""
        left = self.place("leftUpperLeg") - self.place("rightUpperLeg")
        forward = np.cross(left, self.trunk)
        return np.asarray(forward / np.maximum(np.linalg.norm(forward, axis=-1, keepdims=True), 1e-12), np.float64)

    @cached_property
    def spin_m_per_s(self) -> Float:
        """How fast a spin of the hips alone carries the points of the feet over the floor, (F - 1,), metres a second.

        A body spins about a place under its feet, which is none of their joints: :data:`SPIN_REACH_M` away from one at
        most. 0 where it turns slower than any spin.
        """
        turned = self.orientation_wxyz[:, self.at["hips"]]
        step_rad = rotation.log(rotation.mul(turned[1:], rotation.inv(turned[:-1])))
        rate = np.abs(step_rad[:, 1]) * self.clip.frame_rate_hz
        return np.where(rate > _SLOWEST_SPIN_RAD_PER_S, rate * SPIN_REACH_M * self.scale, 0.0)

    @cached_property
    def canonical_turn_wxyz(self) -> Float:
        """Turn of each mapped joint, in the order of ``at``, against the next mapped one above it; (F, N, 4)."""
        world = self.orientation_wxyz
        turn = np.zeros((self.clip.n_frames, len(self.at), 4))
        for i, name in enumerate(self.at):
            above = canonical_parent(name, self.at)
            q = world[:, self.at[name]]
            turn[:, i] = q if above is None else rotation.mul(rotation.inv(world[:, self.at[above]]), q)
        return turn

    def whole(self, kind: str, verdict: str, reason: str, joint: str = "") -> ClipFault:
        """Make a fault of the whole clip.

        Parameters
        ----------
        kind, verdict, reason, joint : as :class:`kernels.health.verdicts.ClipFault` has them

        Returns
        -------
        ClipFault
            From the first frame to the last.
        """
        return ClipFault(kind, joint, 0, self.clip.n_frames - 1, verdict, reason)  # type: ignore[arg-type]

    def at_s(self, frame: int) -> str:
        """Say when a frame is, for sentences.

        Parameters
        ----------
        frame : int

        Returns
        -------
        str
        """
        return f"{frame / self.clip.frame_rate_hz:.2f} s"


def canonical_parent(name: str, at: dict[str, int]) -> str | None:
    """Find the next joint above a canonical one that a rig has.

    Parameters
    ----------
    name : canonical name
    at : canonical names that the rig has, as keys

    Returns
    -------
    canonical name, or None where there is none above
    """
    k = int(canonical.CANONICAL.parent[canonical.JOINTS.index(name)])
    while k >= 0:
        if canonical.JOINTS[k] in at:
            return canonical.JOINTS[k]
        k = int(canonical.CANONICAL.parent[k])
    return None
