"""The table of how much persons differ from each other, and from themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.run_grid import Floats
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import number, percent
from dva_sim.simulation.labels import factor_name, level_name
from dva_sim.statistics import Components, components

if TYPE_CHECKING:
    pass


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
    """Standard deviations in the measure's unit, and the share between persons."""
    deviations: Floats = np.sqrt([found.between, found.within])
    return [*(number(float(x)) for x in deviations), percent(found.share)]
