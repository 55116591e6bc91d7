"""From the files under ``clips/`` to clips, skeletons and poses: parsed or calibrated, and examined."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import dagster as dg
import pyarrow as pa

from assets.declare import code_version, table_assets
from assets.formats import bvh
from assets.formats.errors import FormatError
from assets.partitions import SESSION, lake_key
from assets.plots import calibration as calibration_plots
from assets.plots.spikes import loud, spikes
from assets.sources.calibration import CalibrationError, Solvers, calibrate_file, up_axis
from assets.sources.sources import ClipFile, Studio, session_version
from assets.stamps import ClipStamp, Earlier, Part, Parts, Progress, content_version, version_of
from assets.tables import pack
from assets.tables.calibration import from_calibration
from assets.tables.motion import from_clip_fault, from_pose, from_skeleton, to_fence, to_pose, to_skeleton
from kernels.health.bridging import bridge
from kernels.health.examine import examine
from kernels.health.verdicts import ExaminedClip, within
from kernels.skeleton.naming import JointMapping, map_joints
from kernels.types import Clip
from schemas.calibration import CALIBRATION
from schemas.motion import CLIP, CLIP_FAULT, POSE, SKELETON


@table_assets(
    "capture",
    # Poses first: they are made one session at a time while they are stored, and leave the small tables behind.
    (POSE, SKELETON, CALIBRATION, CLIP_FAULT, CLIP),
    group="capture",
    code_version="7",
    settings="joints limits calibration sensors",
    sources="clips",
    partitions=SESSION,
    checks={"whole": (CLIP_FAULT, "No clip is broken: nothing had to be mended, fenced, doubted or refused.")},
)
def capture(
    context: dg.AssetExecutionContext,
    studio: dg.ResourceParam[Studio],
    solvers: dg.ResourceParam[Solvers],
    earlier: dg.ResourceParam[Earlier],
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Parts] | dg.AssetCheckResult]:
    """Read every file of a session, or refuse it with a reason; unchanged files are carried over."""
    sessions = studio.sources().sessions()
    keys = [lake_key(key) for key in context.partition_keys]
    progress.begin("reading clips", sum(len(sessions.get(key, ())) for key in keys))
    reader = _Reader(studio, solvers, earlier, progress, code_version(context, CLIP.name))
    small: dict[str, list[Part]] = {table.name: [] for table in (SKELETON, CALIBRATION, CLIP_FAULT, CLIP)}

    def poses() -> Iterator[Part]:
        for key in keys:
            parts = reader.read(key, sessions.get(key, ()))
            for name, made in small.items():
                made.append(parts[name])
            yield parts[POSE.name]

    yield dg.Output(Parts(poses()), POSE.name)
    for name, parts in small.items():
        yield dg.Output(Parts(parts), name)
    yield _is_whole(small[CLIP_FAULT.name])


_UNREAD = "cannot be read"


@dataclass(frozen=True, eq=False)
class _Reading:
    """What a file came to: its row, and its rows in the tables of skeletons, poses, calibrations and faults."""

    row: dict[str, object]
    skeleton: pa.Table
    pose: pa.Table
    calibration: pa.Table
    fault: pa.Table


class _Reader:
    """Reads sessions, carrying over what an earlier run read of files with the same bytes."""

    def __init__(self, studio: Studio, solvers: Solvers, earlier: Earlier, progress: Progress, code: str) -> None:
        self._studio, self._solvers, self._earlier, self._progress = studio, solvers, earlier, progress
        self._settings = studio.settings()
        self._max_bytes = int(self._settings.limits.largest_clip_mb * 1e6)
        joints = repr(sorted(self._settings.joints.items()))
        sensors = repr(sorted(self._settings.sensors.items()))
        self._made_by = {
            "bvh": version_of(code, joints),
            "suit": version_of(code, joints, sensors, repr(self._settings.calibration)),
        }

    def read(self, session: str, clips: tuple[ClipFile, ...]) -> dict[str, Part]:
        """Make the tables of one session."""
        known = self._carried(session)
        rows, stamps, n_read = [], {}, 0
        is_unread = False
        found: dict[str, _Reading] = {}
        for clip in clips:
            made_from = version_of(self._made_by[clip.kind], clip.sha256, _answered_for(clip))
            if clip.problem:
                row = _refused(clip.problem)
            elif clip.key in known and known[clip.key][0] == made_from:
                found[clip.key] = known[clip.key][1]
                row = found[clip.key].row
            else:
                found[clip.key] = self._calibrate(clip) if clip.kind == "suit" else self._parse(clip)
                row = found[clip.key].row
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
        doubtful = [f"{r['path']}: {w}" for r in rows for w in r["warnings"]]  # type: ignore[attr-defined]
        by_clip = {row["clip_id"]: pack.from_rows(CLIP, [row]) for row in rows if row["source_sha256"]}
        made = {
            POSE.name: {key: reading.pose for key, reading in found.items()},
            SKELETON.name: {key: reading.skeleton for key, reading in found.items()},
            CALIBRATION.name: {key: reading.calibration for key, reading in found.items()},
            CLIP_FAULT.name: {key: reading.fault for key, reading in found.items()},
        }
        parts = {
            table.name: Part(
                session,
                pack.concat(table, _filled(made[table.name])),
                version,
                _stamps(stamps, made[table.name]),
                counts if table is POSE else _shown(found) if table is CLIP_FAULT else {},
            )
            for table in (POSE, SKELETON, CLIP_FAULT)
        }
        calibration = pack.concat(CALIBRATION, _filled(made[CALIBRATION.name]))
        solver = self._solvers(self._studio.settings().calibration.method) if calibration.num_rows else None
        parts[CALIBRATION.name] = Part(
            session,
            calibration,
            version,
            _stamps(stamps, made[CALIBRATION.name]),
            {"calibrations": dg.MetadataValue.md(calibration_plots.session(calibration, doubtful))}
            | ({"device": getattr(solver, "name", "reference")} if calibration.num_rows else {}),
        )
        parts[CLIP.name] = Part(
            session,
            pack.from_rows(CLIP, rows),
            version,
            _stamps(stamps, {key: by_clip[key] for key in stamps}),
            counts
            | {
                "refused_clips": len(refused),
                "refusals": dg.MetadataValue.md(_listed(refused)),
                "warnings": dg.MetadataValue.md(_listed(doubtful)),
            },
        )
        return parts

    def _carried(self, session: str) -> dict[str, tuple[str, _Reading]]:
        """Look up the record of each clip: what it was read from, and its rows."""
        order = (CLIP, SKELETON, POSE, CALIBRATION, CLIP_FAULT)
        stamps = [self._earlier.stamp(table.name, session) for table in order]
        stored = [self._earlier.table(table.name, session) for table in order]
        if any(stamp is None for stamp in stamps) or any(table is None for table in stored):
            return {}
        # They are stored one after the other: after a kill in between they may be of different readings.
        made_from = [{c: s.made_from for c, s in stamp.clips.items()} for stamp in stamps if stamp]
        agreed = {c for c, version in made_from[0].items() if all(m.get(c) == version for m in made_from)}
        clip, *parts = stored
        of = [pack.by_clip(part) for part in parts]
        nothing = [table.empty() for table in order[1:]]
        return {
            row["clip_id"]: (
                made_from[0][row["clip_id"]],
                _Reading(row, *(o.get(row["clip_id"], n) for o, n in zip(of, nothing, strict=True))),
            )
            for row in clip.to_pylist()  # type: ignore[union-attr]
            if row["clip_id"] in agreed and row["source_sha256"]
        }

    def _parse(self, source: ClipFile) -> _Reading:
        try:
            read = bvh.read(self._studio.file(source.path), max_bytes=self._max_bytes)
            take = bvh.to_clip(read, extra=self._settings.joints)
            mapping = take.mapping or map_joints(take.clip.skeleton, self._settings.joints)
        except (FormatError, ValueError, OSError) as error:
            return _nothing(_sentence(error))
        examined = _examined(take.clip, mapping, source)
        if examined.refusal:
            return _nothing(examined.refusal, from_clip_fault(source.key, examined.faults, take.clip))
        row = _read(
            examined,
            metres_per_unit=take.world.metres_per_unit,
            up_axis=take.world.up_axis,
            root_offset_rule=take.world.root_offset_rule,
            naming_family=mapping.family,
        )
        return _Reading(
            row,
            from_skeleton(source.key, examined.clip.skeleton, mapping),
            from_pose(source.key, examined.clip, examined.is_fenced),
            CALIBRATION.empty(),
            from_clip_fault(source.key, examined.faults, take.clip),
        )

    def _calibrate(self, source: ClipFile) -> _Reading:
        try:
            found = calibrate_file(
                self._studio.file(source.path),
                settings=self._settings.calibration,
                sensors=self._settings.sensors,
                solvers=self._solvers,
                max_bytes=self._max_bytes,
            )
            mapping = map_joints(found.clip.skeleton, self._settings.joints)
        except (FormatError, CalibrationError, ValueError, OSError) as error:
            return _nothing(_sentence(error))
        examined = _examined(found.clip, mapping, source)
        if examined.refusal:
            return _nothing(examined.refusal, from_clip_fault(source.key, examined.faults, found.clip))
        row = _read(
            examined,
            metres_per_unit=found.suit.metres_per_unit,
            up_axis=up_axis(found.gauge),
            root_offset_rule="",
            naming_family=mapping.family,
            warnings=list(found.warnings),
        )
        return _Reading(
            row,
            from_skeleton(source.key, examined.clip.skeleton, mapping),
            from_pose(source.key, examined.clip, examined.is_fenced),
            from_calibration(source.key, found),
            from_clip_fault(source.key, examined.faults, found.clip),
        )


def _shown(found: Mapping[str, _Reading]) -> dict[str, object]:
    """Show a session's faults, beside the motion as it is danced."""
    faults = pack.concat(CLIP_FAULT, _filled({key: reading.fault for key, reading in found.items()}))
    danced = {}
    for key in {str(row["clip_id"]) for row in loud(faults)}:
        if found[key].pose.num_rows:
            rig, _ = to_skeleton(found[key].skeleton)
            danced[key] = bridge(to_pose(found[key].pose, rig), to_fence(found[key].pose))
    return {"faults": dg.MetadataValue.md(spikes(faults, danced))}


