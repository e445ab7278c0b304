"""Mutation test: plants 60 faults, one at a time, and runs the nearest tests.

    python tests/mutants.py                 plant each fault, tell who noticed, exit 0
    python tests/mutants.py --list          print the faults, plant none
    python tests/mutants.py --draw again    other faults, by the same rule
    python tests/mutants.py --only worlds   those whose line has this word in it

The rule, which leaves nothing to choose: a candidate is every place in `dva_sim` where an operator
can be exchanged, a number made one greater, a truth turned, or a call or a result left out, but
for annotations and f-strings. Its rank is the SHA-256 of its name. Each room gives its candidates
of lowest rank: one, and more in proportion to how many it has.

The tests that should notice are those in the room of the fault, but for long ones and those in a
browser; those that bear the name of its module come first. Two copies of the working tree are at
work side by side. A fault counts as noticed if a test fails with it, by itself too, and passes
without it; or if pytest breaks down or takes longer than `PATIENCE_S`. For another commit run this
file in a work tree of that commit.
"""

import argparse
import ast
import hashlib
import itertools
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

import pytest
from helpers.paths import ROOT

MUTANTS = 60
SIDE_BY_SIDE = 2
PATIENCE_S = 900.0
NOTHING_FAILED = (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
LEFT_OUT = "not soak and not browser"
FAILED = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", re.MULTILINE)

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
    """One fault: bytes of a file, and what stands there in its place."""

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
    def room(self) -> str:
        parts = Path(self.file).parts
        return parts[1] if len(parts) > 2 else "dva_sim"

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
    """All candidates of one module."""

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

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None and not is_none(node.value):
            self._add(node, *self._bounds(node), "return None")
        self.generic_visit(node)


def is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)


def is_none(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def candidates() -> dict[str, list[Mutant]]:
    """All of them by room."""
    rooms: dict[str, list[Mutant]] = {}
    for path in sorted((ROOT / "dva_sim").rglob("*.py")):
        for mutant in Sites(str(path.relative_to(ROOT)), path.read_bytes()).found:
            rooms.setdefault(mutant.room, []).append(mutant)
    return rooms


def shares(sizes: dict[str, int], total: int) -> dict[str, int]:
    """Number of faults for each room: one, and the rest by largest remainder."""
    rest, whole = total - len(sizes), sum(sizes.values())
    exact = {room: rest * size / whole for room, size in sizes.items()}
    given = {room: int(share) for room, share in exact.items()}
    by_remainder = sorted(sizes, key=lambda room: (given[room] - exact[room], room))
    for room in by_remainder[: rest - sum(given.values())]:
        given[room] += 1
    return {room: 1 + share for room, share in given.items()}


def drawn(draw: str) -> list[Mutant]:
    """Those that the rule takes."""

    def rank(mutant: Mutant) -> str:
        return hashlib.sha256(f"{draw}{mutant.name}".encode()).hexdigest()

    rooms = candidates()
    number = shares({room: len(found) for room, found in rooms.items()}, MUTANTS)
    chosen: list[Mutant] = []
    for room, found in sorted(rooms.items()):
        good = filter(Mutant.is_python, sorted(found, key=rank))
        chosen += itertools.islice(good, number[room])
    return chosen


def nearest_tests(mutant: Mutant, root: Path) -> list[str]:
    """Files of tests in the room of a fault, those of its module and of its folder first."""
    module = Path(mutant.file).relative_to("dva_sim")
    room = root / "tests" / (mutant.room if len(module.parts) > 1 else "api")
    folder, stem = root / "tests" / module.parent, module.stem

    def distance(file: Path) -> tuple[bool, bool, str]:
        return (stem not in file.stem, not file.is_relative_to(folder), str(file))

    files = sorted(room.rglob("test_*.py"), key=distance)
    return [str(file.relative_to(root)) for file in files]


def copy_of_the_tree(root: Path) -> None:
    """Copy the files that Git knows, as they are in the working tree."""
    words = ["git", "-C", str(ROOT), "ls-files", "-co", "--exclude-standard"]
    for name in subprocess.check_output(words, text=True).splitlines():
        if (ROOT / name).is_file():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, root / name)
    subprocess.check_call(["git", "init", "-q", str(root)])


