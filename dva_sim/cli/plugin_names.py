"""What users may add to the program: kinds of plug-ins, what is installed, and how one is named."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from dva_sim.agents.operator.strategies.loading import PLUGINS as OPERATORS
from dva_sim.agents.tilt.filters import PLUGINS as FILTERS
from dva_sim.agents.tilt.mappings import PLUGINS as MAPPINGS
from dva_sim.core.dispatch.loading import PLUGINS as POLICIES
from dva_sim.kernel.plugins import Plugins
from dva_sim.worlds.drives import PLUGINS as DRIVES

KINDS: Final[dict[str, Plugins[Any]]] = {
    "policies": POLICIES,
    "operators": OPERATORS,
    "filters": FILTERS,
    "mappings": MAPPINGS,
    "drives": DRIVES,
}
"""Kinds of plug-ins by what several are called."""


def as_json() -> dict[str, Any]:
    """Each kind with its key, its group of entry points, its class, and what there is of it."""
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
        for several, plugins in KINDS.items()
    }


def lines() -> Iterator[str]:
    """The same for people."""
    for number, (several, plugins) in enumerate(KINDS.items()):
        yield f"{chr(10) if number else ''}{several}"
        for title, told in _facts(plugins):
            yield f"  {title:<13} {told}"


def _facts(plugins: Plugins[Any]) -> Iterator[tuple[str, str]]:
    yield "key", _key(plugins)
    yield "a file", f"{plugins.key}: mine.py:Mine, looked for beside the configuration, here, "
    yield "", f"and in {plugins.folder}"
    yield "entry points", f"{plugins.group}, for installed packages"
    yield "class", f"derived from {plugins.public}, with {plugins.needs}"
    yield "try it", f"dva-sim check {_checked(plugins)} mine.py:Mine"
    yield "shipped", ", ".join(sorted(plugins.shipped.keys() - plugins.hidden))
    told = [f"{entry.name} ({_package(entry)})" for entry in plugins.installed()]
    yield "installed", ", ".join(told) or "none"
    yield "files there", ", ".join(_near(path) for path in plugins.files()) or "none"


def _key(plugins: Plugins[Any]) -> str:
    return f"{plugins.key} of {'a robot profile' if '.' not in plugins.key else 'a scenario'}"


def _checked(plugins: Plugins[Any]) -> str:
    return "robot" if plugins is DRIVES else plugins.kind


def _package(entry: Any) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.value


def _near(path: Path) -> str:
    """A path as one would write it here."""
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)
