"""Declared contrast as measured, and the answer that follows from it."""

from __future__ import annotations

from dataclasses import dataclass, field
from textwrap import wrap

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.units import unit_of

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Missed:
    """Runs without confirmation under one level, at the hardest condition."""

    level: Level
    missed: int
    runs: int

    @property
    def share(self) -> float:
        """Missed runs as a share of all runs."""
        return self.missed / self.runs if self.runs else float("nan")


@dataclass(frozen=True)
class OtherRuns:
    """The contrast in other runs than the answer's, at the stop the answer leads with.

    Attributes:
        low: Least lower edge of their intervals.
        high: Greatest upper edge.
        means: Least and greatest mean.
        count: Number of settings or of models.
        turns: True if the opposite of the answer is shown in some of them.
    """

    low: float
    high: float
    means: tuple[float, float]
    count: int
    turns: bool


@dataclass(frozen=True)
class Finding:
    """A declared contrast as measured: all that the sentences are made from.

    Attributes:
        measure: Column compared; in excess of the reference if `in_excess`.
        factor: Factor whose levels `first` and `second` are compared.
        over: Factor along which the difference is followed, with its `levels` `(k,)`.
        within: Levels of the other factors.
        mean: First minus second, at each level `(k,)`; nan without pairs.
        low: Lower edge of the simultaneous 95 % band `(k,)`; nan if none can be given.
        high: Its upper edge `(k,)`.
        persons: Number of persons (clusters) behind the band.
        smallest_effect: Smallest difference declared to matter, in the measure's unit.
        usual: Median of the measure itself under the second level `(k,)`: what the difference is
            held against where none was declared to matter.
        missed: Runs without confirmation at the last level, per level of `factor`.
        horizon: Value that such a run counts with [s], if the same for all.
        cluster: Unit of resampling: person or shift.
        widest: The greatest difference that is possible; a band of that size says nothing.
        all_confirmed: True if no run of any cell was missed.
        everywhere: Place of a contrast that has no x axis.
        failed: Runs that are missing because they failed.
        part: Part of the study that was looked at.
        outside: Stops at which a side is extrapolated, beyond the delays people were watched at.
        models: Difference under other models of the persons; None if no other was tried.
        elsewhere: Difference in the other settings that were run; None without others.
        only_model: The one model of the persons that was tried; empty if several were, or where
            nobody drives.
        useful: Sides, each with the count up to which more are shown to help; see `useful_counts`.
    """

    measure: str
    in_excess: bool
    factor: str
    first: Level
    second: Level
    over: str
    levels: tuple[Level, ...]
    within: dict[str, Level]
    mean: Floats
    low: Floats
    high: Floats
    persons: int
    smallest_effect: float | None = None
    usual: Floats | None = None
    missed: tuple[Missed, ...] = ()
    horizon: float | None = None
    cluster: str = "person"
    widest: float = np.inf
    all_confirmed: bool = False
    everywhere: str = ""
    failed: int = 0
    part: str = ""
    outside: tuple[int, ...] = ()
    models: OtherRuns | None = None
    elsewhere: OtherRuns | None = None
    only_model: str = ""
    useful: tuple[tuple[Level, Level], ...] = ()

    @property
    def unit(self) -> str:
        """Unit of the measure."""
        return unit_of(self.measure)

    @property
    def differs(self) -> NDArray[np.bool_]:
        """Stops where the band excludes zero `(k,)`."""
        return np.asarray((self.low > 0) | (self.high < 0))

    @property
    def holds_zero(self) -> NDArray[np.bool_]:
        """Stops where the band includes zero `(k,)`."""
        return np.asarray((self.low <= 0) & (self.high >= 0))

    @property
    def bounds(self) -> Floats:
        """The largest effect, either way, that is not ruled out `(k,)`."""
        return np.asarray(np.maximum(-self.low, self.high))

    @property
    def is_open(self) -> NDArray[np.bool_]:
        """Stops where the band includes both zero and a difference that matters `(k,)`.

        Those that matter were declared to; else they are as large as the measure usually is.
        """
        least = np.inf if self.usual is None else np.where(self.usual > 0, self.usual, np.inf)
        return np.asarray(self.holds_zero & (self.bounds > (self.smallest_effect or least)))

    @property
    def has_too_few(self) -> bool:
        """Return True if nothing is found, and somewhere nothing that matters is ruled out."""
        return bool(not self.differs.any() and self.is_open.any())


def too_few(persons: int, cluster: str = "person") -> str:
    """Return `too few persons (4) to tell`."""
    return f"too few {cluster}s ({persons}) to tell"


@dataclass(frozen=True)
class Answer:
    """A study's answer: its main sentence, conditions and notes.

    Attributes:
        lead: The answer: the first sentence says it, the others where it holds.
        depends: Conditions of the answer, by subject: `Persons`, `Measured` ...
        notes: Other findings, and facts needed to read it fairly.
    """

    lead: str
    depends: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def __repr__(self) -> str:
        """Return the answer in lines, and how much more there is to know."""
        lines = wrap(self.lead, 100)
        more = f"notes: {len(self.notes)}" if self.notes else ""
        return "\n".join([*lines, more] if more else lines)
