"""`odori search`: the clips most like a motion, from the index as it lies on disk.

Dagster is loaded only where something has to be made first: a search of an up-to-date catalogue answers at once.
"""

import difflib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from assets.formats import motion_index
from assets.formats.motion_index import StoredIndex
from kernels.search.aligned import MOST_FRAMES, QUERY_HZ, Alignment, align, room, track
from kernels.search.nearest import Copies, Hit, nearest_clips, steer
from kernels.types import Int
from pipelines.commands.outcome import DONE, Outcome
from pipelines.commands.search_catalogue import NamedMotion, SearchCatalogue
from pipelines.commands.search_report import draw, hit_facts, report
from pipelines.studio.files import StudioError

PINNED_BY_LIKENESS = 5
"""Clips most like one that a pin by likeness admits beside it. Chosen by hand."""


@dataclass(frozen=True)
class MotionQuery:
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


def search(
    root: Path, wish: MotionQuery, *, sheet: Path | None = None, train: bool = False, progress: Callable[[], Any]
) -> Outcome:
    """Find the clips most like a motion.

    Parameters
    ----------
    root : the studio
    wish : MotionQuery
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
    catalogue = SearchCatalogue(root)
    if train or not catalogue.is_current() or not all(catalogue.knows(t) for t in _texts(wish)):
        from pipelines.commands.searchable import make_searchable  # Dagster

        del catalogue  # Windows replaces no file that is mapped
        make_searchable(root, train=train, progress=progress)
        catalogue = SearchCatalogue(root)
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
        "hits": [hit_facts(index.rows, hit) for hit in found],
        "windows_searched": len(index.vector),
        "is_exact": not _is_approximate(index, is_allowed),
        "search_ms": round(1000 * took_s, 3),
        "encoder": catalogue.provenance().get("kind", ""),
    }
    if sheet is not None:
        draw(sheet, catalogue, query or like[0], found)
        facts["sheet"] = str(sheet)
    return Outcome(DONE, facts, report(facts))


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
    found = search(root, MotionQuery(query=name, k=PINNED_BY_LIKENESS), progress=progress).facts
    own = [found["clip_id"]] if found["clip_id"] else []
    return f"{place.strip()}=clip:{','.join([*own, *(hit['clip_id'] for hit in found['hits'])])}"


def _find(
    index: StoredIndex,
    query: NamedMotion | None,
    like: Sequence[NamedMotion],
    unlike: Sequence[NamedMotion],
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


def _copies(catalogue: SearchCatalogue, query: NamedMotion) -> Copies:
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


def _centre(motion: NamedMotion) -> NDArray[np.float32]:
    total = motion.vector.astype(np.float64).sum(axis=0)
    return np.asarray(total / max(float(np.linalg.norm(total)), 1e-12), np.float32)


def _starts(clip_id: pa.ChunkedArray) -> NDArray[np.int64]:
    key = clip_id.combine_chunks()
    is_new = np.append(True, pc.not_equal(key[1:], key[:-1]).to_numpy(zero_copy_only=False))
    return np.flatnonzero(is_new)


def _texts(wish: MotionQuery) -> list[str]:
    return [text for text in (wish.query, *wish.like, *wish.unlike) if text]


def _allowed(rows: pa.Table, wish: MotionQuery) -> NDArray[np.bool_]:
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


def _overlap(rows: pa.Table, motion: NamedMotion) -> NDArray[np.bool_]:
    """Windows that are the query itself."""
    is_own = pc.equal(rows["clip_id"], motion.clip_id).to_numpy(zero_copy_only=False)
    start_s, end_s = rows["start_s"].to_numpy(), rows["end_s"].to_numpy()
    return np.asarray(is_own & (start_s <= motion.end_s) & (end_s >= motion.start_s), bool)