def _is_whole(parts: Sequence[Part]) -> dg.AssetCheckResult:
    """Check that nothing is broken, session by session; who looks here sees which is."""
    broken = {part.key: [f"{row['clip_id']}: {row['reason']}" for row in loud(part.table)] for part in parts}
    return dg.AssetCheckResult(
        check_name="whole",
        asset_key=CLIP_FAULT.name,
        passed=not any(broken.values()),
        severity=dg.AssetCheckSeverity.WARN,
        metadata={
            **{key or "clips": dg.MetadataValue.md(_listed(lines)) for key, lines in broken.items() if lines},
            "broken_sessions": sum(map(bool, broken.values())),
            "pictures": dg.MetadataValue.md(
                "\n\n".join(str(part.metadata["faults"].value) for part in parts if broken[part.key]) or "none"
            ),
        },
    )


def _examined(clip: Clip, mapping: JointMapping, source: ClipFile) -> ExaminedClip:
    """Examine a clip, unless the studio answers for it itself; what it cut off is not danced."""
    said = source.facts
    found = ExaminedClip(clip) if said.health == "ok" else examine(clip, mapping)
    return within(found, said.start_s, said.end_s)


def _answered_for(clip: ClipFile) -> str:
    """Say what of a clip's reading its facts decide."""
    said = clip.facts
    return "" if not said.health and said.start_s is said.end_s else repr((said.health, said.start_s, said.end_s))


