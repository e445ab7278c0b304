"""What registries ship, by name, read from their source: to list names nothing has to be loaded.

A registry is a `Plugins(kind, base, shipped, group=..., hidden=...)`. What it ships is a dictionary
of names and classes, or made from a tuple of classes that say their names themselves.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import dva_sim
from dva_sim.testing.kinds import plural


class Registry(NamedTuple):
    """A kind of plug-ins.

    Attributes:
        several: What several of its kind are called.
        group: Entry points of installed packages.
        shipped: Names that a configuration can use, with the docstring of each class.
    """

    several: str
    group: str
    shipped: dict[str, str]


def registry(place: str) -> Registry:
    """The registry at `module:NAME`."""
    module, _, name = place.partition(":")
    module, call = _found(module, ast.Name(name))
    given = {keyword.arg: keyword.value for keyword in call.keywords}
    given |= dict(zip(("kind", "base", "shipped"), call.args, strict=False))
    hidden = ast.literal_eval(given["hidden"].args[0]) if "hidden" in given else ()
    shipped = {
        name: ast.get_docstring(kind) or ""
        for name, kind in _classes(*_found(module, given["shipped"]))
        if name not in hidden
    }
    return Registry(plural(given["kind"].value), given["group"].value, shipped)


def _classes(module: str, shipped: Any) -> Iterator[tuple[str, ast.ClassDef]]:
    """The names of a dictionary, and what defines the class of each."""
    if isinstance(shipped, ast.Dict):
        for name, kind in zip(shipped.keys, shipped.values, strict=True):
            yield ast.literal_eval(name or ast.Constant("")), _found(module, kind)[1]
        return
    for kind in _found(module, shipped.generators[0].iter)[1].elts:
        origin, found = _found(module, kind)
        yield _found(origin, ast.Name(shipped.key.attr), found.body)[1].value, found


def _found(module: str, what: Any, body: list[ast.stmt] | None = None) -> tuple[str, Any]:
    """What is meant by an expression in a module, or in a part of it, and the module it is from."""
    if isinstance(what, ast.Attribute):
        package, imported = _found(module, what.value)
        return _found(f"{package}.{imported}", ast.Name(what.attr))
    if not isinstance(what, ast.Name):
        return module, what
    for node in _source(module) if body is None else body:
        match node:
            case ast.ClassDef(name=what.id):
                return module, node
            case (
                ast.Assign(targets=[ast.Name(id=what.id)])
                | ast.AnnAssign(target=ast.Name(id=what.id))
            ):
                return _found(module, node.value)
            case ast.ImportFrom(module=str(origin)) if what.id in {a.name for a in node.names}:
                return _found(origin, what) if _file(origin, what.id) is None else (origin, what.id)
    raise LookupError(f"{module} has no {what.id}")


def _file(module: str, name: str = "") -> Path | None:
    """The source of a module, or of one in a package; None if it is none."""
    path = Path(dva_sim.__file__).parent.joinpath(*module.split(".")[1:], name)
    return next((p for p in (path / "__init__.py", path.with_suffix(".py")) if p.is_file()), None)


@cache
def _source(module: str) -> list[ast.stmt]:
    file = _file(module)
    assert file is not None, module
    return ast.parse(file.read_bytes()).body