def notice(mutant: Mutant, root: Path) -> str:
    """Name of the test that noticed a planted fault; empty if none did.

    It fails with the fault and passes without it, each time by itself; others are left out.
    """
    left_out = list[str]()
    while True:
        with planted(mutant, root):
            code, failed = outcome(root, *nearest_tests(mutant, root), left_out=left_out)
            fails_alone = bool(failed) and outcome(root, failed)[0] != 0
        if not failed:
            return "" if code in NOTHING_FAILED else f"pytest ended with {code}"
        if fails_alone and outcome(root, failed)[0] == 0:
            return failed
        left_out.append(failed)


@contextmanager
def planted(mutant: Mutant, root: Path) -> Iterator[None]:
    """A fault is in a copy for a while."""
    file = root / mutant.file
    kept = file.read_bytes()
    put(file, mutant.in_place(kept))
    try:
        yield
    finally:
        put(file, kept)


def put(file: Path, source: bytes) -> None:
    """Write a module, of which nothing compiled is left."""
    file.write_bytes(source)
    for compiled in file.parent.glob(f"__pycache__/{file.stem}.*"):
        compiled.unlink()


def outcome(root: Path, *tests: str, left_out: Sequence[str] = ()) -> tuple[int, str]:
    """With which code pytest ends, and which test was the first to fail."""
    words = [*("-m", LEFT_OUT), *(f"--deselect={test}" for test in left_out)]
    program = subprocess.Popen(
        [sys.executable, "-m", "pytest", "-x", "-p", "no:cacheprovider", *words, *tests],
        cwd=root,
        env=os.environ | {"PYTHONPATH": str(root)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        text, _ = program.communicate(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        text = ""
    finally:
        end(program)
    return program.returncode, next(iter(FAILED.findall(text)), "")


def end(program: subprocess.Popen[str]) -> None:
    """With all that it started."""
    with suppress(ProcessLookupError):
        os.killpg(program.pid, signal.SIGKILL)
    program.wait()


def tried(mutants: list[Mutant]) -> Iterator[tuple[Mutant, str, float]]:
    """Each fault, the test that noticed it, and how long that took [s]."""
    with tempfile.TemporaryDirectory() as folder:
        trees: SimpleQueue[Path] = SimpleQueue()
        for number in range(SIDE_BY_SIDE):
            tree = Path(folder) / f"tree-{number}"
            copy_of_the_tree(tree)
            trees.put(tree)

        def one(mutant: Mutant) -> tuple[Mutant, str, float]:
            tree, began = trees.get(), time.monotonic()
            try:
                return mutant, notice(mutant, tree), time.monotonic() - began
            finally:
                trees.put(tree)

        with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
            yield from pool.map(one, mutants)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", action="store_true", help="print the faults, plant none")
    parser.add_argument("--draw", default="", metavar="WORD", help="others, by the same rule")
    parser.add_argument("--only", default="", metavar="WORD", help="those with it in their line")
    asked = parser.parse_args()
    mutants = [m for m in drawn(asked.draw) if asked.only in m.description]
    if asked.list:
        print(*(mutant.description for mutant in mutants), sep="\n")
        return 0
    noticed, whole = Counter[str](), Counter(mutant.room for mutant in mutants)
    for mutant, test, took in tried(mutants):
        noticed[mutant.room] += bool(test)
        verdict = "noticed " if test else "NOT SEEN"
        print(f"{verdict} {mutant.description}  {test} {took:.0f} s", flush=True)
    for room, number in whole.items():
        print(f"{room:12} {noticed[room]:3} of {number:3}")
    print(f"{noticed.total()} of {whole.total()} faults were noticed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
