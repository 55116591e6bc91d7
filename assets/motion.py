"""From poses to canonical poses and motion beats, session by session and clip by clip."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import dagster as dg
import pyarrow as pa

from assets.declare import code_version, table_asset, table_assets
from assets.partitions import SESSION
from assets.plots import matching as matching_plots
from assets.plots.motion import session_beats
from assets.reading.motion_cuts import cut
from assets.sources.sources import Studio
from assets.stamps import Earlier, Part, Parts, Progress, Stored, clip_versions, per_clip, version_of
from assets.tables import hmm as hmm_tables
from assets.tables import matching as matching_tables
from assets.tables import pack
from assets.tables.motion import (
    from_canonical_pose,
    from_motion_beat,
    from_motion_tempo,
    from_motion_turn,
    to_canonical_pose,
    to_fence,
    to_pose,
    to_skeleton,
)
from kernels import rotation
from kernels.health.bridging import bridge
from kernels.hmm.states import assign
from kernels.motion.dance_pulse import DancePulse, dance_pulse
from kernels.motion.motion_beats import BeatSettings, MotionBeats, motion_beats
from kernels.motion.motion_features import contacts_at_feature_rate, fence_at_feature_rate, motion_features
from kernels.motion.velocity import usable_frames
from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.contacts import foot_contacts
from kernels.skeleton.retarget import retarget
from schemas.hmm import BASIC_MOTION, KEY_POSE
from schemas.motion import CANONICAL_POSE, MOTION_BEAT, MOTION_FEATURE, MOTION_TEMPO, MOTION_TURN
from schemas.settings import FeatureSettings, MotionBeatSettings
from schemas.table import Table


@table_asset(CANONICAL_POSE, group="motion", code_version="2", partitions=SESSION)
def canonical_pose(
    context: dg.AssetExecutionContext,
    pose: Stored,
    skeleton: Stored,
    earlier: dg.ResourceParam[Earlier],
    progress: dg.ResourceParam[Progress],
) -> Parts:
    """Bring every clip to the canonical skeleton; what is never shown of it is bridged."""
    code = code_version(context, CANONICAL_POSE.name)

    def session(key: str) -> Part:
        made_from = {
            clip: version_of(version, skeleton.stamp(key).clips[clip].content)
            for clip, version in clip_versions(pose, key, code).items()
        }
        poses, skeletons = pack.by_clip(pose.read(key)), pack.by_clip(skeleton.read(key))

        def one(clip: str) -> pa.Table:
            if clip not in poses:
                return CANONICAL_POSE.empty()
            rig, mapping = to_skeleton(skeletons[clip])
            moved, is_fenced = to_pose(poses[clip], rig), to_fence(poses[clip])
            try:
                motion = retarget(bridge(moved, is_fenced), mapping)
            except ValueError as error:  # a body that only now turns out to be none must not stop its session
                context.log.warning(f"{clip}: left out of the canonical poses: {error}")
                return CANONICAL_POSE.empty()
            return from_canonical_pose(clip, moved.frame_rate_hz, motion, is_fenced)

        return per_clip(CANONICAL_POSE, key, made_from, one, earlier=earlier, progress=progress)

    return Parts(session(key) for key in _begun(progress, "canonical poses", pose))


@table_assets(
    "motion_beats",
    (MOTION_BEAT, MOTION_TEMPO),
    group="motion",
    code_version="3",
    settings="motion_beat",
    partitions=SESSION,
)
def motion_beats_and_tempi(
    context: dg.AssetExecutionContext,
    canonical_pose: Stored,
    clip: Stored,
    studio: dg.ResourceParam[Studio],
    earlier: dg.ResourceParam[Earlier],
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Parts]]:
    """Find the beats and the tempo of every clip, or that it has no pulse."""
    settings = studio.settings().motion_beat
    code = version_of(code_version(context, MOTION_BEAT.name), repr(settings))
    tempi: list[Part] = []

    def session(key: str) -> Part:
        poses = pack.by_clip(canonical_pose.read(key))
        found: dict[str, tuple[pa.Table, pa.Table]] = {}

        def one(clip_id: str, which: int, table: Table) -> pa.Table:
            if clip_id not in poses:
                return table.empty()
            if clip_id not in found:
                found[clip_id] = beats_of(poses[clip_id], settings)
            return found[clip_id][which]

        made_from = clip_versions(canonical_pose, key, code)
        part, tempo = (
            per_clip(table, key, made_from, partial(one, which=which, table=table), earlier=earlier, progress=told)
            for which, (table, told) in enumerate(((MOTION_BEAT, progress), (MOTION_TEMPO, None)))
        )
        tempi.append(tempo)
        picture = dg.MetadataValue.md(session_beats(part.table, clip.read(key)))
        without = tempo.table.num_rows - int(pack.to_numbers(tempo.table["has_pulse"]).sum())
        return replace(part, metadata={**part.metadata, "beats": picture, "clips_without_pulse": without})

    yield dg.Output(Parts(session(key) for key in _begun(progress, "motion beats", canonical_pose)), MOTION_BEAT.name)
    yield dg.Output(Parts(tempi), MOTION_TEMPO.name)


@table_asset(MOTION_TURN, group="motion", code_version="1", settings="motion_beat", partitions=SESSION)
def motion_turn(
    context: dg.AssetExecutionContext,
    canonical_pose: Stored,
    studio: dg.ResourceParam[Studio],
    earlier: dg.ResourceParam[Earlier],
    progress: dg.ResourceParam[Progress],
) -> Parts:
    """Find where the largest movement of every clip turns; none where those are its beats already."""
    settings = studio.settings().motion_beat
    code = version_of(code_version(context, MOTION_TURN.name), repr(settings))

    def session(key: str) -> Part:
        poses = pack.by_clip(canonical_pose.read(key)) if settings.method == "pulse" else {}

        def one(clip_id: str) -> pa.Table:
            return turns_of(poses[clip_id], settings) if clip_id in poses else MOTION_TURN.empty()

        made_from = clip_versions(canonical_pose, key, code)
        return per_clip(MOTION_TURN, key, made_from, one, earlier=earlier, progress=progress)

    return Parts(session(key) for key in _begun(progress, "turns of movements", canonical_pose))


@table_asset(MOTION_FEATURE, group="motion", code_version="3", settings="feature", partitions=SESSION)
def motion_feature(
    context: dg.AssetExecutionContext,
    canonical_pose: Stored,
    studio: dg.ResourceParam[Studio],
    earlier: dg.ResourceParam[Earlier],
    progress: dg.ResourceParam[Progress],
) -> Parts:
    """Measure weight effort, rhythm, intensity and contacts of every clip."""
    settings = studio.settings().feature
    code = version_of(code_version(context, MOTION_FEATURE.name), repr(settings))

    def session(key: str) -> Part:
        poses = pack.by_clip(canonical_pose.read(key))

        def one(clip_id: str) -> pa.Table:
            return features_of(poses[clip_id], settings) if clip_id in poses else MOTION_FEATURE.empty()

        made_from = clip_versions(canonical_pose, key, code)
        part = per_clip(MOTION_FEATURE, key, made_from, one, earlier=earlier, progress=progress)
        picture = dg.MetadataValue.md(matching_plots.session_features(part.table))
        return replace(part, metadata={**part.metadata, "features": picture})

    return Parts(session(key) for key in _begun(progress, "motion features", canonical_pose))


@table_asset(KEY_POSE, group="motion", code_version="2", settings="basic_motion", partitions=SESSION, only_for="hmm")
def key_pose(
    context: dg.AssetExecutionContext,
    canonical_pose: Stored,
    basic_motion: Stored,
    studio: dg.ResourceParam[Studio],
    earlier: dg.ResourceParam[Earlier],
    progress: dg.ResourceParam[Progress],
) -> Parts:
    """Cut every clip into motions with three key poses each, and tell of which kind each is."""
    settings = studio.settings().basic_motion
    # Started by hand before there are kinds of motions: cut all the same, of no kind.
    is_there = bool(basic_motion.keys)
    states = hmm_tables.to_states(basic_motion.read() if is_there else BASIC_MOTION.empty())
    kinds = basic_motion.stamp().content if is_there else ""
    code = version_of(code_version(context, KEY_POSE.name), repr(settings), kinds)

    def session(key: str) -> Part:
        poses = pack.by_clip(canonical_pose.read(key))

        def one(clip_id: str) -> pa.Table:
            if clip_id not in poses:
                return KEY_POSE.empty()
            found = cut(poses[clip_id], settings)
            return hmm_tables.from_key_pose(clip_id, found.motions, *assign(found.vectors, states))

        made_from = clip_versions(canonical_pose, key, code)
        part = per_clip(KEY_POSE, key, made_from, one, earlier=earlier, progress=progress)
        known = int((pack.to_numbers(part.table["state_index"]) >= 0).sum())
        return replace(part, metadata={**part.metadata, "motions": part.table.num_rows, "of_known_kind": known})

    return Parts(session(key) for key in _begun(progress, "key poses", canonical_pose))


def beats_of(rows: pa.Table, settings: MotionBeatSettings) -> tuple[pa.Table, pa.Table]:
    """Find the beats and the tempo of one clip in the frames of it that are usable.

    Parameters
    ----------
    rows : table ``canonical_pose``, the rows of one clip, at least one
    settings : the ``[motion_beat]`` section

    Returns
    -------
    table ``motion_beat``, a row a beat, and table ``motion_tempo``, one row

    Raises
    ------
    ValueError
        As :func:`beat_settings`.
    """
    moved = to_canonical_pose(rows)
    first, last = usable_frames(moved.position_xyz_m, moved.frame_rate_hz)
    kept = slice(first, last + 1)
    position, rate_hz = moved.position_xyz_m[kept], moved.frame_rate_hz
    beats: MotionBeats | DancePulse
    if settings.method == "pulse":
        beats = dance_pulse(position, rate_hz)
    else:
        heading = rotation.heading_rad(moved.rotation_wxyz[:, 0])[kept] if settings.frame == "body" else None
        beats = motion_beats(position, rate_hz, heading_rad=heading, settings=beat_settings(settings))
    table = from_motion_beat(moved.clip_id, beats, rate_hz, first_frame=first, is_fenced=moved.is_fenced)
    return table, from_motion_tempo(moved.clip_id, beats, beat_count=table.num_rows)


def turns_of(rows: pa.Table, settings: MotionBeatSettings) -> pa.Table:
    """Find the turns of one clip's largest movement in the frames of it that are usable.

    Parameters
    ----------
    rows : table ``canonical_pose``, the rows of one clip, at least one
    settings : the ``[motion_beat]`` section

    Returns
    -------
    table ``motion_turn``, a row a turn

    Raises
    ------
    ValueError
        As :func:`beat_settings`.
    """
    moved = to_canonical_pose(rows)
    first, last = usable_frames(moved.position_xyz_m, moved.frame_rate_hz)
    kept = slice(first, last + 1)
    heading = rotation.heading_rad(moved.rotation_wxyz[:, 0])[kept] if settings.frame == "body" else None
    how = beat_settings(settings)
    found = motion_beats(moved.position_xyz_m[kept], moved.frame_rate_hz, heading_rad=heading, settings=how)
    return from_motion_turn(moved.clip_id, found, moved.frame_rate_hz, first_frame=first, is_fenced=moved.is_fenced)


def features_of(rows: pa.Table, settings: FeatureSettings) -> pa.Table:
    """Measure the features of one clip.

    Parameters
    ----------
    rows : table ``canonical_pose``, the rows of one clip, at least one
    settings : the ``[feature]`` section

    Returns
    -------
    table ``motion_feature``, a row a value at 120 Hz
    """
    moved = to_canonical_pose(rows)
    found = motion_features(
        moved.position_xyz_m,
        moved.rotation_wxyz[:, 0],
        parent=CANONICAL.parent,
        offset_xyz_m=CANONICAL.offset_xyz_m,
        frame_rate_hz=moved.frame_rate_hz,
        width_s=settings.width_s,
    )
    feet = [CANONICAL.index(name) for name in ("leftFoot", "leftToes", "rightFoot", "rightToes")]
    stands = foot_contacts(moved.position_xyz_m[:, feet], moved.frame_rate_hz)
    contact = contacts_at_feature_rate(stands, moved.frame_rate_hz, len(found.rhythm))
    is_fenced = fence_at_feature_rate(moved.is_fenced, moved.frame_rate_hz, len(found.rhythm))
    return matching_tables.from_motion_feature(moved.clip_id, found.without(is_fenced), contact, is_fenced)


def beat_settings(settings: MotionBeatSettings) -> BeatSettings:
    """Turn the names of ``odori.toml`` into what the search by principal components takes.

    Parameters
    ----------
    settings : the ``[motion_beat]`` section

    Raises
    ------
    ValueError
        If a joint is none of the canonical skeleton.
    """
    joints = tuple(CANONICAL.index(name) for name in settings.joints)
    method = "fft" if settings.method == "pulse" else settings.method
    return BeatSettings(settings.component, joints, method, settings.extrema_per_beat)  # type: ignore[arg-type]


def _begun(progress: Progress, what: str, upstream: Stored) -> Iterator[str]:
    progress.begin(what, sum(len(upstream.stamp(key).clips) for key in upstream.keys))
    yield from upstream.keys
