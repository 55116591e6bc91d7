import math

import numpy as np
import pytest

from assets.formats import bvh
from assets.formats.errors import FormatError
from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.synthetic import dancer, rigs
from kernels.types import Clip, Skeleton

ARM = b"""HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Arm
  {
    OFFSET 1 2 3
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 5 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
1 2 3 90 0 0 0 0 0
1 2 3 0 90 0 0 0 90
"""


@pytest.fixture(scope="module")
def spin():
    return dancer.take("spin", n_beats=6).clip


def world(clip):
    return kinematics.place(clip)[0]


def by_name(clip):
    return dict(zip(clip.skeleton.joints, np.moveaxis(world(clip), 1, 0), strict=True))


# Frame rates ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "rate_hz"),
    [
        ("0.0083333", 120), ("0.008333", 120), ("0.008342", 120), ("0.00833333333", 120), ("8.3333e-3", 120),
        ("0.033332", 30), (".03333", 30), ("0.0333333", 30), ("0.033", 30), ("0.03", 30),
        ("0.041667", 24), ("0.0417", 24), ("0.0416", 24), ("0.016667", 60), ("0.016666666666666666", 60),
        ("0.0167", 60), ("0.04", 25), ("0.02", 50), ("0.01", 100), ("0.0041667", 240), ("0.00416", 240),
        ("0.011111", 90),
        ("0.005", 200),
        ("0.0417083750417", 23.976), ("0.0417083333333", 24000 / 1001), ("0.033366700033", 29.97), ("0.0333667", 29.97),
        ("0.016683350016683", 59.94), ("0.08", 12.5), ("0.0083194675541", 120.2), ("1", 1), ("+0.04", 25),
    ],
)  # fmt: skip
def test_frame_rate_that_was_meant(text, rate_hz):
    assert bvh.frame_rate_hz(text) == pytest.approx(rate_hz, rel=1e-9)


def test_frame_rate_of_every_whole_rate_however_rounded():
    for rate in range(10, 241):
        for digits in (7, 9, 12):
            assert bvh.frame_rate_hz(f"{1 / rate:.{digits}f}") == rate


@pytest.mark.parametrize("text", ["0", "-0.03", "nan", "inf", "", "fast", "33.33", "120", "1e-9"])
def test_frame_times_that_mean_nothing(text):
    with pytest.raises(ValueError, match=r"want a Frame Time of 0\.0001 to 2 seconds"):
        bvh.frame_rate_hz(text)


# Parsing ----------------------------------------------------------------------------------------------------------


def test_parse_arm():
    arm = bvh.parse(ARM)
    assert arm.joints == ("Hips", "Arm")
    assert (arm.frame_time_s, arm.frame_rate_hz) == (0.0333333, 30)
    np.testing.assert_array_equal(arm.values, [[1, 2, 3, 90, 0, 0, 0, 0, 0], [1, 2, 3, 0, 90, 0, 0, 0, 90]])


@pytest.mark.parametrize(
    "form",
    [
        ARM.replace(b"\n", b"\r\n"),
        ARM.replace(b"\n", b"\r"),
        b"\xef\xbb\xbf" + ARM,
        ARM.decode().encode("utf-16"),
        ARM + b"\n\n  \n",
        ARM + b"\x1a",
        ARM.rstrip(),
    ],
    ids=["crlf", "cr", "bom", "utf-16", "blank lines", "ctrl-z", "no last line end"],
)
def test_bytes_of_every_system(form):
    arm, plain = bvh.parse(form), bvh.parse(ARM)
    assert arm.joints == plain.joints
    np.testing.assert_array_equal(arm.values, plain.values)


@pytest.mark.parametrize("ends", [b"\n", b"\r\n", b"\r"])
def test_lines_are_counted_whatever_ends_them(ends):
    with pytest.raises(FormatError) as caught:
        bvh.parse(ARM.replace(b"0 90 0 0 0 90", b"0 90 0 0 0 x").replace(b"\n", ends), "arm.bvh")
    assert str(caught.value) == "arm.bvh:20: want a number, got 'x'"


