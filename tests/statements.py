"""Size of the program: statements and modules, by room.

    python tests/statements.py                      this version
    python tests/statements.py --against COMMIT     another one beside it

A statement is one of Python's, however many stand in a line; docstrings are none, and an assignment
of several values to several names counts as many.
"""

from __future__ import annotations

import argparse
import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from helpers.paths import ROOT
from helpers.processes.other_version import version

PACKAGE = "dva_sim"
Size = tuple[int, int]


def weight(statement: ast.stmt) -> int:
    """Number of statements that one counts as."""
    match statement:
        case ast.Expr(value=ast.Constant(value=str())):
            return 0
        case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Tuple()):
            return len(names)
    return 1


def statements(source: str) -> int:
    """Statements of a module."""
    nodes = ast.walk(ast.parse(source))
    return sum(weight(node) for node in nodes if isinstance(node, ast.stmt))


def sizes(root: Path) -> dict[str, Size]:
    """Statements and modules of each room in a folder, and of all."""
    counts, modules = Counter[str](), Counter[str]()
    for path in (root / PACKAGE).rglob("*.py"):
        room = path.relative_to(root / PACKAGE).parts[0].removesuffix(".py")
        for key in (room, "all"):
            counts[key] += statements(path.read_text())
            modules[key] += 1
    return {room: (counts[room], modules[room]) for room in counts}


def lines(ours: dict[str, Size], theirs: dict[str, Size]) -> Iterator[str]:
    """The table, the largest room first."""
    yield f"{'':16}{'statements':>11}{'modules':>9}" + ("  before" if theirs else "")
    for room in sorted({*ours, *theirs}, key=lambda room: -ours.get(room, (0, 0))[0]):
        (here, files), before = ours.get(room, (0, 0)), theirs.get(room, (0, 0))
        change = f"{before[0]:>9,}{before[1]:>5}  {here - before[0]:+,}" if theirs else ""
        yield f"{room:16}{here:>11,}{files:>9}{change}"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("--against", metavar="COMMIT", default="")
    against = parser.parse_args().against
    theirs = {}
    if against:
        with version(against) as other:
            theirs = sizes(other)
    print("\n".join(lines(sizes(ROOT), theirs)))


if __name__ == "__main__":
    main()
