"""The page of plug-ins: each kind with its key, its base class and the promises that are checked.

The promises are read from the checks themselves: a check yields the words of what is broken.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from itertools import chain
from typing import Any

from dva_sim.cli.names import key_of, named_as
from dva_sim.testing.promises import TRIALS, CheckedKind
from generators.markdown import code, prose, shell, table
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
    yield prose((inspect.getdoc(plugins.base) or "").partition("\n\n")[0])
    yield table(
        ["", ""],
        [
            ["key", f"{code(plugins.key)} {key_of(plugins).partition(' ')[2]}"],
            ["named as", code(f"{plugins.key}: {named_as(plugins)}")],
            ["folder", code(plugins.folder)],
            ["entry points", code(plugins.group)],
            ["base class", code(plugins.public)],
            ["defines", code(plugins.needs)],
            ["shipped", ", ".join(map(code, shipped))],
        ],
    )
    yield shell([f"dva-sim check {word} mine.py:Mine"])
    unless = "unless" if word == "transport" else "if"
    yield f"The check fails {unless} the class ... (capitals stand for values)"
    yield "\n".join(f"- {prose(each)}" for each in broken_promises(trial))


def broken_promises(trial: CheckedKind) -> list[str]:
    """Return the words for each promise that the check of a kind can find broken."""
    module = import_module(f"dva_sim.testing.{trial.module}")
    kinds = (ast.FunctionDef, ast.ClassDef)
    tree = ast.parse(inspect.getsource(module))
    parts = {each.name: each for each in tree.body if isinstance(each, kinds)}
    reached = [f"check_{trial.kind}"]
    for name in reached:
        names = {n.id for n in ast.walk(parts[name]) if isinstance(n, ast.Name)}
        reached += [each for each in parts if each in names and each not in reached]
    cases = chain.from_iterable(_cases(parts[name]) for name in parts if name in reached)
    found = (words for case in cases for words in _words(case.elts[0], vars(module)))
    return list(dict.fromkeys(words for words in found if " " in words and words[0].isalpha()))


def _cases(part: ast.AST) -> Iterator[ast.Tuple]:
    """Yield the pairs of a promise and a case that a part yields, appends or returns."""
    for node in ast.walk(part):
        if isinstance(node, ast.Yield):
            held: Sequence[ast.AST | None] = [node.value]
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "append":
            held = node.args
        elif isinstance(node, ast.Tuple) and len(node.elts) == 1:
            held = node.elts
        else:
            continue
        yield from (pair for pair in held if isinstance(pair, ast.Tuple) and len(pair.elts) == 2)


def _words(node: ast.expr, known: Mapping[str, Any]) -> Iterator[str]:
    """Yield the texts that an expression can be, with the names of values in capitals."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.Name) and isinstance(known.get(node.id), str):
        yield known[node.id]
    elif isinstance(node, ast.IfExp):
        yield from (*_words(node.body, known), *_words(node.orelse, known))
    elif isinstance(node, ast.JoinedStr):
        yield "".join(
            ast.unparse(v.value).upper()
            if isinstance(v, ast.FormattedValue)
            else ast.literal_eval(v)
            for v in node.values
        )
