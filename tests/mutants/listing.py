"""Write ``docs/mutants.md`` from what was found: the score, and every survivor with a word why."""

import datetime
import json
from collections import Counter
from pathlib import Path
from typing import Any

import draw

WORDS = Path(__file__).with_name("words.json")
"""A word for a survivor, by its key without the file: a file that is renamed keeps its words."""
LISTING = draw.REPOSITORY / "docs" / "mutants.md"


def folder(key: str) -> str:
    """Give the chapter of a mutant: ``kernels/music``, ``assets/dancing``, or ``kernels``."""
    return str(Path(key.split(" ", 1)[0]).parent)


def write(held: dict[str, Any], mutants: list[draw.Mutant]) -> None:
    """Write the page."""
    words = json.loads(WORDS.read_text(encoding="utf-8")) if WORDS.exists() else {}
    place = {m.key: m for m in mutants}
    chapters: dict[str, Counter[str]] = {}
    for key, value in held.items():
        chapters.setdefault(folder(key), Counter())[value["verdict"]] += 1
    total: Counter[str] = sum(chapters.values(), Counter())
    decided = total["killed"] + total["survived"]
    by_hand = [k for k in held if held[k]["kind"] == "named"]
    today = datetime.datetime.now(tz=datetime.UTC).date()
    not_run = f", {len(mutants) - len(held)} not yet run" if len(held) < len(mutants) else ""
    hand_killed = sum(held[k]["verdict"] == "killed" for k in by_hand)
    lines = [
        "# Mutants",
        "",
        "Small changes of meaning, one at a time, in `kernels` and `assets/dancing`; a test has to fail.",
        "`make mutants` draws and runs them ([decision 0027](decisions/0027-mutants.md)) and writes this page;",
        "`make mutants-sample` runs a part again, and CI with it.",
        "",
        f"Last run {today}: of {len(mutants)} mutants, {len(by_hand)} of them by hand against documented rules,",
        f"{total['killed']} killed, {total['survived']} survived, {total['undecided']} undecided{not_run}.",
        f"Killed of the decided: **{100 * total['killed'] / max(decided, 1):.1f} %**;",
        f"of those by hand {hand_killed} of {len(by_hand)}.",
        "",
        "| chapter | killed | survived | undecided |",
        "|---|---|---|---|",
        *(
            f"| {name} | {count['killed']} | {count['survived']} | {count['undecided']} |"
            for name, count in sorted(chapters.items())
        ),
        "",
        "## Survivors",
        "",
        "*equivalent*: no input tells it apart, with the reason; *heuristic*: a number or a choice that no rule",
        "promises; *owed*: a test is missing.",
        "",
    ]
    for verdict in ("survived", "undecided"):
        if verdict == "undecided" and total["undecided"]:
            lines += ["", "## Undecided", ""]
        for key in sorted(k for k, v in held.items() if v["verdict"] == verdict):
            word = words.get(key.split(" ", 1)[1], "owed") if verdict == "survived" else held[key]["by"]
            mutant = place[key]
            lines += [f"- {mutant.path}:{mutant.line_number()} {mutant.place}: {word}", ""]
            lines += [f"      - {mutant.old}", f"      + {mutant.new}", ""]
    LISTING.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")
