"""What a dance looks like: its timeline, phrases, figures and measures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from assets.plots.draw import COOL, INK, WARM, body_side, figure_of, markdown, plain, png
from kernels.assembly.blend import Dance
from kernels.assembly.quality import Measure
from kernels.motion.velocity import kinematic_beats, mean_speed
from kernels.types import Choreography, Float
from kernels.warp import EASY_WARP


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


def measure_table(found: Sequence[Measure]) -> str:
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
