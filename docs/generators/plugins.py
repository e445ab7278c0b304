"""The page of plug-ins: each kind with its key, its base class and the promises that are checked.

The promises are read from the checks themselves: a check yields the words of what is broken.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from importlib import import_module
from itertools import chain

from dva_sim.cli.names import _key, _named
from dva_sim.testing.promises import TRIALS, CheckedKind
from generators.markdown import code, prose, sentence, shell, table
from generators.markdown import page as page_of

_HEAD = """\
A plug-in is a class in a file of yours, or in an installed package. A configuration names it as
`file.py:Class`. The file is looked for beside the configuration, in the working folder, and in the
folder below. It runs only when a scenario, a study or a command names it. In a run, an answer that
breaks a promise is counted and replaced or limited; `dva-sim check` lists such answers beforehand.
`dva-sim plugins` prints what is installed here."""


def page() -> str:
    """Return the page in Markdown."""
    return page_of(
        "Plug-ins", _HEAD, *chain.from_iterable(_section(w, t) for w, t in TRIALS.items())
    )


def _section(word: str, trial: CheckedKind) -> Iterator[str]:
    plugins = trial.load_plugins()
    shipped = sorted(plugins.shipped.keys() - plugins.hidden)
    yield f"## {trial.classes.capitalize()}"
    yield prose(inspect.getdoc(plugins.base).partition("\n\n")[0])
    yield table(
        ["", ""],
        [
            ["key", code(_key(plugins).partition(" ")[0]) + " " + _key(plugins).partition(" ")[2]],
            ["named as", code(f"{plugins.key}: {_named(plugins)}")],
            ["folder", code(plugins.folder)],
            ["entry points", code(plugins.group)],
            ["base class", code(plugins.public)],
            ["defines", code(plugins.needs)],
            ["shipped", ", ".join(map(code, shipped))],
        ],
    )
    yield shell([f"dva-sim check {word} mine.py:Mine"])
    yield "The check fails if the class"
    yield "\n".join(f"- {prose(each)}" for each in broken_promises(trial))


def broken_promises(trial: CheckedKind) -> list[str]:
    """Return the words for each promise that the check of a kind can find broken."""
    tree = ast.parse(inspect.getsource(import_module(f"dva_sim.testing.{trial.module}")))
    parts = {
        each.name: each for each in tree.body if isinstance(each, (ast.FunctionDef, ast.ClassDef))
    }
    reached = [f"check_{trial.kind}"]
    for name in reached:
        names = {n.id for n in ast.walk(parts[name]) if isinstance(n, ast.Name)}
        reached += [each for each in parts if each in names and each not in reached]
    found = chain.from_iterable(_promises(part) for n, part in parts.items() if n in reached)
    return list(dict.fromkeys(found))


def _promises(part: ast.AST) -> Iterator[str]:
    """Yield the first words of each pair that a part yields, appends or returns in a tuple."""
    for node in ast.walk(part):
        if isinstance(node, ast.Tuple) and len(node.elts) == 2:
            text = _words(node.elts[0])
            if " " in text and text[0].islower() and not _is_pair_of_numbers(node):
                yield text


def _is_pair_of_numbers(node: ast.Tuple) -> bool:
    return isinstance(node.elts[1], ast.Constant) and not isinstance(node.elts[1].value, str)


def _words(node: ast.expr) -> str:
    """Return a constant text, or a formatted one with the names of its values."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(
            str(v.value) if isinstance(v, ast.Constant) else ast.unparse(v.value).upper()
            for v in node.values
        )
    return ""


def sections() -> list[str]:
    """Return the titles of the sections, one for each kind."""
    return [sentence(trial.classes).rstrip(".") for trial in TRIALS.values()]
