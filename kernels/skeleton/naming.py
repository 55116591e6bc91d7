"""Which joint of a rig is which canonical joint: by its names, and by its shape where names fail.

Conventions
-----------
A name is compared without its namespace, its rig's prefix, case and separators, and its side is taken off first:
``mixamorig:LeftUpLeg``, ``thigh.L`` and ``Bip01 L Thigh`` become left *upleg*, left *thigh*, left *thigh*.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

from kernels.skeleton import canonical, topology
from kernels.types import Skeleton

END_SUFFIX = "_end"

_PARTS = ("hips", "head", *topology.ARM, *topology.LEG)


class NoBodyError(ValueError):
    """A rig in which no human body was found."""


@dataclass(frozen=True)
class JointMapping:
    """The rig's joint for each canonical joint that has one.

    Parameters
    ----------
    joint : canonical name to the rig's name
        Has all of ``canonical.REQUIRED_JOINTS``.
    family : str
        The table of names that fitted: ``"mixamo"``, ``"bandai"`` …; ``"topology"`` where the shape decided,
        ``"user"`` where the user's own table did alone.
    """

    joint: Mapping[str, str]
    family: str


def _family(centre: str, arm: str, leg: str) -> dict[str, tuple[str, ...]]:
    """Names by part: parts are separated by spaces, spellings of one by slashes."""
    spellings = (*centre.split(), *arm.split(), *leg.split())
    return {part: tuple(spelling.split("/")) for part, spelling in zip(_PARTS, spellings, strict=True)}


# Only hips, head and limbs are told by name: what lies between hips and arms is the spine, above it the neck.
_FAMILIES: dict[str, dict[str, tuple[str, ...]]] = {
    "vrm": _family("hips head", "shoulder upperarm lowerarm hand", "upperleg lowerleg foot toes/toebase/toe"),
    "lafan1": _family("hips head", "shoulder arm forearm hand", "upleg leg foot toe"),
    "humanik": _family(
        "hips/hip/pelvis/root head",
        "shoulder arm/uparm forearm hand",
        "upleg/upperleg leg/lowerleg foot toebase/toe/toes",
    ),
    "rokoko": _family("hips/hip head", "shoulder arm/upperarm forearm/lowerarm hand", "thigh/upleg shin/leg foot toe"),
    "xsens": _family("pelvis/hips head", "shoulder upperarm forearm hand", "upperleg lowerleg foot toe/toebase"),
    "mvn": _family(
        "hips/hip/root head",
        "collar/clavicle/scapula shoulder elbow wrist/hand",
        "hip knee ankle/foot toe/toes/toebase",
    ),
    "cgspeed": _family(
        "hip/hips head",
        "collar shldr/shldrbend/shoulder forearm/forearmbend hand",
        "thigh/thighbend shin foot toe/toes",
    ),
    "cmu": _family("root head", "clavicle humerus radius hand/wrist", "femur tibia foot toes"),
    "smpl": _family(
        "pelvis/hips/spinebase/hipcenter head", "collar/clavicle shoulder elbow wrist", "hip knee ankle foot"
    ),
    "blender": _family(
        "pelvis/hips/spine/root head/face/spine006",
        "shoulder/clavicle upperarm forearm/lowerarm hand",
        "thigh/upperleg shin/lowerleg/calf foot toe/toes",
    ),
    "unreal": _family("pelvis head", "clavicle upperarm lowerarm hand", "thigh calf foot ball/toe"),
    "biped": _family("pelvis/hip head", "clavicle upperarm forearm hand", "thigh calf foot toe0/toebase/toe"),
    "suit": _family("pelvis head", "shoulder upperarm forearm hand", "thigh shank foot toe"),
    "optitrack": _family("hip/hips head", "shoulder uarm farm hand", "thigh shin foot toe"),
    "mmd": _family("下半身/腰 頭", "肩 腕 ひじ/肘 手首", "足 ひざ/膝 足首 つま先/足先ex"),
}
# Rigs whose spelling, not whose vocabulary, tells them from another family.
_MARKS = {
    "mixamo": re.compile(r"^mixamorig\d*[:_]", re.IGNORECASE),
    "bandai": re.compile(r"^joint_Root$"),
    "cmu": re.compile(r"^[lr]hipjoint$", re.IGNORECASE),
}
_PREFIX = re.compile(
    r"^(?:mixamorig\d*|character\d*|valvebiped|bip\d*|cc_base|j_bip|j_sec|joint|jnt|def|org|sk|m_avg|f_avg|c(?=_))[_.\s-]+",
    re.IGNORECASE,
)
_SIDES = {"left": "left", "l": "left", "lft": "left", "左": "left"}
_SIDES |= {"right": "right", "r": "right", "rgt": "right", "右": "right"}
_CENTRES = ("m", "mid", "c")
_VOCABULARY = frozenset(name for family in _FAMILIES.values() for names in family.values() for name in names)


def map_joints(skeleton: Skeleton, extra: Mapping[str, str] | None = None) -> JointMapping:
    """Find the canonical joints of a rig.

    Parameters
    ----------
    skeleton : Skeleton
        Of any units, axes and rest pose. Joints named ``<joint>_end`` are taken as the ends of bones: they stand in
        for hands and toes that the rig has no joint for.
    extra : rig's name to canonical name, or None
        The user's own table. Wins over everything; names that this rig does not have are left alone.

    Returns
    -------
    JointMapping
        With all of ``canonical.REQUIRED_JOINTS``; the spine, neck, shoulders and toes as far as the rig has them.

    Raises
    ------
    NoBodyError
        If neither names nor shape tell a human body, listing the joints and what to write into ``odori.toml``.
    ValueError
        If the user's table names what is no canonical joint, or one canonical joint twice.
    """
    user = _user_joints(skeleton, extra or {})
    joint, family = _by_name(skeleton, user)
    if joint is None:
        joint, family = (
            topology.find_body(skeleton, sides=tuple(side_and_part(n)[0] for n in skeleton.joints)),
            "topology",
        )
    if joint is not None:
        joint = {name: source for name, source in joint.items() if source not in user.values()} | user
        joint = _add_ends(skeleton, joint)
        if _is_body(skeleton, joint):
            joint = topology.spread_spine(skeleton, joint) | user
            ordered = {name: joint[name] for name in canonical.JOINTS if name in joint}
            return JointMapping(ordered, family)
    raise NoBodyError(
        f"joints: want a human body by names or by shape, got {', '.join(skeleton.joints)}; say which joint is which "
        'in odori.toml: a table [joints] with lines "name in the file" = "canonical name", for '
        f"{', '.join(name for name in canonical.REQUIRED_JOINTS if name not in user)}"
    )


def _user_joints(skeleton: Skeleton, extra: Mapping[str, str]) -> dict[str, str]:
    user: dict[str, str] = {}
    for source, name in extra.items():
        if name not in canonical.JOINTS:
            raise ValueError(f"joints: want one of {', '.join(canonical.JOINTS)}, got {name!r} for {source!r}")
        if source in skeleton.joints:
            if name in user:
                raise ValueError(f"joints: want one joint for {name!r}, got {user[name]!r} and {source!r}")
            user[name] = source
    return user


def _by_name(skeleton: Skeleton, user: dict[str, str]) -> tuple[dict[str, str] | None, str]:
    """Joints of the family that knows most of the rig's names; None when none knows all that are required."""
    known = [(family, dict(joint) | user) for family, joint in _by_family(skeleton.joints)]
    for family, joint in sorted(known, key=lambda one: -len(one[1])):
        if _is_body(skeleton, _add_ends(skeleton, joint)):
            return joint, "user" if len(joint) == len(user) else family
    return None, "user"


