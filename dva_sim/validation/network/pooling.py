"""Many runs under loss: is the model's mean off by more than chance explains?

For each condition and measure, z is the difference of the means over its standard error; that
comes from how much the model's runs differ, scaled to the number of runs on sockets. The laws
without loss are exact to half a millisecond only, so that much is added to the error; where it
is more than chance, runs hardly differ, and the measure is judged as without loss.

What z are to be expected is not left to the normal law, since ages under loss are skewed and
the measures of a run go together: runs of the model itself take the place of the sockets' many
times over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dva_sim.network.pattern_runs import Condition
from dva_sim.statistics import holm
from dva_sim.validation.network.verdicts import (
    MEASURES,
    ComparedCell,
    ComparedMeasure,
    reason_against,
)

Floats = NDArray[np.float64]

EXACT_S = 0.0005  # the laws without loss hold to this
SIGNIFICANT = 0.05
MAX_BIAS = 0.05  # median over conditions
MAX_TAIL_BIAS = 0.10  # median over conditions, of the tails of ages
MIN_EVENTS = 5  # fewer time-outs or alerts than this, expected in all runs, tell nothing
MIN_CONDITIONS = 10  # fewer have no median to speak of
MIN_SHARE = 0.9  # minimum share of the model's runs in which a measure is defined
DRAWS = 1000


@dataclass(frozen=True)
class Scored:
    """One measure of one pooled condition.

    Attributes:
        cell: Measure and condition.
        z: Difference of the means in standard errors.
        error: The standard error.
        p: Two-sided, by the normal law.
    """

    cell: ComparedCell
    z: float
    error: float
    p: float


@dataclass(frozen=True)
class Pooled:
    """Result of all pooled conditions.

    Attributes:
        scored: Scores of each measure of each condition.
        significant: Those that are after Holm's correction for their number.
        rms: Root mean square of z.
        expected: The range in which 95 of 100 of them would lie if the model were right.
        false_alarms: Expected rate of significant results if the model were right.
        biases: Median over conditions of model / real - 1, by measure; of measures that enough
            conditions have.
    """

    scored: tuple[Scored, ...]
    significant: tuple[Scored, ...]
    rms: float
    expected: tuple[float, float]
    false_alarms: float
    biases: dict[ComparedMeasure, float]

    @property
    def biased(self) -> list[ComparedMeasure]:
        """The measures whose median bias is too large."""
        return [m for m, bias in self.biases.items() if not abs(bias) < bias_limit(m)]

    @property
    def spread_is_right(self) -> bool:
        """True if the root mean square lies in the expected range."""
        return self.expected[0] <= self.rms <= self.expected[1]

    @property
    def passes(self) -> bool:
        """True if all three criteria hold."""
        return not self.significant and self.spread_is_right and not self.biased


def bias_limit(measure: ComparedMeasure) -> float:
    """Return the largest acceptable median bias."""
    tail_of_age = measure.is_tail and measure.name.startswith(("age", "stale"))
    return MAX_TAIL_BIAS if tail_of_age else MAX_BIAS


def pool_variant(own: Pooled, variants: Sequence[ComparedCell]) -> Pooled:
    """Return a variant of the model, with the standard errors of the model itself.

    So it cannot gain or lose by how much its own runs differ.

    Args:
        own: Result of the full model.
        variants: Cells of the variant; those that the model is not judged by are left out.
    """
    cells = {(c.group.condition, c.measure): c for c in variants if len(c.predicted)}
    scored = []
    for each in own.scored:
        cell = cells.get((each.cell.group.condition, each.cell.measure))
        if cell is not None:
            scored.append(score(cell, each.error))
    return _judged(scored, own.expected, own.false_alarms)


def to_be_pooled(cells: Sequence[ComparedCell]) -> list[ComparedCell]:
    """Return the cells that may be judged, say something, and differ from run to run."""
    return [c for c in cells if not reason_against(c) and tells(c) and not is_steady(c)]


def pool(judged: Sequence[ComparedCell], rng: np.random.Generator) -> Pooled:
    """Judge cells of pooled conditions together.

    Args:
        judged: Cells to judge; see `to_be_pooled`.
        rng: Random generator of the runs that replace the sockets.
    """
    scored = [score(cell, standard_error(cell)) for cell in judged]
    null = null_scores(judged, rng)
    rms = np.sqrt((null**2).mean(axis=1)) if judged else np.zeros(1)
    low, high = np.percentile(rms, (2.5, 97.5))
    alarms = [bool((holm(two_sided(row)) <= SIGNIFICANT).any()) for row in null]
    return _judged(scored, (float(low), float(high)), float(np.mean(alarms)))


def _judged(scored: Sequence[Scored], expected: tuple[float, float], false_alarms: float) -> Pooled:
    significant = holm([s.p for s in scored]) <= SIGNIFICANT
    offs = {m: [s.cell.off for s in scored if s.cell.measure == m] for m in MEASURES}
    return Pooled(
        tuple(scored),
        tuple(s for s, is_significant in zip(scored, significant, strict=True) if is_significant),
        float(np.sqrt(np.mean([s.z**2 for s in scored]))) if scored else 0.0,
        expected,
        false_alarms,
        {m: float(np.median(own)) for m, own in offs.items() if len(own) >= MIN_CONDITIONS},
    )


def tells(cell: ComparedCell) -> bool:
    """Return True if a mean over runs is meaningful: nearly always defined, events not rare."""
    runs = len(cell.group.runs)
    if not len(cell.measured) or len(cell.predicted) < 2:
        return False
    if cell.measure.name in ("timeouts", "alerts"):
        return runs * max(cell.model, cell.real) >= MIN_EVENTS
    return len(cell.measured) >= MIN_SHARE * runs


def is_steady(cell: ComparedCell) -> bool:
    """Return True if runs differ by less than the model's resolution."""
    return tells(cell) and chance(cell) < resolution(cell)


