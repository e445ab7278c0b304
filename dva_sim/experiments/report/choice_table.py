"""The map of a study as a table and in sentences: which choice is best in which situation."""

from __future__ import annotations

import numpy as np

from dva_sim.experiments.analysis.choice_map import ChoiceMap
from dva_sim.experiments.analysis.run_grid import Floats
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note
from dva_sim.kernel.wording import listing, quantity
from dva_sim.simulation.labels import factor_name, level_name

NEVER = "never done"


def choice_table(found: ChoiceMap, part: str) -> CellTable:
    """A row for each situation: the best choices, and what each other one costs beyond them."""
    choices = found.choice.levels
    heads = [
        factor_name(found.given.name),
        "best",
        *(level_name(found.choice.name, level, short=True) for level in choices),
        *(["by assumption"] if found.notes else []),
    ]
    rows = []
    for g, situation in enumerate(found.given.levels):
        name = situation_name(found, g)
        cells = [regret_text(found, g, c) for c in range(len(choices))]
        notes = [found.notes.get(str(situation), "")] if found.notes else []
        rows.append([name, _best(found, g), *cells, *notes])
    text = note("map", found=found)
    return CellTable(part, heads, 2, rows, note=text)


def beside_table(found: ChoiceMap, part: str) -> CellTable:
    """A row for each situation and choice: the loss itself, and what else a drive is like."""
    heads = [
        factor_name(found.given.name),
        factor_name(found.choice.name),
        f"median [{found.unit}]" if found.unit else "median",
        "contacts",
        "in safe stop [%]",
        *(["move and wait [%]"] if found.waiting is not None else []),
    ]
    rows = []
    for g, c in np.ndindex(found.is_worse.shape):
        stops = 100.0 * found.beside["stop_share"][g, c]
        cells = [found.median[g, c], found.beside["contacts"][g, c], stops]
        waits = [] if found.waiting is None else [regret_number(100.0 * float(found.waiting[g, c]))]
        choice = level_name(found.choice.name, found.choice.levels[c], short=True)
        rows.append([situation_name(found, g), choice, *map(_range, cells), *waits])
    return CellTable(part, heads, 2, rows, note=note("beside", found=found))


def _range(values: Floats) -> str:
    """`39 to 103`, from the least to the greatest."""
    ends = (regret_number(float(edge)) for edge in (values.min(), values.max()))
    return " to ".join(dict.fromkeys(ends))


def regret_text(found: ChoiceMap, situation: int, choice: int) -> str:
    """`3 to 69`, over the models of persons; `=` where it is as good as the best."""
    if not found.is_worse[situation, choice]:
        return "="
    if found.never[situation, choice]:
        return NEVER
    low, high = found.least[situation, choice], found.worst[situation, choice]
    return _range(np.array([low, high]))


def situation_name(found: ChoiceMap, situation: int) -> str:
    """A situation, marked if it, unlike others, is beyond what people were watched at."""
    name = level_name(found.given.name, found.given.levels[situation])
    is_marked = found.outside[situation].any() and not found.is_beyond
    return f"{name} †" if is_marked else name


def lead_of(found: ChoiceMap) -> str:
    """Say whether one choice is best everywhere, and which has the least regret."""
    names = [level_name(found.choice.name, level) for level in found.choice.levels]
    best = [name for name, worse in zip(names, found.is_worse.T, strict=True) if not worse.any()]
    given = factor_name(found.given.name)
    if len(best) == len(names):
        return f"Nothing differs by more than matters, on any {given} tried."
    if best:
        return f"On every {given} tried, none is better than {listing(best)}."
    order = np.argsort(found.overall, kind="stable").tolist()
    costs = [f"{names[c]} {_cost(found, c)}" for c in order]
    return (
        f"Nothing is best on every {given} tried. The most that each costs beyond the best one, "
        f"for the same {given} and persons: {'; '.join(costs)}."
    )


def _cost(found: ChoiceMap, choice: int) -> str:
    """`14.6 s, slow robot`."""
    where = int(np.argmax(found.clear_worst[:, choice]))
    is_never = found.never[where, choice]
    cost = NEVER if is_never else quantity(float(found.overall[choice]), found.unit)
    return f"{cost}, {level_name(found.given.name, found.given.levels[where])}"


def _best(found: ChoiceMap, situation: int) -> str:
    best = found.best_of(situation)
    if len(best) == len(found.choice.levels):
        return "nothing differs"
    return listing([level_name(found.choice.name, level, short=True) for level in best])


def regret_number(value: float) -> str:
    """Format a regret, which has room for no more."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"