def test_a_frame_time_of_zero_names_its_line():
    with pytest.raises(FormatError, match="Frame Time") as caught:
        bvh.parse(ARM.replace(b"0.0333333", b"0"))
    assert caught.value.line == 18


def test_no_channel_at_all():
    still = ARM.replace(b"CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation", b"CHANNELS 0")
    with pytest.raises(FormatError, match="want at least one channel"):
        bvh.parse(still.replace(b"    CHANNELS 3 Zrotation Xrotation Yrotation\n", b""))


def test_any_bytes_are_refused_cleanly():
    rng = np.random.default_rng(0)
    whole = bytearray(ARM)
    for _ in range(400):
        broken = bytearray(whole)
        for at in rng.integers(0, len(broken), 3):
            broken[at] = rng.integers(0, 256)
        try:
            bvh.parse(bytes(broken[: rng.integers(1, len(broken) + 1)]))
        except FormatError:
            continue


def test_read_names_the_file(tmp_path):
    path = tmp_path / "踊り 'one'.bvh"
    path.write_bytes(ARM)
    assert bvh.read(path).joints == ("Hips", "Arm")
    path.write_bytes(ARM[:-8])
    with pytest.raises(FormatError, match=r"the file is cut short|values in a frame") as caught:
        bvh.read(path)
    assert caught.value.path == str(path)


def test_read_refuses_a_huge_file_before_reading_it(tmp_path):
    path = tmp_path / "huge.bvh"
    with path.open("wb") as file:
        file.truncate(2 * 1024**3)
    with pytest.raises(FormatError, match="want at most 1074 MB, got 2147 MB"):
        bvh.read(path)
    path.write_bytes(ARM)
    with pytest.raises(FormatError, match="want at most"):
        bvh.read(path, max_bytes=100)


def test_read_of_no_file(tmp_path):
    with pytest.raises(FileNotFoundError):
        bvh.read(tmp_path / "none.bvh")


# To a clip --------------------------------------------------------------------------------------------------------


def test_rotations_compose_from_left_to_right():
    clip = bvh.to_clip(bvh.parse(ARM)).clip
    scale = bvh.to_clip(bvh.parse(ARM)).world.metres_per_unit
    place = {name: xyz / scale for name, xyz in by_name(clip).items()}
    # Frame 0: the root turns x to y. Frame 1: y to z; the arm, about its own y, leaves its end in place.
    np.testing.assert_allclose(place["Arm"], [[1 - 2, 2 + 1, 6], [2, 2 - 3, 3 + 2]], atol=1e-6)
    np.testing.assert_allclose(place["Arm_end"] - place["Arm"], [[-5, 0, 0], [0, 0, 5]], atol=1e-6)


@pytest.mark.parametrize("order", ["zyx", "xyz", "yxz", "zxy", "xzy", "yzx"])
def test_channel_orders_give_the_same_clip(spin, order):
    np.testing.assert_allclose(
        world(bvh.to_clip(bvh.parse(bvh.format(spin, order=order))).clip),
        world(bvh.to_clip(bvh.parse(bvh.format(spin))).clip),
        atol=1e-6,
    )


def test_orders_may_differ_and_rotation_may_come_first():
    mixed = ARM.replace(
        b"6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
        b"6 Zrotation Yposition Xrotation Zposition Yrotation Xposition",
    ).replace(b"1 2 3 90 0 0", b"90 2 0 3 0 1").replace(b"1 2 3 0 90 0", b"0 2 90 3 0 1")  # fmt: skip
    np.testing.assert_allclose(
        world(bvh.to_clip(bvh.parse(mixed)).clip), world(bvh.to_clip(bvh.parse(ARM)).clip), atol=1e-12
    )


