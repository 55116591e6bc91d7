"""Pictures of the calibrations of a suit, for a person to look at in Dagster's UI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from assets.plots.draw import COOL, INK, WARM, figure_of, markdown, picture, plain, png
from assets.tables import pack
from assets.tables.calibration import to_curves

_CONFIDENCE = {"high": "#3c8c50", "medium": "#c8a01e", "low": WARM, "axis-unobserved": "#8c3c96", "none": INK}
_MOST_PICTURES, _MOST_WARNINGS = 6, 60
"""Chosen by hand, so that a page can be looked through."""


def session(rows: pa.Table, doubtful: Sequence[str]) -> str:
    """Show the calibrations of a session: residuals over time, gaps before and after, bones, advice, warnings.

    Parameters
    ----------
    rows : table ``calibration``
    doubtful : warnings, a sentence each

    Returns
    -------
    str
        Markdown; ``no suit recordings`` where there is nothing to show. Pictures of the first six recordings.
    """
    by_clip = pack.by_clip(rows)
    if not by_clip and not doubtful:
        return "no suit recordings"
    parts = [f"- {line}" for line in doubtful[:_MOST_WARNINGS]]
    for clip_id, joints in list(by_clip.items())[:_MOST_PICTURES]:
        parts += ["", f"### {clip_id}", "", picture(residuals(joints), clip_id), "", joint_table(joints)]
    if len(by_clip) > _MOST_PICTURES:
        parts += ["", f"… and {len(by_clip) - _MOST_PICTURES} more recordings; their rows are in the table"]
    return "\n".join(parts)


def joint_table(joints: pa.Table) -> str:
    """List the joints of one calibration with their lengths, how sure they are, and what the performer can do.

    Parameters
    ----------
    joints : table ``calibration``, rows of one recording

    Returns
    -------
    str
        Markdown; the headers alone where there are no rows.
    """
    rows = [
        (
            joint["joint_name"],
            joint["parent_name"],
            f"{1000 * joint['length_m']:.1f}",
            joint["confidence_label"],
            joint["rank"],
            f"{np.degrees(joint['range_of_motion_rad'][-1]):.1f}",
            f"{1000 * joint['residual_rms_m']:.1f}",
            f"{100 * joint['filled_ratio']:.1f}",
            joint["advice"],
        )
        for joint in joints.to_pylist()
    ]
    head = ("joint", "on", "bone, mm", "confidence", "rank", "least motion, deg", "residual, mm", "filled, %", "advice")
    return markdown(head, rows)


def residuals(joints: pa.Table) -> bytes:
    """Draw one calibration as PNG: residual of each joint over time, gaps before and after, bones by confidence.

    Parameters
    ----------
    joints : table ``calibration``, the rows of one recording, at least one

    Returns
    -------
    bytes
        PNG.
    """
    from matplotlib.patches import Patch

    names = joints["joint_name"].to_pylist()
    before, after = (to_curves(joints[f"gap_{when}_curve_m"]) for when in ("before", "after"))
    figure = figure_of(12, 6.5)
    halves: Any = figure.subfigures(1, 2, width_ratios=(1.7, 1))
    left, right = halves
    heat, gap = left.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
    most_mm = max(float(np.percentile(1000 * before, 99)) if before.size else 0.0, 1.0)
    span_s = joints["span_s"][0].as_py()
    extent = (0.0, span_s * max(before.shape[1], 1), len(names) - 0.5, -0.5)
    image = heat.imshow(1000 * before, aspect="auto", cmap="magma_r", vmin=0, vmax=most_mm, extent=extent)
    heat.set_yticks(range(len(names)), names, fontsize=7)
    heat.set_title("residual: where the two sensors of a joint have it, mm apart", fontsize=8, loc="left")
    figure.colorbar(image, ax=heat, pad=0.01).ax.tick_params(labelsize=7)
    time_s = span_s * (np.arange(before.shape[1]) + 0.5)
    for curve, colour, word in ((before, WARM, "before"), (after, COOL, "after")):
        size_mm = np.maximum(1000 * np.sqrt(np.mean(curve**2, axis=0)), 1e-13)
        gap.semilogy(time_s, size_mm, color=colour, linewidth=1, label=word)
    gap.set_title("gap at the joints, mm, root mean square of all", fontsize=8, loc="left")
    gap.set_xlabel("seconds of the recording", fontsize=8)
    gap.legend(fontsize=7, frameon=False, loc="center right")
    bones = right.add_subplot()
    words = joints["confidence_label"].to_pylist()
    length_mm = 1000 * pack.to_numbers(joints["length_m"])
    bones.barh(range(len(names)), length_mm, color=[_CONFIDENCE[word] for word in words])
    for k, value in enumerate(length_mm):
        bones.text(value, k, f" {value:.0f}", fontsize=7, va="center")
    bones.set_yticks(range(len(names)), names, fontsize=7)
    bones.set_ylim(len(names) - 0.4, -0.6)
    bones.set_title("bone to the joint, mm, by confidence", fontsize=8, loc="left")
    bones.legend(
        handles=[Patch(color=_CONFIDENCE[word], label=word) for word in _CONFIDENCE if word in words],
        fontsize=7,
        frameon=False,
        ncols=len(_CONFIDENCE),
        loc="upper center",
        bbox_to_anchor=(0.5, -0.04),
    )
    for axes in (heat, gap, bones):
        plain(axes)
    return png(figure)
