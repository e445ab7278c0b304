"""What a run's numbers depend on besides its configuration: the program and what users edit."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path

import dva_sim
from dva_sim import resources

# Reports may change without making old runs stale; what measures and simulates may not.
_CODE = (
    "agents",
    "core",
    "network",
    "protocol",
    "scenario",
    "simulation",
    "tasks",
    "timed",
    "worlds",
    "clock.py",
    "recorder.py",
    "streams.py",
    "experiments/budget.py",
    "experiments/dispatch/bounds.py",
    "experiments/dispatch/measures.py",
    "experiments/dispatch/outcomes.py",
    "experiments/episode.py",
    "experiments/metrics.py",
    "experiments/models.py",
    "experiments/transports",
    "experiments/workload.py",
)
# What says whether a hypothesis held: a registration fixes it, other results may be judged anew.
_JUDGES = (
    "experiments/contrasts.py",
    "experiments/effects.py",
    "experiments/reading.py",
    "experiments/statistics",
)
_EDITED = ("agents", "protocol", "worlds")
_SUFFIXES = {".yaml", ".geojson", ".xsd", ".pgm", ".png", ".py"}


def fingerprint() -> str:
    """64 bits over the simulating code and every profile, site and schema within reach."""
    return _hash_of((*_code(_CODE), *_edited()))


def fingerprint_of_judges() -> str:
    """64 bits over the code that comes from tables of runs to verdicts."""
    return _hash_of(_code(_JUDGES))


def _hash_of(files: Iterable[tuple[str, Path]]) -> str:
    total = hashlib.sha256()
    for name, path in files:
        total.update(name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()[:16]


def _code(parts: Iterable[str]) -> Iterator[tuple[str, Path]]:
    package = Path(dva_sim.__file__).parent
    for part in parts:
        start = package / part
        for path in sorted(start.rglob("*.py")) if start.is_dir() else [start]:
            yield path.relative_to(package).as_posix(), path


def _edited() -> Iterator[tuple[str, Path]]:
    """Each name once, from the nearest folder that has it, as it would be found."""
    seen: dict[str, Path] = {}
    for root in resources.roots():
        for folder in _EDITED:
            for path in sorted((root / folder).rglob("*")):
                if path.suffix in _SUFFIXES and path.is_file():
                    seen.setdefault(path.relative_to(root).as_posix(), path)
    yield from sorted(seen.items())