@pytest.mark.parametrize(
    ("channels", "values", "turned"),
    [
        ("1 Xrotation", "90", [0, 0, 5]),
        ("2 Zrotation Xrotation", "90 0", [-5, 0, 0]),
        ("3 Zrotation Xrotation Zrotation", "90 90 90", [0, -5, 0]),
        ("5 Xposition Zposition Zrotation Xrotation Yrotation", "1 3 90 0 0", [-5, 0, 0]),
        ("9 Xposition Yposition Zposition Zrotation Xrotation Yrotation Xscale Yscale Zscale",
         "1 2 3 90 0 0 1 1 1", [-5, 0, 0]),
    ],
)  # fmt: skip
def test_any_number_of_channels(channels, values, turned):
    text = ARM.replace(b"3 Zrotation Xrotation Yrotation", channels.encode())
    text = text[: text.index(b"1 2 3 90")].replace(b"Frames: 2", b"Frames: 1") + f"0 0 0 0 0 0 {values}\n".encode()
    take = bvh.to_clip(bvh.parse(text))
    place = by_name(take.clip)
    end = (place["Arm_end"] - place["Arm"])[0] / take.world.metres_per_unit
    np.testing.assert_allclose(end, turned, atol=1e-6)


def test_scales_other_than_one_are_refused():
    text = ARM.replace(b"3 Zrotation Xrotation Yrotation", b"4 Zrotation Xrotation Yrotation Xscale")
    text = text.replace(b" 0 0 0\n1", b" 0 0 0 1\n1").replace(b"0 0 90\n", b"0 0 90 2\n")
    with pytest.raises(ValueError, match="Xscale of 'Arm': want 1"):
        bvh.to_clip(bvh.parse(text))


