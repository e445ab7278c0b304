"""The table of how much persons differ from each other, and from themselves."""

from __future__ import annotations

import numpy as np

from dva_sim.experiments.cells import CellTable
from dva_sim.experiments.effects import Floats, View
from dva_sim.experiments.labels import factor_name, level_name, number, percent, unit_of
from dva_sim.experiments.statistics import Components, components

_FEWEST = 2


def spread_table(view: View) -> CellTable | None:
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


def _stop_name(view: View, stop: int) -> str:
    return level_name(view.over.name, view.stops[stop]) if view.over else ""


def _printed(found: Components) -> list[str]:
    """As standard deviations, which have the measure's own unit."""
    deviations: Floats = np.sqrt([found.between, found.within])
    return [*(number(float(x)) for x in deviations), percent(found.share)]
