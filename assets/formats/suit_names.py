"""What exporters call the sensors of a suit and the columns of a recording."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence

from kernels.calibration.records import SENSORS

_SIDED = {name[2:] for name in SENSORS if name.startswith("l_")}
_SPELLINGS = {
    "pelvis": "pelvis hips hip sacrum waist root",
    "thorax": "thorax chest sternum torso trunk upperchest back t8 spine",
    "head": "head skull",
    "shoulder": "shoulder clavicle scapula collar acromion",
    "upper_arm": "upperarm humerus uparm uarm",
    "forearm": "forearm lowerarm radius ulna farm larm",
    "hand": "hand wrist",
    "thigh": "thigh upperleg femur upleg uleg",
    "shank": "shank lowerleg tibia shin calf lleg",
    "foot": "foot ankle",
}
_PART = {spelling: part for part, spellings in _SPELLINGS.items() for spelling in spellings.split()}
_SIDES = {"l": "l", "left": "l", "lft": "l", "r": "r", "right": "r", "rgt": "r", "rt": "r", "lt": "l"}
_NOISE = {"sensor", "imu", "marker", "segment", "seg", "receiver", "s"}


def sensor_of(name: str) -> str | None:
    """Name of ours for a sensor as a file calls it; None where it is not known.

    Case, punctuation and the place of the side do not matter: ``L.UpperArm``, ``left_upper_arm`` and ``upperarm_l``
    are one.
    """
    words = [w.lower() for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)]
    words = [w for w in words if w not in _NOISE]
    side = next((_SIDES[w] for w in words if w in _SIDES), "")
    part = _PART.get("".join(w for w in words if w not in _SIDES))
    if part is None and len(words) == 1:  # lefthand, lthigh, rforearm
        for start in ("left", "right", "l", "r"):
            if words[0].startswith(start) and words[0][len(start) :] in _PART:
                side, part = _SIDES[start], _PART[words[0][len(start) :]]
                break
    if part is None or (part in _SIDED) != bool(side):
        return None
    return f"{side}_{part}" if side else part


def name_sensors(names: Sequence[str], own: Mapping[str, str] | None = None) -> tuple[tuple[str, ...], str]:
    """Name the sensors of a file.

    Parameters
    ----------
    names : as the file has them, each once
    own : the user's table, name in the file to ours, or to nothing where it is to be left out; wins

    Returns
    -------
    tuple of str, str
        Ours, in the file's order, empty for one to be left out, a name that tells nothing as it was; and a word on what
        was assumed, or nothing.
        Seventeen stations that are only numbered are taken in the order of
        :data:`~kernels.calibration.records.SENSORS`.

    Raises
    ------
    ValueError
        If two sensors of the file come to one name, or the user's table names none of ours.
    """
    own = own or {}
    for name, ours in own.items():
        if ours and ours not in SENSORS:
            raise ValueError(f"sensors: want one of {', '.join(SENSORS)}, got {ours!r} for {name!r}; mend [sensors]")
    said = ""
    numbers = sorted((int(m[1]), name) for name in names if (m := re.fullmatch(r"\D*?(\d+)", name)))
    unknown = [name for name in names if name not in own and sensor_of(name) is None]
    counted = {name: n for n, name in numbers}
    if len(unknown) == len(names) == len(SENSORS) and [n for n, _ in numbers] in (
        list(range(len(SENSORS))),
        list(range(1, len(SENSORS) + 1)),
    ):
        first = numbers[0][0]
        own = {name: SENSORS[counted[name] - first] for name in names}
        said = (
            f"stations {first} to {first + 16} are taken in the order {', '.join(SENSORS)}; say otherwise in [sensors]"
        )
    found: dict[str, str] = {}
    for name in names:
        ours = own[name] if name in own else sensor_of(name) or name
        if ours and ours in found.values():
            twin = next(n for n, o in found.items() if o == ours)
            raise ValueError(f"sensors: want each once, got {twin!r} and {name!r}, both {ours}; rename one of them")
        found[name] = ours
    return tuple(found.values()), said


def unknown_sensor(name: str) -> str:
    """Say what to do about a sensor that is none of the suit's."""
    near = difflib.get_close_matches(name, SENSORS, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(SENSORS)}"
    return (
        f"sensor {name!r}: want a sensor of the suit ({hint}); rename it, or say in odori.toml, [sensors], which it "
        f'is, or "{name}" = "" to leave it out'
    )
