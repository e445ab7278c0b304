"""Bugs of robots."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from helpers.mutation.planting import (
    RIGHT,
    Bug,
    Make,
    Original,
    Planted,
    afterwards,
    instead,
    skipped,
    with_arguments,
)

from dva_sim.agents.robot.controller import STANDSTILL, Decision, Mode
from dva_sim.protocol import messages as m
from dva_sim.worlds.bodies import TickTarget

_ROBOT = "dva_sim.agents.robot.controller:RobotController"
_LATCH = "dva_sim.agents.robot.emergency_latch:EmergencyLatch"


def _is_driven(controller: Any) -> bool:
    return controller.mode is Mode.TELEOPERATION or controller.by_hand is not None


def _longer(self: Any, decision: Decision, *_: Any) -> Decision | None:
    point = decision.set_point
    if point is None or not point.speed:
        return None
    return decision._replace(set_point=point._replace(until=point.until + 2.0))


def _ignores_age(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, message: m.Message, body: m.SetTeleOp, arrived: float, now: float) -> Any:
        right = original(self, message, body, arrived, now)
        if right.code != m.STALE:
            return right
        self.last_set_id -= 1
        other = original(self, message, m.SetTeleOp(body.speed, body.turn_rate), arrived, now)
        if other.code == m.OK:
            bug.act(f"{self.id_tag} obeys a command that is too old")
        return other

    return wrong


def _ignores_order(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, message: m.Message, *args: Any) -> Any:
        known = self.last_set_id
        self.last_set_id = 0
        decision = original(self, message, *args)
        if decision.code == m.OK and message.message_id <= known:
            bug.act(f"{self.id_tag} obeys command {message.message_id} after {known}")
        self.last_set_id = max(known, self.last_set_id)
        return decision

    return wrong


def _acts_again(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, message: m.Message) -> Any:
        refusal = original(self, message)
        begins = isinstance(message.body, m.StartTeleOp | m.GoTo | m.Patrol | m.ReturnToBase)
        if refusal is not None and begins and self.mode is Mode.IDLE:
            bug.act(f"{self.id_tag} begins by order {message.message_id} once more")

    return wrong


def _feeds_watchdog(kinds: tuple[type, ...]) -> Make:
    """Anything its driver says keeps the robot going."""

    def make(original: Original, bug: Planted) -> Original:
        def wrong(self: Any, message: m.Message, *args: Any, **named_args: Any) -> Any:
            decision = original(self, message, *args, **named_args)
            speed, _, until = self.body.asked
            now = self.device.clock.now
            if isinstance(message.body, kinds) and speed and until > now:
                longer = self.set_point._replace(until=now + self.controller.limits.watchdog)
                if self.controller.mode is Mode.TELEOPERATION:
                    bug.act(f"{self.device.label} goes on because of {type(message.body).__name__}")
                    self.move(longer)
            return decision

        return wrong

    return make


def _status_feeds_watchdog(original: Original, bug: Planted) -> Original:
    def wrong(self: Any) -> Any:
        speed, _, until = self.body.asked
        now = self.device.clock.now
        if speed and until > now and self.controller.mode is Mode.TELEOPERATION:
            bug.act(f"{self.device.label} goes on because it has told its status")
            self.move(self.set_point._replace(until=now + self.controller.limits.watchdog))
        return original(self)

    return wrong


def _forgets_refusal(code: int) -> Make:
    """A rule that refuses senders for one reason refuses nobody."""

    def make(original: Original, bug: Planted) -> Original:
        def wrong(self: Any, message: m.Message, level: str) -> Any:
            refusal = original(self, message, level)
            if refusal is None or refusal.code != code:
                return refusal
            bug.act(f"{self.id_tag} lets {message.source} act: {refusal.text}")
            return None

        return wrong

    return make


def _grants_unasked(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, message: m.Message, body: m.PermissionGrant) -> Any:
        decision = original(self, message, body)
        if decision.code == m.OK and body.level != "sensors" and body != self.grant:
            bug.act(f"{self.id_tag} believes that {body.holder} holds it")
            return self._is_held(body)
        return decision

    return wrong


def _keeps_driver(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, grant: m.PermissionGrant | None) -> Any:
        held = self.grant
        if self.owner is None or (grant and held and grant.session == held.session):
            return original(self, grant)
        bug.act(f"{self.id_tag} is driven on by {self.owner} though {grant} holds it")
        self.grant = grant or held
        return Decision(m.OK)

    return wrong


def _emergency_of_the_holder_only(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, message: m.Message, *args: Any) -> Any:
        if isinstance(message.body, m.Emergency) and message.source != self.owner:
            bug.act(f"{self.id_tag} does not stop for {message.source}")
            return Decision(m.NOT_PERMITTED, "only the holder")
        return original(self, message, *args)

    return wrong


def _resumes(original: Original, bug: Planted) -> Original:
    """Robot that resumes after an emergency at the next request of any kind."""

    def wrong(self: Any, now: float, stopped_by: str | None = None) -> Any:
        mode, owner = self.mode, self.owner
        decision = original(self, now, stopped_by)
        if mode is Mode.TELEOPERATION:
            bug.act(f"{self.id_tag} is still driven by {owner} after an emergency")
            self.mode, self.owner = mode, owner
        return decision

    return wrong


def _keeps_grant_over_restart(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, clock_offset: float, now: float) -> Any:
        kept = self.grant, self.last_order_id, self.last_set_id, self._numbered
        original(self, clock_offset, now)
        if kept[0] is not None:
            bug.act(f"{self.id_tag} restarts and is still held by {kept[0].holder}")
        self.grant, self.last_order_id, self.last_set_id, self._numbered = kept
        self.mode = Mode.TELEOPERATION if kept[0] is not None else self.mode
        self.owner = kept[0].holder if kept[0] is not None else None

    return wrong


def _endless_queue(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, letter: Any, standing: Any) -> Any:
        waits = len(self._lines.get((letter.peer, letter.moves), ()))
        gone = original(self, letter, standing)
        if gone is not letter:
            return gone
        bug.act(f"one more waits behind {waits} of the same sender")
        return None

    return wrong


def _counts_from_now(original: Original, bug: Planted) -> Original:
    """A command is in force from when it was read, not from when it arrived."""

    def wrong(self: Any, message: m.Message, body: m.SetTeleOp, arrived: float, now: float) -> Any:
        waited = now - arrived
        decision = original(self, message, body, max(arrived, now), now)
        if decision.code == m.OK and waited > 0.1 and arrived > self.emergency_at:
            bug.act(f"{self.id_tag} obeys a command {waited:.1f} s too long, which had waited")
        return decision

    return wrong


def _mission_goes_on(original: Original, bug: Planted) -> Original:
    """An emergency stops a robot for a moment; its mission is not over."""

    def wrong(self: Any, now: float, stopped_by: str | None = None) -> Any:
        kept = self.mode, self.owner, self.mission, self.mission_status
        decision = original(self, now, stopped_by)
        if kept[0] is Mode.MISSION:
            bug.act(f"{self.id_tag} has its mission still after an emergency")
            self.mode, self.owner, self.mission, self.mission_status = kept
            return Decision(decision.code, decision.text)
        return decision

    return wrong


def _turns_too_fast(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, speed: float, turn_rate: float, until: float) -> Any:
        original(self, speed, turn_rate, until)
        newest = self._asked.newest
        if abs(turn_rate) > 0.2:
            bug.act(f"motors are asked to turn with {1.5 * turn_rate:.2f} rad/s")
            target = TickTarget(newest[0], 2.0 * turn_rate, self._world.tick_at(until))
            self._asked.put(self._world.next_tick(), target)

    return wrong


def _any_level(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, message: m.Message, level: str) -> Any:
        refusal = original(self, message, level)
        if refusal is None or self.grant is None or not self.knows(message):
            return refusal
        bug.act(f"{self.id_tag} lets {message.source} act: {refusal.text}")
        return None

    return wrong


def _keeps_all_waiting(original: Original, bug: Planted) -> Original:
    """Any number of messages waits for an answer of the DVA, and for ever."""

    def wrong(self: Any, letter: Any, message: m.Message) -> Any:
        waiting = list(self._waiting)
        self._waiting.clear()
        kept = original(self, letter, message)
        self._waiting[:0] = waiting
        if len(self._waiting) > 64:
            bug.act(f"{len(self._waiting)} messages wait for an answer of the DVA")
        return kept

    return wrong


def _taken(controller: Any, who: str, now: float) -> Decision:
    controller.by_hand, controller.last_valid = who, now
    return Decision(m.OK, set_point=STANDSTILL)


def _unclamped(original: Original, bug: Planted, speed: float) -> Original:
    def wrong(self: Any, wanted: float, turn_rate: float, until: float) -> Any:
        original(self, wanted, turn_rate, until)
        if wanted > 0.1:
            bug.act(f"motors are asked for {speed} m/s")
            self._asked.put(
                self._world.next_tick(), TickTarget(speed, 0.0, self._world.tick_at(until))
            )

    return wrong


def _obeys_future_ticks(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, message: m.Message, body: m.SetTeleOp, arrived: float, now: float) -> Any:
        tick = self.tick(now)
        if body.seen_tick is None or body.seen_tick <= tick:
            return original(self, message, body, arrived, now)
        decision = original(self, message, body._replace(seen_tick=tick), arrived, now)
        if decision.code == m.OK:
            bug.act(f"{self.id_tag} obeys behind a picture of {body.seen_tick - tick} ms ahead")
        return decision

    return wrong


def _keeps_mission(original: Original, bug: Planted) -> Original:
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


def _ignores_latch(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, arrived: float, moving: bool, releases: bool = False) -> Any:
        was_held = self.latch.holds
        self.latch.holds = False
        refusal = original(self, arrived, moving, releases)
        self.latch.holds = was_held
        if was_held and refusal is None:
            bug.act(f"{self.id_tag} takes an order though nobody has released it")
        return refusal

    return wrong


def _forgets_latch(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, clock_offset: float, now: float) -> None:
        original(self, clock_offset, now)
        if self.latch.holds:
            bug.act(f"{self.id_tag} restarts, and is stopped no longer")
            self.latch.release(None)

    return wrong


def _takes_any_release(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, answer: m.EmergencyRelease) -> None:
        if self.holds and answer.released is not None and answer.tick != self.tick:
            bug.act(f"a release of {answer.tick} ends the emergency of {self.tick}")
            answer = replace(answer, tick=self.tick)
        original(self, answer)

    return wrong


def _as_fast_as_wanted(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, speed: float, turn_rate: float, until: float) -> Any:
        original(self, speed, turn_rate, until)
        if speed > 1.05 * self.spec.max_speed:
            bug.act(f"motors are asked for {speed:.2f} m/s, as somebody wants it")
            target = TickTarget(speed, turn_rate, self._world.tick_at(until))
            self._asked.put(self._world.next_tick(), target)

    return wrong


ROBOT_BUGS: Final = (
    Bug(
        "watchdog-too-long",
        "S1",
        "a command is in force two seconds too long",
        f"{_ROBOT}._set",
        afterwards(_longer),
    ),
    Bug(
        "watchdog-fed-by-requests",
        "S1",
        "any request keeps a robot going",
        "dva_sim.agents.robot.robot:RobotAgent._decide",
        _feeds_watchdog((m.GetMissionStatus, m.GetSensorInfo, m.StartTeleOp, m.PermissionGrant)),
    ),
    Bug(
        "watchdog-fed-by-status",
        "S1",
        "a robot goes on as long as it tells its status",
        "dva_sim.agents.robot.robot:RobotAgent._publish_status",
        _status_feeds_watchdog,
    ),
    Bug(
        "age-not-checked",
        "S1",
        "old commands are obeyed",
        f"{_ROBOT}._set",
        _ignores_age,
    ),
    Bug(
        "order-not-checked",
        "S1",
        "commands act again",
        f"{_ROBOT}._set",
        _ignores_order,
    ),
    Bug(
        "orders-act-again",
        "S1",
        "an old order acts again",
        f"{_ROBOT}._order",
        _acts_again,
    ),
    Bug(
        "stop-ignored",
        "S1",
        "StopTeleOp is answered, and changes nothing",
        f"{_ROBOT}._stop",
        instead(lambda self, *_: Decision(m.OK) if self.mode is Mode.TELEOPERATION else RIGHT),
    ),
    Bug(
        "cancel-ignored",
        "S1",
        "CancelMission is answered, and changes nothing",
        f"{_ROBOT}._cancel",
        instead(lambda self, *_: Decision(m.OK) if self.mode is Mode.MISSION else RIGHT),
    ),
    Bug(
        "grant-kept-over-restart",
        "S1",
        "a restarted robot is still driven",
        f"{_ROBOT}.restart",
        _keeps_grant_over_restart,
    ),
    Bug(
        "counts-from-reading",
        "S1",
        "a command that waited is in force too long",
        f"{_ROBOT}._set",
        _counts_from_now,
    ),
    Bug(
        "future-tick-obeyed",
        "S1",
        "a command behind a picture that was not taken yet is obeyed",
        f"{_ROBOT}._set",
        _obeys_future_ticks,
    ),
    Bug(
        "revocation-ignored",
        "S2",
        "a revocation is answered, and changes nothing",
        f"{_ROBOT}._revoked",
        instead(
            lambda self, message, body: (
                Decision(m.OK) if self.grant and self.grant.session == body.session else RIGHT
            )
        ),
    ),
    Bug(
        "lease-never-ends",
        "S2",
        "a silent driver keeps the robot",
        f"{_ROBOT}.expire",
        instead(
            lambda self, now: False if _is_driven(self) and now - self.last_valid > 30.0 else RIGHT
        ),
    ),
    Bug(
        "changes-hands-moving",
        "S2",
        "a robot that moves is handed over",
        f"{_ROBOT}._begin",
        with_arguments(moving=False),
    ),
    Bug(
        "driven-on-by-the-former",
        "S2",
        "the former driver drives on",
        f"{_ROBOT}._is_held",
        _keeps_driver,
    ),
    Bug(
        "hand-takes-held-robot",
        "S2",
        "a robot that somebody holds is taken by hand",
        f"{_ROBOT}.take_by_hand",
        instead(
            lambda self, who, now, moving: (
                _taken(self, who, now) if self.grant is not None and not moving else RIGHT
            )
        ),
    ),
    Bug(
        "mission-outlives-session",
        "S2",
        "a mission goes on when its session is over",
        f"{_ROBOT}._is_held",
        _keeps_mission,
    ),
    Bug(
        "emergency-forgotten",
        "S3",
        "an emergency is answered, and changes nothing",
        f"{_ROBOT}.stop",
        instead(
            lambda self, now, stopped_by=None: (
                Decision(m.OK, "stopped") if self.mode is not Mode.IDLE else RIGHT
            )
        ),
    ),
    Bug(
        "emergency-of-holder-only",
        "S3",
        "an emergency of a stranger is refused",
        f"{_ROBOT}._handle",
        _emergency_of_the_holder_only,
    ),
    Bug(
        "emergency-resumes",
        "S3",
        "the drive goes on after an emergency",
        f"{_ROBOT}.stop",
        _resumes,
    ),
    Bug(
        "emergency-leaves-orders",
        "S3",
        "an order from before an emergency is obeyed",
        f"{_ROBOT}._begin",
        with_arguments(arrived=float("inf")),
    ),
    Bug(
        "mission-survives-emergency",
        "S3",
        "a mission goes on after an emergency",
        f"{_ROBOT}.stop",
        _mission_goes_on,
    ),
    Bug(
        "button-ignored",
        "S3",
        "the button at a robot stops nothing",
        f"{_ROBOT}.stop",
        instead(
            lambda self, now, stopped_by=None: (
                Decision(m.OK) if stopped_by is None and self.mode is not Mode.IDLE else RIGHT
            )
        ),
    ),
    Bug(
        "latch-forgotten",
        "S3",
        "a stopped robot takes orders that nobody has released it for",
        f"{_ROBOT}._begin",
        _ignores_latch,
    ),
    Bug(
        "start-releases",
        "S3",
        "a new start releases a robot though a person should",
        f"{_LATCH}.starts",
        afterwards(lambda self, may: None if may else True),
    ),
    Bug(
        "restart-releases",
        "S3",
        "a robot that restarts forgets that it is stopped",
        f"{_ROBOT}.restart",
        _forgets_latch,
    ),
    Bug(
        "earlier-release-counts",
        "S3",
        "a release of an earlier emergency ends the newest one",
        f"{_LATCH}.take_answer",
        _takes_any_release,
    ),
    Bug(
        "speed-not-clamped",
        "S4",
        "motors are asked for more than they may",
        "dva_sim.worlds.bodies:RobotBody.drive",
        lambda original, bug: _unclamped(original, bug, 0.8),
    ),
    Bug(
        "drives-backwards",
        "S4",
        "motors are asked to go backwards",
        "dva_sim.worlds.bodies:RobotBody.drive",
        lambda original, bug: _unclamped(original, bug, -0.3),
    ),
    Bug(
        "turns-too-fast",
        "S4",
        "motors are asked to turn faster than they may",
        "dva_sim.worlds.bodies:RobotBody.drive",
        _turns_too_fast,
    ),
    Bug(
        "as-fast-as-wanted",
        "S4",
        "motors are asked for what somebody wants",
        "dva_sim.worlds.bodies:RobotBody.drive",
        _as_fast_as_wanted,
    ),
    Bug(
        "session-not-checked",
        "S5",
        "any session will do",
        f"{_ROBOT}._refusal",
        _forgets_refusal(m.BAD_SESSION),
    ),
    Bug(
        "holder-not-checked",
        "S5",
        "anybody may act",
        f"{_ROBOT}._refusal",
        _forgets_refusal(m.NOT_PERMITTED),
    ),
    Bug(
        "grant-not-confirmed",
        "S5",
        "a grant counts before the DVA has confirmed it",
        f"{_ROBOT}._granted",
        _grants_unasked,
    ),
    Bug(
        "readers-not-checked",
        "S5",
        "anybody may read sensors",
        f"{_ROBOT}._subscription",
        afterwards(lambda self, decision, *_: None if decision.code == m.OK else Decision(m.OK)),
    ),
    Bug(
        "level-not-checked",
        "S5",
        "who may drive may send on missions, too",
        f"{_ROBOT}._refusal",
        _any_level,
    ),
    Bug(
        "reads-on",
        "S5",
        "who may read a sensor no longer gets its values",
        "dva_sim.agents.robot.controller:RobotController.may_read",
        afterwards(lambda self, may, device, sensor: None if may else True),
    ),
    Bug(
        "question-lost",
        "S8",
        "a question that was not answered is never asked again",
        "dva_sim.agents.robot.inquiry:Inquiry.unanswered",
        skipped(lambda self: self.asked is not None),
    ),
    Bug(
        "strangers-fill-the-queue",
        "S10",
        "any number of messages may wait",
        "dva_sim.agents.robot.command_queue:FairQueue._make_room",
        _endless_queue,
    ),
    Bug(
        "questions-without-bound",
        "S10",
        "any number of messages waits for the DVA's answer",
        "dva_sim.agents.robot.confirmations:Confirmations.keep",
        _keeps_all_waiting,
    ),
    Bug(
        "no-room-no-word",
        "S11",
        "a message for which there is no room is dropped without a word",
        "dva_sim.agents.robot.robot:RobotAgent._turn_away",
        skipped(),
    ),
)
