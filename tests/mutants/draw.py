"""Draw mutants: small changes of meaning in a source file, one at a time.

Which places are left alone, and why: docstrings, annotations, decorators, what is raised and f-strings (words, not
rules); ``strict=`` of zip, tolerances up to 1e-6 and ties of what has one (they guard against rounding: another value
is no other rule); ``pulse_weights.py`` (numbers of a trained network) and ``kernels/synthetic`` (makers of test
data).
"""

import ast
import hashlib
import itertools
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
NAMED = Path(__file__).with_name("named.toml")
SEED = "14"
SHARE = 0.0152
"""Of a module's candidates, as many are drawn, one at least: 400 over the tree."""

TURNED = {ast.Lt: ">", ast.LtE: ">=", ast.Gt: "<", ast.GtE: "<=", ast.Eq: "!=", ast.NotEq: "=="}
TURNED |= {ast.In: "not in", ast.NotIn: "in", ast.Is: "is not", ast.IsNot: "is"}
TIE = {ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">"}
SYMBOL = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
SYMBOL |= {ast.In: "in", ast.NotIn: "not in", ast.Is: "is", ast.IsNot: "is not"}
SYMBOL |= {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.BitAnd: "&", ast.BitOr: "|"}
SWAPPED = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.BitAnd: "|", ast.BitOr: "&"}
PAIRS = [("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("any", "all"), ("floor", "ceil")]
OTHER_CALL = dict(PAIRS) | {b: a for a, b in PAIRS}
SMALLEST = 1e-6


@dataclass(frozen=True)
class Mutant:
    """One change of one file."""

    path: str
    """From the repository's root."""
    place: str
    """Qualified name of the function; empty at module level."""
    block: str
    """The run of statements it lies in: ``place#n``; empty outside functions."""
    kind: str
    old: str
    new: str
    """The statement's line, before and after."""
    start: int
    stop: int
    text: bytes
    """Bytes ``start`` to ``stop`` of the file are replaced by ``text``."""
    number: int = 0
    """Counts mutants that read alike in one place."""
    rule: str = ""
    """Of a mutant written by hand: what is promised."""

    @property
    def key(self) -> str:
        """What names it in the listing, whatever its line."""
        again = f" ({self.number + 1})" if self.number else ""
        return f"{self.path} {self.place or 'module'}: {self.old} -> {self.new}{again}"

    def source(self) -> bytes:
        """Give the whole file, changed."""
        whole = (REPOSITORY / self.path).read_bytes()
        return whole[: self.start] + self.text + whole[self.stop :]

    def line_number(self) -> int:
        """Give the line it begins in, from 1."""
        return (REPOSITORY / self.path).read_bytes()[: self.start].count(b"\n") + 1


def blocks(tree: ast.Module) -> Iterator[tuple[str, str, list[ast.stmt]]]:
    """Give every run of statements inside functions: place, block name, statements."""

    def inside(node: ast.AST, place: str, counts: dict[str, int]) -> Iterator[tuple[str, str, list[ast.stmt]]]:
        for child in ast.iter_child_nodes(node):
            name = place
            if isinstance(child, ast.FunctionDef | ast.ClassDef):
                name = f"{place}.{child.name}" if place else child.name
            yield from inside(child, name, counts)
        function = isinstance(node, ast.FunctionDef)
        for field in ("body", "orelse", "finalbody"):
            part = getattr(node, field, None)
            if isinstance(part, list) and part and isinstance(part[0], ast.stmt) and (function or place in within):
                counts[place] = counts.get(place, -1) + 1
                yield place, f"{place}#{counts[place]}", part

    within = {n for n, node in functions(tree) if isinstance(node, ast.FunctionDef)}
    yield from inside(tree, "", {})


def functions(tree: ast.AST, place: str = "") -> Iterator[tuple[str, ast.AST]]:
    """Give every function and class with its qualified name."""
    for child in ast.iter_child_nodes(tree):
        name = place
        if isinstance(child, ast.FunctionDef | ast.ClassDef):
            name = f"{place}.{child.name}" if place else child.name
            yield name, child
        yield from functions(child, name)


class _Finder:
    """All changes of one file."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.data = (REPOSITORY / path).read_bytes()
        self.first = [0]
        for line in self.data.splitlines(keepends=True):
            self.first.append(self.first[-1] + len(line))
        self.tree = ast.parse(self.data)
        self.block_of = {id(stmt): (place, name) for place, name, run in blocks(self.tree) for stmt in run}
        self.found: list[Mutant] = []
        self.counts: dict[str, int] = {}

    def all(self) -> list[Mutant]:
        for node in self.tree.body:
            self._visit(node, "", "")
        return self.found

    def _span(self, node: ast.AST) -> tuple[int, int]:
        start = self.first[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]
        return start, self.first[node.end_lineno - 1] + node.end_col_offset  # type: ignore[attr-defined]

    def _text(self, node: ast.AST) -> str:
        start, stop = self._span(node)
        return self.data[start:stop].decode()

    def add(self, kind: str, start: int, stop: int, text: str, place: str, block: str) -> None:
        left = self.data.rfind(b"\n", 0, start) + 1
        right = self.data.find(b"\n", stop)
        old = self.data[left:right].decode()
        new = (self.data[left:start] + text.encode() + self.data[stop:right]).decode()
        old, new = " ".join(old.split()), " ".join(new.split())
        reads = f"{place} {old} {new}"
        self.counts[reads] = self.counts.get(reads, -1) + 1
        number = self.counts[reads]
        self.found.append(Mutant(self.path, place, block, kind, old, new, start, stop, text.encode(), number))

    def _visit(self, node: ast.AST, place: str, block: str) -> None:
        if isinstance(node, ast.stmt):
            place, block = self.block_of.get(id(node), (place, block))
        if isinstance(node, ast.Raise | ast.JoinedStr | ast.Import | ast.ImportFrom | ast.Assert):
            return
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return  # a docstring
        for kind, start, stop, text in self._changes(node):
            self.add(kind, start, stop, text, place, block)
        for field, value in ast.iter_fields(node):
            if field in {"annotation", "returns", "decorator_list", "ctx"}:
                continue
            if isinstance(node, ast.keyword) and node.arg == "strict":
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    self._visit(child, place, block)

    def _changes(self, node: ast.AST) -> Iterator[tuple[str, int, int, str]]:
        match node:
            case ast.Compare():
                left = node.left
                for op, right in zip(node.ops, node.comparators, strict=True):
                    if not (_is_guarded(left) or _is_guarded(right)):
                        yield from self._operator("tie", left, right, SYMBOL[type(op)], TIE.get(type(op)))
                    yield from self._operator("compare", left, right, SYMBOL[type(op)], TURNED[type(op)])
                    left = right
            case ast.BinOp(right=ast.Constant(value=float(value))) if 0 < value <= SMALLEST:
                return
            case ast.BinOp() if type(node.op) in SWAPPED and not isinstance(node.left, ast.Constant | ast.List):
                yield from self._operator("sign", node.left, node.right, SYMBOL[type(node.op)], SWAPPED[type(node.op)])
                yield "term", *self._span(node), f"({self._text(node.left)})"
            case ast.AugAssign() if type(node.op) in SWAPPED:
                yield from self._operator(
                    "sign", node.target, node.value, SYMBOL[type(node.op)] + "=", SWAPPED[type(node.op)] + "="
                )
                yield "statement", *self._span(node), "pass"
            case ast.BoolOp():
                word, other = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
                yield from self._operator("boolean", node.values[0], node.values[1], word, other)
                for k in range(len(node.values)):
                    kept = [f"({self._text(v)})" for j, v in enumerate(node.values) if j != k]
                    yield "term", *self._span(node), f"({f' {word} '.join(kept)})"
            case ast.UnaryOp() if isinstance(node.op, ast.Not | ast.USub | ast.Invert):
                if not isinstance(node.operand, ast.Constant):
                    yield "boolean", *self._span(node), f"({self._text(node.operand)})"
            case ast.Constant(value=bool(value)):
                yield "default", *self._span(node), str(not value)
            case ast.Constant(value=int(value)):
                yield "number", *self._span(node), str(value + 1)
                if value > 0:
                    yield "number", *self._span(node), str(value - 1)
            case ast.Constant(value=float(value)) if value == 0 or abs(value) > SMALLEST:
                yield "number", *self._span(node), repr(value * 2 if value else 1.0)
            case ast.Constant(value="left" | "right" as side):
                yield "tie", *self._span(node), repr("right" if side == "left" else "left")
            case ast.Call(func=ast.Name(id=name) as func) if name in OTHER_CALL:
                yield "call", *self._span(func), OTHER_CALL[name]
            case ast.Call(func=ast.Attribute(attr=name) as func) if name in OTHER_CALL:
                stop = self._span(func)[1]
                yield "call", stop - len(name), stop, OTHER_CALL[name]
            case ast.If():
                yield "branch", *self._span(node.test), "False"
                if not any(isinstance(part, ast.Raise) for part in node.body):
                    yield "branch", *self._span(node.test), "True"
            case ast.IfExp():
                yield "branch", *self._span(node), f"({self._text(node.body)})"
                yield "branch", *self._span(node), f"({self._text(node.orelse)})"
            case ast.Expr(value=ast.Call()) | ast.Assign(targets=[ast.Subscript()]):
                yield "statement", *self._span(node), "pass"
            case ast.Continue():
                yield "statement", *self._span(node), "break"
            case ast.Break():
                yield "statement", *self._span(node), "continue"

    def _operator(
        self, kind: str, left: ast.AST, right: ast.AST, symbol: str, other: str | None
    ) -> Iterator[tuple[str, int, int, str]]:
        start, stop = self._span(left)[1], self._span(right)[0]
        at = self.data[start:stop].decode().find(symbol)
        if other is not None and at >= 0:
            start += len(self.data[start:stop].decode()[:at].encode())
            yield kind, start, start + len(symbol), other


def _is_guarded(node: ast.AST) -> bool:
    """Whether a tolerance against rounding is in it."""
    return any(
        isinstance(part, ast.Constant) and isinstance(part.value, float) and 0 < part.value <= SMALLEST
        for part in ast.walk(node)
    )


def candidates(path: str) -> list[Mutant]:
    """All mutants of one file, in the order of the file."""
    return _Finder(path).all()


def modules() -> list[str]:
    """Files that are mutated, from the repository's root."""
    files = [*(REPOSITORY / "kernels").rglob("*.py"), *(REPOSITORY / "assets" / "dancing").rglob("*.py")]
    names = sorted(p.relative_to(REPOSITORY).as_posix() for p in files if p.name != "__init__.py")
    return [n for n in names if not n.startswith("kernels/synthetic/") and not n.endswith("pulse_weights.py")]


def rank(key: str) -> str:
    """Order that is the same on every machine, and does not change for the others when a mutant goes."""
    return hashlib.sha256(f"{SEED} {key}".encode()).hexdigest()


def draw(path: str, share: float = SHARE) -> list[Mutant]:
    """Draw the mutants of one file: kinds of change in turn, so that no kind crowds out the rare ones."""
    by_kind: dict[str, list[Mutant]] = {}
    for mutant in sorted(candidates(path), key=lambda m: rank(m.key)):
        by_kind.setdefault(mutant.kind, []).append(mutant)
    total = sum(map(len, by_kind.values()))
    turns = [
        (turn, rank(f"{path} {kind}"), mutant) for kind, found in by_kind.items() for turn, mutant in enumerate(found)
    ]
    wanted = max(1, round(total * share)) if total else 0
    drawn = (mutant for _, _, mutant in sorted(turns, key=lambda t: t[:2]) if _compiles(mutant))
    return list(itertools.islice(drawn, wanted))


def _compiles(mutant: Mutant) -> bool:
    try:
        compile(mutant.source(), mutant.path, "exec")
    except SyntaxError:
        return False
    return True


def named() -> list[Mutant]:
    """Mutants written by hand, each against one documented rule.

    Raises
    ------
    ValueError
        If the old text is not in its file, or more than once.
    """
    out = []
    for entry in tomllib.loads(NAMED.read_text(encoding="utf-8")).get("mutant", []):
        path, old, new = entry["file"], entry["old"], entry["new"]
        data = (REPOSITORY / path).read_bytes()
        if data.count(old.encode()) != 1:
            raise ValueError(f"{NAMED.name}: want once in {path}, got {data.count(old.encode())} times: {old}")
        start = data.index(old.encode())
        finder = _Finder(path)
        at = data[:start].count(b"\n") + 1
        place, block = "", ""
        for place_, name, run in sorted(blocks(finder.tree), key=lambda b: b[2][0].lineno):
            if run[0].lineno <= at <= (run[-1].end_lineno or 0):
                place, block = place_, name  # the last to hold it is the innermost
        shown = " ".join(old.split()), " ".join(new.split())
        text = new.encode()
        out.append(
            Mutant(path, place, block, "named", *shown, start, start + len(old.encode()), text, 0, entry["rule"])
        )
    return out
