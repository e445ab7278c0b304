"""Days that go wrong: a core at random among devices that fail, lie, vanish and come back."""

import math
import random
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from helpers.dva.dispatch_office import DVA, crow, east

from dva_sim.core.assignments import Rules
from dva_sim.core.dispatch import (
    POLICIES,
    Advice,
    Announcement,
    Assignment,
    Policy,
    Relocation,
    Situation,
)
from dva_sim.core.dva import Dva
from dva_sim.core.events import ACT_STEPS, STEPS, Event, Handling, State
from dva_sim.core.permissions import Access, AccessRule
from dva_sim.core.roles import Roles
from dva_sim.core.sessions import Permissions, Send, Sessions
from dva_sim.core.store import Store
from dva_sim.core.travel_times import SiteKnowledge, WaitingPlace
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import ControlRoomRole

KINDS = {"Guard": 3, "Robot": 2, "TeleOp": 2, "Sensor": 2, "ControlRoom": 2}
DEVICES = {
    f"02:00:00:{kind_number:02X}:00:{number:02X}": kind
    for kind_number, (kind, count) in enumerate(KINDS.items(), 1)
    for number in range(count)
}
ROOMS = [device for device, kind in DEVICES.items() if kind == "ControlRoom"]
ROLES = dict(zip(ROOMS, (ControlRoomRole.SUPERVISE, ControlRoomRole.DISPATCH), strict=True))
POLICY_NAMES = sorted(POLICIES.keys() - {"oracle"} | {"chaos"})
LOOKS = (State.ASSIGNED, State.ON_SCENE)
GROUND = SiteKnowledge(
    None,
    tuple(WaitingPlace(str(at), east(at)) for at in (0, 50, 100)),
    np.array([[9.0, 80, 160], [80, 9, 80], [160, 80, 9]]),
    np.array([0.2, 0.3, 0.5]),
)
LIMIT = 100.0  # order limit [s]


class Chaos(Policy):
    """Anything at all: sensible, forbidden, or nonsense."""

    preempts = auctions = relocates = True

    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        dice = random.Random(int(rng.integers(2**32)))
        tasks, team = len(situation.tasks), len(situation.responders)
        advice: list[Advice] = []
        for _ in range(dice.randrange(6)):
            what = dice.random()
            if what < 0.7 and tasks:
                advice.append(Assignment(dice.randrange(tasks), dice.randrange(team)))
            elif what < 0.85 and tasks:
                advice.append(Announcement(dice.randrange(tasks)))
            else:
                advice.append(Relocation(dice.randrange(team), dice.randrange(3)))
        if dice.random() < 0.02:
            advice.append(Assignment(tasks, team))
        return advice


