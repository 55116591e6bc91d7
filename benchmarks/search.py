"""Motion search: encoders compared on clips they never saw, the same action otherwise recorded, and speed.

Clips are those of ``bvh_labelled`` of the real test data with their ``content`` labels. Splits: by *take* (a quarter of
the takes held out, four times) and by *style* (whole styles held out, five times: whoever was asked to move in another
way is unseen). What is held out is looked up among the rest, which is also what was trained on. ``--queries FOLDER``
looks clips of another folder (BVH with a labels*.csv) up among all, or among those of ``--database FOLDER``.

    python benchmarks/search.py [--json] [--only accuracy|sameness|speed|unseen] [--splits N]
                                [--queries FOLDER] [--database FOLDER]
"""

import argparse
import csv
import dataclasses
import json
import os
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from search_baselines import mean_and_deviation, warped

from assets.formats import bvh
from kernels import rotation
from kernels.search import encoder_fit, network, train
from kernels.search.aligned import MOST_FRAMES, N_TRACK, QUERY_HZ, Alignment, align, room, track
from kernels.search.augment import Augmentation
from kernels.search.discriminant import principal, unit
from kernels.search.document import train_document
from kernels.search.encoder import Encoder
from kernels.search.measure import Retrieval, group_folds, joined, label_folds, retrieval
from kernels.search.nearest import Copies, Hit, nearest_clips
from kernels.search.normalise import channels, resample
from kernels.search.windows import windows
from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import CanonicalMotion, retarget
from kernels.synthetic.rigs import RigPlan, a_pose, author, splayed
from kernels.types import Clip

DATA = Path(os.environ.get("ODORI_TEST_DATA", Path(__file__).parents[2] / "shared" / "data"))
LONGEST_S = 8.0
Distances = NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class Labelled:
    """One clip: canonical motion, and what it is."""

    motion: CanonicalMotion
    frame_rate_hz: float
    label: str
    style: str

    @property
    def window(self) -> NDArray[np.float64]:
        """Its first seconds at the rate of searching."""
        return resample(self.motion.position_xyz_m, self.frame_rate_hz, 0.0, LONGEST_S)


def read(folder: Path) -> Iterator[Labelled]:
    """Read the BVH files of a folder, and of zips in it, that a labels*.csv there names."""
    said: dict[str, dict[str, str]] = {}
    for table in sorted(folder.rglob("labels*.csv")):
        for row in csv.DictReader(table.open(newline="")):
            name = row.get("path") or row.get("path_in_zip") or row.get("file") or ""
            said[Path(name).name] = row
    with tempfile.TemporaryDirectory() as place:
        for archive in sorted(folder.rglob("*.zip")):
            zipfile.ZipFile(archive).extractall(place)
        for path in sorted([*folder.rglob("*.bvh"), *Path(place).rglob("*.bvh")], key=lambda p: p.name):
            if path.name in said:
                take = bvh.to_clip(bvh.read(path))
                moved = retarget(take.clip, take.mapping or map_joints(take.clip.skeleton))
                row = said[path.name]
                yield Labelled(moved, take.clip.frame_rate_hz, row.get("content") or row["label"], row["style"])


