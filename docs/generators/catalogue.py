"""The page of everything that can be named: studies, scenarios, sites, agents and plug-ins."""

from __future__ import annotations

from collections.abc import Iterator

from dva_sim.cli.names import FILES, everything
from generators.markdown import code, sentence, table
from generators.markdown import page as page_of

_HEAD = """\
These names work in every command, scenario and study. A path to a file of yours works as well.
`dva-sim list` prints the same list."""


def page() -> str:
    """Return the page in Markdown."""
    return page_of("Catalogue", _HEAD, *_sections())


def _sections() -> Iterator[str]:
    for kind, entries in everything().items():
        yield f"## {kind.capitalize()}"
        if kind in FILES:
            yield f"Files in `{FILES[kind]}`."
        yield table(
            ["name", "description"], ([code(e.name), sentence(e.description)] for e in entries)
        )
