"""Pictures and tables for a person to look at in Dagster's UI, as Markdown with the picture inside.

Same data, same bytes: no dates in the files. Matplotlib is loaded when the first picture is drawn, not before: it would
cost every command half a second.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, SOFT, WARM, COOL = "#222222", "#999999", "#c8501e", "#1e64c8"
LONGEST_LIST = 60
"""Rows. Chosen by hand, so that a page can be looked through."""


def markdown(headers: Sequence[str], rows: Sequence[Sequence[object]], *, longest: int = LONGEST_LIST) -> str:
    """Write rows as a Markdown table, cut after ``longest`` rows with a word on how many more there are.

    Parameters
    ----------
    headers : C texts
    rows : of C values each, any values; numbers with a fraction get three digits, None an empty cell
    longest : int, >= 0

    Returns
    -------
    str
        The headers alone where there are no rows.
    """
    lines = [f"| {' | '.join(headers)} |", f"|{'---|' * len(headers)}"]
    lines += [f"| {' | '.join(_cell(value) for value in row)} |" for row in rows[:longest]]
    if len(rows) > longest:
        lines.append(f"\n… and {len(rows) - longest} more")
    return "\n".join(lines)


def _cell(value: object) -> str:
    text = f"{value:.3g}" if isinstance(value, float) else "" if value is None else str(value)
    return text.replace("|", "\\|").replace("\n", " ")


def figure_of(width_in: float, height_in: float) -> Figure:
    """Begin a picture.

    Parameters
    ----------
    width_in, height_in : float, inches of 80 pixels, > 0
    """
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), dpi=80, layout="constrained")


def png(figure: Figure) -> bytes:
    """Draw a figure as PNG without a date in it.

    Parameters
    ----------
    figure : matplotlib's Figure

    Returns
    -------
    bytes
        Equal for equal figures.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    sink = io.BytesIO()
    FigureCanvasAgg(figure).print_png(sink, metadata={"Software": None})  # type: ignore[no-untyped-call]
    return sink.getvalue()


def picture(data: bytes, title: str) -> str:
    """Put a PNG into Markdown.

    Parameters
    ----------
    data : bytes of the PNG
    title : shown where pictures are not; no ``]`` in it

    Returns
    -------
    str
        One line, with the picture inside.
    """
    return f"![{title}](data:image/png;base64,{base64.b64encode(data).decode()})"


def plain(axes: Any) -> None:  # noqa: ANN401 - matplotlib has no public type stubs here
    """Take the frame off a plot, and make its labels small.

    Parameters
    ----------
    axes : matplotlib's Axes, changed in place
    """
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8, colors=INK)


def body_side(joint: int) -> int:
    """Say whether a canonical joint is on the left (1), the right (-1) or in the middle (0).

    Parameters
    ----------
    joint : int, 0 to 21
    """
    from kernels.skeleton.canonical import JOINTS

    return 1 if JOINTS[joint].startswith("left") else -1 if JOINTS[joint].startswith("right") else 0
