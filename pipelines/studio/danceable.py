"""Which clips each method can dance, and why it cannot dance the others; for a song, or for any."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow.compute as pc

from assets.dancing import licences
from assets.stamps import content_version
from assets.tables.pack import by_clip
from kernels.graph.path import STEPS
from kernels.warp import HARD_WARP
from pipelines.studio.lake import Lake
from schemas.catalog import TABLES
from schemas.settings import METHODS

UNBUILT = "the catalogue is not built with it; run 'odori build'"


@dataclass(frozen=True)
class DancedSong:
    """A song that clips are to be danced to.

    Parameters
    ----------
    song_id : its key
    allow : licences its brief allows; all where empty
    interval_s : float, seconds between its beats, the median; 0 where it has none
    """

    song_id: str
    allow: tuple[str, ...] = ()
    interval_s: float = 0.0


def why_not(
    lake: Lake, clips: Iterable[Mapping[str, Any]], song: DancedSong | None = None
) -> dict[str, dict[str, str]]:
    """Say by which methods clips cannot be danced, and why.

    Parameters
    ----------
    lake : Lake
    clips : ``clip_id``, ``state``, ``reason`` and ``licence`` of each
    song : of which the licences and the tempo count; None for no song in particular

    Returns
    -------
    dict
        By clip, a sentence for each method that cannot dance it; {} for a clip that all can dance.
    """
    held = _Held(lake)
    found: dict[str, dict[str, str]] = {}
    for clip in clips:
        reason = _at_all(clip, song)
        told = {name: reason or held.by(name, clip, song) for name in METHODS}
        found[str(clip["clip_id"])] = {name: sentence for name, sentence in told.items() if sentence}
    return found


def _at_all(clip: Mapping[str, Any], song: DancedSong | None) -> str:
    """Say why no method dances a clip; empty where one may."""
    if clip["state"] in ("new", "changed"):
        return UNBUILT
    if clip["state"] == "refused":
        return f"it was refused: {clip['reason']}"
    licence = str(clip.get("licence") or "")
    if song is not None and not licences.is_allowed(licence, song.allow):
        return f"its licence, {licence or licences.STUDIO}, is none that the brief of {song.song_id} allows"
    return ""


class _Held:
    """What the lake holds of clips, method by method."""

    def __init__(self, lake: Lake) -> None:
        node = lake.table("motion_graph_node") if _is_there(lake, "motion_graph_node") else None
        kept = None if node is None else node.filter(node["is_kept"])["clip_id"]
        self._noded = None if node is None else set(pc.unique(node["clip_id"]).to_pylist())
        self._kept = set() if kept is None else set(pc.unique(kept).to_pylist())
        self._intervals_s: dict[str, list[float]] = {}
        for table in ("motion_beat", "motion_turn"):
            for key in lake.keys(table):
                for clip, rows in by_clip(lake.table(table, key)).items():
                    self._intervals_s.setdefault(clip, []).append(float(np.median(rows["interval_s"].to_numpy())))
        self._doubt: dict[str, float] = {}
        for key in lake.keys("motion_tempo"):
            rows = lake.table("motion_tempo", key)
            self._doubt |= dict(
                zip(rows["clip_id"].to_pylist(), rows["confidence_probability"].to_pylist(), strict=True)
            )
        self._features = _filled(lake, "motion_feature")
        self._is_modelled = _is_there(lake, "choreography_model")
        self._motions: set[str] = set()
        for key in lake.keys("key_pose"):
            rows = lake.table("key_pose", key)
            self._motions |= set(
                pc.unique(rows.filter(pc.greater_equal(rows["state_index"], 0))["clip_id"]).to_pylist()
            )

    def by(self, method: str, clip: Mapping[str, Any], song: DancedSong | None) -> str:
        """Say why a method cannot dance a clip; empty where it can, and for a method that nothing is known of."""
        clip_id, licence = str(clip["clip_id"]), str(clip.get("licence") or "")
        if method == "graph":
            return self._by_graph(clip_id, song)
        if not licences.may_be_joined(licence):
            return f"its licence, {licence}, forbids to change it: it cannot be danced in pieces"
        ways = {"matching": self._by_matching, "hmm": self._by_hmm}
        return ways[method](clip_id) if method in ways else ""

    def _by_graph(self, clip: str, song: DancedSong | None) -> str:
        if self._noded is None:
            return UNBUILT
        if clip not in self._intervals_s:
            sure = f" (probability {self._doubt[clip]:.2f})" if clip in self._doubt else ""
            return f"no pulse was found in it{sure}, and no movement that turns evenly: the motion graph steps on these"
        if clip not in self._kept:
            nothing = "none of its beats is in the motion graph" if clip not in self._noded else "no pose of it is near"
            return f"{nothing} enough to another beat to go on from; more clips like it would help"
        return _out_of_pace(self._intervals_s[clip], song)

    def _by_matching(self, clip: str) -> str:
        if not self._features:
            return UNBUILT
        return "" if clip in self._features else "no features could be measured of it"

    def _by_hmm(self, clip: str) -> str:
        if not self._is_modelled:
            return "the model of the dancer is made with its first dance; run 'odori dance SONG --method hmm'"
        return (
            "" if clip in self._motions else "no motion in it goes from braking to braking within the lengths asked for"
        )


def _out_of_pace(intervals_s: list[float], song: DancedSong | None) -> str:
    """Say that no step of a clip fits a song's beats; empty where one does, or nobody asks."""
    if song is None or not song.interval_s:
        return ""
    warps = {music * song.interval_s / (motion * own_s): own_s for own_s in intervals_s for motion, music in STEPS}
    if any(HARD_WARP[0] <= warp <= HARD_WARP[1] for warp in warps):
        return ""
    nearest = min(warps, key=lambda warp: abs(np.log(warp)))
    return (
        f"its beats, {60 / warps[nearest]:.0f} a minute, would have to be danced at {1 / nearest:.2f} times their pace "
        f"to the song's {60 / song.interval_s:.0f}; {1 / HARD_WARP[1]:.2f} to {1 / HARD_WARP[0]:.2f} are allowed"
    )


def _is_there(lake: Lake, asset: str) -> bool:
    """Whether a table is stored whole, in the version of today."""
    return lake.stamp(asset) is not None


def _filled(lake: Lake, asset: str) -> set[str]:
    """List the clips that have rows in a table by session."""
    nothing = content_version(TABLES[asset].empty())
    stamps = [lake.stamp(asset, key) for key in lake.keys(asset)]
    return {clip for stamp in stamps if stamp for clip, made in stamp.clips.items() if made.content != nothing}