class Walk:
    """One day at the core.

    Args:
        seed: Random seed.
        folder: Folder of the state file.
        policy: Name of the policy; a random one by default.
    """

    def __init__(self, seed: int, folder: Path, policy: str | None = None) -> None:
        self.dice = random.Random(seed)
        self.file = folder / f"{seed}.sqlite"
        self.policy = policy or self.dice.choice(POLICY_NAMES)
        self.rules = Rules(
            escalate_after=self.dice.choice([0.0, 30.0, 120.0, math.inf]),
            containment=self.dice.random() < 0.6,
            most_waiting=self.dice.choice([None, None, 0, 2]),
            merge_distance=self.dice.choice([0.0, 8.0]),
            order_limit=LIMIT,
            operator_span=1 + seed % 3,
            decide_within=self.dice.choice([5.0, 20.0]),
        )
        self.ask_first = self.dice.random() < 0.5
        self.access_until = self.dice.choice([math.inf, 300.0])
        self.now, self.numbers = 0.0, dict.fromkeys(DEVICES, 0)
        self.alive = dict.fromkeys(DEVICES, True)
        self.in_flight: list[Send] = []
        self.core, self.memory = self._core(), self._store()
        for device in DEVICES:
            self._register(device)
            self._status(device)
        self._take([])

    def _store(self) -> Store:
        """The file; the time is written whenever something is, so that no part of it is lost."""
        store = Store(self.file)
        store.keeps_time = 0.0
        return store

    def _core(self) -> Dva:
        sessions = Sessions(Permissions(lambda: self.dice.randrange(2**32)))
        rng = np.random.default_rng(self.dice.randrange(2**31))
        holds = AccessRule(until=self.access_until)
        core = Dva(
            self._policy(),
            crow,
            self.rules,
            rng=rng,
            sessions=sessions,
            ground=GROUND,
            access=Access((holds,)),
            roles=Roles(dict(ROLES)),
            ask_first=self.ask_first,
        )
        _watch(core)
        return core

    def _policy(self) -> Policy:
        return Chaos() if self.policy == "chaos" else POLICIES[self.policy]()

    # --- random steps ------------------------------------------------------------------

    def step(self) -> None:
        """Something happens, and is written down."""
        name = self.dice.choices(list(STEPS_OF_A_WALK), list(STEPS_OF_A_WALK.values()))[0]
        self._take(getattr(self, f"_{name}")() or [])
        self.check(name)

    def _take(self, sends: list[Send]) -> None:
        assert self.memory.keep(self.core, self.core.events.changes(), self.now) is None
        self.in_flight += sends

    def say(self, source: str, body: m.Body, number: int | None = None) -> list[Send]:
        if number is None:
            number = self.numbers[source] = self.numbers[source] + 1
        stamp = f"12:00:{self.dice.randrange(60):02d}.{self.dice.randrange(10**6)}"
        message = m.Message(DVA, number, source, stamp, 0, body)
        reply, sends = self.core.handle(message, self.now)
        assert reply.answers == number
        return sends

    def _any(self, *kinds: str) -> str:
        return self.dice.choice([d for d, kind in DEVICES.items() if not kinds or kind in kinds])

    def _some_event(self) -> int:
        newest = self.core.events.total
        known = list(self.core.events.open) or [newest]
        return self.dice.choice([*known, *known, max(1, newest), newest + 1])

    def _place(self) -> m.Position:
        return east(self.dice.choice([0, 5, 20, 40, 60, 99]))

    def _register(self, device: str | None = None) -> list[Send]:
        device = device or self._any()
        body = m.Registration(device[-8:], DEVICES[device], "10.0.0.1")
        return self.say(device, body)

    def _impostor(self) -> list[Send]:
        body, device = m.Registration("x", self.dice.choice(list(KINDS)), "10.0.0.66"), self._any()
        if device not in self.core.registry.entries:
            return []  # who is forgotten may be anybody
        return self.say(device, body)

    def _restart(self) -> list[Send]:
        device = self._any()
        self.numbers[device], self.alive[device] = 0, True
        return self._register(device)

    def _vanish(self) -> None:
        self.alive[self._any()] = False

    def _return(self) -> None:
        self.alive[self._any()] = True

    def _status(self, device: str | None = None) -> None:
        device = device or self._any("Guard", "Robot")
        body: m.Body = m.PersonStatus("waiting", self._place())
        if DEVICES[device] == "Robot":
            body = m.RobotStatus("Idle", self._place(), 0.0, 0.0, 0.0, 5)
        self.core.note(m.Message(DVA, 1, device, "12:00:00", 0, body), self.now)

    def _report(self) -> list[Send]:
        finding = "refuted" if self.dice.random() < 0.25 else "detected"
        kind = self.dice.choice(["fire", "flood"])
        severity, sure = self.dice.random(), self.dice.random()
        body = m.EventReport(None, kind, self._place(), severity, sure, finding)
        return self.say(self._any("Sensor", "Guard"), body)

    def _delivered(self) -> list[Send]:
        return self._answer(self.core.delivered, keep=0.1)

    def _undelivered(self) -> list[Send]:
        return self._answer(self.core.undelivered, keep=0.05)

    def _answer(self, what: Callable[[Send, float], list[Send]], keep: float) -> list[Send]:
        """Word of something sent comes back, in any order; of a few things twice."""
        if not self.in_flight:
            return []
        place = self.dice.randrange(min(len(self.in_flight), 6))
        send = self.in_flight[place]
        if self.dice.random() > keep:
            del self.in_flight[place]
        return what(send, self.now)

    def _progress(self) -> list[Send]:
        """Report progress, mostly from the unit with the order and about its event."""
        working = self.core.orders.engaged
        device = self._any()
        if working and self.dice.random() < 0.8:
            device = self.dice.choice(list(working))
        number = self._some_event()
        if device in working and self.dice.random() < 0.8:
            number = working.all(device)[0].number
        states = ["accepted", "departed", "arrived", "done", "failed", "declined"]
        return self.say(device, m.OrderProgress(number, self.dice.choice(states)))

    def _found(self) -> list[Send]:
        number = self._some_event()
        event, device = self.core.events.get(number), self._any()
        if event is not None and event.sent and self.dice.random() < 0.8:
            device = self.dice.choice(sorted(event.sent))
        finding = self.dice.choice(["confirmed", "confirmed", "refuted", "contained", "detected"])
        kind, place = ("fire", self._place()) if event is None else (event.kind, event.position)
        return self.say(device, m.EventReport(number, kind, place, 0.5, 0.9, finding))

    def _bid(self) -> list[Send]:
        running = self.core.dispatcher.auctions.running
        number = self.dice.choice(list(running)) if running else self._some_event()
        return self.say(self._any("Guard", "Robot"), m.TaskBid(number, self.dice.random() * 100))

    def _decide(self) -> list[Send]:
        """Somebody at a control room decides: mostly what can be, and about what is there."""
        number, device = self._some_event(), self._any("Guard", "Robot")
        event = self.core.events.get(number)
        seen = None if event is None or self.dice.random() < 0.4 else event.handling.decisions
        if event is not None and event.holder and self.dice.random() < 0.3:
            device = event.responder or device
        driver = self._any("TeleOp", "ControlRoom") if self.dice.random() < 0.3 else None
        task = self.dice.choice([None, "confirm", "contain", "stand_by"])
        body = self.dice.choice(
            [
                m.Assign(number, device, driver, task, None, seen),
                m.Assign(number, device, driver, task, None, seen),
                m.TakeOff(number, device, None, seen),
                m.Acknowledge(number),
                m.AddNote(number, "a note"),
                m.GetProposal(number),
                m.GetEventList(),
                m.SetDispatch(self.dice.choice(["automatic", "ask_first"])),
                m.Revoke(self._any("Robot")),
                *([m.FalseAlarm(number, "toast"), m.Escalate(number)] * (number % 4 == 0)),
            ]
        )
        return self.say(self.dice.choice(ROOMS), body)

    def _permission(self) -> list[Send]:
        level = self.dice.choice(["teleoperation", "missions", "both", "sensors"])
        body = m.PermissionRequest(self._any("Robot", "Guard"), level, ("heat_flux",))
        return self.say(self._any(), body)

    def _give_back(self) -> list[Send]:
        held = self.core.sessions.permissions.all()
        if not held:
            return []
        grant = self.dice.choice(held)
        return self.say(
            grant.holder, m.PermissionRevocation(grant.robot, grant.holder, grant.session)
        )

    def _time(self) -> list[Send]:
        return self.pass_time(self.dice.choice([0.125, 1.0, 1.0, 2.0, 5.0, 9.0, 12.0, 40.0, 130.0]))

    def _deadline(self) -> list[Send]:
        due = self.core.next_deadline()
        return self.pass_time(min(math.ceil((due - self.now) * 8) / 8, 60.0) if due < 1e9 else 1.0)

    def pass_time(self, seconds: float) -> list[Send]:
        """Let time pass: live devices send heartbeats, and the core checks its deadlines."""
        self.now += max(seconds, 0.125)
        for device, alive in self.alive.items():
            if alive:
                beat = m.Message(DVA, 1, device, "12:00:00", None, m.Heartbeat())
                self.core.note(beat, self.now)
        sends = self.core.tick(self.now)
        assert self.core.next_deadline() > self.now
        ends = (e.waiting_since for e in self.core.events.waiting.values())
        assert all(self.now < since + self.rules.escalate_after for since in ends)
        pending = {n for n, e in self.core.events.open.items() if e.state is State.PENDING}
        assert self.core.dispatcher.auctions.running.keys() <= pending
        return sends

    def _kill(self) -> list[Send]:
        """The core is killed, and a new one goes on from the file."""
        before = snapshot(self.core)
        self.memory.close()
        self.core, self.memory = self._core(), self._store()
        self.memory.recall(self.core, self.now)
        after = snapshot(self.core)
        assert after == before, {k: (before[k], after[k]) for k in after if after[k] != before[k]}
        for device in DEVICES:
            self._status(device)
        self.in_flight = [s for s in self.in_flight if self.dice.random() < 0.5]
        return self.core.orders.again()

    # --- invariants --------------------------------------------------------------------

    def check(self, after: str) -> None:
        """All invariants."""
        core, events = self.core, self.core.events
        assert sum(events.counts.values()) == events.total, after
        for state in State:
            if state in (State.PENDING, *LOOKS):
                here = sum(e.state is state for e in events.open.values())
                assert events.counts[state] == here, (after, state)
        assert all(event.open for event in events.open.values()), after
        assert not any(event.open for event in events.closed.values()), after
        waiting = {n for n, e in events.open.items() if e.waits_for is not None}
        assert events.waiting.keys() == waiting, after
        for device, event in core.orders.engaged.pairs():
            assert device in (event.responder, event.operator, event.actor), after
            assert events.get(event.number) is event, after
        for event in (*events.open.values(), *events.closed.values()):
            self._check_event(event, after)
        looked = [e.responder for e in events.open.values() if e.state in LOOKS]
        assert len(looked) == len(set(looked)), after
        assert not core.dispatcher.situations._bound_for.keys() & set(core.orders.engaged), after

    def _check_event(self, event: Event, after: str) -> None:
        engaged = self.core.orders.engaged
        for steps in (STEPS, ACT_STEPS):
            times = [event.times[step] for step in steps if step in event.times]
            assert times == sorted(times), (after, event)
        assert ("closed" in event.times) != event.open, (after, event)
        if event.state in LOOKS:
            assert event.responder is not None, (after, event)
            assert engaged.is_at(event.responder, event), (after, event)
            is_robot = DEVICES[event.responder] == "Robot"
            assert is_robot == (event.operator is not None), (after, event)
            assert event.operator is None or engaged.is_at(event.operator, event), (after, event)
        if event.state is State.PENDING:
            assert (event.responder, event.operator, event.actor) == (None,) * 3, (after, event)
        if event.open and event.actor is not None:
            assert engaged.is_at(event.actor, event), (after, event)
            assert DEVICES[event.actor] == "Guard", (after, event)
        most = self.rules.max_attempts + ("confirmed" in event.times)  # one to deal with it
        assert 0 <= event.attempts <= most, (after, event)

    # --- when all is well again --------------------------------------------------------

    def recover(self) -> float:
        """Let all devices obey; return the time until no event is open [s]."""
        began, left = self.now, len(self.core.events.open)
        self.in_flight.clear()
        for device in DEVICES:
            self.alive[device] = True
            self._take(self._register(device))
            self._status(device)
        for grant in self.core.sessions.permissions.all():
            body = m.PermissionRevocation(grant.robot, grant.holder, grant.session)
            self._take(self.say(grant.holder, body))
        self._take(self.say(ROOMS[0], m.SetDispatch("automatic")))
        for event in list(self.core.events.open.values()):
            if event.handling.taken_off:  # whom the policy may not send there, it does not
                self._take(self.say(ROOMS[0], m.Escalate(event.number)))
        # What was begun ends by its limit; then each event takes a few seconds of somebody's.
        bound = 2 * LIMIT + 20.0 + 30.0 * left
        while self.core.events.open:
            self._take(self.pass_time(1.0))
            while self.in_flight:
                self._obey(self.in_flight.pop(0))
            self.check("recovery")
            assert self.now - began < bound, (self.rules, self.policy, self.core.events.open)
        return self.now - began

    def _obey(self, send: Send) -> None:
        """Somebody gets an order, and carries it out at once."""
        body = send.body
        self._take(self.core.delivered(send, self.now))
        if isinstance(body, m.TaskAnnouncement):
            self._take(self.say(send.to, m.TaskBid(body.event_id, 10.0)))
        elif isinstance(body, m.Order) and body.task == "stand_by":
            self._take(self.say(send.to, m.OrderProgress(body.event_id, "departed")))
        elif isinstance(body, m.Order):
            self._carry_out(send.to, body.event_id, body.task)
        elif isinstance(body, m.TaskAward) and DEVICES[send.to] == "Guard":
            self._carry_out(send.to, body.event_id, "confirm")

    def _carry_out(self, who: str, event: int, task: str) -> None:
        for state in ("departed", "arrived"):
            self._take(self.say(who, m.OrderProgress(event, state)))
        finding = "contained" if task == "contain" else "confirmed"
        known = self.core.events.get(event)
        kind, place = ("fire", east(0)) if known is None else (known.kind, known.position)
        self._take(self.say(who, m.EventReport(event, kind, place, 0.5, 1.0, finding)))
        self._take(self.say(who, m.OrderProgress(event, "done")))


