"""`odori search`: the clips most like a motion, from the index as it lies on disk.

Dagster is loaded only where something has to be made first: a search of an up-to-date catalogue answers at once.
"""

import difflib
import json
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from assets.formats import bvh, motion_index
from assets.formats.errors import FormatError
from assets.formats.motion_index import StoredIndex
from assets.formats.settings import read_settings
from kernels.search.aligned import MOST_FRAMES, QUERY_HZ, Alignment, align, room, track
from kernels.search.encoder import Encoder, from_arrays
from kernels.search.nearest import Copies, Hit, nearest_clips, steer
from kernels.search.windows import windows
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.types import Float, Int
from pipelines.files import StudioError, write_beside
from pipelines.outcome import DONE, Outcome
from schemas.search import MOTION_EMBEDDING, MOTION_ENCODER, MOTION_INDEX

_RANGE = re.compile(r"(?P<name>.+)@(?P<start>\d+(?:\.\d*)?|\.\d+)-(?P<end>\d+(?:\.\d*)?|\.\d+)")
_SEEN = "seen.json"
PINNED_BY_LIKENESS = 5
"""Clips most like one that a pin by likeness admits beside it."""
_MADE_FROM = ("clip", "canonical_pose", MOTION_ENCODER.name, MOTION_EMBEDDING.name)


@dataclass(frozen=True)
class Wish:
    """What is searched for.

    Parameters
    ----------
    query : clip, ``CLIP@START-END`` or path of a BVH; empty where ``like`` says it
    k : hits wanted
    label, style, licence : any of these, or of all where empty
    min_seconds, max_seconds : length of the clips found
    like, unlike : more motions to go towards, and away from
    """

    query: str = ""
    k: int = 10
    label: Sequence[str] = ()
    style: Sequence[str] = ()
    licence: Sequence[str] = ()
    min_seconds: float = 0.0
    max_seconds: float = float("inf")
    like: Sequence[str] = ()
    unlike: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class Motion:
    """One motion named in a wish.

    Parameters
    ----------
    text : as it was written
    clip_id : of the catalogue; empty for a file outside it
    start_s, end_s : the stretch of it that counts
    vector : (W, D) float32 of its windows
    poses : canonical positions, (F, 22, 3) metres, and their rate in Hz, where they were read; else None
    """

    text: str
    clip_id: str
    start_s: float
    end_s: float
    vector: NDArray[np.float32]
    poses: tuple[Float, float] | None = field(default=None)


def search(
    root: Path, wish: Wish, *, sheet: Path | None = None, train: bool = False, progress: Callable[[], Any]
) -> Outcome:
    """Find the clips most like a motion.

    Parameters
    ----------
    root : the studio
    wish : Wish
    sheet : where to draw query and hits, a PNG
    train : train the encoder anew first
    progress : makes the bar of long steps

    Returns
    -------
    Outcome

    Raises
    ------
    StudioError
        If there is nothing to search, the query is none, or a filter names what no clip has.
    """
    if not (wish.query or wish.like):
        raise StudioError("search: want a clip, a BVH file or --like, got nothing to look for")
    if sheet is not None and sheet.suffix.lower() != ".png":
        raise StudioError(f"--sheet: want a file ending in .png, got {sheet.name!r}")
    catalogue = _Catalogue(root)
    if train or not catalogue.is_current() or not all(catalogue.knows(t) for t in _texts(wish)):
        from pipelines.searchable import make_searchable  # Dagster

        make_searchable(root, train=train, progress=progress)
        catalogue = _Catalogue(root)
        catalogue.remember()
    index = catalogue.index
    if index is None or not len(index.vector):
        raise StudioError(f"{root}: want clips to search, got none that was read; see 'odori status'")
    query = catalogue.motion(wish.query) if wish.query else None
    like, unlike = ([catalogue.motion(text) for text in texts] for texts in (wish.like, wish.unlike))
    is_allowed = _allowed(index.rows, wish)
    for motion in (query, *like, *unlike):
        if motion is not None and motion.clip_id:
            is_allowed &= ~_overlap(index.rows, motion)
    copies = _copies(catalogue, query) if query and not (like or unlike) else None
    begun = time.perf_counter()
    found = _find(index, query, like, unlike, is_allowed, wish.k, copies)
    took_s = time.perf_counter() - begun
    facts = {
        "query": wish.query,
        "clip_id": query.clip_id if query else "",
        "like": list(wish.like),
        "unlike": list(wish.unlike),
        "hits": [_hit_facts(index.rows, hit) for hit in found],
        "windows_searched": len(index.vector),
        "is_exact": not _is_approximate(index, is_allowed),
        "search_ms": round(1000 * took_s, 3),
        "encoder": catalogue.provenance().get("kind", ""),
    }
    if sheet is not None:
        _draw(sheet, catalogue, query or like[0], found)
        facts["sheet"] = str(sheet)
    return Outcome(DONE, facts, _report(facts, wish))


