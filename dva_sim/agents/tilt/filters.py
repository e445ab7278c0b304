"""Filters between the accelerometer and the command: one class each, shipped or a user's.

All take samples one by one and return a value on request. A filter knows only the mean time
between samples: no clock, no random numbers.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from numbers import Real
from pathlib import Path
from typing import Any, Final

from typing_extensions import override

from dva_sim.agents.tilt.calibration import NEUTRAL, Reading
from dva_sim.kernel import options
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.plugins import FAILURES, Guard, Plugins, error_text

BATCH: Final = 20  # source: the document: slots of the dissertation's buffer
MAX_BATCH: Final = 1000  # design: samples of a batch


class Filter(ABC):
    """Base of all filters; derive from this to make another one.

    Args:
        period: Mean time between two samples [s].

    Attributes:
        batch: After so many fresh samples, 1 to 1000, or when the app's longest delay has passed,
            the value is taken, and stands until the next time; None: the value is of use at any
            time, and asking for it changes nothing.
        failures: Number of missing or invalid values; only users' filters have any.
        first_failure: First failure, in one line.
    """

    batch: int | None = None
    failures = 0
    first_failure = ""

    def __init__(self, period: float) -> None:
        self.period = period

    @abstractmethod
    def add(self, sample: Reading) -> None:
        """Take the next sample."""

    @abstractmethod
    def value(self) -> Reading:
        """Return the filtered value now; before the first sample, zero."""

    @property
    def age(self) -> float:
        """Mean age of the value's samples, in samples: 0 for the newest sample.

        It is by how many samples the value lags behind an input that rises steadily.
        """
        return 0.0


class BatchMedian(Filter):
    """The dissertation's filter: the median over a buffer of which only a part is fresh.

    When the time runs out before the buffer is full, the slots not yet refreshed keep what
    they held: with few fresh samples the median of a sorted copy stays frozen at the old
    values, and sorting in place (the fresh samples then overwrite the smallest) ratchets up.

    Its age is that of an input that rises steadily, taken through the same slots. With f fresh
    samples of n slots, more than half of them, the stale slots are lowest and shift the middle to
    (n - 1) / 2 samples behind the newest, whatever f is; a buffer of f slots alone would be
    (f - 1) / 2 behind. The value then stands for f samples, (f - 1) / 2 on average when one
    comes. At 34 samples per second and a longest delay of 0.5 s (f = 17) the mean age of what
    stands is therefore (8 + 8) / 34 = 0.471 s for 17 slots, all fresh, and (9.5 + 8) / 34 =
    0.515 s for 20; averaged over time, not over samples, each is half a sample (15 ms) more.
    Where half or less is fresh, the median is frozen, and its age grows without end.

    Args:
        period: Mean time between two samples [s].
        slots: Size of the buffer.
        in_place: Sort the buffer itself rather than a copy of it.
    """

    batch = BATCH

    def __init__(self, period: float, slots: int = BATCH, in_place: bool = False) -> None:
        super().__init__(period)
        self._slots = slots
        self._in_place = in_place
        self._filled = 0
        self._taken = 0
        self._age = 0.0
        self._speed = [0.0] * slots
        self._turn = [0.0] * slots
        self._rise = [0.0] * slots

    @override
    def add(self, sample: Reading) -> None:
        self._taken += 1
        if self._filled < self._slots:
            self._speed[self._filled], self._turn[self._filled] = sample
            self._rise[self._filled] = self._taken
            self._filled += 1

    def value(self) -> Reading:
        """Return the median of the buffer; the next batch begins."""
        self._filled = 0
        if self._in_place:
            self._speed.sort()
            self._turn.sort()
            self._rise.sort()
        self._age = self._taken - median(self._rise)
        return median(self._speed), median(self._turn)

    @property
    @override
    def age(self) -> float:
        return self._age


class InPlaceMedian(BatchMedian):
    """The dissertation's median, with the buffer itself sorted."""

    def __init__(self, period: float) -> None:
        super().__init__(period, in_place=True)


class CopyMedian(BatchMedian):
    """The dissertation's median, with a copy of the buffer sorted."""

    def __init__(self, period: float) -> None:
        super().__init__(period)


class MovingMedian(Filter):
    """The median of the newest samples: the mended filter.

    Args:
        period: Mean time between two samples [s].
        window: Number of samples in the window.
    """

    def __init__(self, period: float, window: int = 5) -> None:
        super().__init__(period)
        options.whole_number("window", window, 1, 1000)
        self._speed: deque[float] = deque(maxlen=window)
        self._turn: deque[float] = deque(maxlen=window)

    @override
    def add(self, sample: Reading) -> None:
        self._speed.append(sample[0])
        self._turn.append(sample[1])

    @override
    def value(self) -> Reading:
        if not self._speed:
            return NEUTRAL
        return median(self._speed), median(self._turn)

    @property
    @override
    def age(self) -> float:
        return 0.5 * (len(self._speed) - 1) if self._speed else 0.0


