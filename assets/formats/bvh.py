"""BVH files, as exporters really write them: bytes to arrays, arrays to a clip in our world, and back.

Conventions
-----------
:class:`Bvh` is the file as it stands: its units, its axes, its channels, degrees. :func:`to_clip` brings it to metres,
Y up, quaternions. Position channels replace OFFSET on every joint but the root, where the file decides (see there).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from assets.formats.bvh_header import parse_header
from assets.formats.bvh_values import parse_values
from assets.formats.errors import FormatError, check_size
from kernels import rotation
from kernels.skeleton import alignment, axes, kinematics, naming
from kernels.types import Clip, Float, Int, Skeleton

MAX_BYTES = 1 << 30
"""Chosen by hand: hours of motion."""

_MANY_FRAMES = 64
"""Frames of a clip by which its rig is told, evenly spread. Chosen by hand."""

_COMMON_HZ = (24, 25, 30, 48, 50, 60, 72, 90, 100, 120, 144, 150, 180, 200, 240)
"""Rates that cameras, trackers and screens have, by convention."""

_LONGEST_FRAME_S = 2.0
_SHORTEST_FRAME_S = 1e-4
"""Chosen by hand, beyond any recording of a body."""


@dataclass(frozen=True, eq=False)
class Bvh:
    """A BVH file as it stands.

    Parameters
    ----------
    joints : J names, unique (a repeated name gets ``#2``, ``#3`` …: BVH tells joints apart by place)
    parent : (J,) int64, topological, the root -1
    offset : (J, 3) float64, file units
    channels : per joint, its channels in order: ``Xposition`` … ``Zrotation``, ``Xscale`` …; may be empty
    end_joint : (E,) int64
        Joints that carry an End Site.
    end_offset : (E, 3) float64, file units
    frame_time_s : float, seconds, as written
    frame_rate_hz : float, cleaned by :func:`frame_rate_hz`
    values : (F, C) float64
        File units and degrees; the channels of all joints side by side.
    """

    joints: tuple[str, ...]
    parent: Int
    offset: Float
    channels: tuple[tuple[str, ...], ...]
    end_joint: Int
    end_offset: Float
    frame_time_s: float
    frame_rate_hz: float
    values: Float


def read(path: Path | str, *, max_bytes: int = MAX_BYTES) -> Bvh:
    """Read a BVH file.

    Parameters
    ----------
    path : file
    max_bytes : int
        Larger files are refused before they are read.

    Returns
    -------
    Bvh

    Raises
    ------
    FormatError
        If the file is too large or not well formed; see :func:`parse`.
    OSError
        If it cannot be opened.
    """
    path = Path(path)
    check_size(path, max_bytes=max_bytes)
    return parse(path.read_bytes(), str(path))


def parse(data: bytes, path: str = "") -> Bvh:
    """Read the bytes of a BVH file.

    Parameters
    ----------
    data : whole file
        Any line ends, a byte order mark, UTF-8, Shift-JIS or Latin-1 names.
    path : str
        Named in messages.

    Returns
    -------
    Bvh

    Raises
    ------
    FormatError
        With the line, where the hierarchy is broken, a number is none or not finite, or there are not as many values
        as the header promises.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        data = data.decode("utf-16", "replace").encode()
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if data.endswith(b"\x1a"):
        data = data[:-1]
    header = parse_header(data, path)
    try:
        rate_hz = frame_rate_hz(header.frame_time_text)
    except ValueError as error:
        raise FormatError(path, header.frame_time_line, str(error)) from None
    n_channels = sum(map(len, header.channels))
    if n_channels == 0:
        raise FormatError(path, 0, "want at least one channel, got none; the file holds no motion")
    values = parse_values(
        data[header.values_at :], header.frame_count, n_channels, path=path, first_line=header.values_line
    )
    return Bvh(
        joints=header.joints,
        parent=header.parent,
        offset=header.offset,
        channels=header.channels,
        end_joint=header.end_joint,
        end_offset=header.end_offset,
        frame_time_s=float(header.frame_time_text),
        frame_rate_hz=rate_hz,
        values=values,
    )


def frame_rate_hz(frame_time_text: str) -> float:
    """Find the frame rate that was meant by a frame time as written.

    Parameters
    ----------
    frame_time_text : str
        Seconds, with the digits of the file: they say how far the number can be trusted.

    Returns
    -------
    float, Hz
        A whole number where the frame time is within 0.15 % of one (0.002 % when written with 8 digits or more), or
        is a common rate (24, 25, 30 … 240) rounded or cut to the digits written. The rates of video (n × 1000 / 1001,
        or that with two or three decimals) where the text has at least 6 digits and is one of them to its last digit:
        ``0.0417083750417`` is 23.976, while ``0.008342`` is 120. Else one over the frame time.

    Raises
    ------
    ValueError
        If the text is no number, or not between 0.1 ms and 2 s.
    """
    try:
        frame_time_s = float(frame_time_text)
    except ValueError:
        frame_time_s = math.nan
    if not _SHORTEST_FRAME_S <= frame_time_s <= _LONGEST_FRAME_S:
        slip = "; did you mean milliseconds, or frames a second?" if frame_time_s > _LONGEST_FRAME_S else ""
        raise ValueError(f"want a Frame Time of 0.0001 to 2 seconds, got {frame_time_text[:40]!r}{slip}")
    mantissa, _, exponent = frame_time_text.lower().partition("e")
    n_digits = len(mantissa.replace(".", "").lstrip("+-0"))
    n_decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
    last_digit_s = 1.0000001 * 10.0**-n_decimals
    rate = 1.0 / frame_time_s
    whole = max(round(rate), 1)
    ratio = whole * 1000 / 1001
    video = min((round(ratio, 2), round(ratio, 3), ratio), key=lambda common: abs(1 / common - frame_time_s))
    if n_digits >= 6 and abs(1 / video - frame_time_s) <= min(last_digit_s, 1e-5 * frame_time_s):
        return video
    if abs(whole * frame_time_s - 1.0) <= (0.0015 if n_digits < 8 else 2e-5):
        return float(whole)
    rounded = [common for common in _COMMON_HZ if abs(1.0 / common - frame_time_s) <= last_digit_s]
    if rounded and n_digits < 8:
        return float(min(rounded, key=lambda common: abs(common - rate)))
    return rate


@dataclass(frozen=True, eq=False)
class BvhTake:
    """A clip in our world, and what its file was taken to mean.

    Parameters
    ----------
    clip : Clip
        On the file's own rig, in metres, Y up. End Sites of some length are joints, named ``<joint>_end``.
    world : axes.World
        Unit, up axis and root rule inferred.
    mapping : naming.JointMapping or None
        None where the rig is not known to be a body.
    """

    clip: Clip
    world: axes.World
    mapping: naming.JointMapping | None


def to_clip(bvh: Bvh, *, extra: Mapping[str, str] | None = None) -> BvhTake:
    """Bring a file to metres, Y up and quaternions.

    Position channels stand in place of OFFSET, axis by axis; the root's may add to it, which is decided by what puts
    the feet on the floor. Unit and up axis are inferred from the body.

    Parameters
    ----------
    bvh : Bvh
    extra : rig's name to canonical name, or None
        The user's own table of joints.

    Returns
    -------
    BvhTake
        The clip's ``translation_xyz_m`` is None unless channels move a joint off its OFFSET by more than 1/10,000 of
        the body's height.

    Raises
    ------
    ValueError
        If scale channels are not all 1, the user's table names what is no canonical joint, or the body has no sides, no
        up or no legs.
    """
    skeleton = _skeleton_in_units(bvh)
    root, local, translation = _poses_in_units(bvh, skeleton)
    some = np.unique(np.linspace(0, len(root) - 1, _MANY_FRAMES).astype(np.int64))
    moved = None if translation is None else translation[some]
    try:
        mapping = naming.map_joints(skeleton, extra)
        at = {name: skeleton.index(joint) for name, joint in mapping.joint.items()}
    except naming.NoBodyError:
        mapping, at = None, {name: k for k, name in enumerate(skeleton.joints)}
    position, _ = kinematics.forward_some(skeleton, root[some], local[some], at.values(), translation_xyz_m=moved)
    if mapping is not None:
        alignment.check_body(at, position)
    world = axes.infer_world(skeleton, mapping.joint if mapping is not None else None, position)
    if world.root_offset_rule == "add":
        root = root + skeleton.offset_xyz_m[0] * _has_channel(bvh, 0)
    scale = world.metres_per_unit
    offset_m = axes.vectors_to_y_up(skeleton.offset_xyz_m, world.up_axis) * scale
    translation_m = None
    if translation is not None:
        translation_m = axes.vectors_to_y_up(translation, world.up_axis) * scale
        tallest = scale * axes.stature(skeleton, mapping.joint) if mapping is not None else 1.7
        if not (np.abs(translation_m[:, 1:] - offset_m[1:]) > 1e-4 * tallest).any():
            translation_m = None
    clip = Clip(
        skeleton=Skeleton(skeleton.joints, skeleton.parent, offset_m),
        frame_rate_hz=bvh.frame_rate_hz,
        root_xyz_m=axes.vectors_to_y_up(root, world.up_axis) * scale,
        rotation_wxyz=rotation.continuous(axes.rotations_to_y_up(local, world.up_axis)),
        translation_xyz_m=translation_m,
    )
    return BvhTake(clip, world, mapping)


def _skeleton_in_units(bvh: Bvh) -> Skeleton:
    """Joints and End Sites of some length, in file units and axes."""
    names, parent, offset = list(bvh.joints), list(bvh.parent), list(bvh.offset)
    for joint, end in zip(bvh.end_joint, bvh.end_offset, strict=True):
        name = bvh.joints[joint] + naming.END_SUFFIX
        if np.any(end != 0) and name not in names:
            names.append(name)
            parent.append(joint)
            offset.append(end)
    return Skeleton(tuple(names), np.array(parent, np.int64), np.array(offset, np.float64))


def _has_channel(bvh: Bvh, joint: int) -> Float:
    """1 for each axis along which the joint has a position channel, else 0; (3,)."""
    return np.array([float(axis + "position" in bvh.channels[joint]) for axis in "XYZ"])


def _poses_in_units(bvh: Bvh, skeleton: Skeleton) -> tuple[Float, Float, Float | None]:
    """Root positions (F, 3), local rotations (F, J, 4) and local positions (F, J, 3) or None, channels replacing."""
    f, j = len(bvh.values), len(skeleton.joints)
    column = np.cumsum([0, *(len(channels) for channels in bvh.channels)])
    local = np.tile(rotation.IDENTITY, (f, j, 1))
    translation = np.tile(skeleton.offset_xyz_m, (f, 1, 1))
    by_order: dict[str, list[int]] = {}
    has_moved = False
    for joint, channels in enumerate(bvh.channels):
        order = "".join(name[0].lower() for name in channels if name.endswith("rotation"))
        by_order.setdefault(order, []).append(joint)
        for k, name in enumerate(channels):
            value = bvh.values[:, column[joint] + k]
            if name.endswith("position"):
                translation[:, joint, "XYZ".index(name[0])] = value
                has_moved = has_moved or joint > 0
            elif name.endswith("scale") and not np.allclose(value, 1.0, atol=1e-3):
                raise ValueError(
                    f"{name} of {bvh.joints[joint]!r}: want 1, got {value.min()} to {value.max()}; bake it"
                )
    for order, joints in by_order.items():
        turns = [[k for k, name in enumerate(bvh.channels[joint]) if name.endswith("rotation")] for joint in joints]
        columns = column[joints][:, None] + np.array(turns, np.int64).reshape(len(joints), len(order))
        local[:, joints] = rotation.from_euler(np.radians(bvh.values[:, columns]), order)
    return translation[:, 0].copy(), local, translation if has_moved else None


def format(clip: Clip, *, metres_per_unit: float = 0.01, up_axis: str = "Y", order: str = "zxy") -> bytes:
    """Write a clip as a BVH file.

    Parameters
    ----------
    clip : Clip
        At least one frame. Joints named ``<joint>_end`` that hang alone and never turn are written as End Sites.
    metres_per_unit : float, metres, > 0
        Centimetres by default, as most exporters write.
    up_axis : ``"Y"`` or ``"Z"``
    order : three different letters of xyz
        Of the rotation channels, first outermost.

    Returns
    -------
    bytes
        UTF-8, line feeds. Every number with six decimals: read back, positions are within 1e-6 of a unit and angles
        within 1e-7 radians.

    Raises
    ------
    ValueError
        If the clip has no frame, a name cannot be written, or an argument is not as above.
    """
    if clip.n_frames == 0:
        raise ValueError("clip: want at least one frame, got none")
    if up_axis not in ("Y", "Z") or not metres_per_unit > 0:
        raise ValueError(f"metres_per_unit, up_axis: want > 0 and Y or Z, got {metres_per_unit} and {up_axis!r}")
    skeleton, moved = clip.skeleton, clip.translation_xyz_m
    for name in skeleton.joints:
        if not name.strip() or set(name) & set("{}\r\n"):
            raise ValueError(f"joints: want names without braces and line ends, got {name!r}")
    angle = np.degrees(rotation.to_euler(axes.rotations_from_y_up(clip.rotation_wxyz, up_axis), order))
    angle = np.unwrap(angle, period=360.0, axis=0)
    offset = axes.vectors_from_y_up(skeleton.offset_xyz_m, up_axis) / metres_per_unit
    children = [np.flatnonzero(skeleton.parent == k) for k in range(len(skeleton.joints))]
    lines, columns = ["HIERARCHY"], []

    def is_end_site(k: int) -> bool:
        parent = skeleton.parent[k]
        is_named = parent >= 0 and skeleton.joints[k] == skeleton.joints[parent] + naming.END_SUFFIX
        is_still = moved is None or np.ptp(moved[:, k], axis=0).max() == 0
        return bool(
            is_named and len(children[parent]) == 1 and len(children[k]) == 0 and is_still and not angle[:, k].any()
        )

    def open_joint(k: int, depth: int) -> None:
        tab = "\t" * depth
        if is_end_site(k):
            lines.extend([f"{tab}End Site", tab + "{", f"{tab}\tOFFSET {_numbers(offset[k])}"])
            return
        place = clip.root_xyz_m if k == 0 else None if moved is None else moved[:, k]
        lines.extend([f"{tab}{'JOINT' if k else 'ROOT'} {skeleton.joints[k]}", tab + "{"])
        names = [letter.upper() + "rotation" for letter in order]
        if place is not None:
            names = ["Xposition", "Yposition", "Zposition", *names]
            columns.append(axes.vectors_from_y_up(place, up_axis) / metres_per_unit)
        columns.append(angle[:, k])
        lines.extend([f"{tab}\tOFFSET {_numbers(offset[k])}", f"{tab}\tCHANNELS {len(names)} {' '.join(names)}"])
        if len(children[k]) == 0:
            lines.extend([f"{tab}\tEnd Site", tab + "\t{", f"{tab}\t\tOFFSET {_numbers(np.zeros(3))}", tab + "\t}"])

    stack = [(0, False)]
    depth = 0
    while stack:
        k, is_done = stack.pop()
        if is_done:
            depth -= 1
            lines.append("\t" * depth + "}")
            continue
        open_joint(k, depth)
        depth += 1
        stack.append((k, True))
        stack.extend((int(child), False) for child in children[k][::-1])
    lines += ["MOTION", f"Frames: {clip.n_frames}", f"Frame Time: {1 / clip.frame_rate_hz!r}"]
    values = np.concatenate(columns, axis=1)
    lines += [_numbers(row) for row in values]
    return ("\n".join(lines) + "\n").encode()


def _numbers(row: Float) -> str:
    return " ".join(f"{value:.6f}" for value in row.tolist())
