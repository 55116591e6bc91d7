"""Run the mutants and write the listing: ``make mutants``; ``make mutants-sample`` runs a part again.

For each mutant: tests of the mirrored test file that come by the changed statements first, then those of test files
that import the module, the nearest first, quick ones first, until one fails or CLEAN_S CPU-seconds of tests have
passed. What was found is kept after every mutant, so a run that was ended goes on where it was.
"""

import argparse
import ast
import hashlib
import json
import os
import sys
from pathlib import Path
from typing import Any

import draw
import listing
from reach import load_first, reach, run

REPOSITORY = draw.REPOSITORY
RESULTS = Path(__file__).with_name("results.json")
MAPS = REPOSITORY / ".mutants_cache"
CLEAN_S = 30.0
FILES = 6
"""Test files tried for a mutant, its own among them."""
SAMPLE = 60
"""Mutants that CI runs again: about a minute of CPU."""
QUICK_S = 1.5
"""The sample takes mutants whose test is as quick, in CPU-seconds."""


class Reach:
    """Which tests come by which blocks, learned file by file, kept while the test file stays."""

    def __init__(self, mutated: list[str]) -> None:
        self.mutated = set(mutated)
        self.known: dict[str, Any] = {}
        self.imports = {
            p.relative_to(REPOSITORY).as_posix(): _imports(p)
            for package in ("kernels", "assets", "tests/kernels", "tests/assets", "tests/pipelines")
            for p in (REPOSITORY / package).rglob("*.py")
        }

    def of(self, test_file: str) -> dict[str, Any]:
        """What the tests of a file come by."""
        held = hashlib.sha256((REPOSITORY / test_file).read_bytes()).hexdigest()
        kept = MAPS / f"{test_file.replace('/', '-')}.json"
        if test_file not in self.known and kept.exists():
            self.known[test_file] = json.loads(kept.read_text(encoding="utf-8"))
        if self.known.get(test_file, {}).get("sha256") != held:
            self.known[test_file] = {"sha256": held, **reach(test_file, self.mutated)}
            MAPS.mkdir(exist_ok=True)
            kept.write_text(json.dumps(self.known[test_file]), encoding="utf-8")
        return self.known[test_file]

    def near(self, path: str) -> list[str]:
        """Test files of a module: its own, those beside it that import it, others, those of its importers."""
        module = path.removesuffix(".py").replace("/", ".")
        own = [str(p) for p in _own(path)]
        users = {p for p, names in self.imports.items() if module in names and not p.startswith("tests/")}
        modules = {u.removesuffix(".py").replace("/", ".") for u in users}
        tests = [p for p in self.imports if Path(p).name.startswith("test_")]
        if path.startswith("kernels"):  # whole pipelines are slow, and no place to test a kernel
            tests = [p for p in tests if not p.startswith("tests/pipelines")]
        direct = [p for p in tests if module in self.imports[p]]
        mirrored = [str(t) for u in sorted(users) for t in _own(u)]
        further = [p for p in tests if modules & self.imports[p]]
        beside = str(Path("tests") / Path(path).parent)
        found = [*direct, *mirrored, *further]
        found.sort(key=lambda p: (p not in direct, p.startswith("tests/pipelines"), not p.startswith(beside)))
        return list(dict.fromkeys([*own, *found]))

    def tests(self, mutant: draw.Mutant, test_file: str) -> list[tuple[float, str]]:
        """Tests of a file that come by a mutant, with their CPU-seconds, quick ones first."""
        known = self.of(test_file)
        block = f"{mutant.path} {mutant.block}"
        place = f"{mutant.path} "
        if not mutant.block:
            found = {t for t, (_, held) in known["tests"].items() if any(b.startswith(place) for b in held)}
            shared = any(b.startswith(place) for b in known["shared"])
        else:
            found = {t for t, (_, held) in known["tests"].items() if block in held}
            shared = block in known["shared"] or (found and _is_cached(mutant))
        if not mutant.block and Path(test_file) in _own(mutant.path):
            shared = True  # a constant may be read by a test that calls nothing
        chosen = known["tests"] if shared or (not found and not mutant.block) else found
        return sorted((known["tests"][t][0], t) for t in chosen)