def moved_arm(first, second):
    text = ARM.replace(
        b"3 Zrotation Xrotation Yrotation", b"6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    )
    return text.replace(b"90 0 0 0 0 0", f"0 0 0 {first} 0 0 0".encode()).replace(
        b"0 90 0 0 0 90", f"0 0 0 {second} 0 0 0".encode()
    )


def test_positions_stand_in_place_of_offsets():
    take = bvh.to_clip(bvh.parse(moved_arm("7 8 9", "7 8 10")))
    place = by_name(take.clip)["Arm"] / take.world.metres_per_unit
    np.testing.assert_allclose(place, [[1 + 7, 2 + 8, 3 + 9], [1 + 7, 2 + 8, 3 + 10]], atol=1e-9)
    assert take.clip.translation_xyz_m is not None


def test_positions_that_repeat_the_offset_are_no_translation():
    take = bvh.to_clip(bvh.parse(moved_arm("1 2 3", "1.00001 2 3")))
    assert take.clip.translation_xyz_m is None


def test_zero_length_and_missing_ends_are_no_joints():
    no_end = ARM.replace(b"    End Site\n    {\n      OFFSET 0 5 0\n    }\n", b"")
    assert bvh.to_clip(bvh.parse(no_end)).clip.skeleton.joints == ("Hips", "Arm")
    assert bvh.to_clip(bvh.parse(ARM.replace(b"0 5 0", b"0 0 0"))).clip.skeleton.joints == ("Hips", "Arm")
    assert bvh.to_clip(bvh.parse(ARM)).clip.skeleton.joints == ("Hips", "Arm", "Arm_end")


def test_one_frame(spin):
    still = Clip(spin.skeleton, spin.frame_rate_hz, spin.root_xyz_m[:1], spin.rotation_wxyz[:1])
    take = bvh.to_clip(bvh.parse(bvh.format(still)))
    assert take.clip.n_frames == 1
    np.testing.assert_allclose(world(take.clip), world(still), atol=1e-6)


def test_rotations_stay_in_one_hemisphere(spin):
    rotation_wxyz = bvh.to_clip(bvh.parse(bvh.format(spin))).clip.rotation_wxyz
    assert (rotation_wxyz[0, :, 0] >= 0).all()
    assert (np.sum(rotation_wxyz[1:] * rotation_wxyz[:-1], axis=-1) > 0).all()


@pytest.mark.parametrize("up_axis", ["Y", "Z"])
@pytest.mark.parametrize("metres_per_unit", [1.0, 0.01, 0.001, 0.0254, 0.0254 / 0.45])
def test_units_and_axes_are_told_from_the_body(spin, up_axis, metres_per_unit):
    take = bvh.to_clip(bvh.parse(bvh.format(spin, metres_per_unit=metres_per_unit, up_axis=up_axis)))
    assert take.world.up_axis == up_axis
    assert take.world.metres_per_unit == metres_per_unit
    assert take.world.root_offset_rule == "replace"
    np.testing.assert_allclose(world(take.clip), world(spin), atol=1e-5)


def test_no_known_unit_makes_a_body_of_170_cm(spin):
    take = bvh.to_clip(bvh.parse(bvh.format(spin, metres_per_unit=0.12)))
    height = np.ptp(world(take.clip)[0, :, 1]) / np.ptp(world(spin)[0, :, 1])
    assert height == pytest.approx(1.70 / 1.72, rel=1e-6)


def test_standing_height_in_the_offset_is_added(spin):
    low = spin.root_xyz_m - CANONICAL.offset_xyz_m[0]
    written = bvh.format(Clip(CANONICAL, spin.frame_rate_hz, low, spin.rotation_wxyz))
    take = bvh.to_clip(bvh.parse(written))
    assert take.world.root_offset_rule == "add"
    np.testing.assert_allclose(world(take.clip), world(spin), atol=1e-5)


def test_a_sideways_offset_of_the_root_is_replaced(spin):
    aside = Skeleton(JOINTS, CANONICAL.parent, CANONICAL.offset_xyz_m + np.eye(22, 1) * np.array([3.0, 0.0, -2.0]))
    take = bvh.to_clip(bvh.parse(bvh.format(Clip(aside, 30.0, spin.root_xyz_m, spin.rotation_wxyz))))
    assert take.world.root_offset_rule == "replace"
    np.testing.assert_allclose(world(take.clip), world(spin), atol=1e-5)


# Writing ----------------------------------------------------------------------------------------------------------


def test_round_trip(swaying):
    for up_axis, unit in (("Y", 0.01), ("Z", 1.0)):
        again = bvh.to_clip(bvh.parse(bvh.format(swaying, up_axis=up_axis, metres_per_unit=unit, order="yzx"))).clip
        assert again.skeleton.joints == JOINTS
        assert again.frame_rate_hz == swaying.frame_rate_hz
        np.testing.assert_allclose(again.skeleton.offset_xyz_m, CANONICAL.offset_xyz_m, atol=1e-5)
        np.testing.assert_allclose(again.root_xyz_m, swaying.root_xyz_m, atol=1e-5)
        assert rotation.angle_between(again.rotation_wxyz, swaying.rotation_wxyz).max() < 1e-5


def test_round_trip_of_rates():
    for rate_hz in (24.0, 24000 / 1001, 25.0, 29.3, 30000 / 1001, 60.0, 119.88, 240.0):
        clip = Clip(CANONICAL, rate_hz, np.zeros((2, 3)), np.tile(rotation.IDENTITY, (2, 22, 1)))
        assert bvh.parse(bvh.format(clip)).frame_rate_hz == pytest.approx(rate_hz, rel=1e-9)


def test_round_trip_of_moving_joints_and_end_sites(spin):
    rig = rigs.author(spin, rigs.RigPlan(names={"leftHand": "leftLowerArm_end"}, has_root=True))
    still = rig.rotation_wxyz.copy()
    still[:, rig.skeleton.index("leftLowerArm_end")] = rotation.IDENTITY
    rig = Clip(rig.skeleton, rig.frame_rate_hz, rig.root_xyz_m, still, rig.translation_xyz_m)
    written = bvh.format(rig)
    assert b"JOINT leftLowerArm_end" not in written
    again = bvh.to_clip(bvh.parse(written)).clip
    assert again.translation_xyz_m is not None
    places = by_name(again)
    for name, xyz in by_name(rig).items():
        np.testing.assert_allclose(places[name], xyz, atol=1e-5)


def test_same_clip_same_bytes(spin):
    assert bvh.format(spin) == bvh.format(spin)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"up_axis": "X"}, "up_axis"),
        ({"metres_per_unit": 0.0}, "metres_per_unit"),
        ({"order": "xyx"}, "order"),
        ({"order": "xy"}, "order"),
    ],
)
def test_what_cannot_be_written(spin, change, what):
    with pytest.raises(ValueError, match=what):
        bvh.format(spin, **change)


