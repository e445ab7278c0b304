"""A core with a small team, for tests: its incoming and outgoing messages, and a plain map."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.assignments import Rules
from dva_sim.core.dispatch import MinEta, Policy
from dva_sim.core.dva import Dva
from dva_sim.core.events import Event, State
from dva_sim.core.permissions import Access
from dva_sim.core.roles import Roles
from dva_sim.core.sensing import Sensing
from dva_sim.core.sessions import Permissions, Send, Sessions
from dva_sim.core.travel_times import SiteKnowledge, Start
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import ControlRoomRole

Floats = NDArray[np.float64]
DVA = "02:00:00:00:00:01"
ROBOT, OTHER_ROBOT = "02:00:00:01:00:01", "02:00:00:01:00:02"
GUARD, OTHER_GUARD = "02:00:00:02:00:01", "02:00:00:02:00:02"
OPERATOR, OTHER_OPERATOR = "02:00:00:03:00:01", "02:00:00:03:00:02"
ROOM, OTHER_ROOM = "02:00:00:07:00:01", "02:00:00:07:00:02"
DETECTOR, OTHER_DETECTOR = "02:00:00:04:00:01", "02:00:00:04:00:02"
TEAM = {GUARD: "Guard", ROBOT: "Robot", OPERATOR: "TeleOp", DETECTOR: "Sensor"}
HERE = m.Position(38.6612, -9.2058)
DEGREE_EAST = 87_000.0  # about, at this latitude [m]
PACES = {"guard": (1.3, 20.0), "robot": (0.35, 4.0)}  # [m/s], [s]
ESCALATE_AFTER = 60.0  # [s]
ADDRESS = "192.168.1.9"


def east(metres: float) -> m.Position:
    return m.Position(HERE.latitude, HERE.longitude + metres / DEGREE_EAST)


def crow(starts: Sequence[Start], goals: Sequence[m.Position]) -> tuple[Floats, Floats]:
    """Straight-line distances along the only street."""
    at = np.array([s.position.longitude for s in starts])
    to = np.array([goal.longitude for goal in goals])
    distance = np.abs(to[:, None] - at[None, :]) * DEGREE_EAST
    speed = np.array([PACES[s.kind][0] for s in starts])
    ready = np.array([0.0 if s.under_way else PACES[s.kind][1] for s in starts])
    return distance, ready + distance / speed


class Office:
    """A core with a guard at 0 m, a robot at 10 m, an operator and a detector.

    Everything that the core wants sent is in `sent` too, in order.
    """

    def __init__(
        self,
        policy: Policy | None = None,
        rules: Rules | None = None,
        ground: SiteKnowledge | None = None,
        access: Access | None = None,
        sensing: Sensing | None = None,
        supervisors: frozenset[str] = frozenset(),
        roles: dict[str, str] | None = None,
        ask_first: bool = False,
    ) -> None:
        self.policy, self.ground, self.access = policy or MinEta(), ground, access
        self.sensing, self.supervisors = sensing, supervisors
        self.roles, self.ask_first = roles or {}, ask_first
        self.rules = rules or Rules(escalate_after=ESCALATE_AFTER)
        self.number = 0
        self.sent: list[Send] = []
        self.core = self.new_core()
        for id_tag, kind in TEAM.items():
            self.register(id_tag, kind)
        self.report_place(GUARD, 0)
        self.status(ROBOT, 10)

    def new_core(self) -> Dva:
        """A core of the same kind that knows nobody yet."""
        sessions = Sessions(Permissions(lambda: 7))
        rng = np.random.default_rng(1)
        return Dva(
            self.policy,
            crow,
            self.rules,
            rng=rng,
            sessions=sessions,
            ground=self.ground,
            access=self.access,
            sensing=self.sensing,
            supervisors=self.supervisors,
            roles=Roles({room: ControlRoomRole(role) for room, role in self.roles.items()}),
            ask_first=self.ask_first,
        )

    # --- messages of devices -----------------------------------------------------------

    def register(
        self, id_tag: str, kind: str, at: float | None = None, now: float = 0.0
    ) -> list[Send]:
        """A device registers; a guard or robot tells where it is, too [m]."""
        sends = self.say(id_tag, m.Registration(kind.lower(), kind, ADDRESS), now)[1]
        if at is not None:
            (self.report_place if kind == "Guard" else self.status)(id_tag, at, now)
        return sends

    def say(self, source: str, body: m.Body, now: float = 0.0) -> tuple[m.Reply, list[Send]]:
        self.number += 1
        session = None if isinstance(body, m.Heartbeat) else 0
        message = m.Message(DVA, self.number, source, "12:00:00", session, body)
        reply, sends = self.core.handle(message, now)
        self.sent += sends
        return reply, sends

    def status(self, robot: str, metres: float, now: float = 0.0, speed: float = 0.0) -> None:
        self._publish(robot, m.RobotStatus("Idle", east(metres), 0.0, speed, 0.0, 5), now)

    def shows(self, robot: str, sensor: str, *values: float, now: float = 0.0) -> list[Send]:
        """A sensor of a robot shows these values, one after the other; what that leads to."""
        sends: list[Send] = []
        for value in values:
            body = m.SensorValue(sensor, (value,), "1", 5)
            sends += self.core.note(m.Message(DVA, 1, robot, "12:00:00", 0, body), now)
        self.sent += sends
        return sends

    def is_in(self, mode: str, now: float = 0.0, robot: str = ROBOT) -> None:
        self._publish(robot, m.RobotStatus(mode, east(10), 0.0, 0.0, 0.0, 5), now)

    def report_place(self, guard: str, metres: float, now: float = 0.0) -> None:
        self._publish(guard, m.PersonStatus("waiting", east(metres)), now)

    def beat(self, *devices: str, now: float) -> None:
        """Heartbeats: of these, or of all."""
        for device in devices or list(self.core.registry.entries):
            self._publish(device, m.Heartbeat(), now)

    def _publish(self, source: str, body: m.Body, now: float) -> None:
        session = None if isinstance(body, m.Heartbeat) else 0
        self.core.note(m.Message(DVA, 1, source, "12:00:00", session, body), now)

    def silence(self, device: str, now: float) -> None:
        """Let a device be silent for so long that it counts as absent."""
        for other in list(self.core.registry.entries):
            if other != device:
                self.beat(other, now=now)
        self.tick(now, alive=False)

    def fire(
        self,
        metres: float,
        now: float = 0.0,
        kind: str = "fire",
        severity: float = 0.5,
        source: str = DETECTOR,
        confidence: float = 0.9,
    ) -> list[Send]:
        """Something is detected so far east."""
        body = m.EventReport(None, kind, east(metres), severity, confidence, "detected")
        return self.say(source, body, now)[1]

    def withdraw(self, metres: float, now: float = 0.0, source: str = DETECTOR) -> list[Send]:
        """It is not seen any longer."""
        return self.say(source, m.EventReport(None, "fire", east(metres), 0, 0, "refuted"), now)[1]

    def finds(
        self, who: str, finding: str, now: float = 0.0, event: int = 1
    ) -> tuple[m.Reply, list[Send]]:
        known = self.core.events.get(event)
        kind, place = ("fire", east(12)) if known is None else (known.kind, known.position)
        return self.say(who, m.EventReport(event, kind, place, 0.5, 0.9, finding), now)

    def progress(
        self, who: str, state: str, now: float = 0.0, event: int = 1
    ) -> tuple[m.Reply, list[Send]]:
        return self.say(who, m.OrderProgress(event, state), now)

    def bids(
        self, who: str, arrival_in: float, now: float = 0.0, event: int = 1
    ) -> tuple[m.Reply, list[Send]]:
        return self.say(who, m.TaskBid(event, arrival_in), now)

    # --- outcomes of sent messages -----------------------------------------------------

    def ok(self, sends: Sequence[Send], now: float = 0.0) -> list[Send]:
        """Answer all messages with OK."""
        return self._after([s for send in sends for s in self.core.delivered(send, now)])

    def no(self, sends: Sequence[Send], now: float = 0.0) -> list[Send]:
        """Let all messages be declined or lost."""
        return self._after([s for send in sends for s in self.core.undelivered(send, now)])

    def tick(self, now: float, alive: bool = True) -> list[Send]:
        """Time passes; everybody has been heard just before, unless said otherwise."""
        if alive:
            self.beat(now=now)
        return self._after(self.core.tick(now))

    def _after(self, sends: list[Send]) -> list[Send]:
        self.sent += sends
        return sends

    # --- state -------------------------------------------------------------------------

    def event(self, number: int = 1) -> Event:
        event = self.core.events.get(number)
        assert event is not None
        return event

    def busy(self, *names: str) -> None:
        """Somebody is kept by the rest of an event that is not ours."""
        other = Event(99, "flood", HERE, 0.5, state=State.REFUTED, times={"closed": math.inf})
        for name in names:
            self.core.orders.engaged.begin(name, other)

    def idle(self, *names: str) -> None:
        """And does not any longer."""
        for name in names:
            for event in self.core.orders.engaged.all(name):
                self.core.orders.engaged.end(name, event)

    @property
    def working(self) -> dict[str, int]:
        """Current event of each busy device."""
        return {name: event.number for name, event in self.core.orders.engaged.pairs()}