def by_likeness(root: Path, pin: str, *, progress: Callable[[], Any]) -> str:
    """Write a pin ``PLACE=like:KEY`` as one of the clip and those most like it; other pins stay as they are.

    The clips are named when the pin is asked for, so that a nightly rebuild dances the same.

    Parameters
    ----------
    root : the studio
    pin : as on the command line
    progress : makes the bar of long steps

    Raises
    ------
    StudioError
        As :func:`search`.
    """
    place, _, wish = pin.partition("=")
    if not wish.strip().startswith("like:"):
        return pin
    name = wish.partition(":")[2].strip()
    found = search(root, Wish(query=name, k=PINNED_BY_LIKENESS), progress=progress).facts
    own = [found["clip_id"]] if found["clip_id"] else []
    return f"{place.strip()}=clip:{','.join([*own, *(hit['clip_id'] for hit in found['hits'])])}"


def _find(
    index: StoredIndex,
    query: Motion | None,
    like: Sequence[Motion],
    unlike: Sequence[Motion],
    is_allowed: NDArray[np.bool_],
    k: int,
    copies: Copies | None,
) -> list[Hit]:
    none = np.zeros((0, index.vector.shape[1]), np.float32)
    wanted = (
        steer(
            query.vector if query else none,
            *(np.stack([_centre(m) for m in ms]) if ms else none for ms in (like, unlike)),
        )
        if like or unlike
        else (query.vector if query else none)
    )
    start = _starts(index.rows["clip_id"])
    candidates = index.candidates if _is_approximate(index, is_allowed) else None
    found = nearest_clips(index.vector, start, wanted, k=k, is_allowed=is_allowed, candidates=candidates, copies=copies)
    if candidates is not None and len(found) < k:  # few of the near ones are allowed
        found = nearest_clips(index.vector, start, wanted, k=k, is_allowed=is_allowed, copies=copies)
    return found


def _copies(catalogue: "_Catalogue", query: Motion) -> Copies:
    """Prepare the search for copies of a motion; stretches of its own clip are none."""
    index = catalogue.index
    assert index is not None
    start = _starts(index.rows["clip_id"])
    first, count = (index.rows[name].to_numpy()[start] for name in ("track_index", "track_count"))
    own = index.rows["clip_id"].take(pa.array(start)).to_pylist().index(query.clip_id) if query.clip_id else -1
    poses = query.poses or catalogue.poses(query.clip_id, index.rows["session"][int(start[own])].as_py())
    looked_for = track(*poses, start_s=query.start_s, end_s=query.end_s, rate_hz=QUERY_HZ)

    def copies(clips: Int) -> list[Alignment]:
        taken = clips[: max(int((np.cumsum(room(looked_for, count[clips])) <= MOST_FRAMES).sum()), 1)]
        tracks = [index.track[first[c] : first[c] + count[c]] for c in taken.tolist()]
        return [
            Alignment(np.inf, 0.0, 0.0) if c == own else laid
            for c, laid in zip(taken.tolist(), align(looked_for, tracks), strict=True)
        ]

    return copies


def _is_approximate(index: StoredIndex, is_allowed: NDArray[np.bool_]) -> bool:
    """Whether candidates come from the graph: of a large catalogue that is hardly narrowed."""
    return bool(index.approximate) and int(is_allowed.sum()) > motion_index.EXACT_UP_TO


