"""Reports of finished dances: facts for machines, lines for people, and copies of the stage."""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from assets.dancing import pose_pins
from assets.dancing.asked import direction_of
from assets.dancing.by_graph import poses_of
from assets.dancing.methods import METHODS
from assets.dancing.wishes import stretch
from assets.formats import usd_package
from assets.reading.songs import PlayedSong
from assets.stage import COSTS
from assets.tables import pack
from assets.tables.motion import CanonicalClip
from assets.tables.music import to_music_beat
from kernels.assembly.timing import cover
from pipelines.commands import hmm_report
from pipelines.studio.files import StudioError, write_beside
from pipelines.studio.folder import StudioFolder
from pipelines.studio.stored import StoredTable
from schemas.choreography import CHOREOGRAPHY, DECISIVE_MEASURES
from schemas.keys import alternative_number, base_method, mirrored, seen_label
from schemas.pins import PinWish


def dances_facts(made: list[dict[str, Any]], troubles: list[str], n_asked: int) -> dict[str, Any]:
    """Put together what ``--json`` prints of one dance, or of several."""
    if n_asked == 1:
        return made[0] if made else {"error": "; ".join(dict.fromkeys(troubles))}
    return {"dances": made, "troubles": list(dict.fromkeys(troubles))}


def facts_of(studio: StudioFolder, song: str, method: str) -> dict[str, Any]:
    """Gather the facts of one dance: its files, measures, costs, pins, licence, and how it differs from the best."""
    folder = studio.dances_of(song)
    report = json.loads((folder / f"{method}.json").read_bytes())
    steps = pl.DataFrame(studio.lake.table(CHOREOGRAPHY.name, f"{song}|{method}"))
    costs = {name.removesuffix("_cost"): float(steps[name].sum()) for name in COSTS}
    facts = {
        "song": song,
        "method": method,
        "stage": str(folder / f"{method}.usdc"),
        "usdz": str(folder / f"{method}.usdz"),
        "quality": report["quality"],
        "as_wanted": not not_as_wanted(report),
        "not_as_wanted": not_as_wanted(report),
        "missed": missed(report),
        "licence": report["licence"],
        "cost": sum(costs.values()),
        "costs": costs,
        "clips": steps["clip_id"].unique(maintain_order=True).to_list(),
        "character": report["provenance"].get("character"),
        "pins": _pin_facts(studio, song, method, steps),
    }
    if METHODS[base_method(method)].learns:
        model = hmm_report.model_facts(studio.lake, subject=studio.settings().choreography_model.subject)
        facts["model"] = model | {"notes": [*model["notes"], *hmm_report.dance_notes(report)]}
    if alternative_number(method) > 1:
        facts |= _difference(studio, song, base_method(method), steps)
    return facts


def not_as_wanted(report: Mapping[str, Any]) -> list[str]:
    """Say what keeps a dance from being as wanted: sentences on :data:`schemas.choreography.DECISIVE_MEASURES`.

    Parameters
    ----------
    report : of a dance, the JSON beside its stage

    Returns
    -------
    list of sentences
        With time and clip where a measure has them; empty for a dance that is as wanted.
    """
    told: list[str] = []
    for name in DECISIVE_MEASURES:
        measure = report["wanted"].get(name, {"is_passed": None})
        if measure["is_passed"] is False:
            told += measure.get("reasons") or [f"{name} is {measure['value']:g}, wanted is {measure['wanted']}"]
    return told


def missed(report: Mapping[str, Any]) -> list[str]:
    """Name the measures of a dance that miss their limits, whether they decide or not.

    Parameters
    ----------
    report : of a dance, the JSON beside its stage
    """
    return sorted(name for name, measure in report["wanted"].items() if measure["is_passed"] is False)


