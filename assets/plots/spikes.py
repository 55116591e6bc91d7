"""What a session's faults look like: how fast the joint turned as recorded, and how fast it does now."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pyarrow as pa

from assets.plots.draw import COOL, SOFT, WARM, figure_of, markdown, picture, plain, png
from assets.tables.pack import by_clip
from kernels.health.turns import turn_rad_per_s
from kernels.types import Clip
from schemas.motion import QUIET_FAULT_KINDS

MOST_PICTURES = 8
"""Faults drawn a session, the fastest of each clip first. Chosen by hand, for looking at."""


def loud(faults: pa.Table) -> list[dict[str, object]]:
    """List the faults somebody should look at.

    Parameters
    ----------
    faults : table ``clip_fault``
    """
    return [row for row in faults.to_pylist() if row["fault_kind"] not in QUIET_FAULT_KINDS]


def spikes(faults: pa.Table, danced: Mapping[str, Clip]) -> str:
    """Show the faults of a session: a table, and pictures of how fast the joints turn around the plainest.

    Parameters
    ----------
    faults : table ``clip_fault`` of one session
    danced : the clips as they are danced, mended and bridged, by clip_id; faults of others are not drawn

    Returns
    -------
    str
        Markdown; "none" without a fault.
    """
    if not faults.num_rows:
        return "none"
    head = ("clip", "kind", "joint", "from s", "to s", "verdict", "reason")
    rows = [
        (r["clip_id"], r["fault_kind"], r["joint_name"], r["start_s"], r["end_s"], r["verdict"], r["reason"])
        for r in faults.to_pylist()
    ]
    table = markdown(head, rows)
    chosen = [row for row in _plainest(faults) if row["clip_id"] in danced]
    if not chosen:
        return table
    figure = figure_of(9, 1.7 * len(chosen))
    for i, row in enumerate(chosen):
        axes = figure.add_subplot(len(chosen), 1, i + 1)
        _draw(axes, row, danced[str(row["clip_id"])])
    return f"{picture(png(figure), 'how fast joints turn around faults')}\n\n{table}"


def _plainest(faults: pa.Table) -> list[dict[str, object]]:
    """Choose the faults to draw: the fastest of each clip, of all those the fastest."""
    each = []
    for rows in by_clip(faults).values():
        drawn = [row for row in loud(rows) if len(row["turn_rad_per_s"]) > 1]  # type: ignore[arg-type]
        each += sorted(drawn, key=_peak, reverse=True)[:1]
    return sorted(each, key=_peak, reverse=True)[:MOST_PICTURES]


def _peak(row: Mapping[str, object]) -> float:
    return max(row["turn_rad_per_s"])  # type: ignore[call-overload, no-any-return]


def _draw(axes, row, clip) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001 - matplotlib's, and Arrow's row
    recorded = np.degrees(row["turn_rad_per_s"])
    rate_hz = clip.frame_rate_hz
    time_s = row["turn_start_s"] + np.arange(len(recorded)) / rate_hz
    axes.axvspan(row["start_s"] - 0.5 / rate_hz, row["end_s"] + 0.5 / rate_hz, color=SOFT, alpha=0.25, linewidth=0)
    axes.plot(time_s, recorded, color=WARM, linewidth=1.2, label="as recorded")
    first = round(row["turn_start_s"] * rate_hz)
    now = np.degrees(turn_rad_per_s(clip, row["joint_name"]))[first : first + len(recorded)]
    axes.plot(time_s[: len(now)], now, color=COOL, linewidth=1.2, label="as danced")
    axes.set_title(
        f"{row['clip_id']}: {row['fault_kind']}, {row['joint_name'] or 'the body'}: {row['verdict']}", fontsize=8
    )
    axes.set_ylabel("degrees/s", fontsize=7)
    axes.legend(fontsize=6, frameon=False, loc="upper right")
    plain(axes)
