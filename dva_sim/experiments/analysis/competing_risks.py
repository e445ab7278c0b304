"""Competing outcomes of events by a fixed time: confirmed, or something that precludes it.

Only what comes first counts, so the ways compete and their shares add up to one. What was still
open when nobody looked any more is cut off; it is not taken for an ending.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.run_grid import Floats, RunGrid, Setting, Table, as_floats
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.study.addresses import Address
from dva_sim.experiments.study.parts import Level
from dva_sim.statistics import (
    Interval,
    cumulative_incidence,
    paired_difference,
    person_means,
    share_interval,
)

CONFIRMED = "confirmed"
CLEARED = "cleared"
NOTHING = "nothing"
RIGHT = (CONFIRMED, CLEARED)
WAYS = (
    *RIGHT,
    *("refuted", "false alarm confirmed", "link lost", "given up", "escalated", "expired"),
    *("never reported", NOTHING),
)
"""All ways, the best first; `cleared` is a false alarm that was refuted."""
_OF_EVENTS = {"contained": CONFIRMED, "open": NOTHING, "undetected": "never reported"}
# Why the DVA escalated; who is refused cannot but give up.
_OF_DRIVES = {"lost link": "link lost", "gave up": "given up", "refused": "given up"}


@dataclass(frozen=True)
class Ended:
    """Outcomes of the events of one series at one stop.

    Attributes:
        level: Level of the factor that is compared.
        stop: Level of the factor along which it is followed.
        events: Number of events.
        shares: Share of each way by the horizon, in the order of `Endings.ways`.
    """

    level: Level
    stop: Level
    events: int
    shares: dict[str, Interval]


class Endings:
    """The events of the part that the answer speaks of, each with how and when it ended.

    Args:
        view: Names the factors and their levels.
        events: Columns of the table `events`.
        runs: Columns of the table `runs`.
        horizon: Until when an ending counts, since the report [s].
    """

    def __init__(self, view: StudyView, events: Table, runs: Table, horizon: float) -> None:
        self._grid = RunGrid(events, view.part.name, view.part.factors)
        rows = self._grid.treated
        self.horizon = horizon
        self.way, self.time = _first(rows, _how_drives_ended(rows, runs))
        self._view = view
        self._person = rows["person"]

    def __len__(self) -> int:
        return len(self.way)

    @cached_property
    def is_right(self) -> NDArray[np.bool_]:
        """Mark events confirmed in time, and false alarms cleared in time `(n,)`."""
        return np.isin(self.way, RIGHT) & (self.time <= self.horizon)

    @cached_property
    def ways(self) -> tuple[str, ...]:
        """Those that occur; `nothing` in any case."""
        late = self.time > self.horizon
        return tuple(w for w in WAYS if w == NOTHING or np.any((self.way == w) & ~late))

    def under(self, level: Level, stop: Level, panel: Setting | None = None) -> NDArray[np.bool_]:
        """Select the events under these levels; other factors as in the answer `(n,)`."""
        view = self._view
        setting: Setting = dict(view.panels[0] if panel is None else panel)
        setting |= {f.name: v for f, v in ((view.series_factor, level), (view.over, stop)) if f}
        return self._grid.at(setting)

    def at(self, level: Level, stop: Level, panel: Setting | None = None) -> Ended:
        """Return shares by the horizon, each with its 95 % interval over persons."""
        mask = self.under(level, stop, panel)
        ending = self.way[mask]
        time = self.time[mask]
        person = self._person[mask]
        causes = list(np.where(ending == NOTHING, "", ending))
        incidence = cumulative_incidence(time, causes, self.horizon, person)
        never = share_interval(np.zeros(len(person)), person)
        shares = {w: incidence.causes.get(w, never) for w in self.ways} | {
            NOTHING: incidence.nothing
        }
        return Ended(level, stop, len(person), shares)

    def difference(self, first: Level, second: Level, stop: Level) -> Interval:
        """Share confirmed by the horizon: first minus second, paired by person."""
        done = (self.way == CONFIRMED) & (self.time <= self.horizon)
        masks = [self.under(level, stop) for level in (first, second)]
        sides = [person_means(done[mask], self._person[mask]) for mask in masks]
        both, *places = np.intersect1d(sides[0][0], sides[1][0], return_indices=True)
        a, b = (means[index] for (_, means), index in zip(sides, places, strict=True))
        return paired_difference(a, b, both)


def with_endings(runs: Table, events: Table) -> Table:
    """Add to each run the share of its true events that any responder confirmed.

    The table itself tells of drives alone. `outcome` says of a run without any how its event
    ended, if it had but one.
    """
    is_true = np.asarray(events["is_true"]).astype(bool)
    times = as_floats(np.asarray(events["confirmation_s"]))
    words = np.asarray(events["outcome"])
    met: dict[Address, list[bool]] = defaultdict(list)
    how: dict[Address, list[str]] = defaultdict(list)
    for key, real, time, word in zip(Address.all_of(events), is_true, times, words, strict=True):
        if real:
            met[key].append(bool(np.isfinite(time)))
            how[key].append(_OF_RUNS.get(str(word), str(word)))
    keys = Address.all_of(runs)
    share = [float(np.mean(met[key])) if key in met else math.nan for key in keys]
    outcomes = np.asarray(runs.get("outcome", np.full(len(keys), None)), dtype=object)
    outcome = [
        how[key][0] if not isinstance(word, str) and len(how[key]) == 1 else word
        for key, word in zip(keys, outcomes, strict=True)
    ]
    return dict(runs) | {"confirmed": np.array(share), "outcome": np.array(outcome, dtype=object)}


_OF_RUNS = {"contained": CONFIRMED, "open": "timeout"}


def horizon_of(view: StudyView, scenario: Mapping[str, Any]) -> float:
    """Return until when an ending counts [s]: as long as events are followed, or a run lasts."""
    if view.part.has("follow_s"):
        return float(np.nanmax(as_floats(view.part.treated["follow_s"])))
    return float(scenario.get("horizon_s", math.inf))


def _first(rows: Table, drives: NDArray[np.str_]) -> tuple[NDArray[np.str_], Floats]:
    """Return the first outcome of each event, and its time since the report [s]."""
    outcome = rows["outcome"].astype(str)
    ending = np.array([_OF_EVENTS.get(word, word) for word in outcome], dtype="U24")
    ending = np.where((ending == "escalated") & (drives != ""), drives, ending)
    confirmed_at = as_floats(rows["confirmation_s"])
    closed_at = as_floats(rows["closing_s"])
    confirmed = np.isfinite(confirmed_at)
    ending = np.where(confirmed, CONFIRMED, ending)
    if "is_true" in rows:
        is_false = ~rows["is_true"].astype(bool)
        ending = np.where(is_false & (ending == "refuted"), CLEARED, ending)
        ending = np.where(is_false & confirmed, "false alarm confirmed", ending)
    time = np.where(confirmed, confirmed_at, closed_at)
    time = np.where(ending == NOTHING, as_floats(rows["watched_s"]), time)
    return ending, np.where(ending == "never reported", 0.0, time)


def _how_drives_ended(rows: Table, runs: Table) -> NDArray[np.str_]:
    """Return how the last drive to an event ended; empty where a run has several events.

    A run tells of the drives to its first driven event only.
    """
    nothing = np.full(len(rows["part"]), "", dtype="U24")
    if "outcome" not in runs:
        return nothing
    addresses = Address.all_of(rows)
    if len(set(addresses)) < len(addresses):
        return nothing
    ends = [_OF_DRIVES.get(str(word), "") for word in runs["outcome"]]
    end_by_address = dict(zip(Address.all_of(runs), ends, strict=True))
    return np.array([end_by_address.get(address, "") for address in addresses], dtype="U24")