@lru_cache(maxsize=64)
def _by_family(names: tuple[str, ...]) -> tuple[tuple[str, tuple[tuple[str, str], ...]], ...]:
    """List what each family of names knows of a rig: its joints by canonical name, in pairs."""
    known: dict[tuple[str, str], str] = {}
    shared = _shared_prefix(names)
    for name in names:
        known.setdefault(side_and_part(name[len(shared) :]), name)
    marked = next((family for family, mark in _MARKS.items() if any(mark.match(name) for name in names)), None)
    found = []
    for family, parts in _FAMILIES.items():
        joint = {}
        for part, spellings in parts.items():
            for side in ("",) if part in ("hips", "head") else ("left", "right"):
                spelling = next((one for one in spellings if (side, one) in known), None)
                if spelling is not None:
                    joint[side + part] = known[side, spelling]
        found.append((marked or family, tuple(joint.items())))
    return tuple(found)


@lru_cache(maxsize=4096)
def side_and_part(name: str) -> tuple[str, str]:
    """Split a joint's name into its side (``"left"``, ``"right"`` or ``""``) and what is left of it, normalised.

    Parameters
    ----------
    name : of a joint, in any script

    Returns
    -------
    side : "left", "right" or ""
    part : in lower case, without prefixes and separators; "" where nothing else stands
    """
    text = re.split(r"[:|]", unicodedata.normalize("NFKC", name).strip())[-1]
    while (shorter := _PREFIX.sub("", text)) != text and shorter:
        text = shorter
    text = re.sub(r"([左右])", r" \1 ", text)
    text = re.sub(r"^([LR])(?=[A-Z])", r"\1 ", text)
    text = re.sub(r"([a-z0-9])(?=[A-Z])", r"\1 ", text)
    words = [word.lower() for word in re.split(r"[\s_.\-#]+", text) if word]
    for at in (0, -1):
        if len(words) > 1 and words[at] in _SIDES:
            side = _SIDES[words.pop(at)]
            return side, "".join(words)
        if len(words) > 1 and words[at] in _CENTRES:
            words.pop(at)
    joined = "".join(words)
    for prefix in ("left", "right", "l", "r"):
        rest = joined.removeprefix(prefix)
        if rest != joined and (rest in _VOCABULARY or (len(prefix) > 1 and rest)):
            return _SIDES[prefix], rest
    return "", joined


