"""Real rigs brought to the canonical skeleton; skipped where there are none."""

import numpy as np
import pytest

from assets.formats import bvh
from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.contacts import find_contacts, foot_slide
from kernels.skeleton.grounding import ANKLES, TOES
from kernels.skeleton.retarget import retarget

RIGS = {
    "cgspeed": "bvh_dance/cmu_salsa/60_05_scaled_30fps.bvh",
    "cgspeed partner": "bvh_dance/cmu_salsa/61_03_scaled_120fps.bvh",
    "z up": "bvh_dance/fair1_dab.bvh",
    "z up 120": "bvh_varied/animdraw_fair1_wave_hello_120fps.bvh",
    "cmu, arms down": "bvh_varied/animdraw_cmu1_jumping_jacks.bvh",
    "cmu, legs apart": "bvh_varied/fairmotion_pfnn_hierarchy_crlf.bvh",
    "mixamo": "bvh_varied/bvhtoolbox_freebvh_mixamo_colon_names.bvh",
    "mvn": "bvh_varied/mvnx_test_mocap_60fps_GPL3.bvh",
    "z up, mixed orders": "bvh_varied/pybvh_bvh_test1_mixed_orders.bvh",
    "arms down": "bvh_varied/pybvh_bvh_test2_crlf_yxz_120fps.bvh",
    "one frame": "bvh_varied/pybvh_standard_skeleton_1frame.bvh",
    "blender, no hands": "bvh_idle/003_genuine_f480-719.bvh",
    "bandai dance": "bvh_labelled/bandai/dataset-1_dance-short_normal_001.bvh",
    "bandai walk": "bvh_labelled/bandai/dataset-1_walk-right_active_001.bvh",
    "bandai run": "bvh_labelled/bandai/dataset-2_run_youthful_036.bvh",
}
LIMBS = (("UpperArm", "LowerArm"), ("LowerArm", "Hand"), ("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot"))


@pytest.fixture(scope="module", params=RIGS)
def taken(request, data_dir):
    """Positions of the source by canonical name, at the canonical scale, and the motion brought back."""
    take = bvh.to_clip(bvh.read(data_dir / RIGS[request.param]))
    ours = retarget(take.clip, take.mapping)
    position = ours.scale_ratio * kinematics.place(take.clip)[0]
    index = take.clip.skeleton.joints.index
    source = {name: position[:, index(joint)] for name, joint in take.mapping.joint.items()}
    return source, ours, take.clip.frame_rate_hz


def test_limbs_point_where_the_sources_do(taken):
    source, ours, _ = taken
    here = dict(zip(JOINTS, np.moveaxis(ours.position_xyz_m, 1, 0), strict=True))
    for side in ("left", "right"):
        for a, b in ((side + a, side + b) for a, b in LIMBS):
            turn = rotation.between(source[b] - source[a], here[b] - here[a])
            assert rotation.angle_between(rotation.IDENTITY, turn).max() < np.radians(3.0), a


def test_feet_keep_their_contacts_and_slide_no_more(taken):
    source, ours, rate_hz = taken
    ankle, toes = (
        np.stack([source.get(side + part, source[side + "Foot"]) for side in ("left", "right")], axis=1)
        for part in ("Foot", "Toes")
    )
    here = ours.position_xyz_m
    found = find_contacts(here[:, ANKLES], here[:, TOES], frame_rate_hz=rate_hz).foot
    both = found.sum() + ours.contacts.foot.sum()
    assert both > 0
    assert 2 * (found & ours.contacts.foot).sum() / both > 0.94
    before = foot_slide(ankle, toes, ours.contacts, frame_rate_hz=rate_hz)
    after = foot_slide(here[:, ANKLES], here[:, TOES], ours.contacts, frame_rate_hz=rate_hz)
    assert after - before < 0.2 * before + 0.002
    assert here[:, [*ANKLES, *TOES], 1].min() > -0.01


def test_bodies_stand_facing_where_their_feet_and_chests_point(taken):
    _, ours, _ = taken
    _, world = kinematics.forward(CANONICAL, ours.root_xyz_m, ours.rotation_wxyz)
    hips = world[:, 0]
    for name, least in (("upperChest", 0.6), ("head", 0.3), ("leftFoot", 0.1), ("rightFoot", 0.1)):
        ahead = rotation.apply(
            rotation.mul(rotation.inv(hips), world[:, JOINTS.index(name)]), np.array([0.0, 0.0, 1.0])
        )
        assert np.median(ahead[:, 2]) > least, name
    up = rotation.apply(hips, np.array([0.0, 1.0, 0.0]))
    assert np.median(up[:, 1]) > 0.8
    assert (ours.position_xyz_m[:, JOINTS.index("head"), 1] > 0.4).all()


def test_palms_of_hanging_arms_face_the_thighs(taken):
    _, ours, _ = taken
    _, world = kinematics.forward(CANONICAL, ours.root_xyz_m, ours.rotation_wxyz)
    for side, s in (("left", 1.0), ("right", -1.0)):
        arm = rotation.mul(rotation.inv(world[:, 0]), world[:, JOINTS.index(side + "UpperArm")])
        hangs = rotation.apply(arm, np.array([s, 0.0, 0.0]))[:, 1] < -0.9
        if hangs.sum() > 5:
            palm = rotation.apply(arm[hangs], np.array([0.0, -1.0, 0.0]))
            assert np.median(-s * palm[:, 0]) > 0.3, side
