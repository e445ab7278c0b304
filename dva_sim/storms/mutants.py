"""Planted bugs: each replaces one function of the program, and says when it acts.

They show that the checkers find what they are there to find. A mutant whose function is gone
fails as soon as it is planted; one that never does anything wrong counts for nothing.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any, Final

from dva_sim.agents.robot.controller import STAND, Decision, Mode
from dva_sim.core.events import State
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.storms.later_mutants import LATER_MUTANTS
from dva_sim.storms.planting import (
    RIGHT,
    Bug,
    Make,
    Mutant,
    Original,
    afterwards,
    instead,
    quiet_about,
    skipped,
    with_arguments,
)
from dva_sim.worlds.bodies import TickTarget


@contextmanager
def planted(name: str) -> Iterator[Bug]:
    """Plant a bug while the block lasts.

    Raises:
        ConfigError: no bug has that name.
        AttributeError: its function is gone.
    """
    (one,) = named(name)
    mutant, bug = MUTANTS[one], Bug(one)
    module, _, path = mutant.place.partition(":")
    owner: Any = importlib.import_module(module)
    *way, attribute = path.split(".")
    for step in way:
        owner = getattr(owner, step)
    original = owner.__dict__[attribute] if way else getattr(owner, attribute)
    if not callable(original):
        raise AttributeError(f"{mutant.place} is no function")
    setattr(owner, attribute, wraps(original)(mutant.make(original, bug)))
    try:
        yield bug
    finally:
        setattr(owner, attribute, original)


def named(name: str) -> list[str]:
    """Return the names of the mutants that are meant: one, or all.

    Raises:
        ConfigError: there is none of that name.
    """
    if name == "all":
        return list(MUTANTS)
    if name not in MUTANTS:
        raise ConfigError(unknown("mutant", name, MUTANTS))
    return [name]


_ROBOT = "dva_sim.agents.robot.controller:RobotController"


def _is_driven(controller: Any) -> bool:
    return controller.mode is Mode.TELEOPERATION or controller.by_hand is not None


def _longer(self: Any, decision: Decision, *_: Any) -> Decision | None:
    point = decision.set_point
    if point is None or not point.speed:
        return None
    return decision._replace(set_point=point._replace(until=point.until + 2.0))


def _ignores_age(original: Original, bug: Bug) -> Original:
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


def _ignores_order(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, message: m.Message, *args: Any) -> Any:
        known = self.last_set_id
        self.last_set_id = 0
        decision = original(self, message, *args)
        if decision.code == m.OK and message.message_id <= known:
            bug.act(f"{self.id_tag} obeys command {message.message_id} after {known}")
        self.last_set_id = max(known, self.last_set_id)
        return decision

    return wrong


def _acts_again(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, message: m.Message) -> Any:
        refusal = original(self, message)
        begins = isinstance(message.body, m.StartTeleOp | m.GoTo | m.Patrol | m.ReturnToBase)
        if refusal is not None and begins and self.mode is Mode.IDLE:
            bug.act(f"{self.id_tag} begins by order {message.message_id} once more")

    return wrong


def _feeds_watchdog(kinds: tuple[type, ...]) -> Make:
    """Anything its driver says keeps the robot going."""

    def make(original: Original, bug: Bug) -> Original:
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


def _status_feeds_watchdog(original: Original, bug: Bug) -> Original:
    def wrong(self: Any) -> Any:
        speed, _, until = self.body.asked
        now = self.device.clock.now
        if speed and until > now and self.controller.mode is Mode.TELEOPERATION:
            bug.act(f"{self.device.label} goes on because it has told its status")
            self.move(self.set_point._replace(until=now + self.controller.limits.watchdog))
        return original(self)

    return wrong


def _forgets_refusal(code: int) -> Make:
    """Nobody is refused for one reason."""

    def make(original: Original, bug: Bug) -> Original:
        def wrong(self: Any, message: m.Message, level: str) -> Any:
            refusal = original(self, message, level)
            if refusal is None or refusal.code != code:
                return refusal
            bug.act(f"{self.id_tag} lets {message.source} act: {refusal.text}")
            return None

        return wrong

    return make


def _grants_unasked(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, message: m.Message, body: m.PermissionGrant) -> Any:
        decision = original(self, message, body)
        if decision.code == m.OK and body.level != "sensors" and body != self.grant:
            bug.act(f"{self.id_tag} believes that {body.holder} holds it")
            return self._is_held(body)
        return decision

    return wrong


def _keeps_driver(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, grant: m.PermissionGrant | None) -> Any:
        held = self.grant
        if self.owner is None or (grant and held and grant.session == held.session):
            return original(self, grant)
        bug.act(f"{self.id_tag} is driven on by {self.owner} though {grant} holds it")
        self.grant = grant or held
        return Decision(m.OK)

    return wrong


def _emergency_of_the_holder_only(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, message: m.Message, *args: Any) -> Any:
        if isinstance(message.body, m.Emergency) and message.source != self.owner:
            bug.act(f"{self.id_tag} does not stop for {message.source}")
            return Decision(m.NOT_PERMITTED, "only the holder")
        return original(self, message, *args)

    return wrong


def _resumes(original: Original, bug: Bug) -> Original:
    """Robot that resumes after an emergency at the next request of any kind."""

    def wrong(self: Any, now: float, stopped_by: str | None = None) -> Any:
        mode, owner = self.mode, self.owner
        decision = original(self, now, stopped_by)
        if mode is Mode.TELEOPERATION:
            bug.act(f"{self.id_tag} is still driven by {owner} after an emergency")
            self.mode, self.owner = mode, owner
        return decision

    return wrong


def _keeps_grant_over_restart(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, clock_offset: float, now: float) -> Any:
        kept = self.grant, self.last_order_id, self.last_set_id, self._numbered
        original(self, clock_offset, now)
        if kept[0] is not None:
            bug.act(f"{self.id_tag} restarts and is still held by {kept[0].holder}")
        self.grant, self.last_order_id, self.last_set_id, self._numbered = kept
        self.mode = Mode.TELEOPERATION if kept[0] is not None else self.mode
        self.owner = kept[0].holder if kept[0] is not None else None

    return wrong


def _by_message_id(original: Original, bug: Bug) -> Original:
    """A reply cache that is keyed without the source."""
    known: dict[Any, bytes] = {}

    def wrong(sender: str | None, request: bytes) -> Any:
        found = re.search(rb"<MessageID>(\d+)<", request)
        key = found[1] if found else request
        if known.setdefault(key, request) != request:
            bug.act(f"a request counts as answered that has number {key!r} like another")
        return sender, key

    return wrong


def _quiet_about(original: Original, bug: Bug) -> Original:
    """A message that is none is dropped without a word and without a count."""

    def wrong(self: Any, request: Any) -> Any:
        try:
            decode(request.data)
        except ProtocolError:
            bug.act(f"{self.label} drops a message")
            return None
        return original(self, request)

    return wrong


def _without_last(original: Original, bug: Bug) -> Original:
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


def _miscounts(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, event: Any, state: Any, now: float) -> Any:
        was = event.state
        original(self, event, state, now)
        if str(state) == "confirmed":
            bug.act(f"event {event.number} is counted twice")
            self.counts[was] += 1

    return wrong


def _resets_timer(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, event: Any, severity: float) -> Any:
        original(self, event, severity)
        if event.waits_for is not None:
            bug.act(f"event {event.number} waits from the beginning again")
            event.waiting_since = 1e9

    return wrong


def _says_before_keeping(original: Original, bug: Bug) -> Original:
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


def _confirms_anyway(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, message: m.Message, reply: m.Reply) -> Any:
        if original(self, message, reply) is not reply:
            bug.act(f"{type(message.body).__name__} is confirmed, and not kept")
        return reply

    return wrong


def _loses_grants(original: Original, bug: Bug) -> Original:
    """A restarted DVA has forgotten who holds what."""

    def wrong(self: Any, dva: Any) -> Any:
        original(self, dva)
        grants = dva.sessions.permissions.grants
        for grant in grants.values():
            bug.act(f"the next life of the DVA does not know that {grant.holder} holds a robot")
        grants.clear()

    return wrong


def _loses_open(original: Original, bug: Bug) -> Original:
    """A restarted DVA has forgotten every second open event."""

    def wrong(self: Any, dva: Any, now: float) -> Any:
        found = original(self, dva, now)
        for number in list(dva.events.open)[::2]:
            bug.act(f"event {number} is forgotten by the next life of the DVA")
            dva.events.waiting.pop(number, None)
            del dva.events.open[number]
        return found

    return wrong


def _two_holders(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, message: m.Message, asker: Any, body: Any, now: float) -> Any:
        grants = self.sessions.permissions.grants
        held = grants.get(body.device)
        others = held is not None and held.holder not in (
            message.source,
            self.sessions.permissions.own,
        )
        if not others or body.level == "sensors":
            return original(self, message, asker, body, now)
        del grants[body.device]
        reply, sends = original(self, message, asker, body, now)
        if reply.code == m.OK:
            bug.act(f"{body.device} is given to {message.source} while {held.holder} holds it")
        else:
            grants.setdefault(body.device, held)
        return reply, sends

    return wrong


def _anybody_confirms(original: Original, bug: Bug) -> Original:
    """DVA that lets any report near an event confirm it."""

    def wrong(self: Any, event: Any, severity: float) -> Any:
        original(self, event, severity)
        if str(event.state) in ("assigned", "on scene"):
            bug.act(f"event {event.number} is confirmed by one more report")
            self.move(event, State.CONFIRMED, max(event.times.values()))

    return wrong


def _unbounded(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, key: Any, source: str, reply: bytes) -> Any:
        self._each, self._room = 100_000, 10**9
        original(self, key, source, reply)
        if len(self._kept[source].keys) > 64:
            bug.act(f"{len(self._kept[source].keys)} replies to {source} are kept")
        return reply

    return wrong


def _endless_queue(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, letter: Any, standing: Any) -> Any:
        waits = len(self._lines.get((letter.peer, letter.moves), ()))
        gone = original(self, letter, standing)
        if gone is not letter:
            return gone
        bug.act(f"one more waits behind {waits} of the same sender")
        return None

    return wrong


def _counts_from_now(original: Original, bug: Bug) -> Original:
    """A command is in force from when it was read, not from when it arrived."""

    def wrong(self: Any, message: m.Message, body: m.SetTeleOp, arrived: float, now: float) -> Any:
        waited = now - arrived
        decision = original(self, message, body, max(arrived, now), now)
        if decision.code == m.OK and waited > 0.1 and arrived > self.emergency_at:
            bug.act(f"{self.id_tag} obeys a command {waited:.1f} s too long, which had waited")
        return decision

    return wrong


def _mission_goes_on(original: Original, bug: Bug) -> Original:
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


def _turns_too_fast(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, speed: float, turn_rate: float, until: float) -> Any:
        original(self, speed, turn_rate, until)
        newest = self._asked.newest
        if abs(turn_rate) > 0.2:
            bug.act(f"motors are asked to turn with {1.5 * turn_rate:.2f} rad/s")
            target = TickTarget(newest[0], 2.0 * turn_rate, self._world.tick_at(until))
            self._asked.put(self._world.next_tick(), target)

    return wrong


def _any_level(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, message: m.Message, level: str) -> Any:
        refusal = original(self, message, level)
        if refusal is None or self.grant is None or not self.knows(message):
            return refusal
        bug.act(f"{self.id_tag} lets {message.source} act: {refusal.text}")
        return None

    return wrong


def _swallows(original: Original, bug: Bug) -> Original:
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


def _meets_once(original: Original, bug: Bug) -> Original:
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


def _keeps_all_waiting(original: Original, bug: Bug) -> Original:
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


MUTANTS: Final[dict[str, Mutant]] = {
    "watchdog-too-long": Mutant(
        "S1", "a command is in force two seconds too long", f"{_ROBOT}._set", afterwards(_longer)
    ),
    "watchdog-fed-by-requests": Mutant(
        "S1",
        "any request keeps a robot going",
        "dva_sim.agents.robot.robot:RobotAgent._decide",
        _feeds_watchdog((m.GetMissionStatus, m.GetSensorInfo, m.StartTeleOp, m.PermissionGrant)),
    ),
    "watchdog-fed-by-status": Mutant(
        "S1",
        "a robot goes on as long as it tells its status",
        "dva_sim.agents.robot.robot:RobotAgent._publish_status",
        _status_feeds_watchdog,
    ),
    "age-not-checked": Mutant("S1", "old commands are obeyed", f"{_ROBOT}._set", _ignores_age),
    "order-not-checked": Mutant("S1", "commands act again", f"{_ROBOT}._set", _ignores_order),
    "orders-act-again": Mutant(
        "S1",
        "an old order acts again",
        f"{_ROBOT}._order",
        _acts_again,
    ),
    "stop-ignored": Mutant(
        "S1",
        "StopTeleOp is answered, and changes nothing",
        f"{_ROBOT}._stop",
        instead(lambda self, *_: Decision(m.OK) if self.mode is Mode.TELEOPERATION else RIGHT),
    ),
    "cancel-ignored": Mutant(
        "S1",
        "CancelMission is answered, and changes nothing",
        f"{_ROBOT}._cancel",
        instead(lambda self, *_: Decision(m.OK) if self.mode is Mode.MISSION else RIGHT),
    ),
    "revocation-ignored": Mutant(
        "S2",
        "a revocation is answered, and changes nothing",
        f"{_ROBOT}._revoked",
        instead(
            lambda self, message, body: (
                Decision(m.OK) if self.grant and self.grant.session == body.session else RIGHT
            )
        ),
    ),
    "lease-never-ends": Mutant(
        "S2",
        "a silent driver keeps the robot",
        f"{_ROBOT}.expire",
        instead(
            lambda self, now: False if _is_driven(self) and now - self.last_valid > 30.0 else RIGHT
        ),
    ),
    "changes-hands-moving": Mutant(
        "S2", "a robot that moves is handed over", f"{_ROBOT}._begin", with_arguments(moving=False)
    ),
    "driven-on-by-the-former": Mutant(
        "S2", "the former driver drives on", f"{_ROBOT}._is_held", _keeps_driver
    ),
    "hand-takes-held-robot": Mutant(
        "S2",
        "a robot that somebody holds is taken by hand",
        f"{_ROBOT}.take_by_hand",
        instead(
            lambda self, who, now, moving: (
                _taken(self, who, now) if self.grant is not None and not moving else RIGHT
            )
        ),
    ),
    "two-holders": Mutant(
        "S2",
        "the DVA gives a robot to a second holder",
        "dva_sim.core.dva:Dva._permitted",
        _two_holders,
    ),
    "silent-holder-keeps": Mutant(
        "S2",
        "who is silent keeps its permissions",
        "dva_sim.core.sessions:Sessions.take_back_all",
        skipped(
            lambda self, holder: any(
                grant.holder == holder for grant in self.permissions.grants.values()
            )
        ),
    ),
    "emergency-forgotten": Mutant(
        "S3",
        "an emergency is answered, and changes nothing",
        f"{_ROBOT}.stop",
        instead(
            lambda self, now, stopped_by=None: (
                Decision(m.OK, "stopped") if self.mode is not Mode.IDLE else RIGHT
            )
        ),
    ),
    "emergency-of-holder-only": Mutant(
        "S3",
        "an emergency of a stranger is refused",
        f"{_ROBOT}._handle",
        _emergency_of_the_holder_only,
    ),
    "emergency-resumes": Mutant(
        "S3", "the drive goes on after an emergency", f"{_ROBOT}.stop", _resumes
    ),
    "emergency-leaves-orders": Mutant(
        "S3",
        "an order from before an emergency is obeyed",
        f"{_ROBOT}._begin",
        with_arguments(arrived=float("inf")),
    ),
    "speed-not-clamped": Mutant(
        "S4",
        "motors are asked for more than they may",
        "dva_sim.worlds.bodies:RobotBody.drive",
        lambda original, bug: _unclamped(original, bug, 0.8),
    ),
    "drives-backwards": Mutant(
        "S4",
        "motors are asked to go backwards",
        "dva_sim.worlds.bodies:RobotBody.drive",
        lambda original, bug: _unclamped(original, bug, -0.3),
    ),
    "session-not-checked": Mutant(
        "S5", "any session will do", f"{_ROBOT}._refusal", _forgets_refusal(m.BAD_SESSION)
    ),
    "holder-not-checked": Mutant(
        "S5", "anybody may act", f"{_ROBOT}._refusal", _forgets_refusal(m.NOT_PERMITTED)
    ),
    "grant-not-confirmed": Mutant(
        "S5",
        "a grant counts before the DVA has confirmed it",
        f"{_ROBOT}._granted",
        _grants_unasked,
    ),
    "readers-not-checked": Mutant(
        "S5",
        "anybody may read sensors",
        f"{_ROBOT}._subscription",
        afterwards(lambda self, decision, *_: None if decision.code == m.OK else Decision(m.OK)),
    ),
    "grant-kept-over-restart": Mutant(
        "S1",
        "a restarted robot is still driven",
        f"{_ROBOT}.restart",
        _keeps_grant_over_restart,
    ),
    "timer-reset-by-reports": Mutant(
        "S6",
        "each report lets an event wait from the beginning",
        "dva_sim.core.events:EventTable.merge",
        _resets_timer,
    ),
    "event-forgotten": Mutant(
        "S6", "every fourth event is forgotten", "dva_sim.core.events:EventTable.add", _without_last
    ),
    "counts-wrong": Mutant(
        "S6",
        "a confirmed event is counted twice",
        "dva_sim.core.events:EventTable.move",
        _miscounts,
    ),
    "order-never-ends": Mutant(
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
    "escalation-forgotten": Mutant(
        "S6",
        "no event is escalated",
        "dva_sim.core.orders:Orders.escalate",
        instead(lambda self, event, now: []),
    ),
    "anybody-confirms": Mutant(
        "S6",
        "one more report confirms an event",
        "dva_sim.core.events:EventTable.merge",
        _anybody_confirms,
    ),
    "events-lost-in-a-restart": Mutant(
        "S6",
        "a restarted DVA forgets open events",
        "dva_sim.core.store:Store._recall",
        _loses_open,
    ),
    "grants-not-kept": Mutant(
        "S2",
        "permissions do not survive the DVA",
        "dva_sim.core.store:Store._recall_sessions",
        _loses_grants,
    ),
    "said-before-kept": Mutant(
        "S6",
        "the DVA answers before it has written",
        "dva_sim.simulation.full.dva_server:DvaAgent._keep_changes",
        _says_before_keeping,
    ),
    "confirms-unkept": Mutant(
        "S6",
        "a DVA with a full disk confirms what it has not written",
        "dva_sim.simulation.full.dva_server:DvaAgent._confirmed",
        _confirms_anyway,
    ),
    "times-out-of-order": Mutant(
        "S7",
        "an arrival is noted before the order",
        "dva_sim.core.orders:Orders.arrived",
        lambda original, bug: _too_early(original, bug),
    ),
    "never-registers-again": Mutant(
        "S8",
        "who could not register gives up",
        "dva_sim.agents.device:AgentDevice._register",
        lambda original, bug: _registers_once(original, bug),
    ),
    "stays-silent": Mutant(
        "S8",
        "a restarted program says nothing",
        "dva_sim.agents.device:AgentDevice.restart",
        lambda original, bug: _stays_silent(original, bug),
    ),
    "question-lost": Mutant(
        "S8",
        "a question that was not answered is never asked again",
        "dva_sim.agents.robot.inquiry:Inquiry.unanswered",
        skipped(lambda self: self.asked is not None),
    ),
    "replies-without-bound": Mutant(
        "S10",
        "replies are kept for ever",
        "dva_sim.protocol.exchange:ReplyCache.put",
        _unbounded,
    ),
    "strangers-fill-the-queue": Mutant(
        "S10",
        "any number of messages may wait",
        "dva_sim.agents.robot.command_queue:FairQueue._make_room",
        _endless_queue,
    ),
    "reply-cache-without-source": Mutant(
        "S6",
        "a request with the number of another gets its answer",
        "dva_sim.agents.device:key_of",
        _by_message_id,
    ),
    "bad-messages-uncounted": Mutant(
        "S11",
        "what is no message is dropped without a word",
        "dva_sim.agents.device:AgentDevice.admit",
        _quiet_about,
    ),
    "no-room-no-word": Mutant(
        "S11",
        "a message for which there is no room is dropped without a word",
        "dva_sim.agents.robot.robot:RobotAgent._turn_away",
        skipped(),
    ),
    "counts-from-reading": Mutant(
        "S1", "a command that waited is in force too long", f"{_ROBOT}._set", _counts_from_now
    ),
    "end-not-passed-on": Mutant(
        "S2",
        "no robot hears that a session is over",
        "dva_sim.core.sessions:Sessions.tell_robot",
        skipped(),
    ),
    "mission-survives-emergency": Mutant(
        "S3", "a mission goes on after an emergency", f"{_ROBOT}.stop", _mission_goes_on
    ),
    "turns-too-fast": Mutant(
        "S4",
        "motors are asked to turn faster than they may",
        "dva_sim.worlds.bodies:RobotBody.drive",
        _turns_too_fast,
    ),
    "level-not-checked": Mutant(
        "S5", "who may drive may send on missions, too", f"{_ROBOT}._refusal", _any_level
    ),
    "reports-swallowed": Mutant(
        "S6",
        "a report is taken for one of another event",
        "dva_sim.core.events:EventTable.near",
        _swallows,
    ),
    "subscribes-once": Mutant(
        "S8",
        "the DVA does not listen to who comes back",
        "dva_sim.simulation.full.dva_server:DvaAgent._meet",
        _meets_once,
    ),
    "questions-without-bound": Mutant(
        "S10",
        "any number of messages waits for the DVA's answer",
        "dva_sim.agents.robot.confirmations:Confirmations.keep",
        _keeps_all_waiting,
    ),
    "silent-when-busy": Mutant(
        "S11",
        "a refusal as busy is not said",
        "dva_sim.agents.device:AgentDevice.conclude",
        quiet_about(m.BUSY),
    ),
} | LATER_MUTANTS


def _taken(controller: Any, who: str, now: float) -> Decision:
    controller.by_hand, controller.last_valid = who, now
    return Decision(m.OK, set_point=STAND)


def _unclamped(original: Original, bug: Bug, speed: float) -> Original:
    def wrong(self: Any, wanted: float, turn_rate: float, until: float) -> Any:
        original(self, wanted, turn_rate, until)
        if wanted > 0.1:
            bug.act(f"motors are asked for {speed} m/s")
            self._asked.put(
                self._world.next_tick(), TickTarget(speed, 0.0, self._world.tick_at(until))
            )

    return wrong


def _too_early(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, event: Any, device: str, now: float) -> Any:
        original(self, event, device, now)
        if "arrived" in event.times and "assigned" in event.times:
            bug.act(f"event {event.number}: arrived before it was assigned")
            event.times["arrived"] = event.times["assigned"] - 1.0

    return wrong


def _registers_once(original: Original, bug: Bug) -> Original:
    def wrong(self: Any, then: Any, life: int) -> Any:
        ask = self.ask

        def asks(peer: str, body: Any, on_reply: Any, on_failure: Any, *rest: Any) -> Any:
            def fails() -> None:
                bug.act(f"{self.label} gives up to register")

            return ask(peer, body, on_reply, fails, *rest)

        self.ask = asks
        try:
            return original(self, then, life)
        finally:
            del self.ask

    return wrong


def _stays_silent(original: Original, bug: Bug) -> Original:
    def wrong(self: Any) -> Any:
        original(self)
        bug.act(f"{self.label} says nothing any more")
        self.silent = True

    return wrong