def _centre(motion: Motion) -> NDArray[np.float32]:
    total = motion.vector.astype(np.float64).sum(axis=0)
    return np.asarray(total / max(float(np.linalg.norm(total)), 1e-12), np.float32)


def _starts(clip_id: pa.ChunkedArray) -> NDArray[np.int64]:
    key = clip_id.combine_chunks()
    is_new = np.append(True, pc.not_equal(key[1:], key[:-1]).to_numpy(zero_copy_only=False))
    return np.flatnonzero(is_new)


def _texts(wish: Wish) -> list[str]:
    return [text for text in (wish.query, *wish.like, *wish.unlike) if text]


def _parse(text: str) -> tuple[str, float, float]:
    """Split ``NAME@START-END``; a whole clip is from 0 to infinity."""
    ranged = _RANGE.fullmatch(text)
    if not ranged:
        return text, 0.0, float("inf")
    start_s, end_s = float(ranged["start"]), float(ranged["end"])
    if end_s <= start_s:
        raise StudioError(f"{text}: want an end after its start, got {start_s:g} to {end_s:g} s")
    return ranged["name"], start_s, end_s


class _Catalogue:
    """The search index of a studio, and what it takes to embed a query."""

    def __init__(self, root: Path) -> None:
        if not root.is_dir():
            raise StudioError(
                f"{root}: want a studio folder with clips/ in it, got nothing there; name one with --studio or "
                "ODORI_STUDIO, or try 'odori demo'"
            )
        self.root = root.absolute()
        self.lake = self.root / "lake"
        self.index = motion_index.read(self.lake / MOTION_INDEX.name)

    def is_current(self) -> bool:
        """Whether the index was made of the tables that there are now."""
        try:
            seen = json.loads((self.lake / MOTION_INDEX.name / _SEEN).read_text())
        except (OSError, ValueError):
            return False
        return self.index is not None and bool(seen == self._state())

    def remember(self) -> None:
        """Keep which tables the index was found to be up to date with."""
        text = json.dumps(self._state(), sort_keys=True)
        if self.index is not None:
            write_beside(self.lake / MOTION_INDEX.name / _SEEN, lambda file: file.write(text.encode()))

    def _state(self) -> dict[str, list[int]]:
        files = [p for name in _MADE_FROM for p in sorted((self.lake / name).glob("*.parquet"))]
        stats = {f"{p.parent.name}/{p.name}": p.stat() for p in files}
        odori = self.root / "odori.toml"
        if odori.is_file():
            stats["odori.toml"] = odori.stat()
        return {name: [s.st_size, s.st_mtime_ns] for name, s in stats.items()}

    def knows(self, text: str) -> bool:
        """Whether a motion can be named without looking for new clips."""
        name, _, _ = _parse(text)
        return self._clip(name) is not None or (not self._inside(name) and _is_file(name))

    def provenance(self) -> dict[str, Any]:
        """Say what the encoder was trained on."""
        metadata = pq.read_schema(self._encoder_path()).metadata or {}
        said: dict[str, Any] = json.loads(metadata.get(b"provenance", b"{}"))
        return said

    def motion(self, text: str) -> Motion:
        """Embed a motion named in a wish; StudioError where it is none."""
        name, start_s, end_s = _parse(text)
        rows = self._clip(name)
        if rows is None and _is_file(name):
            return self._outside(text, Path(name), start_s, end_s)
        if rows is None:
            raise StudioError(self._unknown(name))
        assert self.index is not None
        clip_id, duration_s = rows["clip_id"][0].as_py(), rows["duration_s"][0].as_py()
        if start_s == 0 and end_s == float("inf"):
            at = rows["row_index"].to_numpy()
            return Motion(text, clip_id, 0.0, duration_s, np.asarray(self.index.vector[at[0] : at[-1] + 1]))
        if start_s > duration_s:
            raise StudioError(
                f"{text}: want a stretch within {clip_id}, {duration_s:.2f} s long; it begins after its end"
            )
        poses = self.poses(clip_id, rows["session"][0].as_py())
        return self._embed(text, clip_id, poses, start_s, min(end_s, duration_s))

    def poses(self, clip_id: str, session: str) -> tuple[Float, float]:
        """Read the canonical positions of a clip, (F, 22, 3), and its frame rate."""
        path = self.lake / "canonical_pose" / f"{session}.parquet"
        table = pq.read_table(path, columns=["time_s", "position_xyz_m"], filters=pc.field("clip_id") == clip_id)
        return _positions(table)

    def _embed(self, text: str, clip_id: str, poses: tuple[Float, float], start_s: float, end_s: float) -> Motion:
        settings = read_settings(self.root / "odori.toml").search
        longest = max(settings.longest_whole_s, settings.window_s)
        cut = start_s + windows(end_s - start_s, window_s=settings.window_s, longest_whole_s=longest)
        return Motion(text, clip_id, start_s, end_s, self._encoder().embed(*poses, cut), poses)

    def _encoder(self) -> Encoder:
        table = pq.read_table(self._encoder_path())
        names, shapes = table["parameter_name"].to_pylist(), table["shape"].to_pylist()
        arrays = {
            name: np.asarray(value.values, np.float32).reshape(shape)
            for name, shape, value in zip(names, shapes, table["elements"], strict=True)
        }
        return from_arrays(arrays)

    def _encoder_path(self) -> Path:
        return self.lake / MOTION_ENCODER.name / "all.parquet"

    def _clip(self, name: str) -> pa.Table | None:
        """Rows of a clip by its key, or by its file's path."""
        if self.index is None:
            return None
        rows = self.index.rows
        found = rows.filter(pc.field("clip_id") == name)
        if not found.num_rows and self._inside(name):
            path = Path(name).absolute().relative_to(self.root).as_posix()
            found = rows.filter(pc.field("path") == path)
        return found if found.num_rows else None

    def _inside(self, name: str) -> bool:
        return Path(name).absolute().is_relative_to(self.root / "clips")

    def _outside(self, text: str, path: Path, start_s: float, end_s: float) -> Motion:
        """Read a file that is not of the catalogue, and bring it to the canonical skeleton."""
        joints = read_settings(self.root / "odori.toml").joints
        try:
            take = bvh.to_clip(bvh.read(path), extra=joints)
            mapping = take.mapping or map_joints(take.clip.skeleton, joints)
            moved = retarget(take.clip, mapping)
        except FormatError as error:
            raise StudioError(f"{path}: {f'line {error.line}: ' if error.line else ''}{error.what}") from error
        except ValueError as error:
            raise StudioError(f"{path}: {error}") from error
        if start_s > take.clip.duration_s:
            raise StudioError(
                f"{text}: want a stretch within the file, {take.clip.duration_s:.2f} s long; it begins after"
            )
        poses = (moved.position_xyz_m, take.clip.frame_rate_hz)
        return self._embed(text, "", poses, start_s, min(end_s, take.clip.duration_s))

    def _unknown(self, name: str) -> str:
        refused = self._refused(name)
        if refused:
            return f"{name}: cannot be searched for: {refused}"
        known = pc.unique(self.index.rows["clip_id"]).to_pylist() if self.index is not None else []
        near = difflib.get_close_matches(name, known, n=3, cutoff=0.4) or [k for k in known if name in k][:3]
        hint = f"near are {', '.join(near)}" if near else f"there are {', '.join(known[:5])}"
        return f"{name}: want a clip of this studio or a BVH file, found neither; {hint}"

    def _refused(self, name: str) -> str:
        """Why a clip of the studio is not in the index; empty where it is no clip."""
        for file in sorted((self.lake / "clip").glob("*.parquet")):
            for row in pq.read_table(file, columns=["clip_id", "path", "reason"]).to_pylist():
                if name in (row["clip_id"], row["path"]) or str(Path(name).absolute()) == str(self.root / row["path"]):
                    return row["reason"] or "its motion could not be brought to the canonical skeleton"
        return ""


