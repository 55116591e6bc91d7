"""Pictures and tables for a person to look at in Dagster's UI, as Markdown with the picture inside.

Same data, same bytes: no dates in the files. Matplotlib is loaded when the first picture is drawn, not before: it would
cost every command half a second.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from assets.tables import pack as tables
from kernels.assembly.blend import Dance
from kernels.assembly.quality import Measure
from kernels.motion.velocity import kinematic_beats, mean_speed
from kernels.types import BeatGrid, Choreography, Float
from kernels.warp import EASY_WARP

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, SOFT, WARM, COOL = "#222222", "#999999", "#c8501e", "#1e64c8"
_LONGEST_LIST = 60


def markdown(headers: Sequence[str], rows: Sequence[Sequence[object]], *, longest: int = _LONGEST_LIST) -> str:
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
    by_clip = tables.by_clip(beats)
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
            marks.append((clip["clip_id"], clip["duration_s"], tables.to_numbers(own["time_s"])))
    head = ("clip", "label", "style", "Hz", "seconds", "beats", "beats/min", "confidence", "refused because")
    table = markdown(head, rows)
    if not marks:
        return table
    shown = marks[:_LONGEST_LIST]
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


def song_beats(grid: BeatGrid, time_s: Float, loudness_db: Float) -> str:
    """Show a song: loudness, beats and downbeats, and the tempo over time.

    Parameters
    ----------
    grid : BeatGrid
    time_s : (F,) float, seconds
    loudness_db : (F,) float, dB(A)

    Returns
    -------
    str
        Markdown; empty axes where there is neither sound nor beat.
    """
    figure = figure_of(11, 4)
    level, tempo = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    level.plot(time_s, loudness_db, color=INK, linewidth=0.8)
    level.set_ylabel("level, dB(A)", fontsize=8)
    low, high = (float(np.percentile(loudness_db, q)) for q in (5, 100)) if len(time_s) else (-60.0, 0.0)
    level.set_ylim(low - 6, high + 3)
    is_downbeat = grid.beat_in_bar_number == 1
    level.vlines(grid.time_s, low - 6, low - 1, color=COOL, linewidth=0.7)
    level.vlines(grid.time_s[is_downbeat], low - 6, low + 4, color=WARM, linewidth=1.1)
    if len(grid.time_s) > 1:
        tempo.plot(grid.time_s[1:], 60 / np.diff(grid.time_s), color=COOL, linewidth=1)
    tempo.set_ylabel("beats a minute", fontsize=8)
    tempo.set_xlabel("seconds; beats blue, downbeats red", fontsize=8)
    for axes in (level, tempo):
        plain(axes)
    return picture(png(figure), "beats of the song")


def motion_graph(weight: Float, threshold: float, degree: Float) -> str:
    """Show a motion graph: how close its transitions are, and how many each beat has.

    Parameters
    ----------
    weight : (E,) float, >= 0
        How far apart the beats of each transition are, no unit: see :mod:`kernels.graph.transitions`.
    threshold : float
        Up to which they are kept.
    degree : (N,) float
        Transitions from each beat.

    Returns
    -------
    str
        Markdown.
    """
    figure = figure_of(9, 2.6)
    left, right = figure.subplots(1, 2)
    left.hist(weight, bins=40, color=COOL)
    left.axvline(threshold, color=WARM, linewidth=1)
    left.set_xlabel("d(i,j) / (d(i) + d(j)), threshold red", fontsize=8)
    left.set_ylabel("transitions", fontsize=8)
    right.hist(np.minimum(degree, 60), bins=np.arange(62) - 0.5, color=COOL)
    right.set_xlabel("transitions from a beat, 60 and more together", fontsize=8)
    right.set_ylabel("beats", fontsize=8)
    for axes in (left, right):
        plain(axes)
    return picture(png(figure), "motion graph")


def dance_timeline(dance: Dance, steps: Choreography, music_beat_s: Float) -> bytes:
    """Draw a dance over time as PNG: steps coloured by clip, seams, music beats, warp, and where the body slows.

    Parameters
    ----------
    dance : Dance of F >= 1 frames
    steps : Choreography it was assembled from
    music_beat_s : (B,) float, seconds

    Returns
    -------
    bytes
        PNG.
    """
    from matplotlib import colormaps

    clips = sorted(set(steps.clip_id))
    colour = {clip: colormaps["tab20"](i % 20) for i, clip in enumerate(clips)}
    figure = figure_of(min(8 + 0.12 * float(dance.time_s[-1]), 24), 5)
    band, warp, speed = figure.subplots(3, 1, sharex=True, height_ratios=(1.2, 1, 1.4))
    length = steps.song_end_s - steps.song_start_s
    band.barh(
        np.zeros(len(length)), length, left=steps.song_start_s, height=1.0, color=[colour[c] for c in steps.clip_id]
    )
    seam_s = steps.song_start_s[steps.has_seam]
    band.vlines(seam_s, -0.5, 0.5, color=INK, linewidth=1.2)
    band.vlines(music_beat_s, 0.5, 0.7, color=COOL, linewidth=0.7)
    for number, (a, b) in enumerate(phrases(steps), start=1):
        if steps.song_end_s[b - 1] - steps.song_start_s[a] > 0.012 * float(dance.time_s[-1]):
            band.text(
                (steps.song_start_s[a] + steps.song_end_s[b - 1]) / 2, 0, number, fontsize=7, ha="center", va="center"
            )
    band.set_yticks([])
    band.set_ylim(-0.5, 0.75)
    band.set_title(
        "phrases by clip, numbered as in the choreography's table; seams black, music beats blue",
        fontsize=8,
        loc="left",
    )
    warp.axhspan(*EASY_WARP, color="#e6f0e6")
    warp.step(
        np.append(steps.song_start_s, steps.song_end_s[-1:]),
        np.append(steps.warp_ratio, steps.warp_ratio[-1:]),
        where="post",
        color=INK,
    )
    warp.set_ylim(0.75, 1.3)
    warp.set_title("warp: song time over clip time, 0.90 to 1.10 shaded", fontsize=8, loc="left")
    value = mean_speed(dance.position_xyz_m, dance.frame_rate_hz)
    slow = kinematic_beats(dance.position_xyz_m, dance.frame_rate_hz)
    speed.plot(dance.time_s, value, color=INK, linewidth=0.8)
    speed.plot(dance.time_s[slow], value[slow], "o", color=WARM, markersize=3)
    speed.vlines(music_beat_s, 0, value.max(initial=0.1), color=COOL, linewidth=0.4)
    speed.set_title("mean joint speed, m/s; minima red, music beats blue", fontsize=8, loc="left")
    speed.set_xlabel("seconds", fontsize=8)
    speed.set_xlim(0, max(float(dance.time_s[-1]), 0.1))
    for axes in (band, warp, speed):
        plain(axes)
    return png(figure)


def phrases(steps: Choreography) -> list[tuple[int, int]]:
    """Find the runs of steps without a seam between them: first step, and one past the last.

    Parameters
    ----------
    steps : Choreography of S steps

    Returns
    -------
    list of (first, end)
        In order, together all steps; empty for none.
    """
    start = np.append(0, np.flatnonzero(steps.has_seam))
    return [(a, b) for a, b in zip(start.tolist(), [*start[1:].tolist(), len(steps.clip_id)], strict=True) if b > a]


def phrase_table(steps: Choreography) -> str:
    """List what is danced when, one row a phrase.

    Parameters
    ----------
    steps : Choreography

    Returns
    -------
    str
        Markdown; the headers alone where there are no steps.
    """
    rows = [
        (
            number,
            f"{steps.song_start_s[a]:.2f} to {steps.song_end_s[b - 1]:.2f}",
            steps.clip_id[a],
            f"{steps.clip_start_s[a]:.2f} to {steps.clip_end_s[b - 1]:.2f}",
            b - a,
            f"{steps.warp_ratio[a:b].min():.2f} to {steps.warp_ratio[a:b].max():.2f}",
            f"{steps.blend_s[a]:.2f}",
        )
        for number, (a, b) in enumerate(phrases(steps), start=1)
    ]
    return markdown(("phrase", "song, s", "clip", "clip, s", "steps", "warp", "blend, s"), rows, longest=200)


def contact_sheet(dance: Dance, parent: Sequence[int], *, n_figures: int = 16) -> bytes:
    """Draw stick figures of a dance at even times as PNG, seen from the front right; left blue, right red.

    Parameters
    ----------
    dance : Dance of F >= 1 frames on the canonical skeleton
    parent : of each joint, -1 for the root
    n_figures : int, >= 1

    Returns
    -------
    bytes
        PNG.
    """
    figure = figure_of(14, 3.2)
    axes = figure.add_subplot()
    frames = np.linspace(0, len(dance.time_s) - 1, n_figures).round().astype(int)
    for i, frame in enumerate(frames):
        body = dance.position_xyz_m[frame]
        across = body[:, 0] + 0.35 * body[:, 2]
        across = across - across[0] + 1.1 * i
        for joint, of in enumerate(parent):
            if of >= 0:
                side = COOL if body_side(joint) > 0 else WARM if body_side(joint) < 0 else INK
                axes.plot(
                    across[[joint, of]],
                    body[[joint, of], 1] - 0.12 * (body[[joint, of], 2] - body[0, 2]),
                    color=side,
                    linewidth=1.6,
                )
        axes.text(1.1 * i, -0.25, f"{dance.time_s[frame]:.1f} s", fontsize=8, ha="center")
    axes.set_aspect("equal")
    axes.axis("off")
    return png(figure)


def body_side(joint: int) -> int:
    """Say whether a canonical joint is on the left (1), the right (-1) or in the middle (0).

    Parameters
    ----------
    joint : int, 0 to 21
    """
    from kernels.skeleton.canonical import JOINTS

    return 1 if JOINTS[joint].startswith("left") else -1 if JOINTS[joint].startswith("right") else 0


def measures(found: Sequence[Measure]) -> str:
    """Write the measures of a dance as a Markdown table.

    Parameters
    ----------
    found : measures of one dance

    Returns
    -------
    str
        Markdown; the headers alone where there are none.
    """
    word = {True: "yes", False: "**no**", None: ""}
    rows = [(m.name, float(m.value), m.wanted, word[m.is_passed]) for m in found]
    return markdown(("measure", "value", "wanted", "as wanted"), rows)
