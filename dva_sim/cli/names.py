"""Everything that can be named, with what it is: files that users edit, and classes by name."""

from __future__ import annotations

import inspect
import re
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from dva_sim.cli.plugin_names import KINDS
from dva_sim.kernel import resources
from dva_sim.kernel.config import parse_scalar
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.plugins import Plugins
from dva_sim.kernel.suggestions import hint

_HEAD = re.compile(r"^(?:description|question):.*\n(?:[ \t]+.*\n|[ \t]*\n)*", re.MULTILINE)

FILES: Final = {
    "studies": "experiments",
    "scenarios": "experiments/scenarios",
    "tasks": "experiments/scenarios/tasks",
    "sites": "worlds",
    "robots": "agents/robots",
    "phones": "agents/phones",
    "accelerometers": "agents/accelerometers",
    "people": "agents/people",
}
"""Kinds of files by what several are called, and the folder of each."""


PATTERNS: Final = {
    "req-rep": "One command at a time: the next waits for the answer to the last.",
    "pipelined": "Requests, of which `command.window` may be unanswered at once.",
    "pub-sub": "Commands are published, and the robot works off all of them in order.",
    "latest-wins": "Commands are published, and the robot takes the newest alone.",
}


@dataclass(frozen=True)
class Entry:
    """One thing that can be named.

    Attributes:
        name: As one writes it.
        description: What it is, in a line; empty if nobody said.
        file: Where it lies, if it is a file.
    """

    name: str
    description: str = ""
    file: str | None = None


def everything(kind: str | None = None) -> dict[str, list[Entry]]:
    """All that can be named, by kind.

    Args:
        kind: Only this one, such as `studies`.

    Raises:
        ConfigError: there is no such kind.
    """
    makers: dict[str, Any] = {name: _files(name, folder) for name, folder in FILES.items()}
    makers["patterns"] = (Entry(name, told) for name, told in PATTERNS.items())
    makers |= {several: _classes(plugins) for several, plugins in KINDS.items()}
    if kind is not None and kind not in makers:
        raise ConfigError(f"there is no list of {kind!r}; {hint(kind, makers, 'there are')}")
    return {name: list(made) for name, made in makers.items() if kind in (None, name)}


def as_json(kind: str | None = None) -> dict[str, Any]:
    """The same as JSON can hold it: for each kind a list of `name`, `description` and `file`."""
    return {name: [vars(entry) for entry in found] for name, found in everything(kind).items()}


def lines(kind: str | None = None) -> Iterator[str]:
    """The same for people: a line for each name."""
    for number, (title, entries) in enumerate(everything(kind).items()):
        yield f"{chr(10) if number else ''}{title}"
        width = max((len(entry.name) for entry in entries), default=0)
        for entry in entries:
            yield f"  {entry.name:<{width}}  {entry.description}".rstrip()


def tell(told: Iterable[str]) -> None:
    """Print lines that never wrap: on a terminal what has no room is cut, elsewhere nothing is."""
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    for line in told:
        print(line if width is None or len(line) <= width else f"{line[: width - 3].rstrip()}...")


def _files(kind: str, folder: str) -> Iterator[Entry]:
    prefix = "tasks/" if kind == "tasks" else ""
    for name, path in sorted(resources.available(folder).items()):
        yield Entry(f"{prefix}{name}", _described(path), str(path))


def _described(path: Path) -> str:
    """What a file says of itself, without the whole of it being read as YAML."""
    try:
        head = _HEAD.search(path.read_text(encoding="utf-8") + "\n")
        found = parse_scalar(head[0]) if head else {}
    except (OSError, ValueError, ConfigError):
        return ""
    return _first(" ".join(str(next(iter(found.values()), "")).split())) if found else ""


def _classes(plugins: Plugins[Any]) -> Iterator[Entry]:
    offered = {entry.name: f"of {entry.value}" for entry in plugins.installed()}
    for name in plugins.known():
        yield Entry(name, _documented(plugins.shipped, name) or offered.get(name, ""))


def _documented(shipped: Mapping[str, Any], name: str) -> str:
    text = inspect.getdoc(shipped[name]) if name in shipped else None
    return _first(" ".join((text or "").partition("\n\n")[0].split()))


def _first(text: str) -> str:
    """The first sentence, in which initials are no end."""
    return re.split(r"(?<=[^A-Z\s][.?!])\s+(?=[A-Z])", text)[0]
