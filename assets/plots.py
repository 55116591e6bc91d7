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

from assets import tables
from assets.calibration_table import to_curves
from kernels.assembly.blend import Dance
from kernels.assembly.quality import Measure
from kernels.motion.velocity import kinematic_beats, mean_speed
from kernels.types import BeatGrid, Choreography, Float

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_INK, _SOFT, _WARM, _COOL = "#222222", "#999999", "#c8501e", "#1e64c8"
_LONGEST_LIST = 60


def markdown(headers: Sequence[str], rows: Sequence[Sequence[object]], *, longest: int = _LONGEST_LIST) -> str:
    """Write rows as a Markdown table, cut after ``longest`` rows with a word on how many more there are."""
    lines = [f"| {' | '.join(headers)} |", f"|{'---|' * len(headers)}"]
    lines += [f"| {' | '.join(_cell(value) for value in row)} |" for row in rows[:longest]]
    if len(rows) > longest:
        lines.append(f"\n… and {len(rows) - longest} more")
    return "\n".join(lines)


def _cell(value: object) -> str:
    text = f"{value:.3g}" if isinstance(value, float) else "" if value is None else str(value)
    return text.replace("|", "\\|").replace("\n", " ")


def _figure(width_in: float, height_in: float) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), dpi=80, layout="constrained")


