"""Alarms: conditions that need somebody to act, and what people at pages do about them.

They are derived from what pages are shown, of a run or of a remote system.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.console.asking.refusal import Refused
from dva_sim.console.events.alarms import AlarmCondition, Alarms
from dva_sim.console.events.robot_conditions import robot_conditions
from dva_sim.console.wire.events import AlarmsLine, SiteEventShown
from dva_sim.console.wire.rows import RobotRow
from dva_sim.kernel.recorder import Breach
from dva_sim.protocol.devices import GUARD, ROBOT

ESCALATED_FOR: Final = 60.0  # so long an escalation counts as lasting, time of the run [s]
OUTDOORS: Final = "outdoors"


class ConsoleAlarms:
    """The alarms of a console.

    Args:
        agent: Control room that knows events and devices.
        named: Function that returns the name of a robot by its number, as in `"0"`.
        breaches: Function that returns the broken safety rules, as far as they are judged here.
        clock: Real time [s]: what people can bear does not hang on the pace of a run.

    Attributes:
        alarms: Rules that raise and fold alarms.
    """

    def __init__(
        self,
        agent: ControlRoomAgent,
        named: Callable[[str], str],
        breaches: Callable[[], Iterable[Breach]] = tuple,
        clock: Callable[[], float] | None = None,
    ) -> None:
        self._agent = agent
        self._named = named
        self._breaches = breaches
        self._clock = clock or (lambda: time.monotonic())
        self.alarms = Alarms()
        self._known: list[AlarmCondition] = []
        self._since: dict[str, int] = {}

    def look(
        self,
        events: Sequence[SiteEventShown],
        robots: Sequence[RobotRow],
        now_ms: int,
        system: Iterable[AlarmCondition] = (),
    ) -> AlarmsLine:
        """Derive the alarms from what pages are shown.

        Args:
            events: Rows of the events.
            robots: Rows of the robots.
            now_ms: Time of the run [ms].
            system: Conditions of the system itself.
        """
        self._known = [*_of_events(events, now_ms), *robot_conditions(robots, self._named)]
        self._known += [*self._nobody(events), *self._broken()]
        return self.hold(now_ms, system)

    def hold(self, now_ms: int, system: Iterable[AlarmCondition] = ()) -> AlarmsLine:
        """Keep the alarms of events and robots, of which nothing new is known.

        Args:
            now_ms: Time of the run [ms].
            system: Conditions of the system itself.
        """
        timed = [
            condition._replace(
                since_ms=condition.since_ms or self._since.get(condition.key, now_ms)
            )
            for condition in (*system, *self._known)
        ]
        self._since = {condition.key: condition.since_ms for condition in timed}
        self.alarms.update(timed, self._clock())
        return self._line(now_ms)

    def _line(self, now_ms: int) -> AlarmsLine:
        now = self._clock()
        return {
            "k": "alarms",
            "t": now_ms,
            "alarms": self.alarms.rows(now),
            "shelved": self.alarms.shelved(now),
            "flood": self.alarms.is_flood,
            "rate": self.alarms.rate(now),
            "left_out": self.alarms.left_out,
        }

    def _broken(self) -> Iterator[AlarmCondition]:
        """Yield the safety rules that are broken: for good, so that somebody has to see it."""
        for breach in self._breaches():
            text = f"{breach.rule} broken by {breach.who}: {breach.what}"
            key = f"rule {breach.rule} {breach.who}"
            since = max(1, round(1000 * breach.time))
            yield AlarmCondition(
                key, "safety rule broken", "critical", place="", text=text, since_ms=since
            )

    def _nobody(self, events: Iterable[SiteEventShown]) -> Iterator[AlarmCondition]:
        """Yield the condition that events wait, and nobody is free to go."""
        waits = sum(1 for event in events if event["state"] == "pending")
        if waits and not _is_somebody_free(self._agent):
            text = f"nobody is left to send, and {waits} wait"
            yield AlarmCondition("nobody", "nobody left to send", "high", place="", text=text)

    # --- what people do -----------------------------------------------------------------------

    def members(self, key: Any) -> list[str]:
        """Return the alarms that a row stands for.

        Raises:
            Refused: there is no such row any more.
        """
        members = self.alarms.members(str(key))
        if not members:
            raise Refused("That alarm is over.")
        return members

    def by_event(self, keys: Iterable[str]) -> Mapping[str, int]:
        """Return the alarms of open events whose acknowledgement is news to the DVA."""
        alarms = ((key, self.alarms.known[key]) for key in keys)
        return {
            key: alarm.condition.event
            for key, alarm in alarms
            if alarm.is_on
            and alarm.condition.event is not None
            and alarm.condition.seen_by is None
            and key.startswith("event ")
            and self._is_open(alarm.condition.event)
        }

    def _is_open(self, event: int) -> bool:
        """Return True unless an event is closed, as that of an alarm may be since the last look."""
        status = self._agent.events.get(event)
        return status is None or status.closed_for is None

    def acknowledge(self, key: str, by: str) -> None:
        """Note that somebody has seen an alarm."""
        self.alarms.acknowledge(key, by)

    def shelve(self, keys: Sequence[str], seconds: float, by: str, why: str) -> None:
        """Shelve alarms on which nobody can act now.

        Raises:
            Refused: one of them is critical, and nobody has acknowledged it.
        """
        if any(map(self.alarms.must_be_seen, keys)):
            raise Refused("A critical alarm has to be acknowledged before it can be shelved.")
        for key in keys:
            self.alarms.shelve(key, seconds, by, self._clock(), why)

    def unshelve(self, keys: Iterable[str]) -> None:
        """Put alarms back in the list."""
        for key in keys:
            self.alarms.unshelve(key, self._clock())


def _is_somebody_free(agent: ControlRoomAgent) -> bool:
    """Return True if a guard or a robot is listed that no open event engages."""
    open_events = [status for status in agent.events.values() if status.closed_for is None]
    engaged = {who for e in open_events for who in (e.responder, e.operator, e.actor)}
    return any(
        device.device_type in (ROBOT, GUARD) and id_tag not in engaged
        for id_tag, device in agent.devices.items()
    )


def _of_events(events: Iterable[SiteEventShown], now_ms: int) -> Iterator[AlarmCondition]:
    """Yield open events, and those that have just been escalated."""
    for event in events:
        number = event["number"]
        kind = event["kind"].replace("_", " ")
        place = event["room"] or OUTDOORS
        if not event["over"]:
            seen = event["acknowledged"]
            yield AlarmCondition(
                f"event {number}",
                kind=kind,
                priority=event["severity"],
                place=place,
                text=f"{kind.capitalize()}, {place}",
                since_ms=event["reported_ms"],
                event=number,
                seen_by=None if seen is None else seen["label"],
            )
        elif event["state"] == "escalated":
            closed = event["since_ms"]
            if now_ms - closed < 1000 * ESCALATED_FOR:
                text = f"{kind.capitalize()}, {place}: escalated, others have to go"
                yield AlarmCondition(
                    key=f"escalated {number}",
                    kind="escalation",
                    priority="critical",
                    place=place,
                    text=text,
                    since_ms=closed,
                    event=number,
                )
