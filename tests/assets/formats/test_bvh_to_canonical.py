"""The whole way: the bytes of a BVH file to the canonical skeleton."""

import numpy as np
import pytest

from assets.formats import bvh
from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.retarget import retarget
from kernels.synthetic import dancer, rigs

PLANS = {
    "a-pose": rigs.RigPlan(axes=rigs.a_pose()),
    "forward": rigs.RigPlan(axes=rigs.arms_forward(), twisted=("leftLowerArm", "rightHand", "leftFoot")),
    "lying": rigs.RigPlan(axes=rigs.lying()),
    "splayed": rigs.RigPlan(axes=rigs.splayed(), has_root=True, names={"hips": "Hips"}),
    "along bones": rigs.RigPlan(axes=rigs.along_bones(), has_root=True),
}
FILES = [("Y", 0.01, "zxy"), ("Z", 1.0, "xyz"), ("Z", 0.0254, "yzx"), ("Y", 0.0254 / 0.45, "zyx"), ("Y", 0.037, "yxz")]


@pytest.fixture(scope="module", params=["step", "rock", "kick"])
def motion(request):
    return dancer.take(request.param, n_beats=6).clip


def bring_back(data):
    take = bvh.to_clip(bvh.parse(data))
    return retarget(take.clip, take.mapping)


@pytest.mark.parametrize(("plan", "file"), list(zip(PLANS, FILES, strict=True)))
def test_rest_pose_axes_units_and_orders_do_not_matter(motion, plan, file):
    up_axis, metres_per_unit, order = file
    clip = rigs.author(motion, PLANS[plan])
    ours = bring_back(bvh.format(clip, up_axis=up_axis, metres_per_unit=metres_per_unit, order=order))
    np.testing.assert_allclose(ours.position_xyz_m, kinematics.place(motion)[0], atol=5e-3)
    assert rotation.angle_between(ours.rotation_wxyz, motion.rotation_wxyz).max() < np.radians(1.0)


def test_a_clip_written_again_is_the_same_motion(motion):
    once = bring_back(bvh.format(rigs.author(motion, PLANS["lying"])))
    take = bvh.to_clip(bvh.parse(bvh.format(rigs.author(motion, PLANS["lying"]), up_axis="Z")))
    again = bring_back(bvh.format(take.clip))
    np.testing.assert_allclose(again.position_xyz_m, once.position_xyz_m, atol=1e-5)


def test_same_bytes_same_motion(motion):
    data = bvh.format(rigs.author(motion, PLANS["along bones"]))
    np.testing.assert_array_equal(bring_back(data).rotation_wxyz, bring_back(data).rotation_wxyz)


def test_every_real_file_is_brought_or_refused(data_dir):
    refused = set()
    for path in sorted(data_dir.glob("bvh_*/**/*.bvh"))[::5] + sorted(data_dir.glob("bvh_varied/*.bvh")):
        take = bvh.to_clip(bvh.read(path))
        if take.mapping is None:
            refused.add(path.stem)
            continue
        ours = retarget(take.clip, take.mapping)
        assert np.isfinite(ours.position_xyz_m).all(), path.name
        assert 0.3 < np.median(ours.position_xyz_m[:, 0, 1]) < 1.3, path.name
        assert ours.position_xyz_m[..., 1].min() > -0.05, path.name
    assert refused == {"fairmotion_sinusoidal_no_endsite", "pybvh_full_precision_frame_time"}
