"""Number of robots per operator, predicted by theory from what a single robot needs.

A robot is neglected while it works by itself, and needs interaction before it can go on. With
one robot, neglect and interaction follow each other; with several, one person serves them in
turn. The **fan-out** is the number that keeps the person busy if none ever had to wait; a **queue
with a finite source** lets robots wait for each other, and takes both times as exponential.

References:
    D. R. Olsen, M. A. Goodrich: Metrics for evaluating human-robot interactions. PERMIS 2003.
    D. R. Olsen, S. B. Wood: Fan-out: measuring human control of multiple robots. CHI 2004.
    W. Feller: An Introduction to Probability Theory and Its Applications, vol. 1, 3rd ed., Wiley
    1968, XVII.7: servicing of machines.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.run_grid import Factor, RunGrid, Setting
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ConfigError

SETTLED = "confirmed", "refuted"

Floats = NDArray[np.float64]


class Need(NamedTuple):
    """Mean times that a single robot needs per event.

    Attributes:
        neglect: By itself [s].
        interaction: Operator's time per event [s].
    """

    neglect: float
    interaction: float

    @property
    def fan_out(self) -> float:
        """Number of robots that keep the operator busy."""
        return (self.neglect + self.interaction) / self.interaction

    def rate_without_waiting(self, robots: int) -> float:
        """Return events per second if no robot waits until the operator has no time left."""
        return min(robots, self.fan_out) / (self.neglect + self.interaction)

    def rate_with_waiting(self, robots: int) -> float:
        """Return events per second of a finite source of exponential times (M/M/1//N)."""
        ratio = self.interaction / self.neglect
        busier = [left * ratio for left in range(robots, 0, -1)]
        idle = 1.0 / sum(accumulate(busier, operator.mul, initial=1.0))
        return (1.0 - idle) / self.interaction


def settled_per_person(results: Results, part: str, where: Setting, since: float) -> Floats:
    """Return events settled per second from a time [s] on, for each person, shape `(persons,)`.

    The time before is left out: at the start every robot sets out, and nobody has anything to
    judge.

    Args:
        results: Results of a study of the full model.
        where: Levels of factors.
        since: Start of the time in which closed events count [s].
    """
    events, runs = (_rows(results.table(name), part, where) for name in ("events", "runs"))
    counts = np.isin(events["outcome"], SETTLED) & (events["t_closed_s"] >= since)
    persons = np.unique(runs["person"])
    settled = np.array([float(counts[events["person"] == p].sum()) for p in persons])
    lasted = np.array([(runs["simulated_s"] - since)[runs["person"] == p].sum() for p in persons])
    rates: Floats = settled / lasted
    return rates


def need_of(results: Results, part: str, where: Setting, since: float) -> Need:
    """Estimate the needs of a single robot from the runs with certain levels.

    Interaction is from the first sight of the place to the judgement. All else is neglect: also
    that the operator reads the order and the robot is started.

    Args:
        results: Results of a study of the full model.
        where: Levels of factors.
        since: Start of the time in which closed events count [s].

    Raises:
        ConfigError: no event was settled there.
    """
    events = _rows(results.table("events"), part, where)
    counts = np.isin(events["outcome"], SETTLED) & (events["t_closed_s"] >= since)
    if not counts.any():
        raise ConfigError(f"part {part!r} has no settled event where {where}")
    interaction = float(np.mean((events["t_closed_s"] - events["t_arrived_s"])[counts]))
    cycle = 1.0 / float(np.mean(settled_per_person(results, part, where, since)))
    return Need(cycle - interaction, interaction)


def _rows(table: Mapping[str, Any], part: str, where: Setting) -> dict[str, Any]:
    factors = [Factor(name, (level,)) for name, level in where.items()]
    return RunGrid(table, part, factors).rows_at(where)
