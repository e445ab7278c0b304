"""Severity of events that moves by what the DVA learns: reports, sensors of robots, and findings.

It only rises, and each rise has a reason that people can read. An option of the scenario decides
whether it moves at all; otherwise it is the highest severity reported.
"""

from __future__ import annotations

from dataclasses import dataclass

from dva_sim.core.events import Event
from dva_sim.core.orders import Orders
from dva_sim.protocol.event_kinds import severity_word
from dva_sim.protocol.facts import Fact

SEVERAL_REPORTERS = 3  # devices that report one event: it is seen from several places; assumed
SEVERAL_SEVERITY = 0.5  # least severity of such an event; assumed
ALARM_SEVERITY = (
    0.25  # severity of a value at its alarm level, twice as much at twice that; assumed
)


@dataclass
class Grading:
    """Raises the severity of events.

    Attributes:
        orders: Orders of the DVA, with its rules and its trail of decisions.
    """

    orders: Orders

    def reported(self, event: Event, severity: float, source: str, now: float) -> None:
        """Follow another report of a known event."""
        label = self.orders.label_of(source)
        self._raise(event, severity, f"{label} reports it as graver", now)
        if len(event.sources) >= SEVERAL_REPORTERS:
            self._raise(event, SEVERAL_SEVERITY, f"{len(event.sources)} devices report it", now)

    def sensed(
        self, event: Event, sensor: str, robot: str, *, times_alarm: float, now: float
    ) -> None:
        """Follow a robot's sensor that has been above its alarm level for a while."""
        label = self.orders.label_of(robot)
        reason = f"{sensor} at {label} is {times_alarm:.1f} times the alarm level"
        self._raise(event, min(1.0, ALARM_SEVERITY * times_alarm), reason, now)

    def found(self, event: Event, severity: float, device: str, now: float) -> None:
        """Follow a finding that confirms an event."""
        self._raise(event, severity, f"{self.orders.label_of(device)} confirms it", now)

    def _raise(self, event: Event, severity: float, reason: str, now: float) -> None:
        if not self.orders.rules.severity_moves or severity <= event.severity:
            return
        before = severity_word(event.severity)
        event.severity = severity
        self.orders.events.touch(event)
        word = severity_word(severity)
        if word != before:
            fact = Fact(
                time=now,
                author=self.orders.sessions.permissions.own,
                label="rule",
                action="severity",
                event=event.number,
                text=word,
                cause=reason,
                outcome=word,
                waited=now - event.times["detected"],
            )
            self.orders.trail.note(fact)
