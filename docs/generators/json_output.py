"""The page of JSON that commands print, with the keys read from the code that makes it."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from itertools import chain

from dva_sim.cli import results_json
from generators.markdown import code, table
from generators.markdown import page as page_of

_HEAD = """\
`list`, `plugins`, `show` and `compare` print JSON with `--json`, and nothing else on standard
output. Keys in parentheses are those of the value before them, or of each of its items. Later
versions may add keys, and keep these. Missing numbers are `null`."""
CALLS = {
    "show FOLDER --json": "shown",
    "show FOLDER --table NAME --json": "table",
    "show FOLDER --columns --json": "columns",
    "compare A B --json": "compared",
}
"""Calls, each with the function whose value it prints."""


def page() -> str:
    """Return the page in Markdown."""
    tree = ast.parse(inspect.getsource(results_json))
    shapes = Shapes({each.name: each for each in tree.body if isinstance(each, ast.FunctionDef)})
    return page_of(
        "JSON output",
        _HEAD,
        table(
            ["call", "keys"], ([code(call), shapes.keys_of(name)] for call, name in CALLS.items())
        ),
        "`partial` is `null` once a study is finished; `data` holds the first `--rows` rows, each "
        "with a value for every column. `list --json` gives `name`, `description` and `file` of "
        "each entry, by kind, `plugins --json` what [the page](plugins.md) says of each kind.",
    )


class Shapes:
    """Keys of the dictionaries that functions of a module return.

    Args:
        functions: The functions, by name.
    """

    def __init__(self, functions: dict[str, ast.FunctionDef]) -> None:
        self._functions = functions

    def keys_of(self, name: str) -> str:
        """Return the keys of what a function returns or yields, in Markdown."""
        function = self._functions[name]
        known = {
            each.targets[0].id: each.value
            for each in ast.walk(function)
            if isinstance(each, ast.Assign) and isinstance(each.targets[0], ast.Name)
        }
        ends = (each for each in ast.walk(function) if isinstance(each, (ast.Return, ast.Yield)))
        found = (", ".join(self._keys(end.value, known)) for end in ends if end.value is not None)
        return max(found, key=len)

    def _keys(self, node: ast.expr, known: dict[str, ast.expr]) -> Iterator[str]:
        """Yield the keys of an expression, each with those of its value in parentheses."""
        if isinstance(node, ast.Dict):
            for key, value in zip(node.keys, node.values, strict=True):
                inner = ", ".join(self._keys(value, known))
                yield code(ast.literal_eval(key or node)) + (f" ({inner})" if inner else "")
        elif isinstance(node, ast.BinOp):
            yield from chain(self._keys(node.left, known), self._keys(node.right, known))
        elif isinstance(node, ast.DictComp) and isinstance(named := known.get("keys"), ast.Tuple):
            yield from map(code, ast.literal_eval(named))
        elif isinstance(node, ast.DictComp):
            yield from self._keys(node.value, known)
        elif isinstance(node, ast.ListComp):
            yield from self._keys(node.elt, known)
        elif isinstance(node, ast.Name) and node.id in known:
            yield from self._keys(known[node.id], known)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id in self._functions:
                yield self.keys_of(node.func.id)
            elif node.func.id == "list" and node.args:
                yield from self._keys(node.args[0], known)
