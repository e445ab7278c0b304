"""Reports about events by sensors and people, and findings of the devices sent there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from dva_sim.core.control_rooms import ControlRooms
from dva_sim.core.dispatcher import Dispatcher
from dva_sim.core.events import SAME_SPOT, Cause, Event, EventTable, State, apart
from dva_sim.core.registry import DRIVERS, DeviceEntry
from dva_sim.core.sensing import Sensing
from dva_sim.core.sessions import DvaAnswer, Send
from dva_sim.core.severity import Grading
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import CONTROL_ROOM, ROBOT, ControlRoomRole

FOUND_WITHIN = 20.0  # maximum distance of a finding from its event [m]
REACH = 20.0  # maximum distance of a source that a robot's sensor measures [m]; assumed
CONFIDENCE = 0.6  # confidence in a report by a robot's sensor alone; assumed
SEVERITY = 0.5  # severity of an event whose source nobody has seen
NO_NEWS = 600.0  # time for which sensors raise no new event where one was settled [s]; assumed
_FOUND = frozenset({State.CONFIRMED, State.CONTAINED, State.ESCALATED})


@dataclass
class Reports:
    """Books reports as events, and findings as their ends.

    Attributes:
        dispatcher: Dispatcher, with all orders.
        events: All events.
        sensing: Robot sensors that the DVA uses.
        control_rooms: Tells which control room may report.
        grading: Raises the severity of events.
    """

    dispatcher: Dispatcher
    events: EventTable
    sensing: Sensing
    control_rooms: ControlRooms
    grading: Grading

    # --- by those who were sent ----------------------------------------------------------

    def found(self, device: str, body: m.EventReport, now: float) -> DvaAnswer:
        """Book what a device has found at an event that it was sent to."""
        event = self.events.get(body.event_id or 0)
        if event is None:
            return DvaAnswer(m.UNKNOWN_EVENT, f"no event {body.event_id}")
        if device not in event.sent:
            return DvaAnswer(m.NOT_PERMITTED, f"was not sent to event {event.number}")
        if body.kind != event.kind or apart(body.position, event.position) > FOUND_WITHIN:
            # A life of the DVA that could keep nothing may have given its number to another event.
            text = f"event {event.number} is another one, a {event.kind} elsewhere"
            return DvaAnswer(m.UNKNOWN_EVENT, text)
        sends = self.dispatcher.orders.found(event, device, body.finding, now)
        if event.state is State.CONFIRMED:
            self.grading.found(event, body.severity, device, now)
        if event.waits_for is not None:
            sends += self.dispatcher.decide(now)
        return DvaAnswer(sends=sends)

    def progress(self, device: str, body: m.OrderProgress, now: float) -> DvaAnswer:
        """Book the progress of an order."""
        event = self.dispatcher.orders.engaged.find(device, body.event_id)
        if event is None or not self.dispatcher.orders.has_order(event, device):
            label = self.dispatcher.orders.label_of(device)
            text = f"{label} has no order for event {body.event_id}"
            return DvaAnswer(m.UNKNOWN_EVENT, text)
        sends: list[Send] = []
        if body.state == "departed":
            self.dispatcher.orders.departed(event, device, now)
        elif body.state == "arrived":
            self.dispatcher.orders.arrived(event, device, now)
        elif body.state in ("done", "failed", "declined"):
            sends = self.dispatcher.orders.ends(event, device, body.state, now)
            sends += self.dispatcher.decide(now)
        return DvaAnswer(sends=sends)

    # --- by anybody ----------------------------------------------------------------------

    def sighted(self, source: DeviceEntry, body: m.EventReport, now: float) -> DvaAnswer:
        """Book a sighting by a device that was not sent there; a control room needs a role for it.

        A device by which people report gets the event in return, and can follow it from then on.
        """
        device = source.device
        if device.device_type not in DRIVERS:
            return self._sighted(device.id_tag, body, now)
        is_room = device.device_type == CONTROL_ROOM
        if is_room:
            refusal = self.control_rooms.may(device, ControlRoomRole.DRIVE, "report an event")
            if refusal is not None:
                return DvaAnswer(m.NOT_PERMITTED, refusal)
        answer = self._sighted(device.id_tag, body, now)
        event = self.events.near(body.kind, body.position)
        if event is None:  # reports are not merged
            events = self.events.reported_by(device.id_tag, body.kind, body.position)
            event = events[-1] if events else None
        if event is None:
            return answer
        if is_room:
            self.control_rooms.raised(event, device, now)
        return replace(answer, content=self.control_rooms.event_status(event, now))

    def _sighted(self, source: str, body: m.EventReport, now: float) -> DvaAnswer:
        if body.finding == "refuted":
            return self._withdrawn(source, body, now)
        event = self.events.near(body.kind, body.position)
        sends: list[Send] = []
        if event is None:
            event, sends = self._corrected(source, body, now)
        if event is None and (settled := self._said_again(source, body, now)) is not None:
            self.events.merge(settled, body.severity)
            return DvaAnswer(sends=sends)
        if event is None and self.events.full:
            return DvaAnswer(m.BUSY, "too many events are open; no more are accepted")
        is_known = event is not None
        if event is None:
            contain = self.dispatcher.orders.rules.containment
            event = self.events.add(body.kind, body.position, body.severity, now, contain)
        self.events.note_source(event, source, body.confidence)
        if is_known:
            self.grading.reported(event, body.severity, source, now)
            self.events.merge(event, body.severity)
        return DvaAnswer(sends=sends + self.dispatcher.decide(now))

    def _said_again(self, source: str, body: m.EventReport, now: float) -> Event | None:
        """Return the settled event that a device reports again, if there is one."""
        if not self.dispatcher.orders.rules.severity_moves:
            return None
        near = max(self.events.merge_distance, SAME_SPOT)
        again = (
            event
            for event in _settled(self.events, body.kind, now)
            if source in event.sources and apart(event.position, body.position) < near
        )
        return next(again, None)

    def _withdrawn(self, source: str, body: m.EventReport, now: float) -> DvaAnswer:
        """Close an event that all its reporters have withdrawn before anybody was sent."""
        sends = list[Send]()
        for event in self.events.reported_by(source, body.kind, body.position):
            self.events.take_back(event, source)
            if event.state is State.PENDING and not event.sources:
                sends += self.dispatcher.orders.transition(event, Cause.WITHDRAWN, now)
        return DvaAnswer(sends=sends)

    def _corrected(
        self, source: str, body: m.EventReport, now: float
    ) -> tuple[Event | None, list[Send]]:
        """Correct the position of an event that only sensors felt, by a report of somebody on site.

        The event is moved there, or ends, if somebody is on the way to where it was felt.
        """
        if not self.sensing.alarms:
            return None, []
        felt = (e for e in self.events.open.values() if self._is_only_felt(e))
        event = _within_reach(felt, body.kind, body.position)
        if event is None or source in event.sources:
            return None, []
        if event.state is State.PENDING:
            event.position = body.position
            return event, []
        if event.state is State.CONFIRMED:
            return None, []  # people are there: the report may be about something else
        return None, self.dispatcher.orders.transition(event, Cause.SUPERSEDED, now)

    def _is_only_felt(self, event: Event) -> bool:
        """Return True if only robots' sensors support an event: its position is uncertain."""
        entries = self.dispatcher.orders.registry.entries
        return {e.device.device_type for s in event.sources if (e := entries.get(s))} == {ROBOT}

    # --- by sensors of robots ------------------------------------------------------------

    def felt(self, robot: str, body: m.SensorValue, place: m.Position, now: float) -> DvaAnswer:
        """Handle a sensor value of a robot: it may be a new event, or support a known one."""
        alarm = self.sensing.crossed(robot, body)
        self._grade(robot, body, place, now)
        if alarm is None:
            return DvaAnswer()
        event = _within_reach(self.events.open.values(), alarm.kind, place)
        counters = self.dispatcher.orders.counters
        if event is None:
            if _is_no_news(self.events, alarm.kind, place, now):
                return DvaAnswer()
            counters["event raised by a sensor"] += 1
            report = m.EventReport(None, alarm.kind, place, SEVERITY, CONFIDENCE, "detected")
            return self._sighted(robot, report, now)
        witnesses = event.sources.keys() - {robot}
        self.events.merge(event, 0.0)
        self.events.note_source(event, robot, CONFIDENCE)
        is_near = apart(event.position, place) < self.dispatcher.orders.rules.merge_distance
        if not (is_near and witnesses) or event.state is State.CONFIRMED:
            return DvaAnswer()
        counters["event confirmed by a sensor"] += 1
        sends = self.dispatcher.orders.transition(event, Cause.SENSED, now)
        return DvaAnswer(sends=sends + self.dispatcher.decide(now))

    def _grade(self, robot: str, body: m.SensorValue, place: m.Position, now: float) -> None:
        """Raise the severity of a nearby event by a sensor value above its alarm level."""
        times = self.sensing.times_alarm(robot, body.sensor)
        if not times:
            return
        kind = self.sensing.alarms[body.sensor].kind
        event = _within_reach(self.events.open.values(), kind, place)
        if event is not None:
            self.grading.sensed(event, body.sensor, robot, times_alarm=times, now=now)


# --- which event it is ---------------------------------------------------------------------


def _within_reach(events: Iterable[Event], kind: str, place: m.Position) -> Event | None:
    """Return the nearest event that can be felt at a place."""
    near = [(apart(e.position, place), e.number, e) for e in events if e.kind == kind]
    nearest = min((entry for entry in near if entry[0] < REACH), default=None)
    return nearest[2] if nearest else None


def _is_no_news(events: EventTable, kind: str, place: m.Position, now: float) -> bool:
    """Return True if people recently found such an event nearby, or were called to one."""
    return _within_reach(_settled(events, kind, now), kind, place) is not None


def _settled(events: EventTable, kind: str, now: float) -> Iterator[Event]:
    """Yield the events of a kind that people have recently found, or were called to."""
    for event in events.closed.values():
        is_found = event.kind == kind and event.state in _FOUND
        if is_found and now - event.times["closed"] < NO_NEWS:
            yield event