class Methods:
    """Every way to search, fitted on some clips and asked about others: (Q, N) distances by name."""

    def __init__(self, clips: list[Labelled], seed: int) -> None:
        self.clips, self.seed = clips, seed
        self.window = [clip.window for clip in clips]
        names = sorted({clip.label for clip in clips})
        self.number = np.array([names.index(clip.label) for clip in clips])
        self.label = [clip.label for clip in clips]
        self.statistics = encoder_fit.statistics_of(self.window, has_travel=True)
        self.channels = [channels(window) for window in self.window]

    def run(self, held: NDArray[np.bool_]) -> Iterator[tuple[str, Distances]]:
        """Fit every method on what is not held out, and measure distances from what is."""
        kept = ~held
        rows = np.flatnonzero(kept).tolist()
        motions, number, told = [self.window[i] for i in rows], self.number[kept], self.statistics[kept]
        how = train.Training(seed=self.seed)

        def apart(vector: NDArray[np.floating]) -> Distances:
            a, b = vector[held].astype(np.float64), vector[kept].astype(np.float64)
            return np.sqrt(np.maximum((a**2).sum(1)[:, None] + (b**2).sum(1)[None] - 2 * a @ b.T, 0.0))

        yield "chance", np.random.default_rng(self.seed).random((int(held.sum()), int(kept.sum())))
        yield "mean and deviation of the pose", apart(mean_and_deviation(self.window))
        yield "dynamic time warping", warped([self.window[i] for i in np.flatnonzero(held)], motions)
        n_frames = -(-max(len(window) for window in self.window) // 4) * 4
        for name, is_masked in (("the encoder of Ganbat 2020", False), ("the same, masked and pooled", True)):
            found = train_document(
                motions, number, n_frames=n_frames, is_masked=is_masked, seed=self.seed, augmentation=Augmentation()
            )
            yield name, apart(found.embed(self.window))
        yield "statistics, untrained", apart(unit(principal(told, 128)(self.statistics)))
        alone = train.train(motions, np.arange(len(motions)), how=how)
        yield "network, self-supervised", apart(self._network(alone))
        spread = principal(told, 128)
        yield (
            "untrained and self-supervised (no labels)",
            apart(self._joined(Encoder(encoder_fit.UNLABELLED, True, spread, None, alone))),
        )
        turned = encoder_fit.mirrored_labels(motions, number, told, has_travel=True)
        weights = train.train(motions, number, how=how, mirrored_label=turned)
        yield "network, supervised contrast", apart(self._network(weights))
        telling = encoder_fit.mirrored_discriminant(motions, number, told, turned, has_travel=True)
        yield "statistics, discriminant", apart(unit(telling(self.statistics)))
        yield (
            "**both together (the default)**",
            apart(self._joined(Encoder(encoder_fit.LABELLED, True, spread, telling, weights))),
        )

    def _network(self, weights: train.Trained) -> NDArray[np.float32]:
        return np.concatenate([network.forward(weights, *network.batch([channel])) for channel in self.channels])

    def _joined(self, encoder: Encoder) -> NDArray[np.float32]:
        return np.stack([encoder.embed_channels(channel) for channel in self.channels])


def accuracy(clips: list[Labelled], most: int) -> dict[str, dict[str, Retrieval]]:
    """Compare the methods on both kinds of splits, at most so many of each: by kind, by method."""
    numbers = np.unique([clip.label for clip in clips], return_inverse=True)[1]
    splits = {
        "take": label_folds(numbers, 4, np.random.default_rng(0)),
        "style": group_folds([clip.style for clip in clips], 5),
    }
    found: dict[str, dict[str, Retrieval]] = {}
    for name, folds in splits.items():
        parts: dict[str, list[Retrieval]] = {}
        for seed, held in enumerate(folds[:most]):
            methods = Methods(clips, seed)
            known = [methods.label[i] for i in np.flatnonzero(~held)]
            asked = [methods.label[i] for i in np.flatnonzero(held)]
            for method, distance in methods.run(held):
                parts.setdefault(method, []).append(retrieval(distance, asked, known))
                sys.stderr.write(f"  {name} {seed + 1}, {method}: {parts[method][-1]}\n")
            sys.stderr.write(f"{name}: split {seed + 1} of {len(folds)}\n")
        found[name] = {method: joined(each) for method, each in parts.items()}
    return found


def default(clips: list[Labelled]) -> tuple[Encoder, float]:
    """Fit the default encoder to all clips; and the CPU seconds that took."""
    begun = time.process_time()
    fitted = encoder_fit.fit([clip.window for clip in clips], [clip.label for clip in clips], how=train.Training())
    return fitted.encoder, time.process_time() - begun


class Catalogue:
    """Clips embedded and followed, to be searched as the command does: by windows, copies first."""

    def __init__(self, clips: list[Labelled], encoder: Encoder) -> None:
        self.encoder = encoder
        self.vector, self.start = embedded(encoder, clips)
        self.tracks = [track(clip.motion.position_xyz_m, clip.frame_rate_hz) for clip in clips]

    def search(self, query: Labelled, k: int) -> list[Hit]:
        """Find the clips most like another."""
        looked_for = track(query.motion.position_xyz_m, query.frame_rate_hz, rate_hz=QUERY_HZ)
        vector = embedded(self.encoder, [query])[0]
        return nearest_clips(self.vector, self.start, vector, k=k, copies=copies_among(self.tracks, looked_for))


def copies_among(tracks: Sequence[NDArray[np.float32]], looked_for: NDArray[np.float32]) -> Copies:
    """Lay a query over as many of the nearest as the command does."""
    count = np.array([len(each) for each in tracks])

    def copies(near: NDArray[np.int64]) -> list[Alignment]:
        n = max(int((np.cumsum(room(looked_for, count[near])) <= MOST_FRAMES).sum()), 1)
        return align(looked_for, [tracks[c] for c in near[:n].tolist()])

    return copies


def unseen(clips: list[Labelled], queries: list[Labelled], encoder: Encoder) -> dict[str, Retrieval]:
    """Look other clips up among all, as the command does."""
    asked, known = [q.label for q in queries], [c.label for c in clips]
    whole, other = [c.window for c in clips], [q.window for q in queries]
    described, of = mean_and_deviation(whole), mean_and_deviation(other)
    catalogue = Catalogue(clips, encoder)
    distance = np.full((len(queries), len(clips)), np.inf)
    for row, query in enumerate(queries):
        for hit in catalogue.search(query, len(clips)):
            distance[row, hit.clip] = hit.distance
    return {
        "mean and deviation of the pose": retrieval(
            np.linalg.norm(of[:, None] - described[None], axis=-1), asked, known
        ),
        "dynamic time warping": retrieval(warped(other, whole), asked, known),
        "**both together (the default)**": retrieval(distance, asked, known),
    }


def embedded(encoder: Encoder, clips: list[Labelled]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Embed clips by their windows: vectors, and the first row of each clip."""
    rows = []
    for clip in clips:
        duration_s = (len(clip.motion.position_xyz_m) - 1) / clip.frame_rate_hz
        rows.append(encoder.embed(clip.motion.position_xyz_m, clip.frame_rate_hz, windows(duration_s)))
    return np.concatenate(rows), np.append(0, np.cumsum([len(r) for r in rows]))[:-1]


def sameness(clips: list[Labelled], encoder: Encoder) -> dict[str, float]:
    """Share of clips whose copy, otherwise recorded, has the clip itself as its first hit."""
    catalogue = Catalogue(clips, encoder)
    shares = {}
    for name, make in COPIES.items():
        right = placed = 0
        for number, clip in enumerate(clips):
            hit = catalogue.search(make(clip, number), 1)[0]
            right += hit.clip == number
            if name == "part" and hit.clip == number and hit.copied:
                placed += abs(hit.copied.start_s - _part(clip, number)[0] / clip.frame_rate_hz) < 0.1
        shares[f"{name}_first_ratio"] = right / len(clips)
        if name == "part":
            shares["part_placed_ratio"] = placed / len(clips)
    return shares


def _other_rig(clip: Labelled, number: int) -> Labelled:
    """Retarget a clip to another body, at another rate, and back."""
    rate = (24.0, 60.0, 120.0)[number % 3]
    f = len(clip.motion.root_xyz_m)
    at = np.arange(int((f - 1) / clip.frame_rate_hz * rate) + 1) / rate * clip.frame_rate_hz
    low = np.minimum(at.astype(int), max(f - 2, 0))
    high, share = np.minimum(low + 1, f - 1), at - low
    turned = rotation.slerp(
        clip.motion.rotation_wxyz[low], clip.motion.rotation_wxyz[high], np.broadcast_to(share[:, None], (len(at), 22))
    )
    root = clip.motion.root_xyz_m[low] * (1 - share[:, None]) + clip.motion.root_xyz_m[high] * share[:, None]
    arms = {f"{side}{part}": 1.25 for side in ("left", "right") for part in ("LowerArm", "Hand")}
    legs = {f"{side}{part}": 0.85 for side in ("left", "right") for part in ("LowerLeg", "Foot")}
    plan = RigPlan(axes=a_pose() if number % 2 else splayed(), stretch=arms | legs | {"upperChest": 1.15})
    other = author(Clip(CANONICAL, rate, root, turned), plan)
    return Labelled(retarget(other, map_joints(other.skeleton)), rate, clip.label, clip.style)


def _moved(clip: Labelled, position: NDArray[np.float64]) -> Labelled:
    motion = dataclasses.replace(clip.motion, position_xyz_m=position)
    return dataclasses.replace(clip, motion=motion)


def _rotated(clip: Labelled, number: int) -> Labelled:
    turn = rotation.from_heading(2.399963 * (number + 1))
    return _moved(clip, rotation.apply(turn, clip.motion.position_xyz_m) + np.array([3.0, 0.0, -2.0]))


def _shifted(clip: Labelled, number: int) -> Labelled:
    """Begin a tenth of the clip later, at most half a second."""
    first = min(int(0.1 * len(clip.motion.position_xyz_m)), int(clip.frame_rate_hz / 2))
    return _moved(clip, clip.motion.position_xyz_m[first:])


def _ended(clip: Labelled, number: int) -> Labelled:
    """Cut a tenth of the clip off its end, at most half a second."""
    cut = min(int(0.1 * len(clip.motion.position_xyz_m)), int(clip.frame_rate_hz / 2))
    return _moved(clip, clip.motion.position_xyz_m[: len(clip.motion.position_xyz_m) - cut])


def _part(clip: Labelled, number: int) -> tuple[int, int]:
    """Choose 2 seconds of a clip, all of a shorter one: first frame and end."""
    n = len(clip.motion.position_xyz_m)
    long = min(int(2 * clip.frame_rate_hz) + 1, n)
    first = int((number * 0.618034) % 1 * (n - long))
    return first, first + long


def _parted(clip: Labelled, number: int) -> Labelled:
    first, end = _part(clip, number)
    return _moved(clip, clip.motion.position_xyz_m[first:end])


def _paced(clip: Labelled, number: int) -> Labelled:
    """Play a clip a tenth faster or slower."""
    return dataclasses.replace(clip, frame_rate_hz=clip.frame_rate_hz * (1.1 if number % 2 else 0.9))


COPIES: dict[str, Callable[[Labelled, int], Labelled]] = {
    "rig": _other_rig,
    "rotated": _rotated,
    "shifted": _shifted,
    "ended": _ended,
    "part": _parted,
    "paced": _paced,
}


def speed(clips: list[Labelled], encoder: Encoder) -> dict[str, float]:
    """Embed all clips; search 50,000 windows mapped from disk."""
    begun = time.process_time()
    embedded(encoder, clips)
    found = {"embedding_clips_per_cpu_s": len(clips) / (time.process_time() - begun)}
    n, width = 50_000, 512
    vector = unit(np.random.default_rng(0).normal(size=(n, width))).astype(np.float32)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "vectors.f32"
        vector.tofile(place)
        mapped = np.memmap(place, np.float32, "r", shape=(n, width))
        followed = np.resize(np.concatenate(Catalogue(clips, encoder).tracks), (30 * n, N_TRACK))
        tracks = followed.reshape(n, 30, N_TRACK)
        wall, cpu = [], []
        for k in range(30):
            query, start = vector[k : k + 1], np.arange(n)
            moved = clips[k].motion.position_xyz_m, clips[k].frame_rate_hz
            copies = copies_among(tracks, track(*moved, end_s=4.0, rate_hz=QUERY_HZ))
            begun, worked = time.perf_counter(), time.process_time()
            nearest_clips(mapped, start, query, k=10, copies=copies)
            wall.append(1000 * (time.perf_counter() - begun))
            cpu.append(1000 * (time.process_time() - worked))
    return found | {
        "query_least_ms": min(wall),
        "query_median_ms": float(np.median(wall)),
        "query_cpu_ms": float(np.median(cpu)),
    }


def _some(folder: Path) -> list[Labelled]:
    """Read a folder of which something has to come."""
    clips = list(read(folder))
    if not clips:
        raise SystemExit(f"{folder}: want BVH files that a labels*.csv there names, got none")
    return clips


def table(found: dict[str, dict[str, Retrieval]]) -> str:
    """Write measures as a Markdown table, one column a split."""
    heads = [f"{name}: 1-NN | mAP" for name in found]
    lines = [f"| method | {' | '.join(heads)} |", "|---|" + "---|---|" * len(found)]
    for method in dict.fromkeys(method for split in found.values() for method in split):
        cells = [
            f"{r[method].first_ratio:.3f} | {r[method].mean_precision_ratio:.3f}" if method in r else "– | –"
            for r in found.values()
        ]
        lines.append(f"| {method} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Measure, and print a table or one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--only", choices=("accuracy", "sameness", "speed", "unseen"))
    parser.add_argument("--queries", type=Path, help="clips of another folder, looked up among all")
    parser.add_argument("--database", type=Path, help="clips to look among, in place of bvh_labelled of the test data")
    parser.add_argument("--splits", type=int, default=5, help="splits of each kind at most; a split takes minutes")
    asked = parser.parse_args()
    if asked.only == "unseen" and not asked.queries:
        parser.error("--only unseen: want --queries FOLDER, got none; name a folder of BVH files with a labels*.csv")
    clips = _some(asked.database or DATA / "bvh_labelled")
    figures: dict[str, float] = {"clips": len(clips)}
    tables: dict[str, dict[str, Retrieval]] = {}
    if asked.only in (None, "accuracy"):
        tables |= accuracy(clips, asked.splits)
    if asked.queries or asked.only in (None, "sameness", "speed"):
        encoder, figures["training_cpu_s"] = default(clips)
        if asked.queries:
            tables["unseen"] = unseen(clips, _some(asked.queries), encoder)
        if asked.only in (None, "sameness"):
            figures |= sameness(clips, encoder)
        if asked.only in (None, "speed"):
            figures |= speed(clips, encoder)
    for split, methods in tables.items():
        for method, said in methods.items():
            name = f"{split}_{method.strip('*').partition(' (')[0].replace(' ', '_').replace(',', '')}"
            figures |= {f"{name}_first_ratio": said.first_ratio, f"{name}_map_ratio": said.mean_precision_ratio}
    if asked.json:
        print(json.dumps(figures, sort_keys=True))
        return
    if tables:
        print(table(tables))
    for name, value in figures.items():
        if not name.endswith(("_first_ratio", "_map_ratio")) or name.split("_")[0] in COPIES:
            print(f"{name}: {value:.4g}")


if __name__ == "__main__":
    main()