STEPS_OF_A_WALK = {
    "register": 3,
    "impostor": 1,
    "restart": 2,
    "vanish": 1,
    "return": 2,
    "status": 3,
    "report": 12,
    "delivered": 14,
    "undelivered": 7,
    "progress": 14,
    "found": 8,
    "bid": 6,
    "decide": 10,
    "permission": 2,
    "give_back": 1,
    "time": 10,
    "deadline": 3,
    "kill": 1,
}


def _watch(core: Dva) -> None:
    """Check that no device with an order gets another one."""
    confirm, act, orders = core.orders.confirm, core.orders.act, core.orders

    def watched_confirm(
        event: Event, responder: str, operator: str | None, *args: Any, **named: Any
    ) -> Send:
        span = orders.rules.operator_span
        assert responder not in orders.engaged
        assert operator is None or orders.engaged.count(operator) < span
        return confirm(event, responder, operator, *args, **named)

    def watched_act(event: Event, guard: str, now: float) -> Send:
        assert guard not in orders.engaged
        assert event.open
        assert event.needs_containment
        assert event.actor is None
        return act(event, guard, now)

    core.orders.confirm, core.orders.act = watched_confirm, watched_act  # type: ignore[method-assign]


def snapshot(core: Dva) -> dict[str, Any]:
    """Return the state that a core must restore after a kill."""
    events, permissions = core.events, core.sessions.permissions
    lasts = core.sessions.with_something_open()
    return {
        "open": {n: repr(_with_sets_in_order(e)) for n, e in events.open.items()},
        "closed": {n: repr(_with_sets_in_order(e)) for n, e in sorted(events.closed.items())},
        "waiting": set(events.waiting),
        "counts": events.counts,
        "total": events.total,
        "engaged": sorted((device, event.number) for device, event in core.orders.engaged.pairs()),
        "devices": [
            e.device for i, e in core.registry.entries.items() if not e.silent or i in lasts
        ],
        "grants": permissions.grants,
        "observers": permissions.observers,
        "sessions": permissions.count,
        "unacknowledged": core.sessions.unacknowledged,
    }


def _with_sets_in_order(event: Event) -> dict[str, Any]:
    fields = {name: getattr(event, name) for name in Event.__slots__}
    fields["times"] = dict(sorted(event.times.items()))
    handling = {name: getattr(event.handling, name) for name in Handling.__slots__}
    handling["taken_off"] = sorted(event.handling.taken_off)
    sets = {"failed": sorted(event.failed), "sent": sorted(event.sent)}
    return fields | sets | {"handling": handling}
