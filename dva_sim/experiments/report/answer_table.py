"""The answer level by level: both sides and their difference, in numbers.

How large a study was as it was run, and whether that is its usual size.

The table of how much persons differ from each other, and from themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.analysis.run_grid import Floats, nan_mean, person_means
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.study.parts import POINT
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import number, percent
from dva_sim.simulation.labels import factor_name, level_name
from dva_sim.statistics import Components, components

if TYPE_CHECKING:
    from dva_sim.experiments.analysis.answer import Finding
    from dva_sim.experiments.report.summary import Reading


def answer_table(reading: Reading) -> CellTable | None:
    """A row for each level that the answer runs over; None where it has no contrast."""
    view, finding = reading.view, reading.told
    if view is None or finding is None or not finding.over:
        return None
    first, second = (_means(view, level) for level in (finding.first, finding.second))
    rows = [
        [level_name(finding.over, level), number(a), number(b), difference]
        for level, a, b, difference in zip(
            finding.levels, first, second, _differences(finding), strict=True
        )
    ]
    unit = f" [{finding.unit}]" if finding.unit else ""
    sides = [f"{level_name(finding.factor, x)}{unit}" for x in (finding.first, finding.second)]
    heads = [factor_name(finding.over), *sides, f"difference (95 % band){unit}"]
    return CellTable(finding.part, heads, 1, rows)


def _means(view: StudyView, level: object) -> Floats:
    """Over persons, at each stop."""
    curve = view.curve(view.values, view.panels[0], level)  # type: ignore[arg-type]
    return nan_mean(person_means(curve), axis=0)


def _differences(finding: Finding) -> list[str]:
    """`7.6 (2.1 to 13.1)`."""
    return [
        f"{number(mean)} ({number(low)} to {number(high)})" if np.isfinite(low) else number(mean)
        for mean, low, high in zip(finding.mean, finding.low, finding.high, strict=True)
    ]


def size_of(reading: Reading) -> str:
    """`A smaller version of X: 4 persons × 2 trials, 440 runs ... The whole study has ...`."""
    usual = reading.manifest.get("usual") or {}
    return f"{_version(reading, usual)}{_as_run(reading)}.{_whole(reading, usual)}"


def _as_run(reading: Reading) -> str:
    study, cells = reading.study, len(reading.manifest.get("cells", []))
    if reading.by_people:
        return f"1 run in real time, in which people drove, seed {study.get('seed')}"
    persons = _people(reading.persons, study.get("replications"), reading.cluster)
    configurations = f" in {cells:,} configurations" if cells else ""
    runs = sum(
        reading.results.table(name).rows
        for name in ("runs", "robustness")
        if reading.results.has(name)
    )
    return f"{persons}, {runs:,} runs{configurations}, seed {study.get('seed')}"


def _people(persons: int, trials: int | None, cluster: str) -> str:
    counted = f"{persons} {cluster}{'' if persons == 1 else 's'}"
    return (
        counted if cluster == "shift" else f"{counted} × {trials} trial{'' if trials == 1 else 's'}"
    )


def _version(reading: Reading, usual: Mapping[str, Any]) -> str:
    """Which version of which study."""
    if not usual:
        return ""
    name, weight = usual["name"], _weight(reading.study) / _weight(usual)
    if weight == 1:
        return f"Study {name}: "
    return f"A {'smaller' if weight < 1 else 'larger'} version of {name}: "


def _weight(size: Mapping[str, Any]) -> float:
    """How many runs of one part that is."""
    count = float(size.get("persons") or 1) * float(size.get("replications") or 1)
    for levels in (size.get("factors") or {}).values():
        count *= len(levels)
    return count


def _whole(reading: Reading, usual: Mapping[str, Any]) -> str:
    """What the study as its file says has that this one has otherwise."""
    if not usual or _weight(reading.study) == _weight(usual):
        return ""
    persons = _people(usual["persons"], usual["replications"], reading.cluster)
    return f" Its usual size: {', '.join([persons, *_levels(reading.study, usual)])}."


def _levels(study: Mapping[str, Any], usual: Mapping[str, Any]) -> list[str]:
    """Of which factors it has more or fewer levels."""
    here = study.get("factors") or {}
    return [
        f"{len(levels)} levels of {factor_name(name)} (here {len(here.get(name, ()))})"
        for name, levels in (usual.get("factors") or {}).items()
        if name != POINT and len(levels) != len(here.get(name, ()))
    ]


_FEWEST = 2


def spread_table(view: StudyView) -> CellTable | None:
    """Spread between and within persons, in the panel that the answer speaks of."""
    if view.contrast is None or view.line is None or len(view.part.trials) < _FEWEST:
        return None
    panel, values = view.panels[0], view.values
    first, second = (view.curve(values, panel, level) for level in view.contrast)
    names = [level_name(view.line.name, level) for level in view.contrast]
    kinds = [(names[0], first), (names[1], second), (f"{names[0]} − {names[1]}", first - second)]
    rows = [
        [_stop_name(view, stop), name, *_printed(components(curve[stop]))]
        for stop in range(len(view.stops))
        for name, curve in kinds
    ]
    unit = f" [{unit_of(view.measure)}]" if unit_of(view.measure) else ""
    over = factor_name(view.over.name) if view.over else ""
    heads = [over, "of", f"between persons{unit}", f"within a person{unit}", "share between"]
    return CellTable(view.part.name, heads, 2, rows)


def _stop_name(view: StudyView, stop: int) -> str:
    return level_name(view.over.name, view.stops[stop]) if view.over else ""


def _printed(found: Components) -> list[str]:
    """As standard deviations, which have the measure's own unit."""
    deviations: Floats = np.sqrt([found.between, found.within])
    return [*(number(float(x)) for x in deviations), percent(found.share)]
