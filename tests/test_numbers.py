"""Every number says where it is from: constants bear the word of their origin.

Conventions
-----------
Rule and vocabulary are in ``docs/decisions/0026-numbers.md``. A constant is an assignment at module level whose value
holds a number. What is only a place (in square brackets, in ``range``) or stands in a lambda or a comprehension is
code, not a constant. Its word stands on its line, in the comment just above or in the text just beneath; constants
that follow each other without an empty line may share the text beneath the last of them, four at most.
"""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
FOLDERS = ("kernels", "assets", "pipelines")
TRAINED = "pulse_weights.py"  # weights of a network: its file says as a whole what they were trained on
SOURCES = sorted(p for folder in FOLDERS for p in (REPOSITORY / folder).rglob("*.py") if p.name != TRAINED)

ORIGINS = {
    "a law": r"\bby (definition|convention|proof)\b",
    "a paper": r"\[[A-Z][A-Za-z]+\d{4}[a-z]?\]",
    "tuned, and on what": r"\btuned on \w+",
    "measured, and on what": r"\bmeasured (on|in|over) \w+",
    "a choice, and by what": r"\bchosen (by hand|as|because|between|below|above|for|from|so that|to|within)\b",
    "a promise": r"\bagreed for \w+",
}
ORIGIN = re.compile("|".join(ORIGINS.values()), re.IGNORECASE)
KEY = re.compile(ORIGINS["a paper"])
MOST_SHARING = 4

REFERENCES = REPOSITORY / "docs" / "references.md"


def _holds_number(node):
    """Whether a value holds a number that is more than a place."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int | float | complex) and not isinstance(node.value, bool)
    if isinstance(node, ast.Lambda | ast.comprehension | ast.GeneratorExp | ast.ListComp | ast.SetComp | ast.DictComp):
        return False
    if isinstance(node, ast.Subscript):
        return _holds_number(node.value)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "range":
        return False
    return any(_holds_number(child) for child in ast.iter_child_nodes(node))


def _is_text(node):
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _names(node):
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return ", ".join(ast.unparse(target).strip("()") for target in targets)


def words(source):
    """Find the constants of a module with the words they bear: their own, and the one they share."""
    comments = {
        token.start[0]: token.string.lstrip("# ")
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT
    }
    lines = source.splitlines()
    body = ast.parse(source).body
    found = {}
    sharing = []
    for node, after in zip(body, [*body[1:], None], strict=True):
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            sharing = []
            continue
        first = node.lineno
        while lines[first - 2].startswith("#"):
            first -= 1
        if lines[first - 2].strip() == "":
            sharing = []
        own = [comments[line] for line in range(first, node.end_lineno + 1) if line in comments]
        is_told = after is not None and _is_text(after) and after.lineno == node.end_lineno + 1
        if is_told:
            own.append(after.value.value)
        if _holds_number(node.value):
            name = _names(node)
            found[name] = " ".join(" ".join(own).split())
            sharing.append(name)
        if is_told:
            for name in sharing[-MOST_SHARING:]:
                found[name] += " " + " ".join(after.value.value.split())
            sharing = []
    return found


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(REPOSITORY)))
def test_every_number_says_where_it_is_from(path):
    assert [name for name, text in words(path.read_text(encoding="utf-8")).items() if not ORIGIN.search(text)] == []


@pytest.mark.skipif(not REFERENCES.exists(), reason="no list of references")
@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(REPOSITORY)))
def test_papers_of_numbers_are_in_the_list_of_references(path):
    used = {key for text in words(path.read_text(encoding="utf-8")).values() for key in KEY.findall(text)}
    listed = REFERENCES.read_text(encoding="utf-8")
    assert [key for key in sorted(used) if key not in listed and key.strip("[]") not in listed] == []


PLANTED = '''
from a import b

A = 3

B = 3
"""Seconds."""

C_S = 0.5  # tuned on

D = 1
E, F = 2, 3

G = -0.5
"""Metres, tuned on ten songs."""
H = b[0]
I = tuple(k + 1 for k in b)
J = (len(b), range(1, 3))
K: dict[str, float] = {
    "a": 1.0,  # by definition
}
# Chosen by hand, never varied.
L = 3.0
M = 4.0
N = 5.0
"""By convention."""

O1 = 1
O2 = 2
O3 = 3
O4 = 4
O5 = 5
"""After [Knuth1973]."""
'''


def test_what_the_rule_finds():
    unsaid = [name for name, text in words(PLANTED).items() if not ORIGIN.search(text)]
    assert unsaid == ["A", "B", "C_S", "D", "E, F", "O1"]
    assert set(words(PLANTED)) == {*"ABDGKLMN", "C_S", "E, F", *(f"O{k}" for k in range(1, 6))}
