"""The grammar of a BVH file up to its numbers: the joints, their offsets and channels, the frame count and time.

Conventions
-----------
Nothing is converted: offsets stay in the file's units, channels in the file's order. Lines count from 1.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain

import numpy as np

from assets.formats.errors import FormatError
from kernels.types import Float, Int

CHANNELS: tuple[str, ...] = tuple(axis + kind for kind in ("position", "rotation", "scale") for axis in "XYZ")
_CHANNEL_BY_NAME = {name.lower(): name for name in CHANNELS}
_MOTION = re.compile(rb"(?:^|[\n}])[^\S\n]*MOTION(?![^\s:])", re.IGNORECASE)
_OPENERS = {"ROOT", "JOINT", "END", "ENDSITE"}
_WANT_WORD = "want OFFSET, CHANNELS, JOINT, End Site or }"
_WANT_CHANNELS = f"want CHANNELS, a count and as many of {', '.join(CHANNELS)}, no position twice"
_BLANK = re.compile(rb"\s*")
_FRAMES = re.compile(rb"\s*Frames\s*:?[^\S\n]*([^\n]*)", re.IGNORECASE)
_FRAME_TIME = re.compile(rb"\s*Frame[^\S\n]*Time\s*:?[^\S\n]*([^\s]*)[^\S\n]*", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Header:
    """What stands before the numbers.

    Parameters
    ----------
    joints : J names, unique
    parent : (J,) int64, topological, -1 first
    offset : (J, 3) float64, file units
    channels : per joint, its channel names in order
    end_joint : (E,) int64, joints that carry an End Site
    end_offset : (E, 3) float64, file units
    frame_count : int, >= 1
    frame_time_text : str, as written
    frame_time_line : int
    values_at : int, byte where the numbers start
    values_line : int, line of that byte
    """

    joints: tuple[str, ...]
    parent: Int
    offset: Float
    channels: tuple[tuple[str, ...], ...]
    end_joint: Int
    end_offset: Float
    frame_count: int
    frame_time_text: str
    frame_time_line: int
    values_at: int
    values_line: int


@dataclass(slots=True)
class _Joint:
    name: str
    parent: int
    line: int
    is_end: bool = False
    offset: tuple[float, ...] | None = None
    channels: tuple[str, ...] = ()


def parse_header(data: bytes, path: str) -> Header:
    """Read everything before the numbers.

    Parameters
    ----------
    data : whole file, line ends already as line feeds, no byte order mark
    path : as the user knows it, for messages

    Returns
    -------
    Header

    Raises
    ------
    FormatError
        With the line, where the grammar is broken.
    """
    opening = data[:64].split(None, 1)
    if not opening or opening[0].upper() != b"HIERARCHY":
        got = repr(opening[0][:20].decode("latin-1")) if opening else "an empty file"
        line = 1 + data[: len(data[:64]) - len(data[:64].lstrip())].count(b"\n") if opening else 0
        raise FormatError(path, line, f"want HIERARCHY, got {got}; not a BVH file")
    motion = _MOTION.search(data, max(data.find(b"\nMOTION"), 0))
    text = _decode(data[: motion.start() + 1 if motion else len(data)])
    joints = _parse_joints(text, path, is_whole=motion is not None)
    if motion is None:
        raise FormatError(path, 1 + data.count(b"\n"), "want MOTION after the hierarchy, got the end of the file")
    bones = [joint for joint in joints if not joint.is_end]
    ends = [joint for joint in joints if joint.is_end]
    index = {id(joint): k for k, joint in enumerate(bones)}

    def owner(joint: _Joint) -> int:
        return -1 if joint.parent < 0 else index[id(joints[joint.parent])]

    count, time_text, time_line, values_at = _parse_motion(data, motion.end(), path)
    return Header(
        joints=_unique([joint.name for joint in bones]),
        parent=np.array([owner(joint) for joint in bones], np.int64),
        offset=np.array([joint.offset for joint in bones], np.float64),
        channels=tuple(joint.channels for joint in bones),
        end_joint=np.array([owner(joint) for joint in ends], np.int64),
        end_offset=np.array([joint.offset for joint in ends], np.float64).reshape(-1, 3),
        frame_count=count,
        frame_time_text=time_text,
        frame_time_line=time_line,
        values_at=values_at,
        values_line=1 + data.count(b"\n", 0, values_at),
    )


def _decode(header: bytes) -> str:
    """Text of the header: UTF-8, else Shift-JIS, else Latin-1.

    Shift-JIS is tried only where bytes 81–9F occur: they lead most of its characters, and Latin-1 has none there.
    """
    try:
        return header.decode("utf-8")
    except UnicodeDecodeError:
        pass
    if re.search(rb"[\x81-\x9f]", header):
        try:
            return header.decode("cp932")
        except UnicodeDecodeError:
            pass
    return header.decode("latin-1")


def _words(text: str) -> Iterator[tuple[int, list[str]]]:
    """Lines that are not blank, with their number, split into words; braces are words of their own."""
    for number, line in enumerate(text.split("\n"), 1):
        words = line.split()
        if len(words) > 1 and ("{" in line or "}" in line):
            words = line.replace("{", " { ").replace("}", " } ").split()
        if words:
            yield number, words


def _parse_joints(text: str, path: str, *, is_whole: bool) -> list[_Joint]:
    """Joints and End Sites in file order; the parent of each is an index into the list."""
    joints: list[_Joint] = []
    stack: list[int] = []
    opening: _Joint | None = None
    last = 1
    lines = _words(text)
    first_line, first = next(lines)
    for number, words in chain([(first_line, first[1:])], lines):
        last, at, n = number, 0, len(words)
        while at < n:
            word = words[at]
            if opening is not None:
                if word != "{":
                    raise FormatError(path, number, f"want {{ after {opening.name!r}, got {word[:40]!r}")
                stack.append(len(joints))
                joints.append(opening)
                opening, at = None, at + 1
            elif word == "}":
                if not stack:
                    raise FormatError(path, number, "want no more than one } for each {, got one too many")
                _close(joints[stack.pop()], path, number)
                at += 1
            elif (keyword := word.upper()) in _OPENERS:
                stop = words.index("{", at) if "{" in words else n
                opening = _begin(keyword, " ".join(words[at + 1 : stop]), joints, stack, path, number)
                at = stop
            elif not stack:
                raise FormatError(path, number, f"want {'MOTION' if joints else 'ROOT'}, got {word[:40]!r}")
            elif keyword == "OFFSET":
                joints[stack[-1]].offset = _numbers(words[at + 1 : at + 4], path, number)
                at += 4
            elif keyword == "CHANNELS":
                channels = _channels(tuple(words[at + 1 :]))
                if channels is None:
                    raise FormatError(path, number, f"{_WANT_CHANNELS}, got {' '.join(words[at:])[:80]!r}")
                joints[stack[-1]].channels = channels
                at += 2 + len(channels)
            else:
                inside = joints[stack[-1]].name
                raise FormatError(path, number, f"{_WANT_WORD}, got {word[:40]!r} in {inside!r}")
    if opening is not None or stack:
        name = opening.name if opening is not None else joints[stack[-1]].name
        where = "MOTION" if is_whole else "the end of the file"
        raise FormatError(path, last, f"want }} to close {name!r}, got {where}; braces do not balance")
    if not joints:
        raise FormatError(path, last, "want ROOT after HIERARCHY, got no joint")
    return joints


def _begin(keyword: str, name: str, joints: list[_Joint], stack: list[int], path: str, line: int) -> _Joint:
    is_end = keyword.startswith("END")
    parent = stack[-1] if stack else -1
    if keyword == "ROOT" and joints:
        raise FormatError(path, line, f"want one ROOT, got a second, {name!r}; split the file, one body each")
    if keyword != "ROOT" and parent < 0:
        raise FormatError(path, line, f"want ROOT around every joint, got {keyword} {name!r} outside")
    if parent >= 0 and joints[parent].is_end:
        raise FormatError(path, line, f"want nothing but OFFSET in an End Site, got {keyword} {name!r}")
    if not is_end and not name:
        raise FormatError(path, line, f"want a name after {keyword}, got none")
    return _Joint(name=name if not is_end else "End Site", parent=parent, line=line, is_end=is_end)


def _close(joint: _Joint, path: str, line: int) -> None:
    if joint.offset is None:
        if not joint.is_end:
            raise FormatError(path, line, f"want an OFFSET in {joint.name!r} (line {joint.line}), got none")
        joint.offset = (0.0, 0.0, 0.0)


def _numbers(words: list[str], path: str, line: int) -> tuple[float, ...]:
    try:
        numbers = tuple(float(word) for word in words)
    except ValueError:
        numbers = ()
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise FormatError(path, line, f"want OFFSET and three finite numbers, got {' '.join(words)!r}")
    return numbers


@lru_cache(maxsize=256)
def _channels(words: tuple[str, ...]) -> tuple[str, ...] | None:
    """Names of as many channels as the first word says; None where that does not fit or one stands twice."""
    n = int(words[0]) if words and words[0].isdecimal() else -1
    names = tuple(_CHANNEL_BY_NAME.get(word.lower(), "") for word in words[1 : n + 1])
    once = [name for name in names if not name.endswith("rotation")]
    return None if n < 0 or len(names) != n or "" in names or len(set(once)) != len(once) else names


def _parse_motion(data: bytes, at: int, path: str) -> tuple[int, str, int, int]:
    """Frame count, frame time as written and its line, and the byte where the numbers start."""

    def line_of(position: int) -> int:
        blank = _BLANK.match(data, position)
        return 1 + data.count(b"\n", 0, blank.end() if blank else position)

    if data[at : at + 1] == b":":
        at += 1
    frames = _FRAMES.match(data, at)
    if frames is None:
        raise FormatError(path, line_of(at), f"want 'Frames: N' after MOTION, got {_next_line(data, at)}")
    count_text = frames[1].decode("latin-1").strip()
    if not re.fullmatch(r"\+?\d{1,12}", count_text):
        raise FormatError(path, line_of(frames.start(1)), f"want a whole number of Frames, got {count_text[:40]!r}")
    if int(count_text) == 0:
        raise FormatError(path, line_of(frames.start(1)), "want at least one frame, got Frames: 0; nothing to dance")
    time = _FRAME_TIME.match(data, frames.end())
    if time is None:
        raise FormatError(
            path,
            line_of(frames.end()),
            f"want 'Frame Time: seconds' after Frames, got {_next_line(data, frames.end())}",
        )
    return int(count_text), time[1].decode("latin-1"), line_of(time.start(1)), time.end()


def _next_line(data: bytes, at: int) -> str:
    line = data[at : at + 200].lstrip().split(b"\n", 1)[0]
    return repr(line[:40].decode("latin-1")) if line else "the end of the file"


def _unique(names: list[str]) -> tuple[str, ...]:
    """Give a name that stands before a number of its own: BVH tells joints apart by place, not by name."""
    seen: set[str] = set()
    taken = set(names)
    result = []
    for name in names:
        unique, n = name, 2
        while unique in seen or (unique != name and unique in taken):
            unique, n = f"{name}#{n}", n + 1
        seen.add(unique)
        result.append(unique)
    return tuple(result)
