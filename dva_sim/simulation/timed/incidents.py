"""Events as they happen in the world, whatever the DVA knows of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from dva_sim.core.events import Event
from dva_sim.protocol import messages as m
from dva_sim.simulation.timed.travel import Place
from dva_sim.worlds.hazards import Hazard, make_hazard


@dataclass(slots=True, eq=False)
class Incident:
    """One event of the world, with its own random draws.

    Attributes:
        stream: Number of its stream.
        index: Index in the stream.
        number: Index among all incidents of the run.
        kind: `fire`, `gas_leak` or `flood`.
        true: True for a real event, false for a false alarm.
        severity: Reported severity, 0 to 1.
        confidence: Reported confidence, 0 to 1.
        occurred: Start of the event [s].
        noticed: Time of the first report [s]; nan before.
        sources: Devices that have reported it.
        event: The DVA's event about it, once it is reported.
        shared: True if the DVA already knew the event from another incident.
        over: Time at which the danger ended, or others took over [s].
    """

    stream: int
    index: int
    number: int
    kind: str
    place: Place
    true: bool
    severity: float
    confidence: float
    occurred: float
    noticed: float = math.nan
    sources: list[str] = field(default_factory=list)
    event: Event | None = None
    shared: bool = False
    over: float = math.inf
    _hazard: Hazard | None = None

    def __post_init__(self) -> None:
        self.place.about = self

    def danger_radius(self, now: float) -> float:
        """Radius in which people should not be [m]; 0 if the hazard is not real or has ended."""
        if not self.true or now >= self.over:
            return 0.0
        if self._hazard is None:
            self._hazard = make_hazard(self.kind, self.place.point, self.occurred)
        return self._hazard.danger_radius(now)

    def report(self, finding: str) -> m.EventReport:
        """Return the report of a device that was not sent."""
        return m.EventReport(
            None, self.kind, self.place.position, self.severity, self.confidence, finding
        )