def png(figure: Figure) -> bytes:
    """Draw a figure as PNG without a date in it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    sink = io.BytesIO()
    FigureCanvasAgg(figure).print_png(sink, metadata={"Software": None})  # type: ignore[no-untyped-call]
    return sink.getvalue()


def picture(data: bytes, title: str) -> str:
    """Put a PNG into Markdown."""
    return f"![{title}](data:image/png;base64,{base64.b64encode(data).decode()})"


def _plain(axes: Any) -> None:  # noqa: ANN401 - matplotlib has no public type stubs here
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8, colors=_INK)


# What the plots of other areas draw with.
INK, SOFT, WARM, COOL = _INK, _SOFT, _WARM, _COOL
figure_of, plain = _figure, _plain


def session_beats(beats: pa.Table, clips: pa.Table) -> str:
    """Show a session: its clips with label, rate, length and beats, and a raster of the beats."""
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
    figure = _figure(9, 0.7 + 0.16 * len(shown))
    axes = figure.add_subplot()
    for i, (_, duration_s, time_s) in enumerate(shown):
        axes.plot([0, duration_s], [i, i], color=_SOFT, linewidth=0.8)
        axes.plot(time_s, np.full(len(time_s), i), "|", color=_WARM, markersize=6)
    axes.set_yticks(range(len(shown)), [name.rsplit("-", 1)[-1] for name, _, _ in shown], fontsize=6)
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.set_xlabel("seconds of the clip, beats marked", fontsize=8)
    _plain(axes)
    return f"{picture(png(figure), 'motion beats')}\n\n{table}"


_CONFIDENCE = {"high": "#3c8c50", "medium": "#c8a01e", "low": _WARM, "axis-unobserved": "#8c3c96", "none": _INK}
_MOST_PICTURES = 6


def calibrations(rows: pa.Table, doubtful: Sequence[str]) -> str:
    """Show the calibrations of a session: residuals over time, gaps before and after, bones, advice, warnings."""
    by_clip = tables.by_clip(rows)
    if not by_clip and not doubtful:
        return "no suit recordings"
    parts = [f"- {line}" for line in doubtful[:_LONGEST_LIST]]
    for clip_id, joints in list(by_clip.items())[:_MOST_PICTURES]:
        parts += ["", f"### {clip_id}", "", picture(calibration(joints), clip_id), "", calibration_table(joints)]
    if len(by_clip) > _MOST_PICTURES:
        parts += ["", f"… and {len(by_clip) - _MOST_PICTURES} more recordings; their rows are in the table"]
    return "\n".join(parts)


def calibration_table(joints: pa.Table) -> str:
    """List the joints of one calibration with their lengths, how sure they are, and what the performer can do."""
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


def calibration(joints: pa.Table) -> bytes:
    """Draw one calibration as PNG: residual of each joint over time, gaps before and after, bones by confidence."""
    from matplotlib.patches import Patch

    names = joints["joint_name"].to_pylist()
    before, after = (to_curves(joints[f"gap_{when}_curve_m"]) for when in ("before", "after"))
    figure = _figure(12, 6.5)
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
    for curve, colour, word in ((before, _WARM, "before"), (after, _COOL, "after")):
        size_mm = np.maximum(1000 * np.sqrt(np.mean(curve**2, axis=0)), 1e-13)
        gap.semilogy(time_s, size_mm, color=colour, linewidth=1, label=word)
    gap.set_title("gap at the joints, mm, root mean square of all", fontsize=8, loc="left")
    gap.set_xlabel("seconds of the recording", fontsize=8)
    gap.legend(fontsize=7, frameon=False, loc="center right")
    bones = right.add_subplot()
    words = joints["confidence_label"].to_pylist()
    length_mm = 1000 * tables.to_numbers(joints["length_m"])
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
        _plain(axes)
    return png(figure)


def song_beats(grid: BeatGrid, time_s: Float, loudness_db: Float) -> str:
    """Show a song: loudness, beats and downbeats, and the tempo over time."""
    figure = _figure(11, 4)
    level, tempo = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    level.plot(time_s, loudness_db, color=_INK, linewidth=0.8)
    level.set_ylabel("level, dB(A)", fontsize=8)
    low, high = (float(np.percentile(loudness_db, q)) for q in (5, 100)) if len(time_s) else (-60.0, 0.0)
    level.set_ylim(low - 6, high + 3)
    is_downbeat = grid.beat_in_bar_number == 1
    level.vlines(grid.time_s, low - 6, low - 1, color=_COOL, linewidth=0.7)
    level.vlines(grid.time_s[is_downbeat], low - 6, low + 4, color=_WARM, linewidth=1.1)
    if len(grid.time_s) > 1:
        tempo.plot(grid.time_s[1:], 60 / np.diff(grid.time_s), color=_COOL, linewidth=1)
    tempo.set_ylabel("beats a minute", fontsize=8)
    tempo.set_xlabel("seconds; beats blue, downbeats red", fontsize=8)
    for axes in (level, tempo):
        _plain(axes)
    return picture(png(figure), "beats of the song")


def motion_graph(weight: Float, threshold: float, degree: Float) -> str:
    """Show a motion graph: how close its transitions are, and how many each beat has."""
    figure = _figure(9, 2.6)
    left, right = figure.subplots(1, 2)
    left.hist(weight, bins=40, color=_COOL)
    left.axvline(threshold, color=_WARM, linewidth=1)
    left.set_xlabel("d(i,j) / (d(i) + d(j)), threshold red", fontsize=8)
    left.set_ylabel("transitions", fontsize=8)
    right.hist(np.minimum(degree, 60), bins=np.arange(62) - 0.5, color=_COOL)
    right.set_xlabel("transitions from a beat, 60 and more together", fontsize=8)
    right.set_ylabel("beats", fontsize=8)
    for axes in (left, right):
        _plain(axes)
    return picture(png(figure), "motion graph")


def dance_timeline(dance: Dance, steps: Choreography, music_beat_s: Float) -> bytes:
    """Draw a dance over time as PNG: steps coloured by clip, seams, music beats, warp, and where the body slows."""
    from matplotlib import colormaps

    clips = sorted(set(steps.clip_id))
    colour = {clip: colormaps["tab20"](i % 20) for i, clip in enumerate(clips)}
    figure = _figure(min(8 + 0.12 * float(dance.time_s[-1]), 24), 5)
    band, warp, speed = figure.subplots(3, 1, sharex=True, height_ratios=(1.2, 1, 1.4))
    length = steps.song_end_s - steps.song_start_s
    band.barh(
        np.zeros(len(length)), length, left=steps.song_start_s, height=1.0, color=[colour[c] for c in steps.clip_id]
    )
    seam_s = steps.song_start_s[steps.has_seam]
    band.vlines(seam_s, -0.5, 0.5, color=_INK, linewidth=1.2)
    band.vlines(music_beat_s, 0.5, 0.7, color=_COOL, linewidth=0.7)
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
    warp.axhspan(0.90, 1.10, color="#e6f0e6")
    warp.step(
        np.append(steps.song_start_s, steps.song_end_s[-1:]),
        np.append(steps.warp_ratio, steps.warp_ratio[-1:]),
        where="post",
        color=_INK,
    )
    warp.set_ylim(0.75, 1.3)
    warp.set_title("warp: song time over clip time, 0.90 to 1.10 shaded", fontsize=8, loc="left")
    value = mean_speed(dance.position_xyz_m, dance.frame_rate_hz)
    slow = kinematic_beats(dance.position_xyz_m, dance.frame_rate_hz)
    speed.plot(dance.time_s, value, color=_INK, linewidth=0.8)
    speed.plot(dance.time_s[slow], value[slow], "o", color=_WARM, markersize=3)
    speed.vlines(music_beat_s, 0, value.max(initial=0.1), color=_COOL, linewidth=0.4)
    speed.set_title("mean joint speed, m/s; minima red, music beats blue", fontsize=8, loc="left")
    speed.set_xlabel("seconds", fontsize=8)
    speed.set_xlim(0, max(float(dance.time_s[-1]), 0.1))
    for axes in (band, warp, speed):
        _plain(axes)
    return png(figure)


def phrases(steps: Choreography) -> list[tuple[int, int]]:
    """Find the runs of steps without a seam between them: first step, and one past the last."""
    start = np.append(0, np.flatnonzero(steps.has_seam))
    return [(a, b) for a, b in zip(start.tolist(), [*start[1:].tolist(), len(steps.clip_id)], strict=True) if b > a]


def phrase_table(steps: Choreography) -> str:
    """List what is danced when, one row a phrase."""
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
    """Draw stick figures of a dance at even times as PNG, seen from the front right; left blue, right red."""
    figure = _figure(14, 3.2)
    axes = figure.add_subplot()
    frames = np.linspace(0, len(dance.time_s) - 1, n_figures).round().astype(int)
    for i, frame in enumerate(frames):
        body = dance.position_xyz_m[frame]
        across = body[:, 0] + 0.35 * body[:, 2]
        across = across - across[0] + 1.1 * i
        for joint, of in enumerate(parent):
            if of >= 0:
                side = _COOL if body_side(joint) > 0 else _WARM if body_side(joint) < 0 else _INK
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
    """Say whether a canonical joint is on the left (1), the right (-1) or in the middle (0)."""
    from kernels.skeleton.canonical import JOINTS

    return 1 if JOINTS[joint].startswith("left") else -1 if JOINTS[joint].startswith("right") else 0


def measures(found: Sequence[Measure]) -> str:
    """Write the measures of a dance as a Markdown table."""
    word = {True: "yes", False: "**no**", None: ""}
    rows = [(m.name, float(m.value), m.wanted, word[m.is_passed]) for m in found]
    return markdown(("measure", "value", "wanted", "as wanted"), rows)