def _imports(path: Path) -> set[str]:
    out: set[str] = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            out |= {a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            out |= {node.module, *(f"{node.module}.{a.name}" for a in node.names)}
    return out


def _own(path: str) -> list[Path]:
    folder = Path("tests") / Path(path).parent
    stem = f"test_{Path(path).stem}"
    return [folder / n for n in (f"{stem}.py", f"{stem}_edges.py") if (REPOSITORY / folder / n).exists()]


def _is_cached(mutant: draw.Mutant) -> bool:
    tree = ast.parse((REPOSITORY / mutant.path).read_bytes())
    nodes = dict(draw.functions(tree))
    function = nodes.get(mutant.place)
    return isinstance(function, ast.FunctionDef) and any("cache" in ast.unparse(d) for d in function.decorator_list)


def judge(mutant: draw.Mutant, known: Reach, *, most_s: float, files: int) -> dict[str, Any]:
    """Run a mutant's tests until one fails: its verdict, and the test that killed it."""
    left_s, reached, usable = most_s, 0, 0
    source = mutant.source()
    for test_file in known.near(mutant.path)[:files]:
        tests = known.tests(mutant, test_file)
        usable += len(known.of(test_file)["tests"])
        chosen, spent = [], 0.0
        for seconds, test in tests:
            if not chosen or spent + seconds <= left_s:
                chosen.append(test)
                spent += seconds
        if not chosen:
            continue
        reached += len(chosen)
        ended = run(mutant.path, source, chosen, spent)
        if ended.code in (4, 5):  # tests are named for what the mutant changed
            ended = run(mutant.path, source, [test_file], sum(t[0] for t in known.of(test_file)["tests"].values()))
        if ended.code in (1, 2, 3):
            by = ended.failed or ended.running
            return {"verdict": "killed", "by": by, "s": round(known.of(test_file)["tests"].get(by, [0.0])[0], 1)}
        if ended.code == -1:
            return {"verdict": "killed", "by": ended.running, "ended": True}
        if ended.code != 0:  # fixtures cannot be loaded; this kill is no part of the sample
            return {"verdict": "killed", "by": test_file, "ended": True}
        left_s -= spent
        if left_s <= 0:
            break
    if not usable:
        return {"verdict": "undecided", "by": "its tests are skipped or fail here"}
    return {"verdict": "survived", "by": f"{reached} tests" if reached else "no test comes by"}


def drawn() -> list[draw.Mutant]:
    """All mutants: those by hand, then the draw over all modules."""
    return [*draw.named(), *(m for path in draw.modules() for m in draw.draw(path))]


def everything(options: argparse.Namespace) -> None:
    """Judge what is not yet judged, and write the listing."""
    again = options.again.split(",")
    mutants = drawn()
    held: dict[str, Any] = {} if options.fresh or not RESULTS.exists() else json.loads(RESULTS.read_text())["mutants"]
    keys = {m.key for m in mutants}
    held = {key: value for key, value in held.items() if key in keys}
    known = Reach(sorted({*draw.modules(), *(m.path for m in mutants)}))
    for count, mutant in enumerate(sorted(mutants, key=lambda m: (not m.rule, draw.rank(m.key))), 1):
        if not mutant.path.startswith(options.only):
            continue
        before = held.get(mutant.key)
        if before is None or before["verdict"] in again:
            held[mutant.key] = {
                "kind": mutant.kind,
                **judge(mutant, known, most_s=options.seconds, files=options.files),
            }
            print(f"{count}/{len(mutants)} {held[mutant.key]['verdict']}: {mutant.key}", flush=True)
            _keep(held, mutants)
    _keep(held, mutants)


def _keep(held: dict[str, Any], mutants: list[draw.Mutant]) -> None:
    RESULTS.write_text(
        json.dumps({"mutants": dict(sorted(held.items()))}, indent=0, ensure_ascii=False) + "\n", encoding="utf-8"
    )
    listing.write(held, mutants)


def sample(results: Path) -> int:
    """Run a part of the killed mutants against the test that killed each: a kill that is lost is an error."""
    held = json.loads(results.read_text(encoding="utf-8"))["mutants"]
    killed = [k for k, v in held.items() if v["verdict"] == "killed" and not v.get("ended") and v["s"] <= QUICK_S]
    chosen = sorted(killed, key=draw.rank)[:SAMPLE]
    paths = {key.split(" ", 1)[0] for key in chosen}
    now = {m.key: m for m in [*draw.named(), *(m for path in sorted(paths) for m in draw.draw(path))]}
    lost, gone = [], []
    for key in chosen:
        test = held[key]["by"]
        mutant = now.get(key)
        if mutant is None:
            gone.append(key)
            continue
        ended = run(mutant.path, mutant.source(), [test], QUICK_S * 4)
        if ended.code == 4:
            gone.append(key)
        elif ended.code == 0:
            lost.append(f"{key}\n    no longer killed by {test}")
    print(f"{len(chosen) - len(lost) - len(gone)} of {len(chosen)} mutants killed again, {len(gone)} no longer there")
    for line in lost:
        print(f"lost: {line}")
    if len(gone) * 4 > len(chosen):
        print("more than a quarter of the sample is no longer there: run 'make mutants'")
        return 1
    return 1 if lost else 0


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sample", action="store_true", help="a part of the killed ones, each against its test")
    parser.add_argument("--again", default="", help="judge these verdicts anew: survived,undecided")
    parser.add_argument("--only", default="", help="path that files begin with")
    parser.add_argument("--fresh", action="store_true", help="forget what was found")
    parser.add_argument("--results", type=Path, default=RESULTS, help="what the sample is taken from")
    parser.add_argument("--map", action="store_true", help="only learn what the tests come by")
    parser.add_argument("--seconds", type=float, default=CLEAN_S, help="CPU-seconds of tests a mutant, at most")
    parser.add_argument("--files", type=int, default=FILES, help="test files a mutant, at most")
    options = parser.parse_args()
    os.chdir(REPOSITORY)
    sys.path.insert(0, str(REPOSITORY))
    load_first()
    if options.sample:
        return sample(options.results)
    if options.map:
        known = Reach(sorted({*draw.modules(), *(m.path for m in draw.named())}))
        for test_file in sorted(
            {f for path in draw.modules() for f in known.near(path)[: options.files]}, key=draw.rank
        ):
            known.of(test_file)
        return 0
    everything(options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
