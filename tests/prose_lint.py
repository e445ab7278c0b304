"""Check that docstrings read as a native engineer would write them, as far as a program can see.

    python tests/prose_lint.py               tell what is wrong; exit 1 if a room got worse
    python tests/prose_lint.py ROOM          each finding in a room, such as dva_sim/network
    python tests/prose_lint.py --write       write down what is left, once rooms have got better

A summary names the thing, or begins with a verb; an argument line begins with a noun. What is left
from before stands in `prose_debt.toml` by room and rule, and may only become less.
"""

import argparse
import ast
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
DEBT = Path(__file__).with_name("prose_debt.toml")
FOLDERS = ("dva_sim", "agents", "experiments", "protocol", "tests")

OPENINGS = {
    "question": re.compile(r"(What|Who|Whom|Whoever|Whether|How|Where|Why|Which|When)\b"),
    "fragment": re.compile(r"(Of|That|As|The same)\b"),
    "see": re.compile(r"See `[^`]*`[.;]"),
}
WORDS = re.compile(
    r"\b(luck|anew|whoever|(?:is|are) told|gone on with|goes on with|shall|(?:is|are) no"
    r"(?= [a-z]+[^a-z ]))\b",
    re.IGNORECASE,
)
ARGUMENT = re.compile(
    r"^\s+\w+: (Of|What|Whether|How|Who|Whose|Which|When|Where|That|Told)\b", re.MULTILINE
)


class Finding(NamedTuple):
    """One thing that a reader would stumble over."""

    room: str
    rule: str
    place: str
    text: str


def findings_in(source: str, path: Path) -> Iterator[Finding]:
    """All findings in the docstrings of a file."""
    room = "/".join(path.parts[:2]).removesuffix(".py")
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    for node in ast.walk(ast.parse(source)):
        text = ast.get_docstring(node) if isinstance(node, kinds) else None
        if not text:
            continue
        place = f"{path}:{getattr(node, 'lineno', 1)}"
        summary = text.partition("\n")[0]
        for rule, opening in OPENINGS.items():
            if opening.match(summary):
                yield Finding(room, rule, place, summary)
        for word in WORDS.finditer(text):
            yield Finding(room, "word", place, word[0])
        for line in ARGUMENT.finditer(text):
            yield Finding(room, "argument", place, line[0].strip())


def all_findings() -> Iterator[Finding]:
    """All findings in the repository."""
    for folder in FOLDERS:
        for file in sorted((ROOT / folder).rglob("*.py")):
            path = file.relative_to(ROOT)
            if "vendor" not in path.parts:
                yield from findings_in(file.read_text(encoding="utf-8"), path)


def counted(findings: list[Finding]) -> dict[str, Counter[str]]:
    """Findings by room and rule."""
    rooms: dict[str, Counter[str]] = {}
    for found in findings:
        rooms.setdefault(found.room, Counter())[found.rule] += 1
    return rooms


def worse(now: dict[str, Counter[str]], before: dict[str, dict[str, int]]) -> list[tuple[str, str]]:
    """Rooms and rules of which there are more findings than before."""
    return [
        (room, rule)
        for room, rules in sorted(now.items())
        for rule, count in sorted(rules.items())
        if count > before.get(room, {}).get(rule, 0)
    ]


def written(rooms: dict[str, Counter[str]]) -> str:
    """Remaining findings as TOML."""
    lines = ["# Written by `python tests/prose_lint.py --write`; numbers may only become less.\n"]
    for room, rules in sorted(rooms.items()):
        inner = ", ".join(f"{rule} = {count}" for rule, count in sorted(rules.items()))
        lines.append(f'"{room}" = {{ {inner} }}\n')
    return "".join(lines)


def main() -> int:
    """Tell what is wrong; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("room", nargs="?")
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    findings = list(all_findings())
    now = counted(findings)
    before = tomllib.loads(DEBT.read_text(encoding="utf-8")) if DEBT.exists() else {}
    if asked.write:
        DEBT.write_text(written(now), encoding="utf-8")
        return 0
    bad = worse(now, before)
    for found in findings:
        if found.room == asked.room or (found.room, found.rule) in bad:
            print(f"{found.place}: {found.rule}: {found.text}")
    for room, rule in bad:
        print(f"{room}: {now[room][rule]} of {rule}, {before.get(room, {}).get(rule, 0)} before")
    print(f"{sum(map(Counter.total, now.values()))} findings left")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
