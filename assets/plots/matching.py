"""Pictures of features, segments and matches; see :mod:`assets.plots`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from assets.plots.draw import COOL, INK, SOFT, WARM, figure_of, markdown, picture, plain, png
from assets.tables.matching import StoredMatches
from assets.tables.pack import by_clip, to_numbers
from kernels.matching.match_sequence import Chosen
from kernels.matching.score import SCALE_DENOMINATOR
from kernels.motion.motion_features import FEATURE_RATE_HZ
from kernels.music.segments import Segments
from kernels.types import Float

_MOST_CLIPS = 6
"""Drawn apart. Chosen by hand."""


def session_features(features: pa.Table) -> str:
    """Show the features of a session's first clips: rhythm as bumps, intensity, contacts below; and a table of all.

    Parameters
    ----------
    features : rows of ``motion_feature``, of one session

    Returns
    -------
    str, Markdown; a table without rows where there is no clip
    """
    clips = by_clip(features)
    rows = []
    for clip_id, own in clips.items():
        effort = to_numbers(own["weight_effort_rad_per_s"])
        rhythm = to_numbers(own["rhythm"])
        stops = int(((rhythm[1:-1] > rhythm[:-2]) & (rhythm[1:-1] >= rhythm[2:])).sum())
        feet = [float(np.mean(to_numbers(own[c]))) for c in ("is_left_contact", "is_right_contact")]
        rows.append((clip_id, f"{len(rhythm) / FEATURE_RATE_HZ:.2f}", stops, float(np.mean(effort)), *feet))
    head = ("clip", "seconds", "stops", "mean effort, rad/s", "left foot down", "right foot down")
    table = markdown(head, rows)
    shown = list(clips.items())[:_MOST_CLIPS]
    if not shown:
        return table
    figure = figure_of(10, 0.6 + 1.1 * len(shown))
    for axes, (clip_id, own) in zip(np.ravel(figure.subplots(len(shown), 1)), shown, strict=True):
        time_s = to_numbers(own["time_s"])
        axes.fill_between(time_s, to_numbers(own["rhythm"]), color=WARM, alpha=0.6, linewidth=0)
        axes.plot(time_s, to_numbers(own["intensity"]), color=INK, linewidth=0.8)
        effort = to_numbers(own["weight_effort_rad_per_s"])
        axes.plot(time_s, effort / max(float(effort.max(initial=0.0)), 1e-9), color=SOFT, linewidth=0.6)
        for level, column in ((-0.08, "is_left_contact"), (-0.16, "is_right_contact")):
            down = np.where(to_numbers(own[column]), level, np.nan)
            axes.plot(time_s, down, color=COOL, linewidth=2)
        axes.set_title(clip_id, fontsize=7, loc="left", pad=1)
        axes.set_ylim(-0.25, 1.6)
        plain(axes)
    return f"{picture(png(figure), 'rhythm orange, intensity black, effort grey, feet down blue')}\n\n{table}"


def song_features(time_s: Float, rhythm: Float, intensity: Float, segments: Segments) -> str:
    """Show a song's rhythm and intensity, cut into its segments, with how much the music changes at each cut.

    Parameters
    ----------
    time_s, rhythm, intensity : (F,) float, seconds and features of the song
    segments : Segments of it

    Returns
    -------
    str, Markdown
    """
    figure = figure_of(12, 3)
    axes = figure.add_subplot()
    axes.fill_between(time_s, rhythm, color=WARM, alpha=0.6, linewidth=0)
    axes.plot(time_s, intensity, color=INK, linewidth=0.8)
    axes.vlines(segments.start_s, 0, 0.3 + 1.2 * segments.novelty, color=COOL, linewidth=1)
    for index, start in enumerate(segments.start_s):
        axes.text(start, -0.12, str(index), fontsize=6, color=COOL)
    axes.set_ylim(-0.2, 1.7)
    axes.set_xlabel("seconds; rhythm orange, intensity black; segments blue, as high as the music changes", fontsize=8)
    plain(axes)
    rows = [
        (i, f"{a:.2f} to {b:.2f}", int(n), float(v))
        for i, (a, b, n, v) in enumerate(
            zip(segments.start_s, segments.end_s, segments.frame_count, segments.novelty, strict=True)
        )
    ]
    table = markdown(("segment", "song, s", "frames", "change"), rows, longest=200)
    return f"{picture(png(figure), 'features and segments')}\n\n{table}"


def segment_matches(segments: Segments, found: Sequence[StoredMatches]) -> str:
    """Show segments against their best matches: score of every rank, scale and clip of the best; and a table.

    Parameters
    ----------
    segments : S Segments
    found : S StoredMatches, empty ones for segments without

    Returns
    -------
    str, Markdown
    """
    figure = figure_of(12, 5)
    score, scale, clip = figure.subplots(3, 1, sharex=True, height_ratios=(2, 1, 2))
    middle = (segments.start_s + segments.end_s) / 2
    width = segments.end_s - segments.start_s
    names = sorted({m.clip_ids[0] for m in found if m.clip_ids})
    rows: list[tuple[object, ...]] = []
    for i, matches in enumerate(found):
        if not matches.clip_ids:
            rows.append((i, "", "", "", "", "", ""))
            continue
        score.plot(np.full(len(matches.score), middle[i]), matches.music_ratio, "_", color=SOFT, markersize=5)
        score.plot(middle[i], matches.music_ratio[0], "o", color=WARM, markersize=4)
        score.plot(middle[i], matches.mutual_ratio[0], "x", color=COOL, markersize=4)
        scale.bar(middle[i], matches.numerator[0] / SCALE_DENOMINATOR - 1, width[i] * 0.9, color=INK)
        clip.barh(names.index(matches.clip_ids[0]), width[i], left=segments.start_s[i], height=0.8, color=COOL)
        rows.append(
            (
                i,
                f"{segments.start_s[i]:.2f} to {segments.end_s[i]:.2f}",
                matches.clip_ids[0],
                f"{matches.numerator[0] / SCALE_DENOMINATOR:.2f}",
                f"{matches.start_frame_index[0] / FEATURE_RATE_HZ:.2f}",
                float(matches.score[0]),
                float(matches.mutual_ratio[0]),
            )
        )
    score.set_title("C over half the music's sum: best red, others grey; mutual ratio of the best blue", fontsize=8)
    scale.set_title("scale of the best, over 1", fontsize=8)
    scale.set_ylim(-0.12, 0.12)
    clip.set_title("clip of the best", fontsize=8)
    clip.set_yticks(range(len(names)), [n.rsplit("-", 1)[-1][:28] for n in names], fontsize=max(8 - len(names) // 8, 3))
    clip.set_xlabel("seconds of the song", fontsize=8)
    for axes in (score, scale, clip):
        plain(axes)
    head = ("segment", "song, s", "best clip", "scale", "from, s", "score", "mutual")
    return f"{picture(png(figure), 'segments and their best matches')}\n\n{markdown(head, rows, longest=200)}"


def matched_curves(title: str, music: Float, motions: Sequence[tuple[str, Float]]) -> str:
    """Lay one segment's rhythm over that of its best matches, read at their scales.

    Parameters
    ----------
    title : str
    music : (L,) float, rhythm of the segment
    motions : a name and (L,) float each, rhythm of the clips under it

    Returns
    -------
    str, Markdown; empty without motions
    """
    if not motions:
        return ""
    figure = figure_of(10, 0.6 + 1.2 * len(motions))
    time_s = np.arange(len(music)) / FEATURE_RATE_HZ
    for axes, (name, motion) in zip(np.ravel(figure.subplots(len(motions), 1)), motions, strict=True):
        axes.fill_between(time_s, music, color=WARM, alpha=0.5, linewidth=0)
        axes.plot(time_s, motion, color=COOL, linewidth=1.1)
        axes.set_title(name, fontsize=7, loc="left", pad=1)
        plain(axes)
    return f"{title}\n\n{picture(png(figure), 'music orange, motion blue, seconds of the segment')}"


def chosen(spans: Float, pieces: Sequence[Any], found: Chosen) -> str:
    """List what was chosen, one row a span: rank, costs, and whether its seam is within the thresholds.

    Parameters
    ----------
    spans : (S + 1,) float, seconds of the song
    pieces : S pieces, :class:`kernels.matching.price.MatchPiece`
    found : Chosen, of S spans

    Returns
    -------
    str, Markdown
    """
    rows = [
        (
            i,
            f"{a:.2f} to {b:.2f}",
            p.clip_id,
            f"{p.start_s:.2f} to {p.end_s:.2f}",
            p.rank_number or "none",
            "yes" if p.is_snapped else "",
            float(p.match_cost),
            float(p.intensity_cost),
            float(p.warp_cost),
            float(found.seam_cost[i]),
            float(found.repetition_cost[i]),
            "" if found.is_connected[i] else "**no**",
        )
        for i, (a, b, p) in enumerate(zip(spans[:-1], spans[1:], pieces, strict=True))
    ]
    costs = ("match", "intensity", "warp", "seam", "repetition")
    head = ("span", "song, s", "clip", "clip, s", "rank", "snapped", *costs, "connects")
    return markdown(head, rows, longest=200)
