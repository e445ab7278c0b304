"""Check that docstrings read as a native engineer would write them, as far as a program can see.

A summary names the thing, or begins with a verb; an argument line begins with a noun. So it is in
Python, constants included, and in the doc comments of the console's pages.
"""

import ast
import re
import sys
from collections.abc import Iterator
from inspect import cleandoc
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("dva_sim", "agents", "experiments", "protocol", "tests")
LEFT_OUT = "vendor", "lines.js"  # of others; generated

OPENINGS = {
    "question": re.compile(r"(What|Who|Whom|Whose|Whoever|Whether|How|Where|Why|Which|When)\b"),
    "fragment": re.compile(r"(Of|That|As|The same)\b"),
    "see": re.compile(r"See `[^`]*`[.;]"),
}
NO_VERB = re.compile(
    r"(A|All|An|Another|Any|At|Both|By|Each|Every|Everybody|Everything|False|For|From|In|It|Its|No"
    r"|Nobody|Nothing|On|One|Others|So|Some|Somebody|Something|The|There|Those|True|With|Without)\b"
)
WORDS = re.compile(
    r"\b(luck|anew|whoever|(?:is|are) told|gone on with|goes on with|shall|(?:is|are) no"
    r"(?= [a-z]+[^a-z ]))\b",
    re.IGNORECASE,
)
ARGUMENT = re.compile(
    r"^\s+\w+: (Of|What|Whether|How|Who|Whose|Which|When|Where|That|Told)\b", re.MULTILINE
)


DOC_COMMENT = re.compile(r"/\*\*\s*(?:\*\s*)?([^@*\s].*)")
_DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


class Finding(NamedTuple):
    """One thing that a reader would stumble over."""

    rule: str
    place: str
    text: str


def findings_in(source: str, path: Path) -> Iterator[Finding]:
    """All findings in the docstrings of a Python file, or the doc comments of a JavaScript file."""
    is_python = path.suffix == ".py"
    if is_python and path.parts[0] == "dva_sim":
        yield from _verbless(ast.parse(source), path)
    docs = _docstrings(ast.parse(source)) if is_python else _comments(source)
    for line, text in docs:
        place = f"{path}:{line}"
        summary = text.partition("\n")[0]
        for rule, opening in OPENINGS.items():
            if opening.match(summary):
                yield Finding(rule, place, summary)
        for word in WORDS.finditer(text):
            yield Finding("word", place, word[0])
        for argument in ARGUMENT.finditer(text):
            yield Finding("argument", place, argument[0].strip())


def _verbless(tree: ast.Module, path: Path) -> Iterator[Finding]:
    """Functions, but for properties, whose summary does not begin with a verb."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            summary = (ast.get_docstring(node) or "").partition("\n")[0]
            decorators = {ast.unparse(each).split(".")[-1] for each in node.decorator_list}
            if NO_VERB.match(summary) and not decorators & {"property", "cached_property"}:
                yield Finding("verb", f"{path}:{node.lineno}", summary)


def _docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Lines and texts of docstrings: of modules, classes, functions and constants."""
    for node in ast.walk(tree):
        if not isinstance(node, _DOCUMENTED):
            continue
        if text := ast.get_docstring(node):
            yield getattr(node, "lineno", 1), text
        for before, after in pairwise(node.body):
            if isinstance(before, ast.Assign | ast.AnnAssign) and isinstance(after, ast.Expr):
                value = getattr(after.value, "value", None)
                if isinstance(value, str):
                    yield after.lineno, cleandoc(value)


def _comments(source: str) -> Iterator[tuple[int, str]]:
    for found in DOC_COMMENT.finditer(source):
        yield source.count("\n", 0, found.start(1)) + 1, found[1]


def all_findings() -> Iterator[Finding]:
    """All findings in the repository."""
    for folder in FOLDERS:
        for file in sorted((ROOT / folder).rglob("*.[pj][ys]")):
            path = file.relative_to(ROOT)
            if not set(LEFT_OUT).intersection(path.parts):
                yield from findings_in(file.read_text(encoding="utf-8"), path)


def main() -> int:
    """Print what is wrong; the exit code."""
    findings = list(all_findings())
    for found in findings:
        print(f"{found.place}: {found.rule}: {found.text}")
    print(f"{len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
