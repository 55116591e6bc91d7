"""How well the examination of clips finds what is wrong: clean takes, and takes damaged in known ways.

    python benchmarks/clip_health.py [FOLDER ...] [--takes N] [--json FOLDER]

Folders are searched for .bvh files, and for .zip files of such; without any, the labelled and the idle takes are read
where there are some (in ODORI_TEST_DATA, else beside the checkout). The made-up dancers on three rigs are always
looked at. First every take is examined as it is: *alarms* are all faults but `fast`. Then each kind of damage is done
to N takes without alarm, at random places, joints and rates (24, 30, 60, 120 Hz): how often it is found with the right
kind, how often it is mended and fenced, which part of the damaged frames is mended or fenced, how often anything else
is said, and how far what was mended is from the truth. CPU time is of one core, beside that of reading and retargeting.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from assets.formats import bvh
from assets.formats.errors import FormatError
from kernels import rotation
from kernels.assembly.blend import sample
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.examine import examine
from kernels.skeleton.naming import JointMapping, map_joints
from kernels.skeleton.retarget import retarget
from kernels.synthetic import dancer, rigs
from kernels.synthetic.rigs import RigPlan
from kernels.types import Clip, Float, Skeleton

RATES_HZ = (24.0, 30.0, 60.0, 120.0)
PLANS = (
    RigPlan(),
    RigPlan(axes=rigs.along_bones(), has_root=True),
    RigPlan(axes=rigs.a_pose(), twisted=("leftLowerArm",), without=("leftToes", "rightToes")),
)


@dataclass(frozen=True, eq=False)
class Take:
    """A clip with its mapping and where it is from."""

    name: str
    clip: Clip
    mapping: JointMapping


@dataclass(frozen=True, eq=False)
class Damaged:
    """A clip after damage: the frames that are wrong, kinds and verdicts that are right, and which joint moves."""

    clip: Clip
    first: int
    last: int
    kinds: frozenset[str]
    verdicts: frozenset[str]


def files(paths: list[Path]) -> Iterator[tuple[str, bytes]]:
    """List names and bytes of all takes in folders and archives."""
    for path in paths:
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.suffix == ".bvh":
                yield f"{path.name}/{file.name}", file.read_bytes()
            elif file.suffix == ".zip":
                with zipfile.ZipFile(file) as archive:
                    for name in sorted(archive.namelist()):
                        if name.endswith(".bvh"):
                            yield f"{file.name}/{Path(name).name}", archive.read(name)


def made_up() -> list[Take]:
    """Take every move of the made-up dancer on three rigs at three rates."""
    takes = []
    for number, plan in enumerate(PLANS):
        for label in dancer.MOVES:
            for rate_hz in (24.0, 60.0, 120.0):
                clip = rigs.author(dancer.take(label, n_beats=10, frame_rate_hz=rate_hz).clip, plan)
                takes.append(Take(f"made up/{label}-{number}-{rate_hz:g}", clip, map_joints(clip.skeleton)))
    return takes


def resampled(clip: Clip, rate_hz: float, pace: float = 1.0) -> Clip:
    """Bring a clip to another rate, through its frames; played at a pace."""
    if clip.frame_rate_hz == rate_hz and pace == 1.0:
        return clip
    time_s = np.arange(int(clip.duration_s / pace * rate_hz) + 1) / rate_hz * pace
    root, turn = sample(clip, time_s)
    moved = clip.translation_xyz_m
    if moved is not None:
        moved = CubicSpline(np.arange(clip.n_frames) / clip.frame_rate_hz, moved, axis=0)(time_s)
    return Clip(clip.skeleton, rate_hz, root, turn, moved)


def _axis(rng: np.random.Generator) -> Float:
    axis = rng.standard_normal(3)
    return axis / np.linalg.norm(axis)


def _where(rng: np.random.Generator, clip: Clip, n: int) -> int:
    edge = max(round(0.5 * clip.frame_rate_hz), 8)
    return int(rng.integers(edge, max(clip.n_frames - n - edge, edge + 1)))


def _turned(take: Take, rng: np.random.Generator, first: int, n: int, *, wild: bool, n_joints: int = 1) -> Clip:
    q = take.clip.rotation_wxyz.copy()
    names = rng.choice(list(take.mapping.joint.values()), n_joints, replace=False)
    for name in names:
        k = take.clip.skeleton.index(str(name))
        by = rotation.from_axis_angle(_axis(rng), rng.uniform(1.2, 3.1))
        for frame in range(first, min(first + n, len(q))):
            if wild:
                by = rotation.from_axis_angle(_axis(rng), rng.uniform(1.2, 3.1))
            q[frame, k] = rotation.mul(q[frame, k], by)
    return replace(take.clip, rotation_wxyz=rotation.continuous(q))


def _held(clip: Clip, first: int, n: int) -> Clip:
    root, q = clip.root_xyz_m.copy(), clip.rotation_wxyz.copy()
    root[first : first + n], q[first : first + n] = root[first - 1], q[first - 1]
    moved = clip.translation_xyz_m
    if moved is not None:
        moved = moved.copy()
        moved[first : first + n] = moved[first - 1]
    return Clip(clip.skeleton, clip.frame_rate_hz, root, q, moved)


def _moved(clip: Clip, shift: Float) -> Clip:
    """Shift the body by (F, 3): its root, or the joint below a root that stands still."""
    if clip.translation_xyz_m is None:
        return replace(clip, root_xyz_m=clip.root_xyz_m + shift)
    moved = clip.translation_xyz_m.copy()
    moved[:, 1] += shift
    return replace(clip, translation_xyz_m=moved)


def flips(n_low: int, n_high: int, *, wild: bool = False) -> Callable[[Take, np.random.Generator], Damaged]:
    """Turn one joint in some frames."""

    def damage(take: Take, rng: np.random.Generator) -> Damaged:
        n = int(rng.integers(n_low, n_high + 1))
        first = _where(rng, take.clip, n)
        verdicts = frozenset({"mended", "fenced"})
        clip = _turned(take, rng, first, n, wild=wild)
        return Damaged(clip, first, first + n - 1, frozenset({"flip", "gimbal"}), verdicts)

    return damage


def several(take: Take, rng: np.random.Generator) -> Damaged:
    """Turn five joints in one to three frames."""
    n = int(rng.integers(1, 4))
    first = _where(rng, take.clip, n)
    clip = _turned(take, rng, first, n, wild=False, n_joints=5)
    return Damaged(clip, first, first + n - 1, frozenset({"flip", "gimbal"}), frozenset({"mended", "fenced"}))


def stays(take: Take, rng: np.random.Generator) -> Damaged:
    """Turn one joint from a frame on."""
    first = _where(rng, take.clip, 1)
    clip = _turned(take, rng, first, take.clip.n_frames, wild=False)
    return Damaged(clip, first - 1, first, frozenset({"flip"}), frozenset({"fenced"}))


def pops(n_low: int, n_high: int) -> Callable[[Take, np.random.Generator], Damaged]:
    """Shift the body in some frames."""

    def damage(take: Take, rng: np.random.Generator) -> Damaged:
        n = int(rng.integers(n_low, n_high + 1))
        first = _where(rng, take.clip, n)
        shift = np.zeros((take.clip.n_frames, 3))
        shift[first : first + n] = _axis(rng) * rng.uniform(0.15, 0.6)
        clip = _moved(take.clip, shift)
        return Damaged(clip, first, first + n - 1, frozenset({"pop"}), frozenset({"mended", "fenced"}))

    return damage


def teleport(take: Take, rng: np.random.Generator) -> Damaged:
    """Shift the body from a frame on."""
    first = _where(rng, take.clip, 1)
    shift = np.zeros((take.clip.n_frames, 3))
    shift[first:] = _axis(rng) * rng.uniform(0.15, 0.6)
    return Damaged(_moved(take.clip, shift), first - 1, first, frozenset({"pop"}), frozenset({"fenced"}))


def freeze(take: Take, rng: np.random.Generator) -> Damaged:
    """Hold all channels for a while."""
    n = round(rng.uniform(0.3, 0.8) * take.clip.frame_rate_hz)
    first = _where(rng, take.clip, n)
    return Damaged(
        _held(take.clip, first, n), first, first + n - 1, frozenset({"frozen"}), frozenset({"fenced", "mended"})
    )


def twice(take: Take, rng: np.random.Generator) -> Damaged:
    """Say one or two frames again."""
    n = int(rng.integers(1, 3))
    first = _where(rng, take.clip, n)
    return Damaged(
        _held(take.clip, first, n), first, first + n - 1, frozenset({"frozen"}), frozenset({"mended", "fenced"})
    )


def filled(*, euler: bool) -> Callable[[Take, np.random.Generator], Damaged]:
    """Fill a gap with straight lines, of rotations or of angles."""

    def damage(take: Take, rng: np.random.Generator) -> Damaged:
        clip = take.clip
        n = round(rng.uniform(0.3, 0.8) * clip.frame_rate_hz)
        first = _where(rng, clip, n)
        a, b = first - 1, first + n
        share = np.linspace(0, 1, n + 2)[1:-1]
        q, root = clip.rotation_wxyz.copy(), clip.root_xyz_m.copy()
        if euler:
            angle = np.unwrap(rotation.to_euler(q[[a, b]], "zxy"), axis=0)
            between = (1 - share[:, None, None]) * angle[0] + share[:, None, None] * angle[1]
            q[first:b] = rotation.from_euler(between, "zxy")
        else:
            q[first:b] = rotation.slerp(q[a], q[b], share[:, None] * np.ones(q.shape[1]))
        root[first:b] = (1 - share[:, None]) * root[a] + share[:, None] * root[b]
        moved = clip.translation_xyz_m
        if moved is not None:
            moved = moved.copy()
            moved[first:b] = (1 - share[:, None, None]) * moved[a] + share[:, None, None] * moved[b]
        bad = Clip(clip.skeleton, clip.frame_rate_hz, root, rotation.continuous(q), moved)
        return Damaged(bad, first, b - 1, frozenset({"gap"}), frozenset({"fenced"}))

    return damage


def slide(*, still: bool) -> Callable[[Take, np.random.Generator], Damaged]:
    """Let the body glide away, in its motion or standing still."""

    def damage(take: Take, rng: np.random.Generator) -> Damaged:
        n = round(rng.uniform(0.6, 1.0) * take.clip.frame_rate_hz)
        first = _where(rng, take.clip, n)
        clip = _held(take.clip, first, n) if still else take.clip
        way = rng.uniform(0.7, 1.2) * np.array([np.sin(a := rng.uniform(0, 2 * np.pi)), 0.0, np.cos(a)])
        share = np.clip((np.arange(clip.n_frames) - first + 1) / n, 0, 1)
        kinds = frozenset({"sliding", "frozen"} if still else {"sliding"})
        return Damaged(_moved(clip, share[:, None] * way), first, first + n - 1, kinds, frozenset({"fenced"}))

    return damage


def calibrated(take: Take, rng: np.random.Generator) -> Damaged:
    """Begin with the rig's own T-pose, for one frame or half a second."""
    clip = take.clip
    n = 1 if rng.random() < 0.5 else round(0.5 * clip.frame_rate_hz)
    q, root = clip.rotation_wxyz.copy(), clip.root_xyz_m.copy()
    q[:n, 1:] = rotation.IDENTITY
    q[:n, 0] = rotation.from_heading(rotation.heading_rad(q[n : n + 1, 0]))
    q[:n] = rotation.normalize(q[:n] + 1e-5 * rng.standard_normal(q[:n].shape))
    bad = replace(clip, root_xyz_m=root, rotation_wxyz=rotation.continuous(q))
    return Damaged(bad, 0, n - 1, frozenset({"tpose"}), frozenset({"fenced"}))


