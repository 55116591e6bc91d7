"""What a session looks like: its clips, and the beats of its motions."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from assets.plots.draw import LONGEST_LIST, SOFT, WARM, figure_of, markdown, picture, plain, png
from assets.tables import pack


def session_beats(beats: pa.Table, clips: pa.Table) -> str:
    """Show a session: its clips with label, rate, length and beats, and a raster of the beats.

    Parameters
    ----------
    beats : table ``motion_beat``
    clips : table ``clip`` of the same session; refused ones show their reason

    Returns
    -------
    str
        Markdown; the table without a picture where no clip was read. The first 60 clips are shown.
    """
    by_clip = pack.by_clip(beats)
    rows, marks = [], []
    for clip in clips.to_pylist():
        own = by_clip.get(clip["clip_id"], beats.slice(0, 0)) if clip["state"] == "read" else beats.slice(0, 0)
        interval_s = own["interval_s"][0].as_py() if own.num_rows else 0.0
        rows.append(
            (
                clip["clip_id"],
                clip["label"],
                clip["style"],
                f"{clip['frame_rate_hz']:g}",
                f"{clip['duration_s']:.2f}",
                own.num_rows,
                f"{60 / interval_s:.0f}" if interval_s else "",
                f"{own['confidence'][0].as_py():.2f}" if own.num_rows else "",
                clip["reason"] or "",
            )
        )
        if clip["state"] == "read":
            marks.append((clip["clip_id"], clip["duration_s"], pack.to_numbers(own["time_s"])))
    head = ("clip", "label", "style", "Hz", "seconds", "beats", "beats/min", "confidence", "refused because")
    table = markdown(head, rows)
    if not marks:
        return table
    shown = marks[:LONGEST_LIST]
    figure = figure_of(9, 0.7 + 0.16 * len(shown))
    axes = figure.add_subplot()
    for i, (_, duration_s, time_s) in enumerate(shown):
        axes.plot([0, duration_s], [i, i], color=SOFT, linewidth=0.8)
        axes.plot(time_s, np.full(len(time_s), i), "|", color=WARM, markersize=6)
    axes.set_yticks(range(len(shown)), [name.rsplit("-", 1)[-1] for name, _, _ in shown], fontsize=6)
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.set_xlabel("seconds of the clip, beats marked", fontsize=8)
    plain(axes)
    return f"{picture(png(figure), 'motion beats')}\n\n{table}"