class OnePole(Filter):
    """A first-order low-pass filter: older samples count less and less.

    Args:
        period: Mean time between two samples [s].
        time_constant_s: Time constant [s]: the mean age of its value, the wait for the next sample
            included.
    """

    def __init__(self, period: float, time_constant_s: float = 0.1) -> None:
        super().__init__(period)
        options.number("time_constant_s", time_constant_s, above=0, most=60)
        self._keep = math.exp(-period / time_constant_s)
        self._speed = self._turn = 0.0
        self._begun = False

    @override
    def add(self, sample: Reading) -> None:
        keep = self._keep if self._begun else 0.0
        self._begun = True
        self._speed = sample[0] + (self._speed - sample[0]) * keep
        self._turn = sample[1] + (self._turn - sample[1]) * keep

    @override
    def value(self) -> Reading:
        return self._speed, self._turn

    @property
    @override
    def age(self) -> float:
        # The sum of k keep^k (1 - keep) over all k from 0 on.
        return self._keep / (1.0 - self._keep)


class NoFilter(Filter):
    """The newest sample, unfiltered."""

    def __init__(self, period: float) -> None:
        super().__init__(period)
        self._sample = NEUTRAL

    @override
    def add(self, sample: Reading) -> None:
        self._sample = sample

    @override
    def value(self) -> Reading:
        return self._sample


def median(values: Iterable[float]) -> float:
    """Return the median of a short list; `sorted` is many times faster than `numpy.median`."""
    ordered = sorted(values)
    count = len(ordered)
    middle = count >> 1
    if count & 1:
        return ordered[middle]
    return 0.5 * (ordered[middle - 1] + ordered[middle])


FILTERS: Final[dict[str, Callable[..., Filter]]] = {
    "median20-copy": CopyMedian,
    "median20-inplace": InPlaceMedian,
    "median": MovingMedian,
    "one_pole": OnePole,
    "none": NoFilter,
}


def _usable(filter_: Filter) -> Filter:
    """Return a user's filter, if a phone can work with it."""
    check_filter(filter_)
    return filter_


PLUGINS: Final = Plugins(
    "filter",
    Filter,  # type: ignore[type-abstract]
    FILTERS,
    folder="agents/filters",
    group="dva_sim.filters",
    key="phone.filter",
    needs="add(sample)",
    public="dva_sim.agents.tilt.Filter",
    finish=_usable,
)


known_filters = PLUGINS.known


def load_filter(
    name: str | Callable[..., Filter],
    options: Mapping[str, Any] | None = None,
    base: Path | None = None,
) -> Callable[[float], Filter]:
    """Return a factory for a named filter; it takes the mean time between samples [s].

    Arguments as of `Plugins.load`.

    Raises:
        ConfigError: as `Plugins.load`; a bad `batch` or `age` of a user's is reported when it is
            made.
    """
    return PLUGINS.load(name, options, base)


def load_guarded_filter(
    name: str, chosen: Mapping[str, Any] | None = None
) -> Callable[[float], Filter]:
    """Return `load_filter`'s factory, with a user's filter limited to valid commands.

    Raises:
        ConfigError: as `load_filter`.
    """
    make = load_filter(name, chosen)
    return make if name in FILTERS else lambda period: GuardedFilter(make(period), period)


def check_filter(filter_: Filter) -> None:
    """Refuse a filter with which a phone could not work.

    Raises:
        ConfigError: its `batch` is neither None nor from 1 to 1000, or its `age` is invalid.
    """
    batch = filter_.batch
    age = filter_.age
    if batch is not None and not (type(batch) is int and 1 <= batch <= MAX_BATCH):
        valid = f"None or a whole number, 1 to {MAX_BATCH}"
        raise ConfigError(f"its batch is {batch!r}; should be {valid}")
    if not is_age(age):
        raise ConfigError(f"its age is {age!r}; should be a number of samples, at least 0")


def is_age(age: object) -> bool:
    """Return True for a valid age: a finite number, at least 0."""
    return isinstance(age, Real) and 0.0 <= float(age) < math.inf


class GuardedFilter(Guard, Filter):
    """A filter of a user; where it gives no answer, the reading is that of a phone at rest.

    Its value after a sample that it did not take does not count either: it would be an old one.

    Args:
        filter_: The user's own.
        period: Mean time between two samples [s].

    Raises:
        ConfigError: a phone cannot work with it.
    """

    def __init__(self, filter_: Filter, period: float) -> None:
        check_filter(filter_)
        super().__init__(period)
        self._filter = filter_
        self.batch = filter_.batch
        self._took = True

    @override
    def add(self, sample: Reading) -> None:
        try:
            self._filter.add(sample)
            self._took = True
        except FAILURES as error:
            self._took = False
            self._count(error_text(error))

    @override
    def value(self) -> Reading:
        return (self._answer(self._filter.value) if self._took else None) or NEUTRAL

    @property
    @override
    def age(self) -> float:
        try:
            age = self._filter.age
            if is_age(age):
                return float(age)
            self._count(f"is {age!r} samples old")
        except FAILURES as error:
            self._count(error_text(error))
        return 0.0