def whole(place: tuple[float, ...], turn: tuple[float, ...], kind: str) -> Callable[..., Damaged]:
    """Mirror or turn a whole take."""

    def damage(take: Take, rng: np.random.Generator) -> Damaged:
        clip, p = take.clip, np.array(place)
        bad = Clip(
            Skeleton(clip.skeleton.joints, clip.skeleton.parent, clip.skeleton.offset_xyz_m * p),
            clip.frame_rate_hz,
            clip.root_xyz_m * p,
            clip.rotation_wxyz * np.array((1.0, *turn)),
            None if clip.translation_xyz_m is None else clip.translation_xyz_m * p,
        )
        return Damaged(bad, 0, clip.n_frames - 1, frozenset({kind}), frozenset({"mended"}))

    return damage


def unit(take: Take, rng: np.random.Generator) -> Damaged:
    """Write the path in another unit."""
    scale = float(rng.choice([100.0, 1000.0, 0.01]))
    clip = take.clip
    if clip.translation_xyz_m is None:
        bad = replace(clip, root_xyz_m=clip.root_xyz_m * scale)
    else:
        moved = clip.translation_xyz_m.copy()
        moved[:, 1] *= scale
        bad = replace(clip, translation_xyz_m=moved)
    return Damaged(bad, 0, clip.n_frames - 1, frozenset({"root_path"}), frozenset({"mended", "refused"}))


