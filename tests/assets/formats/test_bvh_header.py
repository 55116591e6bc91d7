import numpy as np
import pytest

from assets.formats.bvh_header import parse_header
from assets.formats.errors import FormatError

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
Frames: 1
Frame Time: 0.0333333
0 0 0 0 0 0 0 0 0
"""


def test_joints_offsets_channels_and_ends():
    header = parse_header(ARM, "arm.bvh")
    assert header.joints == ("Hips", "Arm")
    np.testing.assert_array_equal(header.parent, [-1, 0])
    np.testing.assert_array_equal(header.offset, [[0, 0, 0], [1, 2, 3]])
    assert header.channels[1] == ("Zrotation", "Xrotation", "Yrotation")
    np.testing.assert_array_equal(header.end_joint, [1])
    np.testing.assert_array_equal(header.end_offset, [[0, 5, 0]])
    assert (header.frame_count, header.frame_time_text) == (1, "0.0333333")
    assert ARM[header.values_at :].strip().startswith(b"0 0 0")
    assert header.values_line == 18


@pytest.mark.parametrize(
    ("written", "read"),
    [
        (b"mixamorig:Hips", "mixamorig:Hips"),
        (b"Left Hand", "Left Hand"),
        (b"  Left   Hand  ", "Left Hand"),
        ("下半身".encode(), "下半身"),
        ("下半身".encode("cp932"), "下半身"),
        ("センター".encode("cp932"), "センター"),
        ("Hüfte".encode("latin-1"), "Hüfte"),
        ("élan".encode("latin-1"), "élan"),
        (b"ROOT", "ROOT"),
    ],
)
def test_names_as_exporters_write_them(written, read):
    assert parse_header(ARM.replace(b"Hips", written), "").joints[0] == read


def test_names_that_stand_twice_get_a_number():
    again = ARM.replace(b"JOINT Arm", b"JOINT Hips")
    assert parse_header(again, "").joints == ("Hips", "Hips#2")


def test_a_number_given_does_not_meet_a_name_that_has_it():
    three = ARM.replace(
        b"    End Site", b"    JOINT Hips#2\n    {\n    OFFSET 0 0 0\n    CHANNELS 1 Xrotation\n    }\n    End Site"
    )
    names = parse_header(three.replace(b"JOINT Arm", b"JOINT Hips"), "").joints
    assert len(set(names)) == 3
    assert names[2] == "Hips#2"


@pytest.mark.parametrize(
    "form",
    [
        ARM.replace(b"ROOT Hips\n{", b"ROOT Hips {"),
        b" ".join(ARM[: ARM.index(b"MOTION")].split()) + b"\n" + ARM[ARM.index(b"MOTION") :],
        ARM.replace(b"OFFSET", b"Offset").replace(b"CHANNELS", b"channels").replace(b"JOINT", b"Joint"),
        ARM.replace(b"Zrotation", b"ZROTATION").replace(b"End Site", b"End site"),
        ARM.replace(b"  ", b"\t"),
        ARM.replace(b"Frames: 1", b"Frames 1").replace(b"Frame Time:", b"Frame Time"),
        ARM.replace(b"Frames: 1", b"FRAMES:\t1").replace(b"Frame Time: ", b"frame time:"),
        ARM.replace(b"\nMOTION", b"\n\n  MOTION"),
        b"\n\n" + ARM,
    ],
    ids=["brace", "one line", "keywords", "case", "tabs", "colons", "spacing", "blank lines", "leading lines"],
)
def test_layout_does_not_matter(form):
    header = parse_header(form, "")
    assert header.joints == ("Hips", "Arm")
    assert header.channels[1] == ("Zrotation", "Xrotation", "Yrotation")
    assert header.frame_count == 1


def test_joints_without_channels_and_ends_without_offset():
    bare = ARM.replace(b"    CHANNELS 3 Zrotation Xrotation Yrotation\n", b"").replace(b"      OFFSET 0 5 0\n", b"")
    header = parse_header(bare, "")
    assert header.channels[1] == ()
    np.testing.assert_array_equal(header.end_offset, [[0, 0, 0]])


def test_nesting_is_limited_by_memory_alone():
    n = 5000
    opened = b"".join(b"JOINT j%d\n{\nOFFSET 0 1 0\nCHANNELS 1 Xrotation\n" % k for k in range(n))
    deep = b"HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n" + opened + b"}\n" * (n + 1)
    header = parse_header(deep + b"MOTION\nFrames: 1\nFrame Time: 0.1\n", "")
    assert len(header.joints) == n + 1
    assert header.parent[-1] == n - 1


@pytest.mark.parametrize(
    ("broken", "line", "what"),
    [
        (b"", 0, "empty file"),
        (b" \n \n", 0, "empty file"),
        (b"\x93NUMPY\x01\x00v\x00{'descr'", 1, "want HIERARCHY"),
        (b"\n" + ARM.replace(b"HIERARCHY", b"HIERARCHIE"), 2, "want HIERARCHY"),
        (ARM[: ARM.index(b"MOTION")], 16, "want MOTION"),
        (ARM.replace(b"MOTION\n", b""), 16, "want MOTION"),
        (ARM.replace(b"    }\n  }\n}\n", b"    }\n  }\n"), 14, "braces do not balance"),
        (ARM.replace(b"    }\n  }\n}\n", b"    }\n  }\n}\n}\n"), 16, "one too many"),
        (ARM.replace(b"Hips\n{", b"Hips\n"), 4, "want { after 'Hips'"),
        (ARM.replace(b"OFFSET 1 2 3", b"OFFSET 1 2"), 8, "three finite numbers"),
        (ARM.replace(b"OFFSET 1 2 3", b"OFFSET 1 nan 3"), 8, "three finite numbers"),
        (ARM.replace(b"OFFSET 1 2 3", b"OFSET 1 2 3"), 8, "got 'OFSET' in 'Arm'"),
        (ARM.replace(b"    OFFSET 1 2 3\n", b""), 13, "want an OFFSET in 'Arm'"),
        (ARM.replace(b"CHANNELS 3", b"CHANNELS 4"), 9, "want CHANNELS"),
        (ARM.replace(b"CHANNELS 3", b"CHANNELS -3"), 9, "want CHANNELS"),
        (ARM.replace(b"CHANNELS 3 Z", b"CHANNELS 3 W"), 9, "want CHANNELS"),
        (ARM.replace(b"Yposition", b"Xposition"), 5, "no position twice"),
        (ARM.replace(b"JOINT Arm", b"JOINT"), 6, "want a name"),
        (ARM.replace(b"JOINT Arm", b"ROOT Arm"), 6, "want one ROOT"),
        (ARM.replace(b"      OFFSET 0 5 0", b"      JOINT X\n {}"), 12, "nothing but OFFSET"),
        (ARM.replace(b"ROOT Hips", b"JOINT Hips"), 2, "want ROOT"),
        (ARM.replace(b"Frames: 1\n", b""), 17, "want 'Frames: N'"),
        (ARM.replace(b"Frames: 1\n", b"Frames: many\n"), 17, "got 'many'"),
        (ARM.replace(b"Frames: 1\n", b"Frames: -1\n"), 17, "got '-1'"),
        (ARM.replace(b"Frames: 1\n", b"Frames: 0\n"), 17, "at least one frame"),
        (ARM.replace(b"Frame Time: 0.0333333\n", b""), 18, "want 'Frame Time: seconds'"),
    ],
)
def test_refusals_name_the_line(broken, line, what):
    with pytest.raises(FormatError) as caught:
        parse_header(broken, "a.bvh")
    assert what in caught.value.what
    assert caught.value.line == line
    assert caught.value.path == "a.bvh"
