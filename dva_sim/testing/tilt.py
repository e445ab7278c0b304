"""Checks of the filters and mappings of a tilt phone, on made-up readings."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

import numpy as np

from dva_sim.agents.tilt import Filter, Mapping, filters, load_filter, load_mapping
from dva_sim.agents.tilt.calibration import LEVELS, MAX_TURN_DEG
from dva_sim.agents.tilt.filters import is_age
from dva_sim.testing.promises import Case, Outcome, broken_in, is_slow, kept, part_by_part

Pair = tuple[float, float]
Part = Callable[[], Iterator[Case]]

PERIOD: Final = 1 / 34  # interval between samples [s]
LONG: Final = 20_000  # samples of ten minutes, after which earlier ones are forgotten
RUNS: Final = 40  # runs of random readings
SAMPLES: Final = 120  # samples of such a run
SLOW: Final = 20e-6  # time of a reading above which an episode is slow [s]
HAND: Final = (19.0, 57.0)  # largest readings that a hand can reach by tilting, at 45 degrees
CLOSE_WITHIN_S: Final = 0.9  # time in which a gap on the display has to be closed [s]
REACHED_SHARE: Final = 0.02  # difference that counts as reached, as a share of the full range
HOSTILE: Final = (0.0, 1e-300, -1e-300, 1e3, -1e3, 1e9, -1e9)


def check_filter(
    filter_: str | Callable[..., Filter],
    options: dict[str, Any] | None = None,
    *,
    slow: float = SLOW,
) -> Outcome:
    """See that a filter keeps what all promise.

    It is tried sample by sample; one that works in batches, batch by batch.

    Args:
        filter_: Name, as a phone names it, or its class.
        options: Keyword arguments of its constructor, besides the time between samples.
        slow: A sample that takes longer earns a warning [s].

    Raises:
        BrokenPromises: it does not; a line for each promise.
        ConfigError: there is none of that name, or no phone could work with it.
    """
    make = load_filter(filter_, options)
    filters.check_filter(make(PERIOD))
    trial = _FilterTrial(lambda: make(PERIOD), np.random.default_rng(1))
    return _concluded(trial.parts, trial.sticks, trial.took, slow)


def check_mapping(
    mapping: str | Callable[..., Mapping],
    options: dict[str, Any] | None = None,
    *,
    slow: float = SLOW,
) -> Outcome:
    """See that a mapping keeps what all promise, by itself and with a hand that steers.

    See `check_filter`.

    Raises:
        BrokenPromises: it does not; a line for each promise.
        ConfigError: there is none of that name, or it cannot be made with these options.
    """
    make = load_mapping(mapping, options)
    make()
    trial = _MappingTrial(make, np.random.default_rng(1))
    return _concluded(trial.parts, lambda: iter(()), trial.took, slow)


def _concluded(
    parts: Sequence[Part], doubts: Callable[[], Iterator[str]], took: list[float], slow: float
) -> Outcome:
    """Return the outcome of all parts, up to the first that is broken."""
    broken = broken_in(part_by_part(parts))
    slowest = min(took, default=0.0)
    warnings = [] if broken else list(doubts())
    return kept(broken, warnings + is_slow(slowest, slow, "a reading"), RUNS, slowest)


class _FilterTrial:
    """All that is tried with one filter.

    Attributes:
        took: Mean time of a sample, for each run [s].
    """

    def __init__(self, make: Callable[[], Filter], rng: np.random.Generator) -> None:
        self.make = make
        self.rng = rng
        self.took = list[float]()
        self.parts: tuple[Part, ...] = (
            self._begins, self._bounds, self._copies, self._constant, self._ages
        )  # fmt: skip

    def _values(self, filter_: Filter, samples: Sequence[Pair]) -> list[Pair]:
        """Return the value at each moment at which one is taken."""
        every = filter_.batch or 1
        values = []
        for number, sample in enumerate(samples, 1):
            filter_.add(sample)
            if number % every == 0:
                values.append(filter_.value())
        return values

    def _samples(self, count: int = SAMPLES) -> list[Pair]:
        level = self.rng.uniform(-2, 12, count)
        turn = self.rng.uniform(-40, 40, count)
        return list(zip(level.tolist(), turn.tolist(), strict=True))

    def _begins(self) -> Iterator[Case]:
        value = self.make().value()
        if value != (0.0, 0.0):
            yield "is not zero before the first sample", _pair_text(value)

    def _bounds(self) -> Iterator[Case]:
        """Yield values that are not finite, or lie beyond the samples and zero."""
        hostile = [(one, other) for one in HOSTILE for other in HOSTILE]
        for number in range(RUNS):
            samples = self._samples() if number else hostile
            started = time.perf_counter()
            values = self._values(self.make(), samples)
            self.took.append((time.perf_counter() - started) / len(samples))
            for axis in (0, 1):
                low = min(0.0, *(sample[axis] for sample in samples))
                high = max(0.0, *(sample[axis] for sample in samples))
                slack = 1e-9 * max(-low, high)
                for value in values:
                    if not math.isfinite(value[axis]):
                        yield (
                            "answers what is no number",
                            f"{_pair_text(value)} in run {number + 1}",
                        )
                    elif not low - slack <= value[axis] <= high + slack:
                        yield (
                            "leaves the range of its input",
                            f"{_pair_text(value)} in run {number + 1}",
                        )

    def _copies(self) -> Iterator[Case]:
        """Check that copies give the same values independently, and that reading has no effect."""
        samples = self._samples()
        odd_samples = self._samples()
        alone = self._values(self.make(), samples)
        one = self.make()
        disturbing = self.make()
        beside = []
        for number, (sample, odd) in enumerate(zip(samples, odd_samples, strict=True), 1):
            one.add(sample)
            disturbing.add(odd)
            if number % (one.batch or 1) == 0:
                disturbing.value()
                beside.append(one.value())
                if one.batch is None and one.value() != beside[-1]:
                    yield "changes when it is asked, though it has no batch", f"sample {number}"
        if alone != beside:
            index = next(n for n, (a, b) in enumerate(zip(alone, beside, strict=True)) if a != b)
            yield "shares memory with other copies, or draws random numbers", f"value {index + 1}"

    def _constant(self) -> Iterator[Case]:
        """Check that a constant input comes through, regardless of the history."""
        for level, turn in ((7.0, -20.0), (0.0, 0.0), (3.0, 30.0)):
            filter_ = self.make()
            self._values(filter_, self._samples())
            value = self._values(filter_, [(level, turn)] * LONG)[-1]
            if not _near(value, (level, turn)):
                yield (
                    "does not come to what stands for ten minutes",
                    (f"{_pair_text(value)} for {_pair_text((level, turn))}"),
                )

    def _ages(self) -> Iterator[Case]:
        """Yield a rising input, from long before on, comes out as much later as the filter says."""
        filter_ = self.make()
        count = LONG - LONG % (filter_.batch or 1)  # so that the last sample ends a batch
        value = self._values(filter_, [(n / 100, -n / 100) for n in range(count)])[-1]
        newest = count - 1
        for lag in (newest - 100 * value[0], newest + 100 * value[1]):
            age = filter_.age
            if not (is_age(age) and abs(lag - age) <= 0.5):
                says = f"age says {age:.1f}" if is_age(age) else f"age is {age!r}"
                case = f"{lag:.1f} samples behind a rising input; {says}"
                yield "is not as old as it says", case

    def sticks(self) -> Iterator[str]:
        """Yield a doubt: batches that end early, as when the longest delay of the app is short."""
        batch = self.make().batch
        if batch is None:
            return
        for fresh in (batch // 3, batch // 2):
            filter_ = self.make()
            value = (0.0, 0.0)
            for level in (2.0, 8.0, 2.0):
                for _ in range(10):
                    for _ in range(fresh):
                        filter_.add((level, 0.0))
                    value = filter_.value()
            if not _near(value, (2.0, 0.0)):
                yield f"sticks where only {fresh} of {batch} samples are fresh: {value[0]:g} for 2"
                return


class _MappingTrial:
    """All that is tried with one mapping.

    Attributes:
        took: Mean time of a reading, for each run [s].
    """

    def __init__(self, make: Callable[[], Mapping], rng: np.random.Generator) -> None:
        self.make = make
        self.rng = rng
        self.took = list[float]()
        self.parts: tuple[Part, ...] = (
            self._limits, self._copies, self._steps, self._rest, self._way, self._tilts,
            self._steered,
        )  # fmt: skip

    def _readings(self, count: int = SAMPLES) -> list[Pair]:
        level = self.rng.uniform(-5, 15, count)
        turn = self.rng.uniform(-50, 50, count)
        return list(zip(level.tolist(), turn.tolist(), strict=True))

    def _limits(self) -> Iterator[Case]:
        hostile = [(one, other) for one in HOSTILE for other in HOSTILE]
        for number in range(RUNS):
            mapping = self.make()
            readings = self._readings() if number else hostile
            started = time.perf_counter()
            commands = [mapping.command(*reading, PERIOD) for reading in readings]
            self.took.append((time.perf_counter() - started) / len(readings))
            for (level, turn), reading in zip(commands, readings, strict=True):
                case = f"{_pair_text((level, turn))} for {_pair_text(reading)}"
                if not (math.isfinite(level) and math.isfinite(turn)):
                    yield "answers what is no number", case
                elif not (0.0 <= level <= LEVELS and abs(turn) <= MAX_TURN_DEG):
                    yield "leaves the limits of a command", case

    def _copies(self) -> Iterator[Case]:
        """Check that copies and new drives start afresh, and that memory is declared."""
        readings = self._readings()
        one = self.make()
        other = self.make()
        alone = [one.command(*reading, PERIOD) for reading in readings]
        for reading in self._readings():
            other.command(*reading, PERIOD)
        fresh = self.make()
        if [fresh.command(*reading, PERIOD) for reading in readings] != alone:
            yield (
                "shares memory with other copies, or draws random numbers",
                "a new copy answers differently",
            )
        other.begin()
        if [other.command(*reading, PERIOD) for reading in readings] != alone:
            yield "remembers the drive before", "after begin() it answers differently"
        if not one.integrates:
            backwards = [one.command(*reading, PERIOD) for reading in reversed(readings)]
            if backwards[::-1] != alone:
                yield "depends on readings before, though it does not integrate", "in other order"

    def _steps(self) -> Iterator[Case]:
        """Check that a constant reading integrates to the same value for any step."""
        if not self.make().integrates:
            return
        for share in (1.0, 0.3, 0.1, 0.03):
            reading = (share * HAND[0], share * HAND[1])
            count = round(1.0 / PERIOD)
            whole = self.make()
            halves = self.make()
            for _ in range(count):
                single = whole.command(*reading, PERIOD)
                halves.command(*reading, PERIOD / 2)
                two = halves.command(*reading, PERIOD / 2)
            if not all(
                math.isclose(a, b, rel_tol=REACHED_SHARE) for a, b in zip(single, two, strict=True)
            ):
                case = f"{_pair_text(two)} after {2 * count} half steps, "
                yield (
                    "integrates by steps, not by time",
                    f"{case}{_pair_text(single)} after {count} whole",
                )

    def _rest(self) -> Iterator[Case]:
        """Yield cases of a phone at rest: it stands, or turns no faster than before."""
        for level, turn in ((8.0, 25.0), (3.0, -12.0), (0.0, 0.0)):
            mapping = self.make()
            for _ in range(50):
                _, last = mapping.command(level, turn, PERIOD)
            speed, rate = mapping.command(0.0, 0.0, PERIOD)
            for _ in range(200):
                last = rate
                speed, rate = mapping.command(0.0, 0.0, PERIOD)
                if abs(rate) > abs(last) + 1e-9:
                    yield "turns faster and faster at rest", f"after {_pair_text((level, turn))}"
                    break
            if speed != 0.0:
                yield "drives at rest", f"level {speed:g} after {_pair_text((level, turn))}"

    def _way(self) -> Iterator[Case]:
        """Yield the tilting to the left turns to the left, and more tilt no less.

        And so with speed.
        """
        before: Pair = 0.0, 0.0
        for share in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0):
            reading = share * HAND[0], share * HAND[1]
            mapping = self.make()
            mirror = self.make()
            for _ in range(10):
                now = mapping.command(*reading, PERIOD)
                _, turned = mirror.command(reading[0], -reading[1], PERIOD)
            if now[0] < before[0] - 1e-9 or now[1] < before[1] - 1e-9:
                yield "answers less to more tilt", f"{_pair_text(now)} for {_pair_text(reading)}"
            if abs(now[1] + turned) > 1e-9 * MAX_TURN_DEG:
                yield "turns left and right differently", f"for {_pair_text(reading)}"
            before = now

    def _tilts(self) -> Iterator[Case]:
        mapping = self.make()
        for command in ((-1.0, 0.0), (0.0, 30.0), (10.0, -30.0), (5.0, 0.0), (2.0, 1e-9)):
            for shown in ((0.0, 0.0), (10.0, 30.0), (4.0, -30.0)):
                reading = mapping.tilt_for(command, shown, CLOSE_WITHIN_S)
                if not all(map(math.isfinite, reading)):
                    yield "would tilt to what is no number", f"for {_pair_text(command)}"

    def _steered(self) -> Iterator[Case]:
        """Yield mistakes of `tilt_for`: its tilt should reach the wanted command, and keep it."""
        for command in ((-1.0, 0.0), (5.0, 20.0), (9.0, -25.0), (2.0, 3.0)):
            mapping = self.make()
            shown = (0.0, 0.0)
            shown = mapping.command(0.0, 0.0, PERIOD)
            for _ in range(round(20 * CLOSE_WITHIN_S / PERIOD)):
                level, turn = mapping.tilt_for(command, shown, CLOSE_WITHIN_S)
                shown = mapping.command(_cut(level, HAND[0]), _cut(turn, HAND[1]), PERIOD)
            if not _near(shown, (max(command[0], 0.0), command[1])):
                yield (
                    "does not get where tilt_for tilts to",
                    (f"{_pair_text(shown)} when {_pair_text(command)} is wanted"),
                )


def _near(one: Pair, other: Pair) -> bool:
    level = abs(one[0] - other[0]) / LEVELS
    turn = abs(one[1] - other[1]) / MAX_TURN_DEG
    return max(level, turn) < REACHED_SHARE


def _cut(value: float, most: float) -> float:
    return min(max(value, -most), most)


def _pair_text(pair: Pair) -> str:
    return f"level {pair[0]:.3g}, {pair[1]:.3g} deg/s"