def paced(factor: float) -> Callable[..., Damaged]:
    """Play a take at another pace."""

    def damage(take: Take, rng: np.random.Generator) -> Damaged:
        clip = take.clip
        if factor > 1:
            bad = replace(clip, frame_rate_hz=clip.frame_rate_hz * factor)
        else:
            bad = resampled(clip, clip.frame_rate_hz, factor)
        return Damaged(bad, 0, bad.n_frames - 1, frozenset({"rate"}), frozenset({"doubtful"}))

    return damage


DAMAGES: dict[str, Callable[[Take, np.random.Generator], Damaged]] = {
    "flip, 1 frame": flips(1, 1),
    "flip, 2 or 3 frames": flips(2, 3),
    "flips of 5 joints, 1 to 3 frames": several,
    "flip that stays": stays,
    "gimbal burst, 4 to 12 frames": flips(4, 12, wild=True),
    "pop, 1 to 3 frames": pops(1, 3),
    "teleport": teleport,
    "frozen, .3 to .8 s": freeze,
    "1 or 2 frames repeated": twice,
    "gap, straight rotations": filled(euler=False),
    "gap, straight angles": filled(euler=True),
    "slide while moving": slide(still=False),
    "slide while still": slide(still=True),
    "T-pose first": calibrated,
    "y down": whole((1.0, -1.0, -1.0), (1.0, -1.0, -1.0), "up_axis"),
    "mirrored": whole((-1.0, 1.0, 1.0), (1.0, -1.0, -1.0), "mirrored"),
    "path in another unit": unit,
    "ten times too fast": paced(10.0),
    "ten times too slow": paced(0.1),
}
"""Kinds of damage by what they are called in the table."""


