"""From the files under ``clips/`` to clips, skeletons and poses, file by file."""

from collections.abc import Iterator

import dagster as dg
import pyarrow as pa

from assets import tables
from assets.declare import table_assets
from assets.formats import bvh
from assets.formats.errors import FormatError
from assets.lineage import (
    ClipStamp,
    Earlier,
    Part,
    Parts,
    Progress,
    code_version,
    content_version,
    version_of,
)
from assets.partitions import SESSION, lake_key
from assets.sources import Clip, Studio, session_version
from kernels.skeleton.naming import map_joints
from schemas.motion import CLIP, POSE, SKELETON


@table_assets(
    "capture",
    # Poses first: they are made one session at a time while they are stored, and leave the small tables behind.
    (POSE, SKELETON, CLIP),
    group="capture",
    code_version="1",
    settings="joints limits",
    sources="clips",
    partitions=SESSION,
)
def capture(
    context: dg.AssetExecutionContext,
    studio: dg.ResourceParam[Studio],
    earlier: dg.ResourceParam[Earlier],
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Parts]]:
    """Read every file of a session, or refuse it with a reason; unchanged files are carried over."""
    sessions = studio.sources().sessions()
    keys = [lake_key(key) for key in context.partition_keys]
    progress.begin("reading clips", sum(len(sessions.get(key, ())) for key in keys))
    reader = _Reader(studio, earlier, progress, code_version(context, CLIP.name))
    small: dict[str, list[Part]] = {SKELETON.name: [], CLIP.name: []}

    def poses() -> Iterator[Part]:
        for key in keys:
            parts = reader.read(key, sessions.get(key, ()))
            small[SKELETON.name].append(parts[SKELETON.name])
            small[CLIP.name].append(parts[CLIP.name])
            yield parts[POSE.name]

    yield dg.Output(Parts(poses()), POSE.name)
    for name, parts in small.items():
        yield dg.Output(Parts(parts), name)


_UNREAD = "cannot be read"


