"""The map of a study as a table and in sentences: which choice is best in which situation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dva_sim.experiments.analysis.choice_map import ChoiceMap
from dva_sim.experiments.analysis.run_grid import Floats
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note, sentence
from dva_sim.kernel.wording import listing, quantity
from dva_sim.simulation.labels import factor_name, level_name

NEVER_TEXT = "never"
WORST = "worst of these"


def choice_table(choice_map: ChoiceMap, part: str) -> CellTable:
    """Return the best choices in each situation, and the additional cost of the others.

    A row is a situation, or a choice where those are more.
    """
    text = note("map", **facts_of(choice_map))
    heads, labels, rows = (
        _by_choice(choice_map) if choice_map.is_tall else _by_situation(choice_map)
    )
    return CellTable(part, heads, labels, rows, note=text)


_Lines = tuple[list[str], int, list[list[str]]]


def _by_situation(choice_map: ChoiceMap) -> _Lines:
    """Return heads, how many of them are labels, and a row for each situation."""
    choices = choice_map.choice.levels
    heads = [
        factor_name(choice_map.given.name),
        "best",
        *(level_name(choice_map.choice.name, level, short=True) for level in choices),
        *(["by assumption"] if choice_map.notes else []),
    ]
    rows = []
    for g, situation in enumerate(choice_map.given.levels):
        name = situation_name(choice_map, g)
        cells = [regret_text(choice_map, g, c) for c in range(len(choices))]
        notes = [choice_map.notes.get(str(situation), "")] if choice_map.notes else []
        rows.append([name, _best(choice_map, g), *cells, *notes])
    return heads, 2, rows


def _by_choice(choice_map: ChoiceMap) -> _Lines:
    """Return Heads, how many of them are labels, and a row for each choice.

    Assumptions stand below.
    """
    situations = range(len(choice_map.given.levels))
    names = [situation_name(choice_map, g) for g in situations]
    rows = [
        [
            level_name(choice_map.choice.name, level),
            *(regret_text(choice_map, g, c) for g in situations),
            overall_text(choice_map, c),
        ]
        for c, level in enumerate(choice_map.choice.levels)
    ]
    if choice_map.notes:
        notes = [choice_map.notes.get(str(level), "") for level in choice_map.given.levels]
        rows.append(["by assumption", *notes, ""])
    return [factor_name(choice_map.choice.name), *names, WORST], 1, rows


def beside_table(choice_map: ChoiceMap, part: str) -> CellTable:
    """Return a row for each situation and choice.

    It has the loss, and the other measures of a drive.
    """
    heads = [
        factor_name(choice_map.given.name),
        factor_name(choice_map.choice.name),
        f"median [{choice_map.unit}]" if choice_map.unit else "median",
        f"behind at most [{choice_map.unit}]" if choice_map.unit else "behind at most",
        "contacts",
        "in safe stop [%]",
        *(["move and wait [%]"] if choice_map.waiting is not None else []),
    ]
    rows = []
    for g, c in np.ndindex(choice_map.is_worse.shape):
        stops = 100.0 * choice_map.beside["stop_share"][g, c]
        cells = [choice_map.beside["contacts"][g, c], stops]
        waits = (
            []
            if choice_map.waiting is None
            else [regret_number(100.0 * float(choice_map.waiting[g, c]))]
        )
        choice = level_name(choice_map.choice.name, choice_map.choice.levels[c], short=True)
        is_lost = choice_map.never[g, c].any() and not choice_map.is_lost[g]
        losses = (
            _range(choice_map.median[g, c]),
            regret_number(math.inf if is_lost else max(0.0, float(choice_map.high[g, c].max()))),
        )
        rows.append([situation_name(choice_map, g), choice, *losses, *map(_range, cells), *waits])
    return CellTable(part, heads, 2, rows, note=note("beside", **facts_of(choice_map)))


def facts_of(choice_map: ChoiceMap) -> dict[str, Any]:
    """Return facts about a map for captions and notes."""
    return {
        "unit": choice_map.unit or "no unit",
        "models": len(choice_map.models.levels),
        "levels": choice_map.over,
        "is_beyond": choice_map.is_beyond,
        "is_marked": bool(choice_map.outside.any()) and not choice_map.is_beyond,
        "line": "column" if choice_map.is_tall else "row",
        "smallest": quantity(choice_map.smallest, choice_map.unit) if choice_map.smallest else "",
        "has_waiting": choice_map.waiting is not None,
        "cut_off": quantity(choice_map.most, choice_map.unit) if choice_map.never.any() else "",
        "never": NEVER_TEXT,
    }


def _range(values: Floats) -> str:
    """Return `39 to 103`, from the least to the greatest."""
    ends = (regret_number(float(edge)) for edge in (values.min(), values.max()))
    return " to ".join(dict.fromkeys(ends))


def regret_text(choice_map: ChoiceMap, situation: int, choice: int) -> str:
    """Return `3 to 69`, over the models of persons.

    `=`: as good as any; `0.0 to 9 ?`: too few drives to tell.
    """
    if choice_map.never[situation, choice].all():
        return NEVER_TEXT
    if choice_map.is_best[situation, choice]:
        return "="
    low = choice_map.least[situation, choice]
    high = choice_map.worst[situation, choice]
    is_open = not choice_map.is_worse[situation, choice]
    return f"{_range(np.array([low, high]))}{' ?' if is_open else ''}"


def overall_text(choice_map: ChoiceMap, choice: int) -> str:
    """Return the most that a choice costs beyond the best one, in any situation."""
    return regret_number(float(choice_map.overall[choice]))


def situation_name(choice_map: ChoiceMap, situation: int) -> str:
    """Return a situation, marked if it, unlike others, is beyond what people were watched at."""
    name = level_name(choice_map.given.name, choice_map.given.levels[situation])
    is_marked = choice_map.outside[situation].any() and not choice_map.is_beyond
    return f"{name} †" if is_marked else name


def lead_of(choice_map: ChoiceMap) -> str:
    """Say whether one choice is best everywhere, and which has the least regret."""
    names = [level_name(choice_map.choice.name, level) for level in choice_map.choice.levels]
    settled = choice_map.is_best[~choice_map.is_lost].T
    marked = choice_map.outside.reshape(len(choice_map.given.levels), -1).any(axis=1)
    outside = [
        level_name(choice_map.given.name, choice_map.given.levels[g])
        for g in np.flatnonzero(marked)
    ]
    where = "" if choice_map.is_beyond or not outside else f" on {listing(outside)}"
    hardest = choice_map.worst.argmax(axis=0)  # where each choice is farthest behind the best one
    return sentence(
        "map",
        found=choice_map,
        choice=factor_name(choice_map.choice.name),
        given=factor_name(choice_map.given.name),
        models=len(choice_map.models.levels),
        levels=choice_map.over,
        beyond=f", extrapolated{where}" if outside else "",
        best=[name for name, good in zip(names, settled, strict=True) if good.all()],
        count=len(names),
        is_hopeless=np.isinf(choice_map.overall).all(),
        ranked=[
            (
                names[c],
                _cost(choice_map, c),
                level_name(choice_map.given.name, choice_map.given.levels[hardest[c]]),
            )
            for c in np.argsort(choice_map.overall, kind="stable").tolist()
        ],
    )


def _cost(choice_map: ChoiceMap, choice: int) -> str:
    """Return `14.6 s`: the most that a choice costs beyond the best one."""
    worst = float(choice_map.overall[choice])
    return f"{NEVER_TEXT} finishes" if math.isinf(worst) else quantity(worst, choice_map.unit)


def _best(choice_map: ChoiceMap, situation: int) -> str:
    if choice_map.is_lost[situation]:
        return NEVER_TEXT
    best = choice_map.best_of(situation)
    if len(best) == len(choice_map.choice.levels):
        is_settled = choice_map.is_best[situation].all()
        return "nothing differs" if is_settled else "nothing is shown to differ"
    return listing([level_name(choice_map.choice.name, level, short=True) for level in best])


def regret_number(value: float) -> str:
    """Format a regret, which has room for no more; infinite if another finishes runs alone."""
    if not math.isfinite(value):
        return NEVER_TEXT if math.isinf(value) else "–"
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"
