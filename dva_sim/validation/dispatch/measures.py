"""Measures of a run, each a sum over a sum in every batch, by the names that cases use.

A name may be narrowed: `wait_s@urgent` to the events of one stream; `utilisation/guard` to a
group, `utilisation/operators` to those who drive robots; `workload/guard-1`,
`share/guard-1/urgent` and `wait_beyond/30` need what is behind the stroke. Words mean the same
as in the formulas: `served` events are those that somebody went to and settled; `delayed` is a
share of all but those turned away at once.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.simulation.shift.scenario import TimedScenario
from dva_sim.validation.dispatch.samples import Floats, Sample, occupied

Sums = tuple[Floats, Floats]  # tops and bottoms, one for each batch

OPERATORS = "operators"  # as if they were a group; each robot that is out has one
_ROUNDING = 1e-9  # a wait shorter than this is none [s]


class Batches:
    """A run cut into parts of equal length; an event belongs to the part it was detected in.

    Args:
        sample: The run.
        count: How many parts.
    """

    def __init__(self, sample: Sample, count: int) -> None:
        self.sample = sample
        self.edges = np.linspace(sample.begins, sample.ends, count + 1)
        self.lengths = np.diff(self.edges)
        place = np.searchsorted(self.edges, sample.detected, side="right") - 1
        last = sample.detected == sample.ends
        self.place = np.where(last, count - 1, place)
        self.inside = (self.place >= 0) & (self.place < count)

    def total(self, values: Floats, which: NDArray[np.bool_]) -> Floats:
        """Sum of a value over some events, in each batch."""
        chosen = which & self.inside
        sums = np.bincount(self.place[chosen], values[chosen], minlength=len(self.lengths))
        return np.asarray(sums, dtype=np.float64)

    def count(self, which: NDArray[np.bool_]) -> Floats:
        """How many events there are of some kind, in each batch."""
        return self.total(np.ones(len(which)), which)


Events = NDArray[np.bool_]


def sums(name: str, batches: Batches) -> Sums:
    """Tops and bottoms of a measure."""
    word, stroke, detail = name.partition("/")
    if stroke:
        return _DETAILED[word](batches, detail)
    word, at, stream = name.partition("@")
    sample = batches.sample
    among = np.ones(len(sample.stream), dtype=bool)
    if at:
        among = sample.stream == sample.streams.index(stream)
    if word in _TIMES:
        values, whose = _TIMES[word](sample)
        return batches.total(values, whose & among), batches.count(whose & among)
    if word in _SHARES:
        which, of = _SHARES[word](sample)
        return batches.count(which & of & among), batches.count(of & among)
    return _WHOLE[word](batches)


def check_name(name: str, scenario: TimedScenario) -> None:
    """Refuse the name of a measure that there is not, or not in this scenario.

    Raises:
        ConfigError: with what would be right.
    """
    word, stroke, detail = name.partition("/")
    if stroke:
        _known(word, list(_DETAILED), "measure")
        _check_detail(word, detail, scenario)
        return
    word, at, stream = name.partition("@")
    if at:
        _known(stream, scenario.stream_names, "stream")
        _known(word, [*_TIMES, *_SHARES], "measure of a stream")
    details = [f"{word}/..." for word in _DETAILED]
    if word not in {*_TIMES, *_SHARES, *_WHOLE}:
        _known(word, [*_TIMES, *_SHARES, *_WHOLE, *details], "measure")


def _check_detail(word: str, detail: str, scenario: TimedScenario) -> None:
    if word == "wait_beyond":
        try:
            float(detail)
        except ValueError:
            raise ConfigError(f"wait_beyond/{detail} should end in a number of seconds") from None
    elif word == "utilisation":
        _known(detail, [OPERATORS, *(group.name for group in scenario.responders)], "group")
    else:
        unit, _, stream = detail.partition("/")
        _known(unit, scenario.names, "responder")
        if word == "share":
            _known(stream, scenario.stream_names, "stream")


def _known(word: str, known: list[str], what: str) -> None:
    if word not in known:
        raise ConfigError(unknown(what, word, known))


# --- of each event ---------------------------------------------------------------------
def _between(first: str, second: str) -> Callable[[Sample], tuple[Floats, Events]]:
    """The time from one step to another, of the events served."""

    def values(sample: Sample) -> tuple[Floats, Events]:
        return getattr(sample, second) - getattr(sample, first), sample.served

    return values


def _wait_of_all(sample: Sample) -> tuple[Floats, Events]:
    """The wait for somebody, or until nobody was needed any more."""
    gone = np.where(np.isnan(sample.assigned), sample.closed, sample.assigned)
    return gone - sample.detected, np.ones(len(gone), dtype=bool)


_TIMES: dict[str, Callable[[Sample], tuple[Floats, Events]]] = {
    "wait_s": _between("detected", "assigned"),
    "travel_s": _between("assigned", "arrived"),
    "response_s": _between("detected", "arrived"),
    "stay_s": _between("detected", "closed"),
    "act_wait_s": _between("confirmed", "act_assigned"),
    "wait_all_s": _wait_of_all,
}


def _delayed(sample: Sample) -> tuple[Events, Events]:
    wait = _wait_of_all(sample)[0]
    turned_away = (sample.outcome == "escalated") & (wait <= _ROUNDING)
    return wait > _ROUNDING, ~turned_away


def _act_delayed(sample: Sample) -> tuple[Events, Events]:
    return sample.act_assigned - sample.confirmed > _ROUNDING, sample.served


def _ended(outcome: str) -> Callable[[Sample], tuple[Events, Events]]:
    def which(sample: Sample) -> tuple[Events, Events]:
        return sample.outcome == outcome, np.ones(len(sample.stream), dtype=bool)

    return which


_SHARES: dict[str, Callable[[Sample], tuple[Events, Events]]] = {
    "delayed": _delayed,
    "act_delayed": _act_delayed,
    "lost": _ended("escalated"),
    "abandoned": _ended("expired"),
}


# --- of the whole ----------------------------------------------------------------------
def _busy(batches: Batches, units: list[int]) -> Sums:
    sample = batches.sample
    which = np.isin(sample.busy_unit, units)
    top = occupied(sample.busy_from[which], sample.busy_until[which], batches.edges)
    return top, batches.lengths * len(units)


def _utilisation(batches: Batches) -> Sums:
    return _busy(batches, list(range(len(batches.sample.units))))


def _open(batches: Batches) -> Sums:
    sample = batches.sample
    return occupied(sample.detected, sample.closed, batches.edges), batches.lengths


def _resting(batches: Batches) -> Sums:
    """How many of the finite sources have no event open."""
    area, lengths = _open(batches)
    return batches.sample.sources * lengths - area, lengths


def _total(batches: Batches) -> Sums:
    """Ways to all events that were detected at one moment, added up."""
    sample = batches.sample
    first = np.diff(sample.detected, prepend=-np.inf) > 0
    return batches.total(sample.arrived - sample.assigned, sample.served), batches.count(first)


def _throughput(batches: Batches) -> Sums:
    return batches.count(batches.sample.served), batches.lengths


_WHOLE: dict[str, Callable[[Batches], Sums]] = {
    "utilisation": _utilisation,
    "open": _open,
    "resting": _resting,
    "total_s": _total,
    "throughput": _throughput,
}


# --- with a detail ---------------------------------------------------------------------
def _workload(batches: Batches, unit: str) -> Sums:
    return _busy(batches, [batches.sample.units.index(unit)])


def _group(batches: Batches, group: str) -> Sums:
    sample = batches.sample
    if group == OPERATORS:
        robots = [i for i, kind in enumerate(sample.kinds) if kind == "robot"]
        return _busy(batches, robots)[0], batches.lengths * sample.operators
    return _busy(batches, [i for i, g in enumerate(sample.groups) if g == group])


def _share(batches: Batches, detail: str) -> Sums:
    """Of all events served, those of a stream that a unit served."""
    sample = batches.sample
    unit, _, stream = detail.partition("/")
    which = sample.unit == sample.units.index(unit)
    which &= sample.stream == sample.streams.index(stream)
    return batches.count(which & sample.served), batches.count(sample.served)


def _wait_beyond(batches: Batches, seconds: str) -> Sums:
    sample = batches.sample
    longer = sample.assigned - sample.detected > float(seconds)
    return batches.count(longer & sample.served), batches.count(sample.served)


_DETAILED: dict[str, Callable[[Batches, str], Sums]] = {
    "workload": _workload,
    "utilisation": _group,
    "share": _share,
    "wait_beyond": _wait_beyond,
}