def _is_file(name: str) -> bool:
    return name.lower().endswith(".bvh") and Path(name).is_file()


def _positions(table: pa.Table) -> tuple[Float, float]:
    time_s = table["time_s"].to_numpy()
    column = table["position_xyz_m"].combine_chunks()
    position = np.asarray(column.flatten().flatten(), np.float64).reshape(len(time_s), -1, 3)
    rate = float(np.round((len(time_s) - 1) / (time_s[-1] - time_s[0]), 6)) if len(time_s) > 1 else 1.0
    return position, rate


def _allowed(rows: pa.Table, wish: Wish) -> NDArray[np.bool_]:
    """Which windows may be found; StudioError where a filter names what there is not."""
    is_allowed = np.full(rows.num_rows, True)
    for name in ("label", "style", "licence"):
        asked = list(getattr(wish, name))
        if not asked:
            continue
        there = sorted(set(pc.unique(rows[name]).to_pylist()) - {""})
        for value in asked:
            if value not in there:
                near = difflib.get_close_matches(value, there, n=3)
                raise StudioError(
                    f"--{name}: want one that a clip has, got {value!r}; "
                    f"{'near are' if near else 'there are'} {', '.join(near or there[:20]) or 'none'}"
                )
        is_allowed &= pc.is_in(rows[name], pa.array(asked)).to_numpy(zero_copy_only=False)
    duration_s = rows["duration_s"].to_numpy()
    return np.asarray(is_allowed & (duration_s >= wish.min_seconds) & (duration_s <= wish.max_seconds), bool)