def score(takes: list[Take], damage: Callable[..., Damaged], n: int, rng: np.random.Generator) -> dict[str, float]:
    """Figures of one kind of damage over n takes."""
    found = Counter[str]()
    errors_deg, errors_m, covered, seen = [], [], [], 0
    for i in rng.permutation(len(takes)):
        take = takes[i]
        take = replace(take, clip=resampled(take.clip, float(rng.choice(RATES_HZ))))
        if take.clip.duration_s < 2.0:
            continue
        before = examine(take.clip, take.mapping)
        if any(fault.kind != "fast" for fault in before.faults):
            continue
        bad = damage(take, rng)
        seen += 1
        after = examine(bad.clip, take.mapping)
        told = [f for f in after.faults if f.kind != "fast"]
        here = [f for f in told if f.first <= bad.last + 3 and f.last >= bad.first - 3]
        right = [f for f in here if f.kind in bad.kinds and f.verdict in bad.verdicts]
        found["found"] += bool(here)
        found["right"] += bool(right)
        found["elsewhere"] += len(here) < len(told)
        for verdict in ("mended", "fenced", "refused", "doubtful"):
            found[verdict] += bool(right) and all(f.verdict == verdict for f in right)
        is_out = after.is_fenced.copy()
        for fault in told:
            if fault.verdict in ("mended", "refused", "doubtful"):
                is_out[fault.first : fault.last + 1] = True
        covered.append(float(is_out[bad.first : bad.last + 1].mean()))
        if after.clip.n_frames == take.clip.n_frames and right and all(f.verdict == "mended" for f in here):
            is_shown = ~after.is_fenced
            apart = rotation.angle_between(after.clip.rotation_wxyz, take.clip.rotation_wxyz)[is_shown]
            errors_deg.append(float(np.degrees(apart.max())))
            hips = [BodyInMotion(clip, take.mapping).hips for clip in (after.clip, take.clip)]
            errors_m.append(float(np.abs(hips[0] - hips[1])[is_shown].max()))
        if seen == n:
            break
    share = {f"{name}_ratio": found[name] / max(seen, 1) for name in (*FOUND, "elsewhere")}
    return share | {
        "takes": float(seen),
        "covered_ratio": float(np.mean(covered)) if covered else 0.0,
        "mended_p50_deg": float(np.median(errors_deg)) if errors_deg else 0.0,
        "mended_p95_deg": float(np.quantile(errors_deg, 0.95)) if errors_deg else 0.0,
        "mended_p95_mm": 1000 * float(np.quantile(errors_m, 0.95)) if errors_m else 0.0,
    }


