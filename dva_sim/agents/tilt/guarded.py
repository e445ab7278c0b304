"""Filters and mappings of users, kept within what can be sent whatever they answer."""

from __future__ import annotations

from dva_sim.agents.tilt.filters import Filter, Sample, check_filter, is_age
from dva_sim.agents.tilt.mappings import Mapping, Pair, limited
from dva_sim.kernel.plugins import FAILURES, Guard, said

STAND: Pair = (0.0, 0.0)


class GuardedFilter(Guard, Filter):
    """A filter of a user; where it gives no answer, the reading is that of a phone at rest.

    What it says after a sample that it did not take is no answer, either: it would be an old one.

    Args:
        filter_: The user's own.
        period: Mean time between two samples [s].

    Raises:
        ConfigError: no phone could work with it.
    """

    def __init__(self, filter_: Filter, period: float) -> None:
        check_filter(filter_)
        super().__init__(period)
        self._filter, self.batch = filter_, filter_.batch
        self._took = True

    def add(self, sample: Sample) -> None:
        """See `Filter`."""
        try:
            self._filter.add(sample)
            self._took = True
        except FAILURES as error:
            self._took = False
            self._count(said(error))

    def value(self) -> Sample:
        """See `Filter`."""
        return (self._answer(self._filter.value) if self._took else None) or STAND

    @property
    def age(self) -> float:
        """See `Filter`; what is no age is none."""
        try:
            age = self._filter.age
            if is_age(age):
                return float(age)
            self._count(f"is {age!r} samples old")
        except FAILURES as error:
            self._count(said(error))
        return 0.0


class GuardedMapping(Guard, Mapping):
    """A mapping of a user; where it gives no answer, the command is to stand."""

    def __init__(self, mapping: Mapping) -> None:
        self._mapping = mapping
        self.integrates = bool(mapping.integrates)

    def begin(self) -> None:
        """See `Mapping`; failures are counted by drives."""
        self.failures, self.first_failure = 0, ""
        try:
            self._mapping.begin()
        except FAILURES as error:
            self._count(said(error))

    def command(self, level: float, turn: float, dt: float) -> Pair:
        """See `Mapping`; within the limits."""
        return limited(*(self._answer(self._mapping.command, level, turn, dt) or STAND))

    def tilt_for(self, wanted: Pair, shown: Pair, within: float) -> Pair:
        """See `Mapping`; the hand holds the phone at rest where it is told nothing."""
        return self._answer(self._mapping.tilt_for, wanted, shown, within) or STAND
