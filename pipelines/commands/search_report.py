"""What a person is shown of a search: hits as facts, as lines of text, and as strips of stick figures."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from kernels.search.nearest import Hit
from pipelines.commands.search_catalogue import NamedMotion, SearchCatalogue
from pipelines.studio.files import write_beside


def hit_facts(rows: pa.Table, hit: Hit) -> dict[str, Any]:
    """Say which stretch of which clip was found, as the command prints it with ``--json``.

    Parameters
    ----------
    rows : table ``motion_index``
    hit : Hit
    """
    row = rows.slice(hit.row, 1).to_pylist()[0]
    names = ("clip_id", "start_s", "end_s", "label", "style", "licence", "path")
    facts = {name: row[name] for name in names} | {"distance": round(hit.distance, 6), "copy_apart_m": None}
    if hit.copied:
        stretch = {"start_s": round(hit.copied.start_s, 3), "end_s": round(min(hit.copied.end_s, row["duration_s"]), 3)}
        facts |= stretch | {"copy_apart_m": round(hit.copied.distance_m, 4)}
    return facts


def report(facts: dict[str, Any]) -> str:
    """Write the facts of a search as lines, a hit each.

    Parameters
    ----------
    facts : of the search: ``query``, ``like``, ``hits`` (:func:`hit_facts`), and ``sheet`` where one was drawn
    """
    hits = facts["hits"]
    if not hits:
        return "no clip is left after these filters"
    lines = [f"most like {facts['query'] or ', '.join(facts['like'])} (distance 0 to 2, clip, stretch, label):"]
    width = max(len(hit["clip_id"]) for hit in hits)
    lines += [
        f"  {hit['distance']:.3f}  {hit['clip_id']:<{width}}  {hit['start_s']:.2f} to {hit['end_s']:.2f} s  "
        f"{hit['label']}{', ' + hit['style'] if hit['style'] else ''}{_laid(hit)}"
        for hit in hits
    ]
    if "sheet" in facts:
        lines.append(f"  sheet: {facts['sheet']}")
    return "\n".join(lines)


def _laid(hit: dict[str, Any]) -> str:
    apart_m = hit["copy_apart_m"]
    return "" if apart_m is None else f", a copy: joints {100 * apart_m:.1f} cm apart"


def draw(sheet: Path, catalogue: SearchCatalogue, query: NamedMotion, found: Sequence[Hit]) -> None:
    """Draw the query and its hits, one strip each.

    Parameters
    ----------
    sheet : where the PNG goes
    catalogue : SearchCatalogue, that was searched
    query : NamedMotion
    found : hits, nearest first
    """
    from assets.plots.search import contact_sheet
    from kernels.search.normalise import normalise

    assert catalogue.index is not None
    rows = catalogue.index.rows
    session = dict(zip(rows["clip_id"].to_pylist(), rows["session"].to_pylist(), strict=True))
    shown = [(f"looked for: {query.text}", query.poses or catalogue.poses(query.clip_id, session[query.clip_id]))]
    spans = [(query.start_s, query.end_s)]
    for rank, hit in enumerate(found, start=1):
        row = hit_facts(rows, hit)
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