def _difference(studio: StudioFolder, song: str, best: str, steps: pl.DataFrame) -> dict[str, Any]:
    """Measure what an alternative shares with the best dance: of its seconds, those of the same clip and moment.

    ``shared_ratio`` counts seconds of clips that the best shows too, anywhere in the song; ``same_ratio`` seconds in
    which both show the same of a clip at the same time; ``shared_clips`` whose names both have.
    """
    first = pl.DataFrame(studio.lake.table(CHOREOGRAPHY.name, f"{song}|{best}"))
    frames, other = (
        pl.DataFrame(studio.lake.table("frame_lineage", f"{song}|{method}"))
        for method in (steps["method_name"][0], best)
    )
    n = min(len(frames), len(other))
    frames, other = frames.head(n), other.head(n)
    is_near = (frames["clip_time_s"] - other["clip_time_s"]).abs() < NEAR_S
    is_same = (frames["clip_id"] == other["clip_id"]) & (frames["is_mirrored"] == other["is_mirrored"]) & is_near
    shown = set(_moments(other))
    is_shared = [moment in shown for moment in _moments(frames)]
    clips = set(steps["clip_id"])
    return {
        "same_ratio": int(is_same.sum()) / max(n, 1),
        "shared_ratio": sum(is_shared) / max(n, 1),
        "shared_clips": sorted(clips & set(first["clip_id"])),
    }


NEAR_S = 0.1
"""Moments of a clip no further apart count as the same. Chosen by hand."""


def _moments(frames: pl.DataFrame) -> list[tuple[str, bool, int]]:
    """Name what each frame shows: clip, mirrored or not, moment."""
    cell = (frames["clip_time_s"] / NEAR_S).round().cast(pl.Int64)
    return list(zip(frames["clip_id"], frames["is_mirrored"], cell, strict=True))


def _pin_facts(studio: StudioFolder, song: str, method: str, steps: pl.DataFrame) -> list[dict[str, Any]]:
    """List for each pin when it is danced, by which clips, and whether it is kept."""
    wishes = direction_of(studio, f"{song}|{method}").wishes
    if not wishes:
        return []
    beats = to_music_beat(studio.lake.table("music_beat", song))
    duration_s = max(studio.lake.table("song", song)["duration_s"].to_pylist())
    played = PlayedSong(cover(beats.time_s, duration_s)[0], beats, duration_s)
    clips = {row["clip_id"]: row for s in studio.lake.keys("clip") for row in studio.lake.table("clip", s).to_pylist()}
    posed = _Posed(studio, song, method, played) if any(wish.pose for wish in wishes) else None
    facts = []
    for wish in wishes:
        first, last = stretch(wish, played)
        from_s, to_s = max(played.grid_s[first], 0.0), min(played.grid_s[last], duration_s)
        if posed and wish.pose:
            facts.append({"pin": wish.text, "from_s": float(from_s), "to_s": float(to_s), **posed.facts(wish)})
            continue
        here = steps.filter((pl.col("song_end_s") > from_s + 1e-6) & (pl.col("song_start_s") < to_s - 1e-6))
        danced = list(dict.fromkeys(here["clip_id", "is_mirrored"].iter_rows()))
        facts.append(
            {
                "pin": wish.text,
                "from_s": float(from_s),
                "to_s": float(to_s),
                "clips": list(dict.fromkeys(clip for clip, _ in danced)),
                "is_kept": all(wish.is_kept_by(**_named(clips[clip], is_image=image)) for clip, image in danced),
            }
        )
    return facts


class _Posed:
    """What a finished dance shows at the moments of pins of a pose."""

    def __init__(self, studio: StudioFolder, song: str, method: str, played: PlayedSong) -> None:
        lake, key = studio.lake, f"{song}|{method}"
        self._played = played
        self._lineage = pl.DataFrame(lake.table("frame_lineage", key))
        frames = lake.table("dance_pose", key)
        root, turned, place = (
            pack.to_array(frames[name]) for name in ("root_xyz_m", "rotation_wxyz", "position_xyz_m")
        )
        self._dance = CanonicalClip(
            key, pack.frame_rate_hz(frames), root, turned, place, np.zeros(frames.num_rows, bool)
        )
        stored = StoredTable(lake, "canonical_pose", lake.keys("canonical_pose"))
        self._poses = poses_of(stored, studio.settings())
        self._nodes = pl.DataFrame(lake.table("motion_graph_node"))

    def facts(self, wish: PinWish) -> dict[str, Any]:
        """List for one pin the clip shown, when, how far from the pose, and whether that is near enough."""
        moment_s = pose_pins.moment_of(wish, self._played)
        shown = pose_pins.shown_pose(wish, moment_s, self._lineage, self._dance, self._poses, self._nodes)
        return {"clips": [shown["shown_clip_id"]] if "shown_clip_id" in shown else [], **shown}


