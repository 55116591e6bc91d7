"""Whose body a dance is danced with: a clip's bones, or a rigged character from a USD file."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from assets.formats import tree, usd_character
from assets.formats.errors import FormatError
from assets.formats.usd_character import Copy, UsdRig
from assets.sources.sources import FilePath, Sources, Studio, brief_of, fingerprint, request_of
from assets.stamps import Stored
from assets.tables.motion import to_pose, to_skeleton
from kernels.skeleton import grounding, kinematics
from kernels.skeleton.body_fit import fit
from kernels.skeleton.body_measure import leg_length_m, measure
from kernels.skeleton.canonical import LEG_LENGTH_M
from kernels.skeleton.contacts import find_contacts, foot_slide
from kernels.types import Clip, Float, Skeleton


class CharacterError(ValueError):
    """A character that cannot be danced with; one sentence."""


@dataclass(frozen=True, eq=False)
class Cast:
    """A character ready to dance.

    Parameters
    ----------
    figure : Skeleton of the canonical joints with its bones
    facts : what the provenance says of it
    rig, copy : of a character from a USD file, else None
    """

    figure: Skeleton
    facts: Mapping[str, object] = field(default_factory=dict)
    rig: UsdRig | None = None
    copy: Copy | None = None


def character_of(studio: Studio, key: str, sources: Sources | None = None) -> str:
    """Find the character of a dance: the command's, else the brief's; "" for odori's own mannequin."""
    return request_of(studio, key).character or brief_of(studio, key.split("|")[0], sources).character


def character_version(studio: Studio, key: str, sources: Sources | None = None) -> str:
    """Version of the character of a dance: its name, and the bytes of its file where it has one."""
    text = character_of(studio, key, sources)
    if not text or not usd_character.is_file(text):
        return fingerprint(text)
    place = find_file(studio, text)
    return fingerprint([text, tree.sha256(place) if place is not None else "missing"])


def find_file(studio: Studio, text: str) -> FilePath | None:
    """Find the file of a character: at its place, below the studio, or beside the songs and their briefs."""
    name = usd_character.split(text)[0]
    places = [studio.file(name), studio.file(f"songs/{name}")]  # of an absolute path both are that path
    return next((place for place in places if place.is_file()), None)


def read_file(studio: Studio, text: str) -> Cast:
    """Read a character from a USD file, ``FILE.usd`` or ``FILE.usd:/Path/To/Skeleton``.

    Raises
    ------
    CharacterError
        If the file is not there, or cannot be danced with.
    """
    name, prim = usd_character.split(text)
    place = find_file(studio, text)
    if place is None:
        raise CharacterError(f"{name}: want the USD file of a character, got no such file; check the path")
    try:
        rig = usd_character.read_rig(place, prim=prim, extra=studio.settings().joints)
        copy = usd_character.flat_copy(place)
    except FormatError as error:
        raise CharacterError(str(error)) from error
    facts = {**usd_character.facts(rig), "sha256": tree.sha256(place)}
    return Cast(rig.character.figure, facts, rig, copy)


def read_clip(clip_id: str, skeleton: Stored, pose: Stored) -> Cast:
    """Take the bones of a clip's rig.

    Raises
    ------
    CharacterError
        If there is no such clip, or its body cannot be danced with.
    """
    session = next((key for key in skeleton.keys if clip_id in skeleton.stamp(key).clips), None)
    rows = None if session is None else skeleton.read(session, clip_ids={clip_id})
    if session is None or rows is None or not rows.num_rows:
        raise CharacterError(
            f"{clip_id}: want a clip that was read, or a USD file, got no such clip; see 'odori status'"
        )
    rig, mapping = to_skeleton(rows)
    moved = to_pose(pose.read(session, clip_ids={clip_id}), rig)
    try:
        found = measure(moved, mapping)
    except ValueError as error:
        raise CharacterError(f"{clip_id}: {error}") from error
    return Cast(found.figure, {"clip_id": clip_id, "scale_ratio": round(found.scale_ratio, 6)})


def dress(dance: Clip, cast: Cast) -> tuple[Clip, dict[str, object]]:
    """Fit a dance to a character, and measure its feet there.

    Parameters
    ----------
    dance : Clip on the canonical skeleton, F >= 1 frames
    cast : Cast

    Returns
    -------
    Clip on ``cast.figure``
    dict
        The cast's facts, with slide of feet near the floor, what of it the dance in proportion does not have, and
        depth below the floor, at the character's own size.
    """
    fitted = fit(dance, cast.figure)
    planted = find_contacts(
        *_feet(dance),
        frame_rate_hz=dance.frame_rate_hz,
        planted_height_m=(grounding.ANKLE_HEIGHT_M, grounding.TOES_HEIGHT_M),
    )
    ankle, toes = _feet(fitted)
    lowest = min(float(ankle[..., 1].min()), float(toes[..., 1].min()))
    ours, there = (
        100 * foot_slide(*feet, planted, frame_rate_hz=dance.frame_rate_hz) for feet in (_feet(dance), (ankle, toes))
    )
    scale = leg_length_m(cast.figure) / LEG_LENGTH_M
    measures = {
        "foot_slide_cm_per_s": round(there, 3),
        "added_foot_slide_cm_per_s": round(there - scale * ours, 3),
        "penetration_cm": round(100 * max(-lowest, 0.0), 3),
    }
    return fitted, {**cast.facts, **measures}


def _feet(clip: Clip) -> tuple[Float, Float]:
    position, _ = kinematics.place(clip)
    return position[:, grounding.ANKLES], position[:, grounding.TOES]
