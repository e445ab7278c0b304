"""Bugs of the DVA."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from helpers.mutation.planting import RIGHT, Bug, Original, Planted, afterwards, instead, skipped

from dva_sim.core.emergencies import RobotStop
from dva_sim.core.events import Cause, Choice, State
from dva_sim.core.handovers import Step
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.stage import DVA

LEAKED = 200  # things that are kept for ever until that shows in the number of acts


def _without_last(original: Original, bug: Planted) -> Original:
    """Every fourth event is taken, and not kept."""
    count = [0]

    def wrong(self: Any, *args: Any, **named_args: Any) -> Any:
        event = original(self, *args, **named_args)
        count[0] += 1
        if count[0] % 4 == 0:
            bug.act(f"event {event.number} is forgotten")
            self.open.pop(event.number)
            self.waiting.pop(event.number, None)
        return event

    return wrong


def _miscounts(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, event: Any, cause: Cause, now: float) -> Any:
        was = event.state
        original(self, event, cause, now)
        if event.state is State.CONFIRMED:
            bug.act(f"event {event.number} is counted twice")
            self.counts[was] += 1

    return wrong


def _resets_timer(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, event: Any, severity: float) -> Any:
        original(self, event, severity)
        if event.waits_for is not None:
            bug.act(f"event {event.number} waits from the beginning again")
            event.waiting_since = 1e9

    return wrong


def _says_before_keeping(original: Original, bug: Planted) -> Original:
    """The DVA writes its promises down within five seconds, if it is still alive."""

    def wrong(self: Any) -> Any:
        if self._memory is None:
            return original(self)
        now, memory, unkept = (
            self.device.clock.now,
            self._memory,
            vars(self).setdefault("unkept", {}),
        )
        if now - vars(self).setdefault("kept_at", now) >= 5.0:
            for event in unkept.values():
                self.core.events.touch(event)
            unkept.clear()
            self.kept_at = now
            return original(self)
        changed = self.core.events.changes()
        for event in changed:
            self.core.events.touch(event)
            unkept[event.number] = event
        self._memory = None
        original(self)
        self._memory = memory
        if unkept and not vars(self).get("looks_out"):
            look(self, unkept)
        return None

    def look(self: Any, unkept: dict[int, Any]) -> None:
        """Look whether it has been killed with something unkept."""
        self.looks_out = bool(unkept) and not self.is_gone
        if self.looks_out:
            self.device.clock.call_after(0.2, look, self, unkept)
        elif unkept:
            bug.act(f"the DVA was killed before it had kept event {next(iter(unkept))}")

    return wrong


def _confirms_anyway(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, message: m.Message, reply: m.Reply) -> Any:
        if original(self, message, reply) is not reply:
            bug.act(f"{type(message.body).__name__} is confirmed, and not kept")
        return reply

    return wrong


def _loses_grants(original: Original, bug: Planted) -> Original:
    """A restarted DVA has forgotten who holds what."""

    def wrong(self: Any, dva: Any, now: float) -> Any:
        original(self, dva, now)
        grants = dva.sessions.permissions.grants
        for grant in grants.values():
            bug.act(f"the next life of the DVA does not know that {grant.holder} holds a robot")
        grants.clear()

    return wrong


def _loses_open(original: Original, bug: Planted) -> Original:
    """A restarted DVA has forgotten every second open event."""

    def wrong(self: Any, dva: Any, now: float) -> Any:
        found = original(self, dva, now)
        for number in list(dva.events.open)[::2]:
            bug.act(f"event {number} is forgotten by the next life of the DVA")
            dva.events.waiting.pop(number, None)
            del dva.events.open[number]
        return found

    return wrong


def _two_holders(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, asker: m.Device, body: Any, now: float) -> Any:
        permissions = self._sessions.permissions
        grants = permissions.grants
        held = grants.get(body.device)
        others = held is not None and held.holder not in (asker.id_tag, permissions.own)
        if not others or body.level == "sensors":
            return original(self, asker, body, now)
        del grants[body.device]
        answer = original(self, asker, body, now)
        if answer.code == m.OK:
            bug.act(f"{body.device} is given to {asker.id_tag} while {held.holder} holds it")
        else:
            grants.setdefault(body.device, held)
        return answer

    return wrong


def _anybody_confirms(original: Original, bug: Planted) -> Original:
    """DVA that lets any report near an event confirm it."""

    def wrong(self: Any, event: Any, severity: float) -> Any:
        original(self, event, severity)
        if str(event.state) in ("assigned", "on scene"):
            bug.act(f"event {event.number} is confirmed by one more report")
            self.move(event, Cause.CONFIRMED, max(event.times.values()))

    return wrong


def _swallows(original: Original, bug: Planted) -> Original:
    """A report counts as one of any open event of its kind, wherever that is."""

    def wrong(self: Any, kind: str, position: m.Position) -> Any:
        known = original(self, kind, position)
        if known is not None:
            return known
        other = next((event for event in self.open.values() if event.kind == kind), None)
        if other is not None:
            bug.act(f"a {kind} elsewhere counts as event {other.number}")
        return other

    return wrong


def _meets_once(original: Original, bug: Planted) -> Original:
    """The DVA subscribes only once to what a device publishes."""
    met = set[tuple[int, str]]()

    def wrong(self: Any, device: m.Device) -> Any:
        key = id(self), device.id_tag
        if key in met and device.id_tag not in self._heard:
            bug.act(f"{device.label} is back, and the DVA does not listen to it")
            return None
        met.add(key)
        return original(self, device)

    return wrong


def _too_early(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, event: Any, device: str, now: float) -> Any:
        original(self, event, device, now)
        if "arrived" in event.times and "assigned" in event.times:
            bug.act(f"event {event.number}: arrived before it was assigned")
            event.times["arrived"] = event.times["assigned"] - 1.0

    return wrong


def _ready_at_once(original: Original, bug: Planted) -> Original:
    """A robot is handed over before it stands and has heard that it is."""

    def wrong(self: Any, robot: str, status: m.RobotStatus, now: float) -> None:
        original(self, robot, status, now)
        known = self.under_way.get(robot)
        if known is not None and known.step is Step.STOPPING:
            bug.act(f"{robot} is handed over at {status.speed:.2f} m/s in mode {status.mode}")
            known.step, known.until = Step.READY, now + 30.0

    return wrong


def _releases_unasked(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, robot: str, emergency: m.RobotEmergency, now: float) -> RobotStop:
        stop: RobotStop = original(self, robot, emergency, now)
        if stop.released is None:
            bug.act(f"{robot} is released by nobody")
            return replace(stop, released=Choice(DVA, "dva", "release_emergency", now))
        return stop

    return wrong


def _miscounts_given_up(original: Original, bug: Planted) -> Original:
    """DVA that counts escalated events as expired."""

    def wrong(self: Any, event: Any, cause: Cause, now: float) -> Any:
        original(self, event, cause, now)
        if event.state is State.ESCALATED:
            bug.act(f"event {event.number} is escalated, and counted as expired")
            self.counts[State.ESCALATED] -= 1
            self.counts[State.EXPIRED] += 1

    return wrong


def _keeps_first_severity(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, event: Any, severity: float) -> None:
        if severity > event.severity:
            bug.act(f"event {event.number} stays at {event.severity:g}, not {severity:g}")
        original(self, event, min(severity, event.severity))

    return wrong


def _waits_longer(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, dva: Any, now: float) -> Any:
        found = original(self, dva, now)
        for event in dva.events.open.values():
            bug.act(f"event {event.number} waits 120 s more until it is escalated")
            event.waiting_since += 120.0
        return found

    return wrong


def _confirmed_on_arrival(original: Original, bug: Planted) -> Original:
    """The time of a confirmation is that of the arrival: in order, and not true."""

    def wrong(self: Any, event: Any, device: str, finding: str, now: float) -> Any:
        sends = original(self, event, device, finding, now)
        times = event.times
        early = times.get("arrived", times.get("detected", now))
        if times.get("confirmed") == now and early < now - 1.0:
            bug.act(f"event {event.number} was confirmed {now - early:.0f} s later than noted")
            times["confirmed"] = early
        return sends

    return wrong


def _remembers_requests(original: Original, bug: Planted) -> Original:
    """The DVA keeps each request for ever."""

    def wrong(self: Any, *args: Any) -> Any:
        kept = vars(self).setdefault("kept", [])
        kept.append(args)
        if len(kept) > LEAKED:
            bug.act(f"the DVA keeps {len(kept)} requests")
        return original(self, *args)

    return wrong


def _confirms_more(original: Original, bug: Planted) -> Original:
    """DVA that confirms to robots that any permitted driver may also send them out."""

    def wrong(self: Any, robot: m.Device, body: m.GetGrant) -> Any:
        answer = original(self, robot, body)
        content = answer.content
        if isinstance(content, m.Permission) and content.level == "teleoperation":
            bug.act(f"{content.device} may drive, and is said to be allowed more")
            return replace(answer, content=replace(content, level="both"))
        return answer

    return wrong


DVA_BUGS: Final = (
    Bug(
        "two-holders",
        "S2",
        "the DVA gives a robot to a second holder",
        "dva_sim.core.robot_access:RobotAccess._request",
        _two_holders,
    ),
    Bug(
        "silent-holder-keeps",
        "S2",
        "who is silent keeps its permissions",
        "dva_sim.core.sessions:Sessions.take_back_all",
        skipped(
            lambda self, holder: any(
                grant.holder == holder for grant in self.permissions.grants.values()
            )
        ),
    ),
    Bug(
        "grants-not-kept",
        "S2",
        "permissions do not survive the DVA",
        "dva_sim.core.store:Store._recall_sessions",
        _loses_grants,
    ),
    Bug(
        "end-not-passed-on",
        "S2",
        "no robot hears that a session is over",
        "dva_sim.core.sessions:Sessions.tell_robot",
        skipped(),
    ),
    Bug(
        "handed-over-moving",
        "S2",
        "a robot is handed over before it stands",
        "dva_sim.core.handovers:Handovers.seen",
        _ready_at_once,
    ),
    Bug(
        "policy-drives-on",
        "S3",
        "the DVA sends a robot out again that nobody has released",
        "dva_sim.core.emergencies:Emergencies.holds",
        afterwards(lambda self, holds, robot: False if holds else None),
    ),
    Bug(
        "releases-unasked",
        "S3",
        "the DVA releases a robot that nobody has asked it to release",
        "dva_sim.core.emergencies:Emergencies.hear",
        _releases_unasked,
    ),
    Bug(
        "confirms-more",
        "S5",
        "the DVA confirms more than it has given",
        "dva_sim.core.robot_access:RobotAccess.grant_of",
        _confirms_more,
    ),
    Bug(
        "timer-reset-by-reports",
        "S6",
        "each report lets an event wait from the beginning",
        "dva_sim.core.events:EventTable.merge",
        _resets_timer,
    ),
    Bug(
        "event-forgotten",
        "S6",
        "every fourth event is forgotten",
        "dva_sim.core.events:EventTable.add",
        _without_last,
    ),
    Bug(
        "counts-wrong",
        "S6",
        "a confirmed event is counted twice",
        "dva_sim.core.events:EventTable.move",
        _miscounts,
    ),
    Bug(
        "order-never-ends",
        "S6",
        "who has an order has it for ever",
        "dva_sim.core.orders:Orders.take_back",
        instead(
            lambda self, now: (
                []
                if any(self._order_ends(*pair) <= now for pair in self.engaged.pairs())
                else RIGHT
            )
        ),
    ),
    Bug(
        "escalation-forgotten",
        "S6",
        "no event is escalated",
        "dva_sim.core.orders:Orders.transition",
        instead(lambda self, event, cause, now, device="": [] if cause is Cause.WAITED else RIGHT),
    ),
    Bug(
        "anybody-confirms",
        "S6",
        "one more report confirms an event",
        "dva_sim.core.events:EventTable.merge",
        _anybody_confirms,
    ),
    Bug(
        "events-lost-in-a-restart",
        "S6",
        "a restarted DVA forgets open events",
        "dva_sim.core.store:Store._recall",
        _loses_open,
    ),
    Bug(
        "said-before-kept",
        "S6",
        "the DVA answers before it has written",
        "dva_sim.simulation.full.dva_server:DvaAgent._keep_changes",
        _says_before_keeping,
    ),
    Bug(
        "confirms-unkept",
        "S6",
        "a DVA with a full disk confirms what it has not written",
        "dva_sim.simulation.full.dva_server:DvaAgent._confirmed",
        _confirms_anyway,
    ),
    Bug(
        "reports-swallowed",
        "S6",
        "a report is taken for one of another event",
        "dva_sim.core.events:EventTable.near",
        _swallows,
    ),
    Bug(
        "promises-forgotten",
        "S6",
        "who says OK to an order need never set out",
        "dva_sim.core.orders:Orders._overdue",
        afterwards(lambda self, late, now: [] if late else None),
    ),
    Bug(
        "given-up-miscounted",
        "S6",
        "an escalated event counts as expired",
        "dva_sim.core.events:EventTable.move",
        _miscounts_given_up,
    ),
    Bug(
        "severity-stays",
        "S6",
        "a later report cannot raise the severity of an event",
        "dva_sim.core.events:EventTable.merge",
        _keeps_first_severity,
    ),
    Bug(
        "restart-prolongs-waits",
        "S6",
        "a restart gives every event 120 s more until it is escalated",
        "dva_sim.core.store:Store._recall",
        _waits_longer,
    ),
    Bug(
        "times-out-of-order",
        "S7",
        "an arrival is noted before the order",
        "dva_sim.core.orders:Orders.arrived",
        _too_early,
    ),
    Bug(
        "arrives-from-afar",
        "S7",
        "a finding counts as the arrival of a robot that is far away",
        "dva_sim.core.orders:Orders._was_near",
        afterwards(lambda self, near, event, device: None if near else True),
    ),
    Bug(
        "confirmed-on-arrival",
        "S7",
        "the time of a confirmation is that of the arrival",
        "dva_sim.core.orders:Orders.found",
        _confirmed_on_arrival,
    ),
    Bug(
        "subscribes-once",
        "S8",
        "the DVA does not listen to who comes back",
        "dva_sim.simulation.full.dva_server:DvaAgent._meet",
        _meets_once,
    ),
    Bug(
        "reserved-for-ever",
        "S8",
        "a robot that is kept for somebody is kept for ever",
        "dva_sim.core.handovers:Handovers.lapse",
        skipped(lambda self, now: any(known.until <= now for known in self.under_way.values())),
    ),
    Bug(
        "requests-kept",
        "S10",
        "the DVA keeps each request",
        "dva_sim.core.dva:Dva.handle",
        _remembers_requests,
    ),
)
