"""All that can be named: files that users edit, and classes that they may add to the program.

`dva-sim list` and `dva-sim plugins` print it, for people or as JSON. Only the modules of the kinds
that are listed are loaded.
"""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import hint
from dva_sim.kernel.yaml_files import parse_scalar
from dva_sim.testing.promises import TRIALS, CheckedKind

if TYPE_CHECKING:
    from dva_sim.kernel.plugins import Plugins


def kinds_of_plugins() -> dict[str, tuple[str, Plugins[Any]]]:
    """Return kinds of plug-ins by what several are called, each with the word for trying one."""
    return {trial.classes: (word, trial.load_plugins()) for word, trial in TRIALS.items()}


def plugins_as_json() -> dict[str, Any]:
    """Return each kind with its key, group of entry points, class, and what there is of it."""
    return {
        several: {
            "key": plugins.key,
            "entry_points": plugins.group,
            "class": plugins.public,
            "method": plugins.needs,
            "shipped": sorted(plugins.shipped.keys() - plugins.hidden),
            "installed": [
                {"name": entry.name, "value": entry.value, "package": _package(entry)}
                for entry in plugins.installed()
            ],
            "files": [str(path) for path in plugins.files()],
        }
        for several, (_, plugins) in kinds_of_plugins().items()
    }


def plugin_lines() -> Iterator[str]:
    """Yield the plug-ins as lines for people."""
    for number, (several, (word, plugins)) in enumerate(kinds_of_plugins().items()):
        yield f"{chr(10) if number else ''}{several}"
        for title, entry in _facts(word, plugins):
            yield f"  {title:<13} {entry}"


def _facts(word: str, plugins: Plugins[Any]) -> Iterator[tuple[str, str]]:
    yield "key", key_of(plugins)
    yield (
        "a file",
        f"{plugins.key}: {named_as(plugins)}, looked for beside the configuration, here, ",
    )
    yield "", f"and in {plugins.folder}"
    yield "entry points", f"{plugins.group}, for installed packages"
    yield "class", f"derived from {plugins.public}, with {plugins.needs}"
    yield "try it", f"dva-sim check {word} mine.py:Mine"
    yield "shipped", ", ".join(sorted(plugins.shipped.keys() - plugins.hidden))
    texts = [f"{entry.name} ({_package(entry)})" for entry in plugins.installed()]
    yield "installed", ", ".join(texts) or "none"
    yield "files there", ", ".join(_near_path(path) for path in plugins.files()) or "none"


def key_of(plugins: Plugins[Any]) -> str:
    """Return the key that names a plug-in of a kind, and the file that has the key."""
    where = {"drive": "a robot profile", "measure": "a study, a list"}
    return f"{plugins.key} of {where.get(plugins.kind, 'a scenario')}"


def named_as(plugins: Plugins[Any]) -> str:
    """Return how a configuration writes the name of a user's plug-in."""
    return "[mine.py:Mine]" if plugins.kind == "measure" else "mine.py:Mine"


def _package(entry: Any) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.value


def _near_path(path: Path) -> str:
    """Return a path as one would write it here."""
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)


_HEAD = re.compile(r"^(?:description|question):.*\n(?:[ \t]+.*\n|[ \t]*\n)*", re.MULTILINE)

FILES: Final = {
    "studies": "experiments",
    "scenarios": "experiments/scenarios",
    "tasks": "experiments/scenarios/tasks",
    "sites": "worlds",
    "robots": "agents/robots",
    "ros": "agents/ros",
    "phones": "agents/phones",
    "accelerometers": "agents/accelerometers",
    "people": "agents/people",
}
"""Kinds of files by what several are called, and the folder of each."""


@dataclass(frozen=True)
class NamedThing:
    """One thing that can be named.

    Attributes:
        name: Name as one writes it.
        description: Description in a line; may be empty.
        file: File of the thing, if it is one.
    """

    name: str
    description: str = ""
    file: str | None = None


def kinds() -> list[str]:
    """Return what can be listed, in the order of the list."""
    return [*FILES, *(trial.classes for trial in TRIALS.values())]


def everything(kind: str | None = None) -> dict[str, list[NamedThing]]:
    """Return all that can be named, by kind.

    Args:
        kind: Only this one, such as `studies`.

    Raises:
        ConfigError: there is no such kind.
    """
    makers: dict[str, Any] = {name: _files(name, folder) for name, folder in FILES.items()}
    makers |= {trial.classes: _find_plugins(trial) for trial in TRIALS.values()}
    if kind is not None and kind not in makers:
        raise ConfigError(f"there is no list of {kind!r}; {hint(kind, makers, 'there are')}")
    return {name: list(made) for name, made in makers.items() if kind in (None, name)}


def as_json(kind: str | None = None) -> dict[str, Any]:
    """Return the list as JSON: for each kind a list of `name`, `description` and `file`."""
    return {name: [vars(entry) for entry in entries] for name, entries in everything(kind).items()}


def lines(kind: str | None = None) -> Iterator[str]:
    """Yield the list for people: a line for each name."""
    for number, (title, entries) in enumerate(everything(kind).items()):
        yield f"{chr(10) if number else ''}{title}"
        width = max((len(entry.name) for entry in entries), default=0)
        for entry in entries:
            yield f"  {entry.name:<{width}}  {entry.description}".rstrip()


def tell(texts: Iterable[str]) -> None:
    """Print lines without wrapping: cut to the width of a terminal, else whole."""
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    for line in texts:
        print(line if width is None or len(line) <= width else f"{line[: width - 3].rstrip()}...")


def _files(kind: str, folder: str) -> Iterator[NamedThing]:
    prefix = "tasks/" if kind == "tasks" else ""
    for name, path in sorted(resources.available(folder).items()):
        yield NamedThing(f"{prefix}{name}", _described(path), str(path))


def _described(path: Path) -> str:
    """Return a file's description, without parsing all of it as YAML."""
    try:
        head = _HEAD.search(path.read_text(encoding="utf-8") + "\n")
        fields = parse_scalar(head[0]) if head else {}
    except (OSError, ValueError, ConfigError):
        return ""
    return _first(" ".join(str(next(iter(fields.values()), "")).split())) if fields else ""


@cache
def _installed() -> Any:
    """Read what all installed packages offer; reading it for each kind takes as long each time."""
    return entry_points()


def _find_plugins(trial: CheckedKind) -> Iterator[NamedThing]:
    """Yield the shipped and installed classes; an installed one is loaded only when it is used."""
    values = {entry.name: f"of {entry.value}" for entry in _installed().select(group=trial.group)}
    for name, words in trial.words().items():
        values[name] = _first(words) or values.get(name, "")
    for name, description in sorted(values.items()):
        yield NamedThing(name, description)


_ABBREVIATED: Final = re.compile(
    r"\b([A-Z]|al|cf|doi|ed|ff|no|pp|vol|Conf|Fig|Int|J|Proc|Symp|Trans)\.$"
)


def _first(text: str) -> str:
    """Return the first sentence, which no initial and no abbreviation ends."""
    for end in re.finditer(r"[.?!](?=\s+[A-Z])", text):
        if not _ABBREVIATED.search(text[: end.end()]):
            return text[: end.end()]
    return text