def _named(clip: Mapping[str, Any], *, is_image: bool) -> dict[str, str]:
    """Name what is seen of a clip, or of its mirror image."""
    clip_id, label = str(clip["clip_id"]), str(clip["label"])
    seen = seen_label(label, mirrored(clip_id) if is_image else clip_id)
    return {"clip_id": clip_id, "label": seen, "style": str(clip["style"])}


def report_of(facts: dict[str, Any]) -> str:
    """Write the report of one dance."""
    q = facts["quality"]
    lines = [
        f"{facts['song']}: {facts['usdz']}",
        f"  {q['clip_count']:.0f} clips, {q['seam_count']:.0f} seams; steps start at most {q['beat_lag_ms']:.1f} ms "
        f"off their beat; warp {q['warp_least_ratio']:.2f} to {q['warp_most_ratio']:.2f} (song time over clip time)",
        f"  beats: F {q['beat_f_ratio']:.2f} of 1 (beats of music and body within 70 ms of each other; by chance "
        f"{q['beat_f_chance_ratio']:.2f}), p {q['beat_f_p_probability']:.3f} (how often shifted beats do as well)",
    ]
    costs = ", ".join(f"{name} {value:.1f}" for name, value in facts["costs"].items() if value >= 0.05)
    lines.append(f"  cost {facts['cost']:.1f}: {costs or 'nothing'}")
    if "same_ratio" in facts:
        lines.append(
            f"  compared with the best dance: {facts['same_ratio']:.0%} of the time both show the same moment, "
            f"{facts['shared_ratio']:.0%} of its motion is in the best dance too, "
            f"{len(facts['shared_clips'])} of {len(facts['clips'])} clips are shared"
        )
    if facts["character"]:
        body = facts["character"]
        lines.append(
            f"  danced by {body.get('clip_id') or body['file']}, legs {body['scale_ratio']:.2f} of the canonical "
            f"skeleton's: feet slide {body['added_foot_slide_cm_per_s']:+.1f} cm/s more than there, at most "
            f"{body['penetration_cm']:.1f} cm below the floor"
        )
    lines.append(f"  licence {facts['licence']['name']}: {facts['licence']['sentence']}")
    lines += [
        f"  pin {p['pin']}: {'kept' if p['is_kept'] else 'not kept'}, {', '.join(p['clips'])} {_when(p)}"
        for p in facts["pins"]
    ]
    lines += [f"  not as wanted: {sentence}" for sentence in facts["not_as_wanted"]]
    if facts["missed"]:
        lines.append(f"  limits missed: {', '.join(facts['missed'])} (limits: the .json beside the stage)")
    if "model" in facts:
        lines += hmm_report.report_lines(facts["model"])
    return "\n".join(lines)


def _when(pin: Mapping[str, Any]) -> str:
    """Say when a pin is danced; of a pose, which moment is shown and how far it is from the pose pinned."""
    if "distance_m" not in pin:
        return f"from {pin['from_s']:.2f} to {pin['to_s']:.2f} s"
    turned = " mirrored" if pin["is_mirrored"] else ""
    apart_cm = 100 * pin["distance_m"]
    return (
        f"at {pin['shown_time_s']:.2f} s{turned}, joints {apart_cm:.1f} cm from the pose on average, "
        f"at {pin['at_s']:.2f} s of the song"
    )


def check_out(out: Path) -> None:
    """Refuse to copy to where a file of the user would be lost."""
    if out.suffix not in (".usdz", ".usdc"):
        raise StudioError(f"--out: want a file ending in .usdz or .usdc, got {out.name!r}")
    sound = out.with_suffix(".wav")
    if out.suffix == ".usdc" and sound.exists() and usd_package.song_name(out) != sound.name:
        raise StudioError(
            f"--out: want room for the song beside the stage, got another file {sound}; move it, or name another stage"
        )


def copy_out(facts: dict[str, Any], out: Path) -> None:
    """Copy a finished stage to where it was asked for."""
    source = Path(facts["usdz" if out.suffix == ".usdz" else "stage"])
    facts["out"] = str(out)
    if out.exists() and out.samefile(source):  # also by another spelling, where capitals do not count
        return
    if out.suffix == ".usdc":
        usd_package.copy_stage(out, source)
    else:
        with source.open("rb") as original:
            write_beside(out, lambda file: shutil.copyfileobj(original, file))
