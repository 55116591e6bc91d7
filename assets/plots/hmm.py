"""Pictures of the model of a dancer; see :mod:`assets.plots`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from assets.plots.draw import COOL, INK, SOFT, WARM, figure_of, markdown, picture, plain, png
from kernels.hmm.evidence import Evidence
from kernels.hmm.model import Model, Smoothing
from kernels.hmm.states import States
from kernels.motion.key_poses import to_poses
from kernels.music.drums_and_melody import CONTOUR, FIRST_KEY, Hits
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Float, Int

_MOST_SHOWN = 64
"""Basic motions drawn. Chosen by hand."""

_INCHES_A_METRE, _WIDEST = 0.6, 13.0
"""Scale of figures, and inches of a picture. Chosen by hand."""


def drum_roll(hits: Hits) -> str:
    """Show the drums of a song: one line a key, darker where struck harder; and how often each."""
    keys, count = np.unique(hits.key_number, return_counts=True)
    table = markdown(("key", "strokes"), list(zip(keys.tolist(), count.tolist(), strict=True)))
    if not len(keys):
        return "nothing was heard"
    figure = figure_of(12, 0.8 + 0.18 * len(keys))
    axes = figure.add_subplot()
    row = np.searchsorted(keys, hits.key_number)
    axes.scatter(hits.time_s, row, s=6, c=hits.velocity, cmap="Greys", vmin=0, vmax=127, marker="|")
    axes.set_yticks(range(len(keys)), [str(k) for k in keys])
    axes.set_xlabel("seconds", fontsize=8)
    plain(axes)
    return f"{picture(png(figure), 'drums by key')}\n\n{table}"


def centroids(states: States, examples: Sequence[str]) -> str:
    """Show the basic motions: three key poses each, from grey over blue to orange, seen from the front and the side."""
    if not len(states.centroid):
        return "no motion was found"
    rows = [(k, int(states.count[k]), f"{states.reach[k]:.2f}", examples[k]) for k in range(len(states.count))]
    table = markdown(("state", "motions", "reach, m", "for example"), rows)
    tried = markdown(("states tried", "clearness"), list(states.tried)) if states.tried else ""
    poses = to_poses(states.centroid[:_MOST_SHOWN])
    # One scale for all, wide enough for those that travel: the front on the left, the side on the right.
    front, side = -0.1 - poses[..., 0].max(), 0.1 - poses[..., 2].min()
    edge_m = (poses[..., 0].min() + front - 0.1, poses[..., 2].max() + side + 0.1)
    width = _INCHES_A_METRE * (edge_m[1] - edge_m[0])
    across = int(np.clip(_WIDEST // width, 1, min(8, len(poses))))
    down = -(-len(poses) // across)
    figure = figure_of(width * across, (_INCHES_A_METRE * 2.3 + 0.2) * down)
    drawn = np.ravel(np.array(figure.subplots(down, across, squeeze=False)))
    for k, axes in enumerate(drawn):
        if k >= len(poses):
            axes.axis("off")
            continue
        # A frame says which front and which side belong together.
        axes.set(xticks=[], yticks=[], xlim=edge_m, ylim=(-0.1, 2.2))
        for edge in axes.spines.values():
            edge.set(color=SOFT, linewidth=0.5)
        for pose, colour in zip(poses[k], (SOFT, COOL, WARM), strict=True):
            _stick(axes, pose, 0, front, colour)
            _stick(axes, pose, 2, side, colour)
        axes.set_title(f"{k} ({int(states.count[k])})", fontsize=7, pad=1)
        axes.set_aspect("equal")
    shown = picture(png(figure), "basic motions, front and side: start grey, launch blue, end orange")
    return f"{shown}\n\n{table}\n\n{tried}"


def _stick(axes, pose: Float, axis: int, shift_m: float, colour: str) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    for joint, parent in enumerate(CANONICAL.parent.tolist()):
        if parent >= 0:
            ends = pose[[parent, joint]]
            axes.plot(ends[:, axis] + shift_m, ends[:, 1], color=colour, linewidth=1.0)


def model(found: Model, smoothing: Smoothing) -> str:
    """Show transitions and emissions as matrices, dark for probable, and how the smoothing was chosen."""
    emission = np.exp(found.log_emission[0])
    # What was never heard has the least share a motion gives to any key.
    heard = np.flatnonzero((emission > 1.5 * emission.min(axis=1, keepdims=True)).any(axis=0))
    heard = heard if len(heard) else np.arange(emission.shape[1])
    figure = figure_of(13, 4.2)
    parts = (
        ("next motion", np.exp(found.log_transition), [str(k) for k in range(found.n_states)]),
        ("percussion key", emission[:, heard], [str(k + FIRST_KEY) for k in heard.tolist()]),
        ("melody", np.exp(found.log_emission[1]), list(CONTOUR)),
    )
    widths = [max(values.shape[1], 4) for _, values, _ in parts]
    for axes, (title, values, names) in zip(
        figure.subplots(1, 3, gridspec_kw={"width_ratios": widths}), parts, strict=True
    ):
        # Where all are alike they are no darker than half: nothing is probable there.
        darkest = max(float(values.max()), 2.0 / values.shape[1])
        axes.imshow(values, cmap="Greys", vmin=0, vmax=darkest, aspect="auto", interpolation="nearest")
        axes.set_title(title, fontsize=8)
        if len(names) <= 48:
            axes.set_xticks(range(len(names)), names, fontsize=6, rotation=90)
        axes.set_ylabel("motion", fontsize=8)
        plain(axes)
    head = ("alpha", "transitions", "drums", "melody")
    tried = markdown(head, [(a, *(f"{s:.1f}" for s in scores)) for a, *scores in smoothing.tried])
    return f"{picture(png(figure), 'the model: what follows what, and what sounds with it')}\n\n{tried}"


def evidence(found: Evidence, clips: Sequence[str]) -> str:
    """Show how well motions are predicted with their music, without, and with other music, by performance."""
    rows = [
        (clips[i], int(found.n_motions[i]), found.with_music[i], found.bigram[i], found.shuffled[i])
        for i in range(len(clips))
    ]
    return markdown(("performance", "motions", "with its music", "without", "with other music"), rows)


def timeline(edge_s: Float, state: Int, beat_s: Float) -> str:
    """Show which basic motion is danced when, (S,) between (S + 1,) edges; beats as faint lines."""
    figure = figure_of(12, 2.4)
    axes = figure.add_subplot()
    axes.vlines(beat_s, -0.5, float(state.max(initial=0)) + 0.5, color=SOFT, linewidth=0.3)
    axes.stairs(state, edge_s, baseline=None, color=INK, linewidth=1.0)
    axes.set_xlabel("seconds", fontsize=8)
    axes.set_ylabel("basic motion", fontsize=8)
    plain(axes)
    return picture(png(figure), "basic motions danced")
