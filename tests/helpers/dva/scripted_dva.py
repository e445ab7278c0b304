"""Scripted DVA in virtual time: sends what a test wants, and notes what it receives."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from helpers.dva.permissions import confirmation

from dva_sim.agents.observation import no_smoke
from dva_sim.agents.operator.operator import OperatorAgent
from dva_sim.agents.people.evacuation import AirAt, clean_air
from dva_sim.agents.people.guard import GuardAgent
from dva_sim.agents.people.pedestrian_avoidance import USUAL
from dva_sim.agents.people.profiles import Walker
from dva_sim.agents.people.walking import Walking
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import DriveLog, Recorder
from dva_sim.kernel.streams import Streams
from dva_sim.network.link import ConstantRate, Link, LinkConfig
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol import messages as m
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.control_room import add_operator
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.full.stage import Stage, id_of
from dva_sim.simulation.full.team import TeamBuilder
from dva_sim.worlds.geo import Pose

GUARD, ROBOT, OTHER_ROBOT = id_of("guard", 1), id_of("robot", 1), id_of("robot", 2)
OPERATOR = id_of("operator", 1)
# One metre a second, ten seconds to get ready, three to look, twenty to deal with something.
WALKER = Walker(
    speed=1.0,
    mobilisation=10.0,
    look=3.0,
    contain=40.0,
    extinguish=20.0,
    usual_mobilisation=12.0,
)
POST = (1.4, 12.0)  # at the west end of the main corridor, which is straight [m]
EAST, WEST = (30.0, 12.0), (4.0, 12.0)  # both ends of that corridor [m]
SETTLED = 0.01  # time after which replies have arrived [s]

Point = tuple[float, float]


class Received(NamedTuple):
    """Message received by the DVA: time [s], sender and body."""

    time: float
    source: str
    body: m.Body


class PretendedDva:
    """A scripted DVA and a team.

    Args:
        robots: Number of robots.
        changes: Changes of the scenario, by dotted key.

    Attributes:
        received: Messages received, without registrations.
        there: Kinds of what is there, wherever a guard of this DVA looks.
        contained: Kinds and places of the events that guards contained.
    """

    def __init__(self, robots: int = 0, **changes: object) -> None:
        config = LinkConfig(delay_s=0.001)
        links = [Link(config, ConstantRate(config.rate_bps), Streams(1), way) for way in "ab"]
        self.network = VirtualNetwork(Clock(), lambda *_: (links[0], links[1]))
        counts = {"robot.count": robots, "guard.count": 1}
        scenario = scenarios.build(scenarios.load("drive-to-event"), counts | changes)
        self.stage = Stage(scenario, 1, self.network, Recorder())
        self.field = field = Field(self.stage)
        team = TeamBuilder(self.stage, field.world, field)
        for number in range(1, robots + 1):
            robot = team.add_robot(number)
            field.robots[robot.device.id_tag] = robot
        self.device = self.stage.device("dva", 1)
        self.device.serve(self._hear)
        self.received: list[Received] = []
        self.there: set[str] = set()
        self.contained: list[tuple[str, Point]] = []
        self.sessions: dict[str, m.PermissionGrant] = {}
        self._last_session = 0

    # --- the team ----------------------------------------------------------------------

    def guard(
        self,
        position: Point = POST,
        walker: Walker = WALKER,
        air: AirAt = clean_air,
        refuges: Sequence[Point] = (),
        smoke: Callable[[Point, Point], float] = no_smoke,
    ) -> GuardAgent:
        """A guard who sees what is in `there`, through no more smoke than people do."""
        device, planner, world = self.stage.device("guard", 1), self.stage.planner, self.field.world
        body = world.add_person("guard-1", Pose(*position, 0.0), radius=USUAL.radius_m)
        doors = self.stage.site.doors
        walking = Walking(self.network.clock, planner, world, body, speed=walker.speed, doors=doors)
        there, contained = lambda kind, *_: kind in self.there, self._contained
        guard = GuardAgent(
            device,
            walker,
            planner,
            walking,
            is_there=there,
            contain=contained,
            air=air,
            refuges=refuges,
            smoke=smoke,
        )
        device.register(guard.start)
        self.run_for(1.0)
        return guard

    def operator(self) -> OperatorAgent:
        """An operator of the scenario's population."""
        operator = add_operator(self.stage, 1)
        self.run_for(2.0)
        return operator

    def _contained(self, kind: str, x: float, y: float) -> None:
        self.contained.append((kind, (x, y)))
        self.there.discard(kind)

    # --- time --------------------------------------------------------------------------

    @property
    def now(self) -> float:
        return self.network.clock.now

    def run_for(self, seconds: float) -> None:
        self.network.clock.run(self.now + seconds)

    def run_until(self, condition: Callable[[], object], limit: float = 1200.0) -> None:
        end = self.now + limit
        while not condition():
            assert self.now < end, f"has not come true within {limit} s"
            self.run_for(0.1)

    # --- messages ----------------------------------------------------------------------

    def say(self, to: str, body: m.Body) -> int:
        """Send a message to a device; return the code of the reply."""
        codes: list[int] = []
        self.device.ask(to, body, lambda reply: codes.append(reply.code))
        end = self.now + 1.0
        while not codes and self.now < end:
            self.run_for(0.002)
        self.run_for(SETTLED)
        return codes[0]

    def order(
        self, event: int, place: Point, task: str = "confirm", robot: str | None = None
    ) -> int:
        """Order the guard, or the operator of a robot, to an event of kind fire."""
        body = m.Order(event, "fire", self.position(place), robot, task)
        return self.say(GUARD if robot is None else OPERATOR, body)

    def start(self, event: int, place: Point, robot: str = ROBOT) -> None:
        """Order a robot to an event, and wait until it goes."""
        assert self.order(event, place, robot=robot) == m.OK
        self.run_until(lambda: "departed" in self.progress(event))
        self.run_for(5.0)
        assert abs(self.field.robots[robot].body.speed) > 0.1

    def announce(self, event: int, place: Point, to: str = GUARD, within: float = 2.0) -> int:
        """Put an event of kind fire up for auction."""
        return self.say(to, m.TaskAnnouncement(event, "fire", self.position(place), 0.5, within))

    def position(self, place: Point) -> m.Position:
        return m.Position(*self.stage.site.frame.to_latlon(*place))

    def progress(self, event: int) -> list[str]:
        """States of the order and findings reported for an event, in order."""
        return [
            entry.body.state if isinstance(entry.body, m.OrderProgress) else entry.body.finding
            for entry in self.received
            if isinstance(entry.body, m.OrderProgress | m.EventReport)
            and entry.body.event_id == event
        ]

    def when(self, event: int, word: str) -> float:
        """Time of the first report of a state or finding of an event [s]."""
        return next(
            entry.time
            for entry in self.received
            if word in (getattr(entry.body, "state", None), getattr(entry.body, "finding", None))
            and getattr(entry.body, "event_id", None) == event
        )

    def bids(self) -> list[m.TaskBid]:
        return [entry.body for entry in self.received if isinstance(entry.body, m.TaskBid)]

    # --- received messages -------------------------------------------------------------

    def _hear(self, message: m.Message) -> m.Reply:
        body = message.body
        if not isinstance(body, m.Registration | m.GetGrant):
            self.received.append(Received(self.now, message.source, body))
        if isinstance(body, m.PermissionRequest):
            held = self.sessions.get(body.device)
            if held is not None and held.holder != message.source:
                return m.Reply(message.message_id, m.BUSY, f"held by {held.holder}")
            return m.Reply(message.message_id, m.OK, "", self._permit(message.source, body))
        if isinstance(body, m.GetGrant):
            reported = confirmation(self.sessions.get(message.source))
            return replace(reported, answers=message.message_id)
        if isinstance(body, m.PermissionRevocation) and self.sessions.pop(body.device, None):
            self.device.ask(body.device, body)
        return m.Reply(message.message_id, m.OK, "")

    def _permit(self, holder: str, body: m.PermissionRequest) -> m.Permission:
        """Grant as the real DVA does: a repeated request gets the same session."""
        held = self.sessions.get(body.device)
        if held is None:
            self._last_session += 1
            held = m.PermissionGrant(holder, body.level, self._last_session)
            self.sessions[body.device] = held
            self.device.ask(body.device, held, session=held.session)
        return m.Permission(body.device, body.level, held.session)


def driving(pattern: str, **changes: object) -> tuple[PretendedDva, DriveLog]:
    """A robot on its way to the east, driven by whom the log is of."""
    dva = PretendedDva(robots=1, pattern=pattern, **changes)
    dva.operator()
    dva.start(1, EAST)
    (log,) = dva.stage.recorder.drives
    assert log.ended is None
    return dva, log
