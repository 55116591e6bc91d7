"""The model of the dancer against made-up performances whose rules are known, and on real drums.

1. The model alone: counts against the rules, Viterbi against the hidden motions, held-out music against shuffled.
2. The whole pipeline: twenty minutes of performance in two takes, as BVH and MIDI, learned from; another song by the
   same rules, danced; motions of the finished dance against the hidden ones.
3. Speed: Viterbi, and counting of ten times as much.
4. Drums of real MIDI files (``midi/groove`` and the General MIDI songs of real test data), danced by a performer
   recorded at six tempi; which dances are as wanted, and why the others are not.
5. Character: dances made from two dancers' models, told apart by what follows what in other performances of theirs.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

REPOSITORY = Path(__file__).parents[1]
sys.path.insert(0, str(REPOSITORY))

from assets.formats import bvh, midi  # noqa: E402
from kernels.hmm import model as hmm  # noqa: E402
from kernels.hmm.evidence import measure  # noqa: E402
from kernels.hmm.identity import identify  # noqa: E402
from kernels.hmm.viterbi import viterbi  # noqa: E402
from kernels.synthetic import hidden_rules as made_up  # noqa: E402
from pipelines.commands.dance_songs import dance_songs  # noqa: E402
from pipelines.resources import NoProgress  # noqa: E402
from pipelines.studio.folder import StudioFolder  # noqa: E402
from pipelines.studio.lake import Lake  # noqa: E402

DATA = Path(os.environ.get("ODORI_TEST_DATA", REPOSITORY.parent / "shared" / "data"))
N_MOTIONS, INTERVAL_S = 2400, 0.5
TAKES_S = (0.38, 0.44, 0.51, 0.60, 0.70, 0.80)


def heard(notes: Any, n: int, interval_s: float) -> np.ndarray:  # noqa: ANN401 - kernels.music.notes.Notes
    """Count the twelve drums during each of n motions, (n, 12)."""
    at = np.floor(notes.start_s / interval_s + 1e-6).astype(int)
    inside = at < n
    out = np.zeros((n, len(made_up.DRUM_KEYS)))
    np.add.at(out, (at[inside], [made_up.DRUM_KEYS.index(k) for k in notes.key_number[inside].tolist()]), 1.0)
    return out


def alone(seed: int) -> dict[str, float]:
    """Learn from counts, and find the motions of another song."""
    rules = made_up.hidden_rules(seed=seed)
    k, m = rules.emission.shape
    state = made_up.draw_states(rules, N_MOTIONS, seed=seed)
    notes = made_up.draw_notes(rules, state, interval_s=INTERVAL_S, seed=seed)
    performed = [hmm.Performed(state, (heard(notes, N_MOTIONS, INTERVAL_S),))]
    smoothing = hmm.choose_smoothing(performed, k, [m])
    found = hmm.learn(performed, k, [m], smoothing=smoothing)
    music = measure(performed, k, [m], smoothing=smoothing)
    other = made_up.draw_states(rules, N_MOTIONS, seed=seed + 1000)
    song = heard(made_up.draw_notes(rules, other, interval_s=INTERVAL_S, seed=seed + 1000), N_MOTIONS, INTERVAL_S)
    path, _ = viterbi(found.log_initial, found.log_transition, found.log_likelihood([song]))
    return {
        "model_a_error_ratio": float(np.abs(np.exp(found.log_transition) - rules.transition).mean()),
        "model_b_error_ratio": float(np.abs(np.exp(found.log_emission[0]) - rules.emission).mean()),
        "model_path_accuracy_ratio": float((path == other).mean()),
        "music_gain_nats": music.gain,
        "music_p_probability": music.p,
    }


def write(root: Path, name: str, performed: made_up.SyntheticPerformance, subject: str = "sumire") -> None:
    """Put a performance into a studio."""
    folder = root / "clips" / subject
    folder.mkdir(parents=True, exist_ok=True)
    (root / "songs").mkdir(exist_ok=True)
    (folder / f"{name}.bvh").write_bytes(bvh.format(performed.clip))
    (root / "songs" / f"{name}.mid").write_bytes(midi.format(performed.notes, tempo=performed.tempo))


def dance(root: Path, songs: list[str]) -> Any:  # noqa: ANN401 - pipelines.commands.outcome.Outcome
    """Dance songs by the model."""
    return dance_songs(root, songs, method="hmm", frame_rate_hz=None, out=None, progress=NoProgress)


def whole(seed: int, n_motions: int) -> dict[str, float]:
    """Learn and dance through files, lake and finished dance."""
    rules = made_up.hidden_rules(seed=seed)
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "studio"
        takes = {
            f"take_{i}": made_up.perform(rules, n_motions=n_motions // 2, interval_s=INTERVAL_S, seed=seed + i)
            for i in range(2)
        }
        for name, take in takes.items():
            write(root, name, take)
        hidden = made_up.draw_states(rules, 240, seed=seed + 1000)
        notes = made_up.draw_notes(rules, hidden, interval_s=INTERVAL_S, seed=seed + 1000)
        (root / "songs" / "new.mid").write_bytes(midi.format(notes, tempo=takes["take_0"].tempo))
        start = time.perf_counter()
        outcome = dance(root, ["new"])
        if outcome.status:
            raise SystemExit("; ".join(outcome.troubles))
        took_s = time.perf_counter() - start
        lake = StudioFolder(root).lake
        found = errors(lake, rules, takes)
        steps = lake.table("choreography", "new|hmm").to_pylist()
        hits = [
            takes[s["clip_id"].split("-")[1]].state[int((s["clip_start_s"] + s["clip_end_s"]) / 2 / INTERVAL_S)]
            == hidden[min(int((s["song_start_s"] + s["song_end_s"]) / 2 / INTERVAL_S), len(hidden) - 1)]
            for s in steps
        ]
        evidence = lake.table("music_evidence").to_pylist()[0]
        return found | {
            "dance_path_accuracy_ratio": float(np.mean(hits)),
            "dance_music_p_probability": float(evidence["chance_probability"]),
            "dance_wall_s": took_s,
            "dance_not_as_wanted_count": float(len(outcome.facts["missed"])),
        }


def errors(lake: Lake, rules: made_up.Rules, takes: dict[str, made_up.SyntheticPerformance]) -> dict[str, float]:
    """Compare the stored model with the rules, states matched one to one by the motions they were given."""
    motions = lake.table("key_pose", "sumire").to_pylist()
    n_found = lake.table("basic_motion").num_rows
    k = len(rules.initial)
    together = np.zeros((max(n_found, k), k))
    for one in motions:
        if one["state_index"] >= 0:
            middle = (one["start_s"] + one["end_s"]) / 2
            take = takes[one["clip_id"].split("-")[1]]
            together[one["state_index"], take.state[int(middle / INTERVAL_S)]] += 1
    row, column = linear_sum_assignment(-together)
    found_of = dict(zip(column.tolist(), row.tolist(), strict=True))
    rows = lake.table("choreography_model").to_pylist()
    value = {(r["parameter_name"], r["state_index"], r["target_index"]): r["probability"] for r in rows}
    a = [
        abs(value.get(("transition", found_of[i], found_of[j]), 0.0) - rules.transition[i, j])
        for i in range(k)
        for j in range(k)
    ]
    b = [
        abs(value.get(("emission", found_of[i], key), 0.0) - rules.emission[i, s])
        for i in range(k)
        for s, key in enumerate(made_up.DRUM_KEYS)
    ]
    return {
        "dance_states": float(n_found),
        "dance_motion_accuracy_ratio": float(together[row, column].sum() / len(motions)),
        "dance_a_error_ratio": float(np.mean(a)),
        "dance_b_error_ratio": float(np.mean(b)),
    }


def speed() -> dict[str, float]:
    """Time Viterbi of 2000 steps and 200 states, and counting of n and 10 n motions."""
    rng = np.random.default_rng(0)
    log_a = np.log(rng.dirichlet(np.ones(200), 200))
    log_p = rng.normal(size=(2000, 200))
    start = time.process_time()
    viterbi(np.zeros(200), log_a, log_p)
    found = {"viterbi_cpu_s": time.process_time() - start}

    def counting(n: int) -> float:
        performed = [hmm.Performed(rng.integers(0, 64, n), (rng.poisson(1.0, (n, 47)).astype(float),))]
        best = np.inf
        for _ in range(5):
            begun = time.process_time()
            hmm.count(performed, 64, [47])
            best = min(best, time.process_time() - begun)
        return best

    return found | {"counting_10x_ratio": counting(200_000) / counting(20_000)}


def real_drums(every: int) -> tuple[dict[str, float], list[str]]:
    """Dance real MIDI files; figures, and one line for each dance that is not as wanted."""
    files = [f for name in ("groove", "freedoom", "openmsx") for f in sorted((DATA / "midi" / name).glob("*.mid"))]
    files = files[::every]
    if not files:
        return {}, ["no real test data: none was danced"]
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "studio"
        rules = made_up.hidden_rules(seed=4)
        for number, interval_s in enumerate(TAKES_S):
            write(
                root, f"take_{number}", made_up.perform(rules, n_motions=400, interval_s=interval_s, seed=10 + number)
            )
        for file in files:
            shutil.copyfile(file, root / "songs" / f"{file.parent.name}_{file.name}")
        outcome = dance(root, [f"{file.parent.name}_{file.name}" for file in files])
        made = outcome.facts["dances"] if len(files) > 1 else [outcome.facts]
        lines = [f"{d['song']}: {', '.join(d['missed'])}" for d in made if d["missed"]]
        lines += list(outcome.troubles)
        figures = {
            "real_songs": float(len(files)),
            "real_danced": float(len(made)),
            "real_as_wanted": float(sum(not d["missed"] for d in made)),
        }
        return figures, lines


def character(n_songs: int = 40) -> dict[str, float]:
    """Tell dances by two dancers' models apart, by other performances of theirs."""
    rules = [made_up.hidden_rules(seed=seed) for seed in (4, 5)]
    k, m = rules[0].emission.shape

    def learned(of: made_up.Rules, seed: int) -> hmm.Model:
        state = made_up.draw_states(of, 600, seed=seed)
        notes = made_up.draw_notes(of, state, interval_s=INTERVAL_S, seed=seed)
        performed = [hmm.Performed(state, (heard(notes, 600, INTERVAL_S),))]
        return hmm.learn(performed, k, [m], smoothing=hmm.choose_smoothing(performed, k, [m]))

    judges = [learned(of, 70) for of in rules]
    hits = []
    for song in range(n_songs):
        # Neither dancer's rules made this song: drums at random.
        rng = np.random.default_rng(song)
        drums = rng.multinomial(3, np.full(m, 1 / m), size=64).astype(float)
        for dancer, of in enumerate(rules):
            model = learned(of, 80)
            path, _ = viterbi(model.log_initial, model.log_transition, model.log_likelihood([drums]))
            hits.append(identify(path, judges) == dancer)
    return {"character_accuracy_ratio": float(np.mean(hits))}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--every", type=int, default=1, help="of the real songs only every n-th; 0 for none")
    parser.add_argument("--motions", type=int, default=N_MOTIONS, help="motions of the performance in the pipeline")
    options = parser.parse_args()
    figures = alone(1) | speed() | character() | whole(1, options.motions)
    lines: list[str] = []
    if options.every:
        real, lines = real_drums(options.every)
        figures |= real
    if options.json:
        print(json.dumps({name: round(value, 5) for name, value in figures.items()}))
    else:
        for name, value in figures.items():
            print(f"{name:32} {value:10.4f}")
    for line in lines:
        print(line, file=sys.stderr)


if __name__ == "__main__":
    main()