class _Reader:
    """Reads sessions, carrying over what an earlier run read of files with the same bytes."""

    def __init__(self, studio: Studio, earlier: Earlier, progress: Progress, code: str) -> None:
        self._studio, self._earlier, self._progress = studio, earlier, progress
        self._joints = studio.settings().joints
        self._max_bytes = int(studio.settings().limits.largest_clip_mb * 1e6)
        self._reading = version_of(code, repr(sorted(self._joints.items())))

    def read(self, session: str, clips: tuple[Clip, ...]) -> dict[str, Part]:
        """Make the three tables of one session."""
        known = self._carried(session)
        rows, stamps, n_read = [], {}, 0
        skeletons, poses = {}, {}
        is_unread = False
        for clip in clips:
            made_from = version_of(self._reading, clip.sha256)
            if clip.problem:
                row = _refused(clip.problem)
            elif clip.key in known and known[clip.key][0] == made_from:
                _, row, skeletons[clip.key], poses[clip.key] = known[clip.key]
            else:
                row, skeletons[clip.key], poses[clip.key] = self._parse(clip)
                n_read += 1
                is_unread |= row["state"] == "refused" and str(row["reason"]).startswith(_UNREAD)
            rows.append(_row(clip, row))
            if not clip.problem and not str(rows[-1]["reason"] or "").startswith(_UNREAD):
                stamps[clip.key] = made_from
            self._progress.step()
        counts = {"computed_clips": n_read, "carried_clips": len(clips) - n_read}
        refused = [f"{r['path']}: {r['reason']}" for r in rows if r["state"] == "refused"]
        # What the disk refused may be readable next time: such a session is never taken for fresh.
        version = version_of(session_version(clips), "unread") if is_unread else session_version(clips)
        by_clip = {row["clip_id"]: tables.from_rows(CLIP, [row]) for row in rows if row["source_sha256"]}
        return {
            POSE.name: Part(session, tables.concat(POSE, _filled(poses)), version, _stamps(stamps, poses), counts),
            SKELETON.name: Part(
                session, tables.concat(SKELETON, _filled(skeletons)), version, _stamps(stamps, skeletons)
            ),
            CLIP.name: Part(
                session,
                tables.from_rows(CLIP, rows),
                version,
                _stamps(stamps, {key: by_clip[key] for key in stamps}),
                counts | {"refused_clips": len(refused), "refusals": dg.MetadataValue.md(_listed(refused))},
            ),
        }

    def _carried(self, session: str) -> dict[str, tuple[str, dict[str, object], pa.Table, pa.Table]]:
        """Look up what is known of each clip: what it was read from, its row, its skeleton, its pose."""
        stamps = [self._earlier.stamp(table.name, session) for table in (POSE, SKELETON, CLIP)]
        clip, skeleton, pose = (self._earlier.table(t.name, session) for t in (CLIP, SKELETON, POSE))
        if any(stamp is None for stamp in stamps) or clip is None or skeleton is None or pose is None:
            return {}
        # The three are stored one after the other: after a kill in between they may be of different readings.
        made_from = [{c: s.made_from for c, s in stamp.clips.items()} for stamp in stamps if stamp]
        agreed = {c for c, version in made_from[0].items() if all(m.get(c) == version for m in made_from)}
        skeletons, poses = tables.by_clip(skeleton), tables.by_clip(pose)
        return {
            row["clip_id"]: (
                made_from[0][row["clip_id"]],
                row,
                skeletons.get(row["clip_id"], SKELETON.empty()),
                poses.get(row["clip_id"], POSE.empty()),
            )
            for row in clip.to_pylist()
            if row["clip_id"] in agreed and row["source_sha256"]
        }

    def _parse(self, source: Clip) -> tuple[dict[str, object], pa.Table, pa.Table]:
        try:
            take = bvh.to_clip(bvh.read(self._studio.file(source.path), max_bytes=self._max_bytes), extra=self._joints)
            mapping = take.mapping or map_joints(take.clip.skeleton, self._joints)
        except (FormatError, ValueError, OSError) as error:
            return _refused(_sentence(error)), SKELETON.empty(), POSE.empty()
        clip, world = take.clip, take.world
        row: dict[str, object] = {
            "frame_rate_hz": clip.frame_rate_hz,
            "frame_count": clip.n_frames,
            "duration_s": clip.duration_s,
            "state": "read",
            "reason": None,
            "joint_count": len(clip.skeleton.joints),
            "metres_per_unit": world.metres_per_unit,
            "up_axis": world.up_axis,
            "root_offset_rule": world.root_offset_rule,
            "naming_family": mapping.family,
        }
        return row, tables.from_skeleton(source.key, clip.skeleton, mapping), tables.from_pose(source.key, clip)


def _refused(reason: str) -> dict[str, object]:
    nothing = dict.fromkeys(("frame_count", "joint_count"), 0) | dict.fromkeys(
        ("frame_rate_hz", "duration_s", "metres_per_unit"), 0.0
    )
    texts = dict.fromkeys(("up_axis", "root_offset_rule", "naming_family"), "")
    return {**nothing, **texts, "state": "refused", "reason": reason}


def _row(clip: Clip, reading: dict[str, object]) -> dict[str, object]:
    facts = clip.facts
    return {
        **reading,
        "clip_id": clip.key,
        "session": clip.session,
        "path": clip.path.encode("utf-8", "backslashreplace").decode(),
        "source_sha256": clip.sha256,
        "label": facts.label,
        "style": facts.style,
        "subject": facts.subject,
        "licence": facts.licence,
    }


def _sentence(error: Exception) -> str:
    if isinstance(error, FormatError):
        return f"line {error.line}: {error.what}" if error.line else error.what
    if isinstance(error, OSError):
        return f"{_UNREAD}: {error.strerror or error}; see to the file"
    return str(error)


def _filled(parts: dict[str, pa.Table]) -> list[pa.Table]:
    return [part for part in parts.values() if part.num_rows]


def _stamps(made_from: dict[str, str], parts: dict[str, pa.Table]) -> dict[str, ClipStamp]:
    return {clip: ClipStamp(made_from[clip], content_version(part)) for clip, part in parts.items()}


def _listed(lines: list[str], longest: int = 50) -> str:
    more = f"\n- … and {len(lines) - longest} more" if len(lines) > longest else ""
    return "".join(f"- {line}\n" for line in lines[:longest]) + more or "none"
