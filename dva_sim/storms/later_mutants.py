"""Planted bugs of the last round, written before it was known whether a checker finds them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from dva_sim.agents.robot.controller import Decision, Mode
from dva_sim.core.emergencies import RobotStop
from dva_sim.core.events import State
from dva_sim.core.handling import Choice
from dva_sim.core.handovers import Step
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.stage import DVA
from dva_sim.storms.planting import (
    RIGHT,
    Bug,
    Mutant,
    Original,
    afterwards,
    instead,
    quiet_about,
    skipped,
)
from dva_sim.worlds.bodies import TickTarget

_CONTROLLER = "dva_sim.agents.robot.controller:RobotController"
_LATCH = "dva_sim.agents.robot.emergency_latch:EmergencyLatch"
LEAKED = 200  # things that are kept for ever until that shows in the number of acts


def _obeys_future_ticks(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, message: m.Message, body: m.SetTeleOp, arrived: float, now: float) -> Any:
        tick = self.tick(now)
        if body.seen_tick is None or body.seen_tick <= tick:
            return original(self, message, body, arrived, now)
        decision = original(self, message, body._replace(seen_tick=tick), arrived, now)
        if decision.code == m.OK:
            bug.act(f"{self.id_tag} obeys behind a picture of {body.seen_tick - tick} ms ahead")
        return decision

    return wrong


def _keeps_mission(original: Original, bug: Bug) -> Original:
    """Robot that completes the mission of an owner who has lost it."""

    def wrong(self: Any, grant: m.PermissionGrant | None) -> Any:
        held = self.grant
        same = grant is not None and held is not None and grant.session == held.session
        if self.mode is not Mode.MISSION or same:
            return original(self, grant)
        bug.act(f"{self.id_tag} goes on with the mission of {self.owner}")
        self.grant = grant
        return Decision(m.OK)

    return wrong


def _ready_at_once(original: Original, bug: Bug) -> Original:
    """A robot is handed over before it stands and has heard that it is."""

    def wrong(self: Any, robot: str, status: m.RobotStatus, now: float) -> None:
        original(self, robot, status, now)
        known = self.under_way.get(robot)
        if known is not None and known.step is Step.STOPPING:
            bug.act(f"{robot} is handed over at {status.speed:.2f} m/s in mode {status.mode}")
            known.step, known.until = Step.READY, now + 30.0

    return wrong


def _ignores_latch(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, arrived: float, moving: bool, releases: bool = False) -> Any:
        was_held = self.latch.holds
        self.latch.holds = False
        refusal = original(self, arrived, moving, releases)
        self.latch.holds = was_held
        if was_held and refusal is None:
            bug.act(f"{self.id_tag} takes an order though nobody has released it")
        return refusal

    return wrong


def _forgets_latch(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, clock_offset: float, now: float) -> None:
        original(self, clock_offset, now)
        if self.latch.holds:
            bug.act(f"{self.id_tag} restarts, and is stopped no longer")
            self.latch.release(None)

    return wrong


def _takes_any_release(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, answer: m.EmergencyRelease) -> None:
        if self.holds and answer.released is not None and answer.tick != self.tick:
            bug.act(f"a release of {answer.tick} ends the emergency of {self.tick}")
            answer = replace(answer, tick=self.tick)
        original(self, answer)

    return wrong


def _releases_unasked(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, robot: str, emergency: m.RobotEmergency, now: float) -> RobotStop:
        stop: RobotStop = original(self, robot, emergency, now)
        if stop.released is None:
            bug.act(f"{robot} is released by nobody")
            return replace(stop, released=Choice(DVA, "dva", "release_emergency", now))
        return stop

    return wrong


def _refuses_misdirected(original: Original, bug: Bug) -> Original:
    """An emergency that names another robot is refused."""

    def wrong(self: Any, message: m.Message) -> Any:
        if isinstance(message.body, m.Emergency) and message.destination != self.id_tag:
            bug.act(f"{self.label} refuses an emergency to {message.destination}")
            return m.Reply(message.message_id, m.UNKNOWN_DEVICE, f"this is {self.id_tag}")
        return original(self, message)

    return wrong


def _as_fast_as_wanted(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, speed: float, turn_rate: float, until: float) -> Any:
        original(self, speed, turn_rate, until)
        if speed > 1.05 * self.spec.max_speed:
            bug.act(f"motors are asked for {speed:.2f} m/s, as somebody wants it")
            target = TickTarget(speed, turn_rate, self._world.tick_at(until))
            self._asked.put(self._world.next_tick(), target)

    return wrong


def _miscounts_given_up(original: Original, bug: Bug) -> Original:
    """DVA that counts escalated events as expired."""

    def wrong(self: Any, event: Any, state: State, now: float) -> Any:
        original(self, event, state, now)
        if state is State.ESCALATED:
            bug.act(f"event {event.number} is escalated, and counted as expired")
            self.counts[State.ESCALATED] -= 1
            self.counts[State.EXPIRED] += 1

    return wrong


def _keeps_first_severity(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, event: Any, severity: float) -> None:
        if severity > event.severity:
            bug.act(f"event {event.number} stays at {event.severity:g}, not {severity:g}")
        original(self, event, min(severity, event.severity))

    return wrong


def _waits_longer(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, dva: Any, now: float) -> Any:
        found = original(self, dva, now)
        for event in dva.events.open.values():
            bug.act(f"event {event.number} waits 120 s more until it is escalated")
            event.waiting_since += 120.0
        return found

    return wrong


def _confirmed_on_arrival(original: Original, bug: Bug) -> Original:
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


def _remembers_requests(original: Original, bug: Bug) -> Original:
    """The DVA keeps each request for ever."""

    def wrong(self: Any, *args: Any) -> Any:
        kept = vars(self).setdefault("kept", [])
        kept.append(args)
        if len(kept) > LEAKED:
            bug.act(f"the DVA keeps {len(kept)} requests")
        return original(self, *args)

    return wrong


def _never_over(original: Original, bug: Bug) -> Original:
    """An operator goes on, whatever the robot says."""

    def wrong(self: Any, code: int | None, why: str = "") -> str:
        bug.act(f"{self.me} goes on, though {original(self, code, why)}")
        return ""

    return wrong


def _confirms_more(original: Original, bug: Bug) -> Original:
    """DVA that confirms to robots that any permitted driver may also send them out."""

    def wrong(self: Any, message: m.Message, asker: Any, body: m.GetGrant) -> Any:
        reply, sends = original(self, message, asker, body)
        content = reply.content
        if isinstance(content, m.Permission) and content.level == "teleoperation":
            bug.act(f"{content.device} may drive, and is said to be allowed more")
            reply = replace(reply, content=replace(content, level="both"))
        return reply, sends

    return wrong


LATER_MUTANTS: Final[dict[str, Mutant]] = {
    "future-tick-obeyed": Mutant(
        "S1",
        "a command behind a picture that was not taken yet is obeyed",
        f"{_CONTROLLER}._set",
        _obeys_future_ticks,
    ),
    "mission-outlives-session": Mutant(
        "S2",
        "a mission goes on when its session is over",
        f"{_CONTROLLER}._is_held",
        _keeps_mission,
    ),
    "handed-over-moving": Mutant(
        "S2",
        "a robot is handed over before it stands",
        "dva_sim.core.handovers:Handovers.seen",
        _ready_at_once,
    ),
    "button-ignored": Mutant(
        "S3",
        "the button at a robot stops nothing",
        f"{_CONTROLLER}.stop",
        instead(
            lambda self, now, stopped_by=None: (
                Decision(m.OK) if stopped_by is None and self.mode is not Mode.IDLE else RIGHT
            )
        ),
    ),
    "policy-drives-on": Mutant(
        "S3",
        "the DVA sends a robot out again that nobody has released",
        "dva_sim.core.emergencies:Emergencies.holds",
        afterwards(lambda self, holds, robot: False if holds else None),
    ),
    "latch-forgotten": Mutant(
        "S3",
        "a stopped robot takes orders that nobody has released it for",
        f"{_CONTROLLER}._begin",
        _ignores_latch,
    ),
    "start-releases": Mutant(
        "S3",
        "a new start releases a robot though a person should",
        f"{_LATCH}.starts",
        afterwards(lambda self, may: None if may else True),
    ),
    "restart-releases": Mutant(
        "S3",
        "a robot that restarts forgets that it is stopped",
        f"{_CONTROLLER}.restart",
        _forgets_latch,
    ),
    "earlier-release-counts": Mutant(
        "S3",
        "a release of an earlier emergency ends the newest one",
        f"{_LATCH}.take_answer",
        _takes_any_release,
    ),
    "releases-unasked": Mutant(
        "S3",
        "the DVA releases a robot that nobody has asked it to release",
        "dva_sim.core.emergencies:Emergencies.hear",
        _releases_unasked,
    ),
    "emergency-by-name-only": Mutant(
        "S3",
        "an emergency that names another robot is refused",
        "dva_sim.agents.device:AgentDevice._misdirection",
        _refuses_misdirected,
    ),
    "as-fast-as-wanted": Mutant(
        "S4",
        "motors are asked for what somebody wants",
        "dva_sim.worlds.bodies:RobotBody.drive",
        _as_fast_as_wanted,
    ),
    "reads-on": Mutant(
        "S5",
        "who may read a sensor no longer gets its values",
        "dva_sim.agents.robot.controller:RobotController.may_read",
        afterwards(lambda self, may, device, sensor: None if may else True),
    ),
    "refusals-ignored": Mutant(
        "S5",
        "an operator who is refused drives on",
        "dva_sim.agents.operator.refusals:Refusals._over",
        _never_over,
    ),
    "confirms-more": Mutant(
        "S5",
        "the DVA confirms more than it has given",
        "dva_sim.core.dva:Dva._grant_of",
        _confirms_more,
    ),
    "promises-forgotten": Mutant(
        "S6",
        "who says OK to an order need never set out",
        "dva_sim.core.orders:Orders._overdue",
        afterwards(lambda self, late, now: [] if late else None),
    ),
    "given-up-miscounted": Mutant(
        "S6",
        "an escalated event counts as expired",
        "dva_sim.core.events:EventTable.move",
        _miscounts_given_up,
    ),
    "severity-stays": Mutant(
        "S6",
        "a later report cannot raise the severity of an event",
        "dva_sim.core.events:EventTable.merge",
        _keeps_first_severity,
    ),
    "restart-prolongs-waits": Mutant(
        "S6",
        "a restart gives every event 120 s more until it is escalated",
        "dva_sim.core.store:Store._recall",
        _waits_longer,
    ),
    "arrives-from-afar": Mutant(
        "S7",
        "a finding counts as the arrival of a robot that is far away",
        "dva_sim.core.orders:Orders._was_near",
        afterwards(lambda self, near, event, device: None if near else True),
    ),
    "confirmed-on-arrival": Mutant(
        "S7",
        "the time of a confirmation is that of the arrival",
        "dva_sim.core.orders:Orders.found",
        _confirmed_on_arrival,
    ),
    "reserved-for-ever": Mutant(
        "S8",
        "a robot that is kept for somebody is kept for ever",
        "dva_sim.core.handovers:Handovers.lapse",
        skipped(lambda self, now: any(known.until <= now for known in self.under_way.values())),
    ),
    "requests-kept": Mutant(
        "S10", "the DVA keeps each request", "dva_sim.core.dva:Dva.handle", _remembers_requests
    ),
    "unknown-unanswered": Mutant(
        "S11",
        "who is not registered gets no answer",
        "dva_sim.agents.device:AgentDevice.conclude",
        quiet_about(m.NOT_REGISTERED),
    ),
}
"""Those of the second time, hunted in two to four storms each before any checker was changed."""