def test_clips_that_cannot_be_written():
    one = Skeleton(("a{b",), np.array([-1]), np.zeros((1, 3)))
    with pytest.raises(ValueError, match="without braces"):
        bvh.format(Clip(one, 30.0, np.zeros((1, 3)), np.ones((1, 1, 4)) / 2))
    with pytest.raises(ValueError, match="at least one frame"):
        bvh.format(Clip(CANONICAL, 30.0, np.zeros((0, 3)), np.zeros((0, 22, 4))))


# Real files -------------------------------------------------------------------------------------------------------


def real_files(data_dir, pattern):
    files = sorted(data_dir.glob(pattern))
    assert files
    return files


def test_every_real_file_is_read(data_dir):
    for path in real_files(data_dir, "bvh_varied/*.bvh") + real_files(data_dir, "bvh_idle/*.bvh"):
        file = bvh.read(path)
        assert len(file.values) >= 1
        assert math.isfinite(file.frame_rate_hz)
        block = path.read_bytes().split(b"Frame Time")[1].split(b"\n", 1)[1]
        np.testing.assert_array_equal(file.values.ravel(), [float(word) for word in block.split()])


def test_real_rates(data_dir):
    rates = {path.stem: bvh.read(path).frame_rate_hz for path in real_files(data_dir, "bvh_varied/*.bvh")}
    assert rates["animdraw_fair1_wave_hello_120fps"] == 120
    assert rates["pybvh_bvh_test2_crlf_yxz_120fps"] == 120
    assert rates["mvnx_test_mocap_60fps_GPL3"] == 60
    assert rates["animdraw_cmu1_jumping_jacks"] == 30
    assert rates["pybvh_full_precision_frame_time"] == 23.976


def test_real_bodies_stand_upright_with_their_feet_on_the_floor(data_dir):
    for path in real_files(data_dir, "bvh_*/**/*.bvh")[::9]:
        take = bvh.to_clip(bvh.read(path))
        if take.mapping is None:
            continue
        place = by_name(take.clip)
        joint = take.mapping.joint
        feet = np.minimum(place[joint["leftFoot"]], place[joint["rightFoot"]])[:, 1]
        head = place[joint["head"]][:, 1]
        assert 0.9 < np.median(head - feet) < 2.2, path.name
        if take.clip.n_frames > 30 and "mvnx" not in path.name:
            assert abs(np.quantile(feet, 0.1)) < 0.25, path.name


def test_real_partners_face_each_other_in_one_world(data_dir):
    lead = bvh.to_clip(bvh.read(data_dir / "bvh_dance/cmu_salsa/60_01_scaled_30fps.bvh"))
    follow = bvh.to_clip(bvh.read(data_dir / "bvh_dance/cmu_salsa/61_01_scaled_30fps.bvh"))
    assert lead.world == follow.world
    apart = np.linalg.norm((lead.clip.root_xyz_m - follow.clip.root_xyz_m)[:, [0, 2]], axis=-1)
    assert apart.min() > 0.05
    assert np.median(apart) < 1.5
