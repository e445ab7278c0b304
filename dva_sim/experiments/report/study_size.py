"""The size of a study as it was run, and whether that is its usual size."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dva_sim.experiments.study.parts import POINT
from dva_sim.simulation.labels import factor_name

if TYPE_CHECKING:
    from dva_sim.experiments.report.summary import Reading


def size_of(reading: Reading) -> str:
    """`A smaller version of X: 4 persons × 2 trials, 440 runs ... The whole study has ...`."""
    usual = reading.manifest.get("usual") or {}
    return f"{_version(reading, usual)}{_as_run(reading)}.{_whole(reading, usual)}"


def runs_of(reading: Reading) -> int:
    """Return the number of runs, with those under other models of the persons."""
    tables = (name for name in ("runs", "robustness") if reading.results.has(name))
    return sum(reading.results.table(name).rows for name in tables)


def _as_run(reading: Reading) -> str:
    study, cells = reading.study, len(reading.manifest.get("cells", []))
    if reading.by_people:
        return f"1 run in real time, in which people drove, seed {study.get('seed')}"
    persons = _people(reading.persons, study.get("replications"), reading.cluster)
    configurations = f" in {cells:,} configurations" if cells else ""
    return f"{persons}, {runs_of(reading):,} runs{configurations}, seed {study.get('seed')}"


def _people(persons: int, trials: int | None, cluster: str) -> str:
    counted = f"{persons} {cluster}{'' if persons == 1 else 's'}"
    if cluster != "person":
        return counted
    return f"{counted} × {trials} trial{'' if trials == 1 else 's'}"


def _version(reading: Reading, usual: Mapping[str, Any]) -> str:
    """Name of the study, and whether this is a smaller or larger version of it."""
    if not usual:
        return ""
    name, weight = usual["name"], _weight(reading.study) / _weight(usual)
    if weight == 1:
        return f"Study {name}: "
    return f"A {'smaller' if weight < 1 else 'larger'} version of {name}: "


def _weight(size: Mapping[str, Any]) -> float:
    """Number of runs in one part."""
    count = float(size.get("persons") or 1) * float(size.get("replications") or 1)
    for levels in (size.get("factors") or {}).values():
        count *= len(levels)
    return count


def _whole(reading: Reading, usual: Mapping[str, Any]) -> str:
    """Settings of the study's own file that this run changed."""
    if not usual or _weight(reading.study) == _weight(usual):
        return ""
    persons = _people(usual["persons"], usual["replications"], reading.cluster)
    return f" Its usual size: {', '.join([persons, *_levels(reading.study, usual)])}."


def _levels(study: Mapping[str, Any], usual: Mapping[str, Any]) -> list[str]:
    """Factors with more or fewer levels than in the study's file."""
    here = study.get("factors") or {}
    return [
        f"{len(levels)} levels of {factor_name(name)} (here {len(here.get(name, ()))})"
        for name, levels in (usual.get("factors") or {}).items()
        if name != POINT and len(levels) != len(here.get(name, ()))
    ]