def score(cell: ComparedCell, error: float) -> Scored:
    """Return z of one cell.

    Args:
        error: Standard error of the difference of means.
    """
    z = (cell.model - cell.real) / error
    return Scored(cell, z, error, float(two_sided(np.array([z]))[0]))


def standard_error(cell: ComparedCell) -> float:
    """Standard error of the difference of means, with chance on both sides and resolution."""
    return float(np.hypot(chance(cell), resolution(cell)))


def chance(cell: ComparedCell) -> float:
    """Return standard error of the difference of the means, by how much the model's runs differ."""
    spread = float(cell.predicted.std(ddof=1))
    return float(spread * np.sqrt(1 / len(cell.measured) + 1 / len(cell.predicted)))


def resolution(cell: ComparedCell) -> float:
    """Return the change of the measure if each command took half a millisecond longer."""
    measure = cell.measure
    condition = cell.group.condition
    if measure.is_time:
        return 1000.0 * EXACT_S
    if measure.name == "applied_hz":
        per_command = cell.real**2 * EXACT_S if condition.pattern == "req-rep" else 0.0
        return float(max(per_command, 1.0 / condition.dur_s / len(cell.group.runs)))
    if measure.name == "queue":
        return float(max(EXACT_S * condition.hz, 1e-6))
    if measure.name == "delivered":
        return 1.0 / (condition.hz * condition.dur_s * len(cell.group.runs))
    return 1.0 / len(cell.group.runs)


def null_scores(cells: Sequence[ComparedCell], rng: np.random.Generator) -> Floats:
    """Return z if runs of the model take the sockets' place, shape `(DRAWS, cells)`.

    A condition's measures are taken from the same runs, so that they go together as they do;
    the model's own mean is one of other runs, and what cannot be told apart is an offset.
    """
    draws: dict[Condition, tuple[NDArray[np.int64], NDArray[np.int64], Floats]] = {}
    columns = []
    for cell in cells:
        runs = len(cell.predicted)
        taken = len(cell.group.runs)
        own = draws.get(cell.group.condition)
        if own is None:
            picks = rng.integers(0, 1 << 30, size=(2, DRAWS, max(runs, taken)))
            own = draws[cell.group.condition] = picks[0], picks[1], rng.normal(size=DRAWS)
        sockets = cell.predicted[own[0][:, : len(cell.measured)] % runs].mean(axis=1)
        model = cell.predicted[own[1][:, :runs] % runs].mean(axis=1)
        columns.append((model - sockets + own[2] * resolution(cell)) / standard_error(cell))
    return np.column_stack(columns) if columns else np.zeros((1, 0))


def two_sided(z: Floats) -> Floats:
    """Return the probability of such a z or a larger one, by the normal law."""
    from scipy.special import ndtr

    return np.asarray(2.0 * ndtr(-np.abs(z)))
