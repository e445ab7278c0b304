"""Faults that can be planted, and the rule that draws some of them.

A candidate is every place where an operator can be exchanged, a number made one greater, a truth
turned, or a call, a result, an error or the change of an attribute left out; annotations and
f-strings are not. The rank of a candidate is the SHA-256 of its name.
"""

import ast
import hashlib
import itertools
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from helpers.paths import ROOT

OPERATORS = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
}


@dataclass(frozen=True)
class Mutant:
    """Fault planted in one file: some of its bytes, and the bytes that replace them."""

    file: str  # from the root of the project
    line: int
    place: str  # "Class.function", empty at the level of the module
    start: int
    end: int
    old: str
    new: str
    number: int  # among equal ones in this place

    @property
    def name(self) -> str:
        """Name that is stable in every version in which the function is unchanged."""
        turns = f"{self.old} -> {self.new}"
        return f"{self.file}::{self.place}: {turns} #{self.number}"

    @property
    def module(self) -> Path:
        """Path of the file below `dva_sim`."""
        return Path(self.file).relative_to("dva_sim")

    @property
    def room(self) -> str:
        return self.module.parts[0] if len(self.module.parts) > 1 else "dva_sim"

    @property
    def description(self) -> str:
        old, new = (" ".join(text.split())[:40] for text in (self.old, self.new))
        return f"{self.file}:{self.line} {self.place}: {old} -> {new}"

    def in_place(self, source: bytes) -> bytes:
        """The file with the fault in it."""
        assert source[self.start : self.end].decode() == self.old
        return source[: self.start] + self.new.encode() + source[self.end :]

    def is_python(self) -> bool:
        try:
            ast.parse(self.in_place((ROOT / self.file).read_bytes()))
        except SyntaxError:
            return False
        return True


class Sites(ast.NodeVisitor):
    """Collector of all faults that can be planted in a module."""

    def __init__(self, file: str, source: bytes) -> None:
        self._file, self._source = file, source
        self._starts = [0]
        for line in source.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))
        self._place: list[str] = []
        self._seen: Counter[tuple[str, str, str]] = Counter()
        self.found: list[Mutant] = []
        self.visit(ast.parse(source))

    def _at(self, line: int | None, column: int | None) -> int:
        assert line is not None
        assert column is not None
        return self._starts[line - 1] + column

    def _bounds(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        return (
            self._at(node.lineno, node.col_offset),
            self._at(node.end_lineno, node.end_col_offset),
        )

    def _add(self, node: ast.expr | ast.stmt, start: int, end: int, new: str) -> None:
        old, place = self._source[start:end].decode(), ".".join(self._place)
        self._seen[place, old, new] += 1
        number = self._seen[place, old, new]
        line = self._source.count(b"\n", 0, start) + 1
        self.found.append(Mutant(self._file, line, place, start, end, old, new, number))

    def _exchange(self, left: ast.expr, operator: ast.AST, right: ast.expr) -> None:
        """An operator between two expressions; what else stands between them is kept."""
        if type(operator) not in OPERATORS:
            return
        old, new = OPERATORS[type(operator)]
        start, end = self._bounds(left)[1], self._bounds(right)[0]
        between = self._source[start:end].decode()
        pattern = re.escape(old).replace(r"\ ", r"\s+")
        if found := re.search(pattern, between):
            self._add(left, start + found.start(), start + found.end(), new)

    def _inside(self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> None:
        self._place.append(node.name)
        self.generic_visit(node)
        self._place.pop()

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self._inside(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        node.returns = None
        self._inside(node)

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> None:
        node.returns = None
        self._inside(node)

    def visit_arg(self, node: ast.arg) -> None:
        """Skip annotations: they are not executed."""

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Python 3.11 does not tell where its parts stand."""

    def visit_If(self, node: ast.If) -> None:
        if not (isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"):
            self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        for left, operator, right in zip(
            [node.left, *node.comparators], node.ops, node.comparators, strict=False
        ):
            self._exchange(left, operator, right)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        for left, right in zip(node.values, node.values[1:], strict=False):
            self._exchange(left, node.op, right)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        sides = (node.left, node.right)
        if not any(isinstance(s, ast.JoinedStr) or is_text(s) for s in sides):
            self._exchange(node.left, node.op, node.right)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.Not):
            start = self._bounds(node)[0]
            self._add(node, start, self._bounds(node.operand)[0], "")
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, bool):
            self._add(node, *self._bounds(node), str(not node.value))
        elif isinstance(node.value, int | float):
            self._add(node, *self._bounds(node), repr(node.value + 1))

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call):
            self._add(node, *self._bounds(node), "pass")
        self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        if all(isinstance(target, ast.Attribute | ast.Subscript) for target in node.targets):
            self._add(node, *self._bounds(node), "pass")
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._add(node, *self._bounds(node), "pass")
        self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> None:
        self._add(node, *self._bounds(node), "pass")
        self.generic_visit(node)

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None and not is_none(node.value):
            self._add(node, *self._bounds(node), "return None")
        self.generic_visit(node)


def is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)


def is_none(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def candidates(area: str = "") -> dict[str, list[Mutant]]:
    """Return all candidates by room: of the whole program, or of a folder below `dva_sim`."""
    rooms: dict[str, list[Mutant]] = {}
    for path in sorted((ROOT / "dva_sim" / area).rglob("*.py")):
        for mutant in Sites(str(path.relative_to(ROOT)), path.read_bytes()).found:
            rooms.setdefault(mutant.room, []).append(mutant)
    return rooms


def shares(sizes: dict[str, int], total: int) -> dict[str, int]:
    """Return the number of faults for each room: one, and the rest by largest remainder."""
    rest, whole = total - len(sizes), sum(sizes.values())
    exact = {room: rest * size / whole for room, size in sizes.items()}
    given = {room: int(share) for room, share in exact.items()}
    by_remainder = sorted(sizes, key=lambda room: (given[room] - exact[room], room))
    for room in by_remainder[: rest - sum(given.values())]:
        given[room] += 1
    return {room: 1 + share for room, share in given.items()}


def drawn(draw: str, number: int, area: str = "") -> list[Mutant]:
    """Return the faults of lowest rank: of each room its share, or all of one area."""
    rooms = candidates(area)
    by_room = shares({room: len(found) for room, found in rooms.items()}, number)
    chosen: list[Mutant] = []
    for room, found in sorted(rooms.items()):
        chosen += itertools.islice(_ranked(found, draw), by_room[room])
    return chosen


def _ranked(found: list[Mutant], draw: str) -> Iterator[Mutant]:
    def rank(mutant: Mutant) -> str:
        return hashlib.sha256(f"{draw}{mutant.name}".encode()).hexdigest()

    return filter(Mutant.is_python, sorted(found, key=rank))