def _read(examined: ExaminedClip, **said: object) -> dict[str, object]:
    clip = examined.clip
    return {
        "frame_rate_hz": clip.frame_rate_hz,
        "frame_count": clip.n_frames,
        "duration_s": clip.duration_s,
        "state": "read",
        "reason": None,
        "danceability_ratio": float(1.0 - examined.is_fenced.mean()) if clip.n_frames else 0.0,
        "joint_count": len(clip.skeleton.joints),
        "warnings": [],
        **said,
    }


def _nothing(reason: str, fault: pa.Table | None = None) -> _Reading:
    faults = CLIP_FAULT.empty() if fault is None else fault
    return _Reading(_refused(reason), SKELETON.empty(), POSE.empty(), CALIBRATION.empty(), faults)


def _refused(reason: str) -> dict[str, object]:
    nothing = dict.fromkeys(("frame_count", "joint_count"), 0) | dict.fromkeys(
        ("frame_rate_hz", "duration_s", "metres_per_unit", "danceability_ratio"), 0.0
    )
    texts = dict.fromkeys(("up_axis", "root_offset_rule", "naming_family"), "")
    return {**nothing, **texts, "state": "refused", "reason": reason, "warnings": []}


def _row(clip: ClipFile, reading: dict[str, object]) -> dict[str, object]:
    facts = clip.facts
    return {
        **reading,
        "clip_id": clip.key,
        "session": clip.session,
        "path": clip.path.encode("utf-8", "backslashreplace").decode(),
        "source_sha256": clip.sha256,
        "source_format": clip.kind if clip.sha256 else "",
        "label": facts.label,
        "is_labelled": facts.is_labelled,
        "style": facts.style,
        "subject": facts.subject,
        "licence": facts.licence,
        "performed_to": facts.performed_to,
        "performed_offset_s": facts.performed_offset_s,
        "health": facts.health,
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
    """Stamp the clips whose reading is known; what the disk refused is read again."""
    return {
        clip: ClipStamp(made_from[clip], content_version(part)) for clip, part in parts.items() if clip in made_from
    }


def _listed(lines: list[str], longest: int = 50) -> str:
    more = f"\n- … and {len(lines) - longest} more" if len(lines) > longest else ""
    return "".join(f"- {line}\n" for line in lines[:longest]) + more or "none"
