"""What files a studio has, and what became of each: read, refused, new, changed."""

from collections.abc import Mapping, Sequence
from typing import Any

from assets.sources.sources import Sources
from assets.stamps import content_version
from assets.tables.pack import by_clip
from pipelines.studio.lake import Lake
from schemas.motion import CANONICAL_POSE, CLIP_FAULT, QUIET_FAULT_KINDS
from schemas.music import SONG

_NO_POSE = content_version(CANONICAL_POSE.empty())


def clips_and_doubts(
    sources: Sources, lake: Lake, stored: Mapping[str, Mapping[str, Any]] | None = None
) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
    """List the motion files with their states, and what is doubtful about those that were read.

    Parameters
    ----------
    sources : as found now
    lake : what earlier builds made of them
    stored : :func:`clip_rows` of the lake, where they were read already

    Returns
    -------
    files : ``path``, ``key``, ``session``, ``state`` and ``reason`` of each
        The state is "new" before a file was looked at, "changed" where it was since.
    doubts : ``path`` and ``warning``
    """
    stored = clip_rows(lake) if stored is None else stored
    troubles = _troubles(lake)
    unplaced = {session: _unplaced(lake, session) for session in lake.keys("canonical_pose")}
    found: list[dict[str, Any]] = []
    doubts: list[dict[str, str]] = []
    for clip in sources.clips:
        path = clip.path.encode("utf-8", "backslashreplace").decode()
        row = stored.get(path)
        seen = _seen(row, clip.sha256, clip.problem)
        if seen["state"] == "read" and clip.key in unplaced.get(clip.session, ()):
            seen = {"state": "refused", "reason": "its motion could not be brought to the canonical skeleton"}
        warnings = (
            [*row["warnings"], *troubles.get(clip.key, ())] if row is not None and seen["state"] == "read" else []
        )
        found.append({"path": path, "key": clip.key, "session": clip.session, **seen})
        doubts += [{"path": path, "warning": sentence} for sentence in warnings]
    return found, doubts


def _troubles(lake: Lake) -> dict[str, list[str]]:
    """Say what was mended, fenced or doubted of each clip, a sentence for each kind."""
    found: dict[str, list[str]] = {}
    for session in lake.keys(CLIP_FAULT.name):
        if lake.stamp(CLIP_FAULT.name, session) is None:
            continue
        for clip, rows in by_clip(lake.table(CLIP_FAULT.name, session)).items():
            alike: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
            for row in rows.to_pylist():
                if row["fault_kind"] not in QUIET_FAULT_KINDS and row["verdict"] != "refused":
                    alike.setdefault((row["verdict"], row["fault_kind"]), []).append(row)
            found[clip] = [_trouble(verdict, same) for (verdict, _), same in alike.items()]
    return found


def _trouble(verdict: str, same: Sequence[Mapping[str, Any]]) -> str:
    """Say one kind of fault of a clip: the first in full, and how many more there are."""
    first = same[0]
    more = f" (and {len(same) - 1} more of the kind)" if len(same) > 1 else ""
    return f"{verdict} at {first['start_s']:.2f} s: {first['reason']}{more}"


def clip_rows(lake: Lake) -> dict[str, dict[str, Any]]:
    """Rows of the table ``clip`` of all sessions, by path; those of an older version are as if they were not there.

    Parameters
    ----------
    lake : Lake
    """
    return {
        row["path"]: row
        for session in lake.keys("clip")
        if lake.stamp("clip", session) is not None
        for row in lake.table("clip", session).to_pylist()
    }


def _unplaced(lake: Lake, session: str) -> set[str]:
    """Clips of a session that were read and have no canonical pose."""
    stamp = lake.stamp("canonical_pose", session)
    return {clip for clip, made in stamp.clips.items() if made.content == _NO_POSE} if stamp else set()


def songs_found(
    sources: Sources, lake: Lake, stored: Mapping[str, Mapping[str, Any]] | None = None
) -> list[dict[str, Any]]:
    """List every music file with its state, as :func:`clips_and_doubts`.

    Parameters
    ----------
    sources : as found now
    lake : what earlier builds made of them
    stored : :func:`song_rows` of the lake, where they were read already
    """
    stored = song_rows(lake) if stored is None else stored
    found = []
    for song in sources.songs:
        path = song.path.encode("utf-8", "backslashreplace").decode()
        found.append({"path": path, "key": song.key, **_seen(stored.get(path), song.sha256, song.problem)})
    return found


def song_rows(lake: Lake) -> dict[str, dict[str, Any]]:
    """Rows of the table ``song``, by path.

    Parameters
    ----------
    lake : Lake
    """
    return {row["path"]: row for key in lake.keys(SONG.name) for row in lake.table(SONG.name, key).to_pylist()}


def _seen(row: Mapping[str, Any] | None, sha256: str, problem: str) -> dict[str, Any]:
    if problem:
        return {"state": "refused", "reason": problem}
    if row is None:
        return {"state": "new", "reason": None}
    if row["source_sha256"] != sha256:
        return {"state": "changed", "reason": None}
    return {"state": row["state"], "reason": row["reason"]}