def _shared_prefix(names: tuple[str, ...]) -> str:
    """Find what all names start with, up to its last separator: a character's name."""
    low, high = min(names), max(names)
    n = next((k for k, (a, b) in enumerate(zip(low, high, strict=False)) if a != b), min(len(low), len(high)))
    return re.split(r"[^_.:|\s-]*$", low[:n])[0] if len(names) > 1 else ""


def _add_ends(skeleton: Skeleton, joint: dict[str, str]) -> dict[str, str]:
    """Let the ends of forearms and feet stand in for hands and toes that the rig has no joint for."""
    joint = dict(joint)
    for side in ("left", "right"):
        for parent, child in (("LowerArm", "Hand"), ("Foot", "Toes")):
            source = joint.get(side + parent)
            if side + child not in joint and source is not None and source + END_SUFFIX in skeleton.joints:
                joint[side + child] = source + END_SUFFIX
    return joint


def _is_body(skeleton: Skeleton, joint: Mapping[str, str]) -> bool:
    """Whether all required joints are there, once each, and hang together as a body's do."""
    if any(name not in joint for name in canonical.REQUIRED_JOINTS) or len(set(joint.values())) < len(joint):
        return False
    at = {name: skeleton.joints.index(source) for name, source in joint.items()}
    for side in ("left", "right"):
        for limb in (topology.ARM, topology.LEG):
            chain = [at[side + part] for part in limb if side + part in at]
            if not all(topology.is_above(skeleton, a, b) for a, b in pairwise(chain)):
                return False
    legs = topology.common_ancestor(skeleton, at["leftUpperLeg"], at["rightUpperLeg"])
    return topology.is_above(skeleton, legs, at["hips"]) or topology.is_above(skeleton, at["hips"], legs)