def _overlap(rows: pa.Table, motion: Motion) -> NDArray[np.bool_]:
    """Windows that are the query itself."""
    is_own = pc.equal(rows["clip_id"], motion.clip_id).to_numpy(zero_copy_only=False)
    start_s, end_s = rows["start_s"].to_numpy(), rows["end_s"].to_numpy()
    return np.asarray(is_own & (start_s <= motion.end_s) & (end_s >= motion.start_s), bool)


def _hit_facts(rows: pa.Table, hit: Hit) -> dict[str, Any]:
    row = rows.slice(hit.row, 1).to_pylist()[0]
    names = ("clip_id", "start_s", "end_s", "label", "style", "licence", "path")
    facts = {name: row[name] for name in names} | {"distance": round(hit.distance, 6), "copy_apart_m": None}
    if hit.copied:
        stretch = {"start_s": round(hit.copied.start_s, 3), "end_s": round(min(hit.copied.end_s, row["duration_s"]), 3)}
        facts |= stretch | {"copy_apart_m": round(hit.copied.distance_m, 4)}
    return facts


def _report(facts: dict[str, Any], wish: Wish) -> str:
    hits = facts["hits"]
    if not hits:
        return "no clip is left after these filters"
    lines = [f"like {wish.query or ', '.join(wish.like)}:"]
    width = max(len(hit["clip_id"]) for hit in hits)
    lines += [
        f"  {hit['distance']:.3f}  {hit['clip_id']:<{width}}  {hit['start_s']:.2f} to {hit['end_s']:.2f} s  "
        f"{hit['label']}{', ' + hit['style'] if hit['style'] else ''}"
        for hit in hits
    ]
    if "sheet" in facts:
        lines.append(f"  sheet: {facts['sheet']}")
    return "\n".join(lines)


def _draw(sheet: Path, catalogue: _Catalogue, query: Motion, found: Sequence[Hit]) -> None:
    """Draw the query and its hits, one strip each."""
    from assets.search_plots import contact_sheet
    from kernels.search.normalise import normalise

    assert catalogue.index is not None
    rows = catalogue.index.rows
    session = dict(zip(rows["clip_id"].to_pylist(), rows["session"].to_pylist(), strict=True))
    shown = [(f"looked for: {query.text}", query.poses or catalogue.poses(query.clip_id, session[query.clip_id]))]
    spans = [(query.start_s, query.end_s)]
    for rank, hit in enumerate(found, start=1):
        row = _hit_facts(rows, hit)
        poses = catalogue.poses(row["clip_id"], session[row["clip_id"]])
        shown.append((f"{rank}: {row['clip_id']}, {row['label']}, at {row['distance']:.3f}", poses))
        spans.append((row["start_s"], row["end_s"]))
    strips = []
    for (title, (position, rate)), (start_s, end_s) in zip(shown, spans, strict=True):
        a = min(round(start_s * rate), len(position) - 1)
        b = min(max(round(end_s * rate) + 1, a + 1), len(position))
        strips.append((title, normalise(position[a:b]), np.arange(a, b) / rate))
    data = contact_sheet(strips)
    write_beside(sheet, lambda file: file.write(data))