FOUND = ("found", "right", "mended", "fenced", "refused", "doubtful")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", type=Path)
    parser.add_argument("--takes", type=int, default=100, help="takes that each kind of damage is done to")
    parser.add_argument("--seed", type=int, default=15)
    parser.add_argument("--json", type=Path, help="folder to write clip_health.json into")
    asked = parser.parse_args()
    data = Path(os.environ.get("ODORI_TEST_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    folders = asked.folders or [data / name for name in ("bvh_labelled", "bvh_idle") if (data / name).is_dir()]
    takes, start = [], time.process_time()
    for name, content in files(folders):
        try:
            read = bvh.to_clip(bvh.parse(content, name))
        except (FormatError, ValueError):
            continue
        if read.mapping is not None:
            takes.append(Take(name, read.clip, read.mapping))
    reading_s = time.process_time() - start
    figures: dict[str, object] = {}
    for group, these in (("recorded", takes), ("made up", made_up())):
        start = time.process_time()
        examined = [examine(take.clip, take.mapping) for take in these]
        examining_s = time.process_time() - start
        alarms = Counter(f"{f.kind} {f.verdict}" for e in examined for f in e.faults)
        alarmed = [t.name for t, e in zip(these, examined, strict=True) if any(f.kind != "fast" for f in e.faults)]
        whole_s = sum(take.clip.n_frames / take.clip.frame_rate_hz for take in these)
        print(f"{group}: {len(these)} takes, {whole_s:.0f} s; alarms in {len(alarmed)}: {alarmed[:8]}; {dict(alarms)}")
        figures[group] = {
            "takes": len(these),
            "whole_s": whole_s,
            "alarmed": len(alarmed),
            "fenced_ratio": sum(int(e.is_fenced.sum()) for e in examined) / max(sum(t.clip.n_frames for t in these), 1),
            "examining_cpu_s": examining_s,
        }
        if group == "recorded" and these:
            start = time.process_time()
            for take in these[:100]:
                retarget(take.clip, take.mapping)
            part = sum(t.clip.n_frames for t in these[:100]) / sum(t.clip.n_frames for t in these)
            retargeting_s = (time.process_time() - start) / part
            print(f"CPU: reading {reading_s:.2f} s, examining {examining_s:.2f} s, retargeting {retargeting_s:.2f} s")
            figures["cpu"] = {"reading_s": reading_s, "examining_s": examining_s, "retargeting_s": retargeting_s}
    takes = takes or made_up()
    heads = ("right", "mended", "fenced", "covered", "elsewhere")
    print(f"{'damage':34s} takes " + " ".join(f"{h:>9s}" for h in heads) + "  off p50, p95 °    mm")
    for number, (name, damage) in enumerate(DAMAGES.items()):
        made = score(takes, damage, asked.takes, np.random.default_rng([asked.seed, number]))
        figures[name] = made
        ratios = " ".join(f"{100 * made[h + '_ratio']:8.0f}%" for h in heads)
        off = f"{made['mended_p50_deg']:7.2f} {made['mended_p95_deg']:6.2f} {made['mended_p95_mm']:8.1f}"
        print(f"{name:34s} {made['takes']:5.0f} {ratios} {off}", flush=True)
    if asked.json:
        asked.json.mkdir(parents=True, exist_ok=True)
        (asked.json / "clip_health.json").write_text(json.dumps(figures, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
