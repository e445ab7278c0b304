"""Decisions of people at pages: each becomes messages of a control room, and nothing else.

The DVA decides if that is allowed: it alone knows the role of each control room.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final, Protocol

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused, unanswered
from dva_sim.console.asking.releases import NOBODY_STOPPED, release_robots, revoke_permission
from dva_sim.console.driving.drive_actions import Driving
from dva_sim.console.driving.driven_system import DrivenSystem
from dva_sim.console.events.decisions import (
    DECISIONS,
    answer_of,
    decision_of,
    place_of,
    report_of,
)
from dva_sim.console.events.handing_over import HandingOver
from dva_sim.console.events.missions import SentRobots
from dva_sim.console.system.site_control_room import SiteControlRoom
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import (
    FindingAsked,
    MissionAsked,
    OfDevice,
    OfRegion,
    OfSome,
    ReportAsked,
    RoomName,
    TakeoverAsked,
)
from dva_sim.protocol import messages as m

Decide = Callable[[ControlRoomAgent, OnResult], object]
DECIDING: Final = (m.Assign, m.TakeOff, m.FalseAlarm, m.Escalate, m.AddNote)  # see their event


class DecidingRooms(Protocol):
    """Control rooms of a console: one for each person who decides, or one for all.

    Attributes:
        listener: Control room that knows events and devices for the pages.
        handing_over: Work that people offer to each other.
    """

    listener: SiteControlRoom
    handing_over: HandingOver

    def names(self) -> Mapping[str, str]:
        """Return the name of each person who decides, by page."""

    def join(self, client: str, role: str, name: str, on_result: OnResult) -> None:
        """Let a page's person decide, within a role, under a name of their own.

        Raises:
            Refused: nobody can.
        """

    def decide(self, client: str, role: str, on_result: OnResult, then: Decide) -> None:
        """Call `then` with the control room of a page's person, once the DVA knows its role."""


