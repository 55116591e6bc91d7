"""What a person looks at of motion search: the map of the catalogue, confusions, proposals, a sheet of hits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from assets.plots.draw import COOL, INK, SOFT, WARM, body_side, figure_of, markdown, picture, plain, png
from kernels.search.measure import Confusion
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Float

_MOST_ON_MAP = 1500
_MOST_NAMED = 20
_MOST_CONFUSED = 40
"""Windows on the map, labels with a name there, and labels in a table of confusions. Chosen by hand, to be read."""


def places(centre: NDArray[np.float32]) -> Float:
    """Lay clips out in the plane so that like ones lie together: t-SNE from principal components.

    Parameters
    ----------
    centre : (C, D) float32

    Returns
    -------
    (C, 2) float64
        Of more than a drawing can show, the rest lie where their nearest drawn clip does. Zeros for fewer than two.
    """
    n = len(centre)
    if n < 2:
        return np.zeros((n, 2))
    from sklearn.manifold import TSNE

    at = np.unique(np.linspace(0, n - 1, min(n, _MOST_ON_MAP)).round().astype(int))
    shown = centre[at].astype(np.float64)
    spread = shown - shown.mean(axis=0)
    if len(at) < 4:
        place = np.stack([spread[:, 0], spread[:, 1]], axis=1)
    else:
        perplexity = min(30.0, (len(at) - 1) / 3)
        place = TSNE(perplexity=perplexity, init="pca", random_state=0, max_iter=500, n_jobs=1).fit_transform(shown)
    nearest = np.concatenate([(centre[i : i + 1024] @ centre[at].T).argmax(axis=1) for i in range(0, n, 1024)])
    laid: Float = np.asarray(place, np.float64)[nearest]
    return laid


def catalogue_map(place: Float, label: Sequence[str]) -> str:
    """Show the map of the catalogue, (C, 2), coloured by label; the most frequent labels are named."""
    from matplotlib import colormaps

    if not len(place):
        return "no clips"
    figure = figure_of(9, 6)
    axes = figure.add_subplot()
    names, count = np.unique(np.asarray(label, str), return_counts=True)
    ranked = names[np.argsort(-count, kind="stable")].tolist()
    of = np.asarray(label, str)
    for i, name in enumerate(ranked):
        rows = place[of == name]
        colour = colormaps["tab20"](i % 20) if i < _MOST_NAMED else SOFT
        axes.scatter(rows[:, 0], rows[:, 1], s=14, color=colour, label=name if i < _MOST_NAMED else None)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.legend(fontsize=7, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    plain(axes)
    rest = len(ranked) - _MOST_NAMED
    more = f"\n\n… and {rest} labels in grey" if rest > 0 else ""
    return f"{picture(png(figure), 'map of the catalogue')}{more}"


def confusion(found: Confusion) -> str:
    """Show which labels are taken for which: label of a clip by row, of its nearest other by column."""
    if not found.names:
        return "no label has two clips"
    kept = np.argsort(-(found.count.sum(axis=0) + found.count.sum(axis=1)), kind="stable")[:_MOST_CONFUSED]
    kept = np.sort(kept)
    count, names = found.count[np.ix_(kept, kept)], [found.names[i] for i in kept]
    size = 2.5 + 0.24 * len(names)
    figure = figure_of(size + 1, size)
    axes = figure.add_subplot()
    share = count / np.maximum(count.sum(axis=1, keepdims=True), 1)
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1)
    for row, column in np.argwhere(count > 0).tolist():
        colour = "white" if share[row, column] > 0.5 else INK
        axes.text(column, row, count[row, column], fontsize=6, ha="center", va="center", color=colour)
    axes.set_xticks(range(len(names)), names, fontsize=7, rotation=90)
    axes.set_yticks(range(len(names)), names, fontsize=7)
    wrong = [
        (f"{found.names[a]}", found.names[b], int(found.count[a, b]))
        for a, b in np.argwhere(found.count > 0).tolist()
        if a != b
    ]
    wrong.sort(key=lambda row: (-row[2], row[0], row[1]))
    table = markdown(("clips of", "nearest to one of", "clips"), wrong, longest=20)
    return f"{picture(png(figure), 'label of each clip and of its nearest other')}\n\n{table}"


def proposals(rows: pa.Table) -> str:
    """List the first proposal of every unlabelled clip."""
    shown = [
        (r["clip_id"], r["proposed_label"], r["vote_ratio"], r["nearest_clip_id"], "yes" if r["is_sure"] else "")
        for r in rows.to_pylist()
        if r["rank_number"] == 1
    ]
    return (
        markdown(("clip", "proposed label", "votes", "nearest", "sure"), shown) if shown else "every clip has a label"
    )


def contact_sheet(strips: Sequence[tuple[str, Float, Float]], *, n_figures: int = 9) -> bytes:
    """Draw motions as strips of stick figures, one below the other, as PNG; left blue, right red.

    Parameters
    ----------
    strips : title, (F, 22, 3) metres facing +Z, and (F,) seconds of each, F >= 1
    n_figures : int, figures a strip
    """
    figure = figure_of(n_figures + 0.4, 2.3 * max(len(strips), 1) + 0.2)
    for place, (title, position, time_s) in enumerate(strips):
        axes = figure.add_subplot(max(len(strips), 1), 1, place + 1)
        frames = np.linspace(0, len(position) - 1, min(n_figures, len(position))).round().astype(int)
        for i, frame in enumerate(frames.tolist()):
            body = position[frame]
            across = body[:, 0] - body[0, 0] + 0.45 * (body[:, 2] - body[0, 2]) + 1.25 * i
            up = body[:, 1] - 0.15 * (body[:, 2] - body[0, 2])
            for joint, of in enumerate(CANONICAL.parent.tolist()):
                if of >= 0:
                    side = body_side(joint)
                    colour = COOL if side > 0 else WARM if side < 0 else INK
                    axes.plot(across[[joint, of]], up[[joint, of]], color=colour, linewidth=1.5)
            axes.text(1.25 * i, -0.32, f"{time_s[frame]:.2f} s", fontsize=7, ha="center", color=SOFT)
        axes.set_title(title, fontsize=8, loc="left")
        axes.set_xlim(-0.8, 1.25 * n_figures - 0.45)
        axes.set_ylim(-0.4, 2.1)
        axes.set_aspect("equal")
        axes.axis("off")
    return png(figure)
