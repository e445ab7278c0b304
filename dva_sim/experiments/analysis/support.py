"""Cells beyond the delays at which people were studied: extrapolations.

People who move and wait were watched at long delays, people who steer by what they see at short
ones. A cell in which a loop is closed at a delay that nobody was watched at is an extrapolation,
whatever is known of waiting there, and the other way round.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.operator.published import ranges, supports_of
from dva_sim.experiments.analysis.conditions import get
from dva_sim.experiments.analysis.run_grid import Floats, RunGrid, nan_mean
from dva_sim.experiments.study.parts import STRATEGY

LOOP = "loop_delay_mean_s"


PERSONAL = ("delay_human_s", "delay_hand_s")
LEGS = ("picture_age_mean_s", "age_in_force_mean_s")  # of a loop that is not measured as a whole
WAITING = "move_and_wait_share"
SELDOM = 0.05  # a way of steering that takes less of the driving time does not count


Marks = NDArray[np.bool_]


@dataclass(frozen=True)
class Support:
    """The delays of a part's cells, and which of them no published data cover.

    Attributes:
        delays: Delay of the loop without the person, by cell `(levels of factor 1, ...)` [s]; nan
            where nobody drives.
        outside: True for delays that are not covered.
        words: Description of the range covered, for each strategy.
    """

    delays: Floats
    outside: Marks
    words: str


def support_of_part(part: RunGrid, scenario: Mapping[str, Any]) -> Support | None:
    """Coverage of a part by published data; None if no control loop has a delay.

    Args:
        part: The runs.
        scenario: The part's before any factor changed it, for the strategy.
    """
    strategies = _strategies(part, scenario)
    runs = _loop_delays(part)
    if runs is None or not strategies:
        return None
    of_cells = runs.reshape(*runs.shape[:-2], -1)
    delays = np.where(np.isinf(of_cells).any(axis=-1), math.inf, nan_mean(of_cells, axis=-1))
    own = str(get(scenario, STRATEGY))
    waits = _waiting(part, own, delays)
    outside = ~np.isnan(delays)
    for name in strategies:
        covered = np.full(delays.shape, bool(ranges(name)))
        for steering, share in (("closed", 1.0 - waits), ("waiting", waits)):
            covered &= (share <= SELDOM) | _watched(delays, ranges(name, steering))
        outside &= ~(_has(part, name, own) & covered)
    return Support(delays, outside, "; ".join(map(_coverage, strategies)))


def _loop_delays(part: RunGrid) -> Floats | None:
    """Delay of each run's loop without the person [s]; None where no part of it is measured.

    Nan where nobody drives; infinite where no command or no picture arrives.
    """
    if part.has(LOOP):
        return part.grid(LOOP) - sum(np.nan_to_num(part.grid(column)) for column in PERSONAL)
    if all(map(part.has, LEGS)):
        legs = sum((part.grid(leg) for leg in LEGS), start=np.zeros(1))
        return np.where(np.isnan(legs), math.inf, legs)
    return None


def _waiting(part: RunGrid, own: str, delays: Floats) -> Floats:
    """Share of the driving time that each cell's persons moved and waited.

    Where it is not measured, only persons of the strategy `move_and_wait` count as waiting. That
    marks too many cells rather than too few.
    """
    if part.has(WAITING):
        shares = part.grid(WAITING)
        return np.nan_to_num(nan_mean(shares.reshape(*shares.shape[:-2], -1), axis=-1))
    return np.where(_has(part, "move_and_wait", own), 1.0, np.zeros(delays.shape))


def _watched(delays: Floats, known: Sequence[tuple[float, float]]) -> Marks:
    """Mark the delays that lie within any of the ranges."""
    watched = np.zeros(delays.shape, dtype=bool)
    for low, high in known:
        watched |= (delays >= low) & (delays <= high)
    return watched


def _strategies(part: RunGrid, scenario: Mapping[str, Any]) -> tuple[str, ...]:
    levels = {f.name: f.levels for f in part.factors}
    names = levels.get(STRATEGY, (get(scenario, STRATEGY),))
    return tuple(str(name) for name in names if name is not None)


def _has(part: RunGrid, strategy: str, own: str) -> Marks:
    """Mark the cells driven by a strategy; `own` is that of cells that set none."""
    has = [setting.get(STRATEGY, own) == strategy for setting in part.settings()]
    return np.array(has).reshape([len(f.levels) for f in part.factors])


def _coverage(strategy: str) -> str:
    lines = [
        f"{known.low_s:g} to {known.high_s:g} s, {' '.join(known.why.split())}"
        for known in supports_of(strategy)
    ]
    return f"{strategy}: {', and '.join(lines) or 'no published data'}"