class DecisionActions:
    """Does what people ask for about events, and about robots that the DVA holds or grants.

    Args:
        system: System whose events and robots those are.
        rooms: Control rooms of the console.
        driving: Seats, and drives from pages.
        seeing: Function that makes of a callback one that notes first that the person of a
            successful decision has seen the alarm of its event.

    Attributes:
        sent: Robots that people have sent by themselves.
    """

    def __init__(
        self,
        system: DrivenSystem,
        rooms: DecidingRooms,
        driving: Driving,
        seeing: Callable[[str, Mapping[str, Any], OnResult], OnResult],
    ) -> None:
        self._system = system
        self._rooms = rooms
        self._driving = driving
        self._seeing = seeing
        self.sent = SentRobots()

    @does("room_join")
    def _join(self, client: str, line: RoomName, on_result: OnResult) -> None:
        self._rooms.join(client, _role(line), line["name"].strip(), on_result)

    # --- events -----------------------------------------------------------------------------

    @does(*DECISIONS)
    def decide(self, client: str, line: Asked, on_result: OnResult) -> None:
        """Decide on an event."""
        body, done = decision_of(line, self._device, self._seen)
        if isinstance(body, DECIDING):
            on_result = self._seeing(client, line, on_result)
        self._rooms.decide(client, _role(line), on_result, partial(self._ask, body, done))

    @does("event_raise")
    def _raise(self, client: str, line: ReportAsked, on_result: OnResult) -> None:
        x, y = place_of(line, self._system.site)
        body, done = report_of(line, m.Position(*self._system.frame.to_latlon(x, y)))
        self._rooms.decide(client, _role(line), on_result, partial(self._ask, body, done))

    def _ask(self, body: m.Body, done: str, agent: ControlRoomAgent, on_result: OnResult) -> None:
        agent = self._rooms.listener.about(getattr(body, "event_id", 0), agent)
        agent.raised = None
        for room in self._rooms.listener.rooms[1:] if isinstance(body, m.SetDispatch) else ():
            room.ask(body)

        def answered(reply: m.Reply) -> None:
            if reply.code != m.OK:
                on_result(False, reply.reason)
                return
            more = answer_of(reply, lambda device: device in self._system.robots())
            if isinstance(body, m.EventReport) and agent.raised is not None:
                more["event"] = agent.raised
            on_result(True, done, **more)

        agent.ask(body, answered, partial(unanswered, on_result))

    def _seen(self, event: int) -> int | None:
        """Return how many decisions on an event are known here."""
        status = self._rooms.listener.events.get(event)
        return None if status is None else status.decisions

    def _device(self, label: str) -> str:
        """Return the id of a device by its label.

        Raises:
            Refused: the DVA has listed none of that label.
        """
        for id_tag in self._rooms.listener.devices:
            if self._system.label_of(id_tag) == label:
                return id_tag
        raise Refused(f"there is no device {label!r}")

    # --- robots -----------------------------------------------------------------------------

    @does("mission")
    def _mission(self, client: str, line: MissionAsked, on_result: OnResult) -> None:
        """Have a robot go to an event by itself, and look at it."""
        status = self._rooms.listener.events.get(line["event"])
        if status is None:
            raise Refused(f"there is no event {line['event']}")
        robot = self._driving.robot(line["robot"])
        decisions = line.get("decisions")
        seen_decisions = status.decisions if decisions is None else decisions

        def send(agent: ControlRoomAgent, on_result: OnResult) -> None:
            room = self._rooms.listener.about(status.event_id, agent)
            self.sent.send(client, room, robot, status).begin(
                line.get("reason") or None, seen_decisions, on_result
            )

        on_result = self._seeing(client, line, on_result)
        self._rooms.decide(client, _role(line), on_result, send)

    @does("mission_found")
    def _found(self, client: str, line: FindingAsked, on_result: OnResult) -> None:
        """Report what a person sees through the robot that went by itself."""
        mission = self.sent.mission(client, line["event"])
        mission.found(line["finding"], self._seeing(client, line, on_result))

    @does("revoke")
    def _revoke(self, client: str, line: OfDevice, on_result: OnResult) -> None:
        robot = self._driving.robot(line["device"])
        label = self._system.label_of(robot)

        def revoke(agent: ControlRoomAgent, on_result: OnResult) -> None:
            revoke_permission(robot, label, self._at(robot, agent).ask, on_result)

        self._rooms.decide(client, _role(line), on_result, revoke)

    @does("give_back")
    def _give_back(self, client: str, line: OfRegion, on_result: OnResult) -> None:
        """Have a region given back by the DVA that serves it."""
        region = line["region"]
        regions = self._system.system.regions
        if region not in regions.own:
            raise Refused(f"there is no region {region!r}")

        def ask(agent: ControlRoomAgent, on_result: OnResult) -> None:
            agent = self._rooms.listener.at(regions.server_of(region), agent)
            self._ask(m.GiveBack(region), f"{region} is being given back", agent, on_result)

        self._rooms.decide(client, _role(line), on_result, ask)

    @does("release_emergency")
    def _release(self, client: str, line: OfSome, on_result: OnResult) -> None:
        """Release robots that an emergency holds."""
        stopped = self._system.stopped()
        robots = [robot for robot in self._driving.robots_in(line) if robot in stopped]
        if not robots:
            raise Refused(NOBODY_STOPPED)
        labels = {robot: self._system.label_of(robot) for robot in robots}

        def release(agent: ControlRoomAgent, on_result: OnResult) -> None:
            def ask(body: m.Body, *callbacks: Any) -> None:
                self._at(getattr(body, "device", ""), agent).ask(body, *callbacks)

            release_robots(robots, labels, ask, on_result)

        self._rooms.decide(client, _role(line), on_result, release)

    def _at(self, robot: str, agent: ControlRoomAgent) -> ControlRoomAgent:
        """Return the console's control room at the DVA of a robot, if `agent` is not there."""
        return self._rooms.listener.at(self._system.system.dva_of(robot), agent)

    @does("take_over")
    def _take_over(self, client: str, line: TakeoverAsked, on_result: OnResult) -> None:
        """Take a robot from its driver, with its task or for another, into the client's seat."""
        robot = self._driving.robot(line["robot"])
        events = self._rooms.listener.events
        sent = (e for e in events.values() if e.closed_for is None and e.responder == robot)
        event = events.get(line["event"]) if "event" in line else next(sent, None)

        def begin(agent: ControlRoomAgent, on_result: OnResult) -> None:
            self._driving.take_over(
                client,
                agent=self._at(robot, agent),
                robot=robot,
                reason=line["reason"],
                event=event,
                on_result=on_result,
            )

        on_result = self._seeing(client, line, on_result)
        self._rooms.decide(client, _role(line), on_result, begin)


def _role(line: Mapping[str, object]) -> str:
    return str(line.get("role", "look"))
