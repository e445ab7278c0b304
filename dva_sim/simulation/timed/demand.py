"""Demand: kinds, times and places of events, independent of the responders."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable
from itertools import accumulate, count

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.timed.distributions import ZERO
from dva_sim.simulation.timed.draws import Always, Draws, shares, times
from dva_sim.simulation.timed.incidents import Incident
from dva_sim.simulation.timed.scenario import EventStream, ListedEvent, Severity, TimedScenario
from dva_sim.simulation.timed.travel import Place, Rooms, Terrain

CALLERS = 32  # devices that report a stream's events in turn, where reports are taken back


class EventDraws:
    """Random draws of a stream's events, by their index.

    Args:
        name: Name of the stream.
        streams: Random streams of the run.
    """

    def __init__(self, stream: EventStream, name: str, streams: Streams, terrain: Terrain) -> None:
        def draws(purpose: str) -> Draws[float]:
            return shares(streams, f"demand/{name}/{purpose}")

        still: Draws[float] = Always(0.0)
        self._stream = stream
        self._terrain = terrain
        self._zones = [terrain.zones.index(zone) for zone in stream.zones]
        weights = list(accumulate(stream.zones.values()))
        self._bounds = [w / weights[-1] for w in weights[:-1]] if weights else []
        self._zone = draws("zone") if len(self._zones) > 1 else still
        self._x, self._y = (draws("x"), draws("y")) if terrain.placed else (still, still)
        self._truth = draws("truth") if stream.false_share else Always(1.0)
        self._severity = draws("severity") if isinstance(stream.severity, Severity) else still
        self._repeated = draws("repeated") if stream.repeats else Always(1.0)
        base = f"demand/{name}"
        repeats = stream.repeats
        self._repeat = times(streams, f"{base}/repeat", repeats.after if repeats else ZERO)
        self.patience = times(streams, f"{base}/patience", stream.patience or ZERO)
        notice = ZERO if stream.notice == "detectors" else stream.notice
        self._notice = times(streams, f"{base}/notice", notice)

    def place(self, index: int) -> Place:
        """Return where event number `index` happens."""
        zone = -1
        listed = self._listed(index)
        if listed is not None and listed.position is not None:
            return self._terrain.exact_place(*listed.position, listed.zone)
        if listed is not None and listed.zone is not None:
            zone = self._terrain.zones.index(listed.zone)
        elif self._zones:
            zone = self._zones[bisect_right(self._bounds, self._zone[index])]
        return self._terrain.event_place(zone, self._x[index], self._y[index])

    def true(self, index: int) -> bool:
        """Return True if the event is real."""
        listed = self._listed(index)
        if listed is not None and listed.false_alarm:
            return False
        return self._truth[index] >= self._stream.false_share

    def severity(self, index: int) -> float:
        """Return the severity of the event, 0 to 1."""
        listed = self._listed(index)
        if listed is not None and listed.severity is not None:
            return listed.severity
        severity = self._stream.severity
        if isinstance(severity, Severity):
            return severity.low + (severity.high - severity.low) * self._severity[index]
        return severity

    def confidence(self, index: int) -> float:
        """Return the confidence of the report, 0 to 1."""
        listed = self._listed(index)
        if listed is None or listed.confidence is None:
            return self._stream.confidence
        return listed.confidence

    def _listed(self, index: int) -> ListedEvent | None:
        return self._stream.listed[index] if self._stream.listed else None

    def repeat_after(self, index: int) -> float | None:
        """Return how long after the first report a second source reports it [s]; None: never."""
        repeats = self._stream.repeats
        if repeats is None or self._repeated[index] >= repeats.share:
            return None
        return self._repeat[index]

    def noticed_after(self, incident: Incident) -> float:
        """Return the time from the outbreak to the first report [s]; infinite if nobody notices."""
        if self._stream.notice != "detectors":
            return self._notice[incident.index]
        assert isinstance(self._terrain, Rooms)
        return self._terrain.detected_after(incident.kind, incident.place)


class Demand:
    """Lets the events of a scenario happen.

    Args:
        streams: Random streams of the run.
        happens: Callback for each incident as it breaks out.
        noticed: Callback for each incident when it is to be reported.
    """

    def __init__(
        self,
        scenario: TimedScenario,
        streams: Streams,
        terrain: Terrain,
        clock: Clock,
        happens: Callable[[Incident], None],
        noticed: Callable[[Incident], None],
    ) -> None:
        self._scenario = scenario
        self._terrain = terrain
        self._clock = clock
        self._streams = streams
        self._happens = happens
        self._noticed = noticed
        self._names = scenario.stream_names
        self.draws = [
            EventDraws(stream, name, streams, terrain)
            for stream, name in zip(scenario.demand, self._names, strict=True)
        ]
        self._left = scenario.max_events if scenario.max_events is not None else math.inf
        self._numbers = count()
        self._rest: dict[int, Draws[float]] = {}
        self._check()

    def _check(self) -> None:
        """Refuse detectors without a site, and detectors that cannot notice their events."""
        for stream in self._scenario.demand:
            if stream.notice == "detectors":
                if not isinstance(self._terrain, Rooms):
                    raise ConfigError("notice 'detectors' needs a site")
                self._terrain.check_detectors(stream.kind)

    def start(self) -> None:
        """Schedule the first event of each stream."""
        for number, stream in enumerate(self._scenario.demand):
            name = f"demand/{self._names[number]}"
            if stream.between is not None:
                gaps = times(self._streams, f"{name}/between", stream.between)
                self._next(number, gaps, 0, stream.from_s)
            elif stream.sources is not None:
                self._rest[number] = times(self._streams, f"{name}/rest", stream.sources.rest)
                for source in range(stream.sources.count):
                    self._rests(number, source, stream.from_s)
            elif stream.listed:
                self._next_listed(number, 0)
            elif stream.batch is not None:
                for index in range(stream.batch.count):
                    self._at(number, index, stream.batch.at_s)

    def closed(self, incident: Incident, now: float) -> None:
        """Close an incident: where sources are finite, its source rests."""
        sources = self._scenario.demand[incident.stream].sources
        if sources is not None:
            self._rests(incident.stream, incident.index + sources.count, now)

    @property
    def exhausted(self) -> bool:
        """True if as many events have happened as may."""
        return self._left <= 0

    def share(self) -> list[float]:
        """Return the share of all events that each zone has in the long run, shape `(zones,)`."""
        zones = self._terrain.zones
        total = [0.0] * len(zones)
        for stream in self._scenario.demand:
            weights = (
                Counter(event.zone for event in stream.listed if event.zone is not None)
                or stream.zones
                or {zone: self._terrain.size(number) for number, zone in enumerate(zones)}
            )
            whole = sum(weights.values()) or 1.0
            for zone, weight in weights.items():
                total[zones.index(zone)] += _rate(stream) * weight / whole
        return [part / sum(total) for part in total]

    # --- one after the other -------------------------------------------------------------

    def _next(self, stream: int, gaps: Draws[float], index: int, last: float) -> None:
        when = last + gaps[index] / self._scenario.intensity
        if when <= self._ends(stream):
            self._clock.call_at(when, self._renew, stream, gaps, index, when)

    def _renew(self, stream: int, gaps: Draws[float], index: int, when: float) -> None:
        self._next(stream, gaps, index + 1, when)
        self._break_out(stream, index)

    def _next_listed(self, stream: int, index: int) -> None:
        listed = self._scenario.demand[stream].listed
        if index < len(listed) and listed[index].at_s <= self._ends(stream):
            self._clock.call_at(listed[index].at_s, self._renew_listed, stream, index)

    def _renew_listed(self, stream: int, index: int) -> None:
        self._next_listed(stream, index + 1)
        self._break_out(stream, index)

    def _rests(self, stream: int, index: int, now: float) -> None:
        self._at(stream, index, now + self._rest[stream][index])

    def _at(self, stream: int, index: int, when: float) -> None:
        if when <= self._ends(stream):
            self._clock.call_at(when, self._break_out, stream, index)

    def _ends(self, stream: int) -> float:
        if self._left <= 0:
            return -math.inf
        until = self._scenario.demand[stream].until_s
        return min(self._scenario.horizon_s, math.inf if until is None else until)

    def _break_out(self, stream: int, index: int) -> None:
        if self._left <= 0:
            return
        self._left -= 1
        now = self._clock.now
        draws = self.draws[stream]
        config = self._scenario.demand[stream]
        place = draws.place(index)
        incident = Incident(
            stream=stream,
            index=index,
            number=next(self._numbers),
            kind=config.kind,
            place=place,
            true=draws.true(index),
            severity=draws.severity(index),
            confidence=draws.confidence(index),
            occurred=now,
        )
        self._happens(incident)
        after = draws.noticed_after(incident)
        if after <= 0.0:
            self._noticed(incident)
        elif after < math.inf:
            self._clock.call_after(after, self._noticed, incident)


def _rate(stream: EventStream) -> float:
    """Return events per second; of finite sources, the rate while all are at rest."""
    if stream.between is not None:
        return 1.0 / stream.between.mean
    if stream.sources is not None:
        return stream.sources.count / max(stream.sources.rest.mean, 1e-9)
    if stream.listed:
        return len(stream.listed) / max(stream.listed[-1].at_s, 1.0)
    assert stream.batch is not None
    return float(stream.batch.count)
