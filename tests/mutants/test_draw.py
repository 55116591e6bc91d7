"""What is drawn: changes of meaning, the same on every machine; and a kill that is lost is told."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
SOURCE = '''"""Words 1 + 1."""

LIMIT = 2.0
TINY = 1e-9


def nearest(values: list[float], at: float = 1.0, *, strict: bool = True) -> float:
    """Find it, 3 + 4."""
    if not values:
        raise ValueError(f"want {len(values) + 1} values")
    best = min(values, key=lambda v: abs(v - at))
    while best < LIMIT and strict:
        best += 1
    return best if best >= 0 else -best
'''


@pytest.fixture
def draw(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    import draw

    return draw


@pytest.fixture
def source(tmp_path):
    path = tmp_path / "nearest.py"
    path.write_text(SOURCE)
    return str(path)


def test_each_kind_of_change_is_found(draw, source):
    changes = {(m.kind, m.new) for m in draw.candidates(source)}
    assert {
        ("number", "LIMIT = 4.0"),
        ("number", "def nearest(values: list[float], at: float = 2.0, *, strict: bool = True) -> float:"),
        ("default", "def nearest(values: list[float], at: float = 1.0, *, strict: bool = False) -> float:"),
        ("boolean", "if (values):"),
        ("branch", "if False:"),
        ("call", "best = max(values, key=lambda v: abs(v - at))"),
        ("sign", "best = min(values, key=lambda v: abs(v + at))"),
        ("term", "best = min(values, key=lambda v: abs((v)))"),
        ("tie", "while best <= LIMIT and strict:"),
        ("compare", "while best > LIMIT and strict:"),
        ("boolean", "while best < LIMIT or strict:"),
        ("statement", "pass"),
        ("sign", "best -= 1"),
        ("branch", "return (-best)"),
        ("tie", "return best if best > 0 else -best"),
    } <= changes


def test_words_annotations_and_tolerances_are_left_alone(draw, source):
    old = {m.old for m in draw.candidates(source)}
    assert not [line for line in old if "Words" in line or "Find it" in line or "raise" in line or "TINY" in line]
    assert "if True:" not in {m.new for m in draw.candidates(source)}  # a refusal of everything shows nothing


def test_every_mutant_is_another_program(draw, source):
    whole = ast.dump(ast.parse(SOURCE))
    for mutant in draw.draw(source, share=1.0):
        assert ast.dump(ast.parse(mutant.source())) != whole


def test_a_draw_is_a_share_with_every_kind_in_turn_and_repeats(draw, source):
    some = draw.draw(source, share=0.3)
    assert len(some) == round(0.3 * len(draw.candidates(source)))
    assert len({m.kind for m in some}) == len(some)
    assert some == draw.draw(source, share=0.3)


def test_names_of_mutants_are_their_own(draw):
    keys = [m.key for path in draw.modules()[::12] for m in draw.draw(path)]
    assert len(keys) == len(set(keys))


def test_each_mutant_by_hand_finds_its_text(draw):
    by_hand = draw.named()
    assert len(by_hand) >= 28
    assert all(m.rule and m.place and m.source() for m in by_hand)


@pytest.mark.skipif(sys.platform == "win32", reason="mutants run in forks")
@pytest.mark.parametrize(
    ("test", "status", "told"),
    [
        ("test_what_is_added_beyond_the_easy_bounds_grows_to_the_hard_ones", 0, "1 of 1 mutants killed again"),
        ("test_every_method_keeps_to_the_same_bounds", 1, "lost: kernels/warp.py"),
    ],
)
def test_the_sample_tells_a_lost_kill(draw, tmp_path, test, status, told):
    key = draw.draw("kernels/warp.py")[0].key
    held = {
        "mutants": {key: {"kind": "term", "verdict": "killed", "by": f"tests/kernels/test_warp.py::{test}", "s": 0}}
    }
    path = tmp_path / "results.json"
    path.write_text(json.dumps(held))
    done = subprocess.run(
        [sys.executable, FOLDER / "run.py", "--sample", "--results", path], capture_output=True, text=True, check=False
    )
    assert (done.returncode, told in done.stdout) == (status, True), done.stdout + done.stderr
