"""Does a dancer's character survive? Finished dances of two dancers' models told apart by their poses.

    python benchmarks/hmm_character.py [--songs N] [--json]

Two studios. *Made up*: two performers of one body and the same eight gestures, whose hidden rules differ. *Real*: the
two subjects of the salsa takes of real test data (CMU 60 and 61), who danced to no song of the studio. Of each dancer
some takes are danced from, the others are only known to the judge. Songs that neither danced to are danced by each
one's model (``choreography_model.subject``); of every finished dance, as its stage has it, the judge says whose it is,
by the takes whose stretches of two seconds are nearest in pose and velocity.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).parents[1]
sys.path.insert(0, str(REPOSITORY))

from assets.formats import bvh, midi  # noqa: E402
from assets.tables import pack  # noqa: E402
from assets.tables.motion import to_canonical_poses  # noqa: E402
from kernels.hmm.identity import chance_of, nearest_dancer, pose_windows  # noqa: E402
from kernels.synthetic import hidden_rules as made_up  # noqa: E402
from kernels.types import Float  # noqa: E402
from pipelines.commands.dance_songs import dance_songs  # noqa: E402
from pipelines.resources import NoProgress  # noqa: E402
from pipelines.studio.folder import StudioFolder  # noqa: E402

DATA = Path(os.environ.get("ODORI_TEST_DATA", REPOSITORY.parent / "shared" / "data"))
N_REAL_TAKES = 5


def neutral_songs(root: Path, n: int) -> list[str]:
    """Write songs by neither dancer's rules."""
    (root / "songs").mkdir(exist_ok=True)
    even = made_up.Rules(np.full(8, 1 / 8), np.full((8, 8), 1 / 8), np.full((8, 12), 1 / 12))
    for i in range(n):
        state = made_up.draw_states(even, 48, seed=i)
        notes = made_up.draw_notes(even, state, interval_s=0.5, seed=i)
        (root / "songs" / f"neutral_{i}.mid").write_bytes(midi.format(notes, tempo=((0.0, 120.0),)))
    return [f"neutral_{i}" for i in range(n)]


def made_up_dancers(root: Path) -> list[str]:
    """Write two performances of each of two made-up dancers, one with its song."""
    for name, seed in (("ayame", 4), ("botan", 5)):
        folder = root / "clips" / name
        folder.mkdir(parents=True)
        (root / "songs").mkdir(exist_ok=True)
        rules = made_up.hidden_rules(seed=seed)
        for take in range(2):
            made = made_up.perform(rules, n_motions=400, seed=10 * seed + take)
            (folder / f"{name}_{take}.bvh").write_bytes(bvh.format(made.clip))
            if take == 0:
                (root / "songs" / f"{name}_0.mid").write_bytes(midi.format(made.notes, tempo=made.tempo))
        rows = f"{name}_0.bvh,danced,{name}\n{name}_1.bvh,known,known_{name}\n"
        (folder / "clips.csv").write_text(f"file,label,subject\n{rows}")
    return ["ayame", "botan"]


def real_dancers(root: Path) -> list[str]:
    """Gather the salsa takes of two subjects; the later ones are only known to the judge."""
    for name in ("60", "61"):
        folder = root / "clips" / f"s{name}"
        folder.mkdir(parents=True)
        takes = sorted((DATA / "bvh_dance" / "cmu_salsa").glob(f"{name}_*.bvh"))
        rows = []
        for i, take in enumerate(takes):
            shutil.copyfile(take, folder / take.name)
            rows.append(f"{take.name},salsa,{'' if i < N_REAL_TAKES else 'known_'}s{name}\n")
        (folder / "clips.csv").write_text("file,label,subject\n" + "".join(rows))
    return ["s60", "s61"]


def known_takes(root: Path, dancers: list[str]) -> list[Float]:
    """Describe the takes that the judge knows of each dancer."""
    lake = StudioFolder(root).lake
    found = []
    for name in dancers:
        clips = lake.table("clip", name).to_pylist()
        wanted = [row["clip_id"] for row in clips if row["subject"] == f"known_{name}"]
        moved = to_canonical_poses(lake.table("canonical_pose", name, clip_ids=wanted))
        found.append(np.concatenate([pose_windows(m.position_xyz_m, m.frame_rate_hz) for m in moved]))
    return found


def dances(root: Path, dancer: str, songs: list[str]) -> list[Float]:
    """Dance the songs by one dancer's model; stretches of each finished dance."""
    (root / "odori.toml").write_text(f'[choreography_model]\nsubject = "{dancer}"\n')
    made = dance_songs(root, songs, method="hmm", frame_rate_hz=None, out=None, progress=NoProgress)
    if made.status:
        raise SystemExit("; ".join(made.troubles))
    lake = StudioFolder(root).lake
    rows = [lake.table("dance_pose", f"{song}|hmm") for song in songs]
    return [pose_windows(pack.to_array(r["position_xyz_m"]), pack.frame_rate_hz(r)) for r in rows]


def judged(root: Path, dancers: list[str], songs: list[str]) -> Mapping[str, float]:
    """Let the judge say whose dance each is."""
    every = [dances(root, name, songs) for name in dancers]
    known = known_takes(root, dancers)
    hits = [nearest_dancer(dance, known) == who for who, made in enumerate(every) for dance in made]
    return {
        "dances": float(len(hits)),
        "accuracy_ratio": float(np.mean(hits)),
        "chance_p_probability": chance_of(sum(hits), len(hits)),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--songs", type=int, default=8, help="songs danced by each model")
    options = parser.parse_args()
    figures: dict[str, float] = {}
    for kind, gather in (("made_up", made_up_dancers), ("real", real_dancers)):
        if kind == "real" and not (DATA / "bvh_dance").is_dir():
            print("no real test data: real dancers were left out", file=sys.stderr)
            continue
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder) / "studio"
            root.mkdir()
            names = gather(root)
            found = judged(root, names, neutral_songs(root, options.songs))
            figures |= {f"{kind}_{name}": value for name, value in found.items()}
    if options.json:
        print(json.dumps({name: round(value, 6) for name, value in figures.items()}))
    else:
        for name, value in figures.items():
            print(f"{name:32} {value:10.4f}")


if __name__ == "__main__":
    main()
