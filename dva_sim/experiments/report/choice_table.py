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

NEVER = "never"
WORST = "worst of these"


def choice_table(found: ChoiceMap, part: str) -> CellTable:
    """Return the best choices in each situation, and what each other one costs beyond them.

    A row is a situation, or a choice where those are more.
    """
    text = note("map", **facts_of(found))
    heads, labels, rows = _by_choice(found) if found.is_tall else _by_situation(found)
    return CellTable(part, heads, labels, rows, note=text)


_Lines = tuple[list[str], int, list[list[str]]]


def _by_situation(found: ChoiceMap) -> _Lines:
    """Return heads, how many of them are labels, and a row for each situation."""
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
    return heads, 2, rows


def _by_choice(found: ChoiceMap) -> _Lines:
    """Return Heads, how many of them are labels, and a row for each choice.

    Assumptions stand below.
    """
    situations = range(len(found.given.levels))
    names = [situation_name(found, g) for g in situations]
    rows = [
        [
            level_name(found.choice.name, level),
            *(regret_text(found, g, c) for g in situations),
            overall_text(found, c),
        ]
        for c, level in enumerate(found.choice.levels)
    ]
    if found.notes:
        notes = [found.notes.get(str(level), "") for level in found.given.levels]
        rows.append(["by assumption", *notes, ""])
    return [factor_name(found.choice.name), *names, WORST], 1, rows


def beside_table(found: ChoiceMap, part: str) -> CellTable:
    """Return a row for each situation and choice.

    The loss itself, and what else a drive is like.
    """
    heads = [
        factor_name(found.given.name),
        factor_name(found.choice.name),
        f"median [{found.unit}]" if found.unit else "median",
        f"behind at most [{found.unit}]" if found.unit else "behind at most",
        "contacts",
        "in safe stop [%]",
        *(["move and wait [%]"] if found.waiting is not None else []),
    ]
    rows = []
    for g, c in np.ndindex(found.is_worse.shape):
        stops = 100.0 * found.beside["stop_share"][g, c]
        cells = [found.beside["contacts"][g, c], stops]
        waits = [] if found.waiting is None else [regret_number(100.0 * float(found.waiting[g, c]))]
        choice = level_name(found.choice.name, found.choice.levels[c], short=True)
        is_lost = found.never[g, c].any() and not found.is_lost[g]
        losses = (
            _range(found.median[g, c]),
            regret_number(math.inf if is_lost else max(0.0, float(found.high[g, c].max()))),
        )
        rows.append([situation_name(found, g), choice, *losses, *map(_range, cells), *waits])
    return CellTable(part, heads, 2, rows, note=note("beside", **facts_of(found)))


def facts_of(found: ChoiceMap) -> dict[str, Any]:
    """Return facts about a map for captions and notes."""
    return {
        "unit": found.unit or "no unit",
        "models": len(found.models.levels),
        "levels": found.over,
        "is_beyond": found.is_beyond,
        "is_marked": bool(found.outside.any()) and not found.is_beyond,
        "line": "column" if found.is_tall else "row",
        "smallest": quantity(found.smallest, found.unit) if found.smallest else "",
        "has_waiting": found.waiting is not None,
        "cut_off": quantity(found.most, found.unit) if found.never.any() else "",
        "never": NEVER,
    }


def _range(values: Floats) -> str:
    """Return `39 to 103`, from the least to the greatest."""
    ends = (regret_number(float(edge)) for edge in (values.min(), values.max()))
    return " to ".join(dict.fromkeys(ends))


def regret_text(found: ChoiceMap, situation: int, choice: int) -> str:
    """Return `3 to 69`, over the models of persons.

    `=`: as good as any; `0.0 to 9 ?`: too few drives to tell.
    """
    if found.never[situation, choice].all():
        return NEVER
    if found.is_best[situation, choice]:
        return "="
    low = found.least[situation, choice]
    high = found.worst[situation, choice]
    is_open = not found.is_worse[situation, choice]
    return f"{_range(np.array([low, high]))}{' ?' if is_open else ''}"


def overall_text(found: ChoiceMap, choice: int) -> str:
    """Return the most that a choice costs beyond the best one, in any situation."""
    return regret_number(float(found.overall[choice]))


def situation_name(found: ChoiceMap, situation: int) -> str:
    """Return a situation, marked if it, unlike others, is beyond what people were watched at."""
    name = level_name(found.given.name, found.given.levels[situation])
    is_marked = found.outside[situation].any() and not found.is_beyond
    return f"{name} †" if is_marked else name


def lead_of(found: ChoiceMap) -> str:
    """Say whether one choice is best everywhere, and which has the least regret."""
    names = [level_name(found.choice.name, level) for level in found.choice.levels]
    settled = found.is_best[~found.is_lost].T
    marked = found.outside.reshape(len(found.given.levels), -1).any(axis=1)
    outside = [level_name(found.given.name, found.given.levels[g]) for g in np.flatnonzero(marked)]
    where = "" if found.is_beyond or not outside else f" on {listing(outside)}"
    hardest = found.worst.argmax(axis=0)  # where each choice is farthest behind the best one
    return sentence(
        "map",
        found=found,
        choice=factor_name(found.choice.name),
        given=factor_name(found.given.name),
        models=len(found.models.levels),
        levels=found.over,
        beyond=f", extrapolated{where}" if outside else "",
        best=[name for name, good in zip(names, settled, strict=True) if good.all()],
        count=len(names),
        is_hopeless=np.isinf(found.overall).all(),
        ranked=[
            (
                names[c],
                _cost(found, c),
                level_name(found.given.name, found.given.levels[hardest[c]]),
            )
            for c in np.argsort(found.overall, kind="stable").tolist()
        ],
    )


def _cost(found: ChoiceMap, choice: int) -> str:
    """Return `14.6 s`: the most that a choice costs beyond the best one."""
    worst = float(found.overall[choice])
    return f"{NEVER} finishes" if math.isinf(worst) else quantity(worst, found.unit)


def _best(found: ChoiceMap, situation: int) -> str:
    if found.is_lost[situation]:
        return NEVER
    best = found.best_of(situation)
    if len(best) == len(found.choice.levels):
        is_settled = found.is_best[situation].all()
        return "nothing differs" if is_settled else "nothing is shown to differ"
    return listing([level_name(found.choice.name, level, short=True) for level in best])


def regret_number(value: float) -> str:
    """Format a regret, which has room for no more; infinite if another finishes runs alone."""
    if not math.isfinite(value):
        return NEVER if math.isinf(value) else "–"
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"
