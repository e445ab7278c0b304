"""Actions of control rooms at pages: each becomes messages of the person's own device."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.asking.releases import NOBODY_STOPPED, release_robots, revoke_permission
from dva_sim.console.driving.drive_actions import Driving
from dva_sim.console.events.decisions import DECISIONS, answer_of, decision_of, place_of, report_of
from dva_sim.console.events.missions import inspection_of, send_on_mission
from dva_sim.console.events.rooms import ConsoleRoom
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import (
    MissionAsked,
    OfDevice,
    OfSome,
    ReportAsked,
    RoomName,
    TakeoverAsked,
)
from dva_sim.console.wire.seats import Answered
from dva_sim.console.world.world import ConsoleWorld
from dva_sim.protocol import messages as m


class RoomActions:
    """Does what control rooms are asked for.

    Args:
        driving: Seats, and drives from pages.
    """

    def __init__(self, world: ConsoleWorld, driving: Driving) -> None:
        self._world = world
        self._rooms = world.rooms
        self._driving = driving
        self._seats = world.seating.seats

    def attend(self, pages: Mapping[str, str]) -> None:
        """Let rooms take part only while their pages are open."""
        self._rooms.attend(pages)

    def forget(self, client: str) -> None:
        """A page is gone for good."""
        self._rooms.leave(client)

    # --- who asks ---------------------------------------------------------------------------

    @does("room_join")
    def _join(self, client: str, line: RoomName, on_result: OnResult) -> None:
        name = line["name"].strip()
        self._rooms.join(client, str(line.get("role", "look")), name, on_result)

    def _room(
        self,
        client: str,
        line: Mapping[str, Any],
        on_result: OnResult,
        then: Callable[[ConsoleRoom, OnResult], object],
    ) -> None:
        """The control room of a page; it gets one with its first decision."""
        room = self._rooms.by_client.get(client)
        if room is not None and room.registered:
            then(room, room.until_answered(on_result))
            return

        def joined(ok: bool, text: str, /, **_: Any) -> None:
            room = self._rooms.by_client.get(client)
            if ok and room is not None:
                then(room, room.until_answered(on_result))
            else:
                on_result(False, text)

        self._rooms.join(client, str(line.get("role", "look")), "", joined)

    def _ask(
        self,
        client: str,
        line: Mapping[str, Any],
        on_result: OnResult,
        body: m.Body,
        done: str,
        then: Callable[[m.Reply], Answered] | None = None,
    ) -> None:
        self._room(client, line, on_result, lambda room, answer: room.ask(body, answer, done, then))

    # --- events -----------------------------------------------------------------------------

    @does(*DECISIONS)
    def decide(self, client: str, line: Asked, on_result: OnResult) -> None:
        """Decide on an event."""
        body, done = decision_of(line, self._device, self._rooms.decisions)
        self._ask(
            client, line, on_result, body, done, lambda reply: answer_of(reply, self._is_robot)
        )

    @does("event_raise")
    def _raise(self, client: str, line: ReportAsked, on_result: OnResult) -> None:
        site = self._world.run.stage.site
        place = m.Position(*site.frame.to_latlon(*place_of(line, site)))
        body, done = report_of(line, place)

        def then(_: m.Reply) -> Answered:
            event = self._world.run.dva.core.events.near(body.kind, body.position)
            return {} if event is None else {"event": event.number}

        self._ask(client, line, on_result, body, done, then)

    def _device(self, label: str) -> str:
        """The id of a device by its label.

        Raises:
            Refused: there is none.
        """
        labels = self._world.run.stage.labels
        listed = self._rooms.listener.devices
        id_tag = next((i for i in listed if labels.get(i) == label), None)
        if id_tag is None:
            raise Refused(f"there is no device {label!r}")
        return id_tag

    def _is_robot(self, device: str) -> bool:
        return device in self._world.run.field.robots

    # --- robots -----------------------------------------------------------------------------

    @does("mission")
    def _mission(self, client: str, line: MissionAsked, on_result: OnResult) -> None:
        """Have a robot go to an event by itself, and look at it."""
        status = self._rooms.listener.events.get(line["event"])
        if status is None:
            raise Refused(f"there is no event {line['event']}")
        robot = self._driving.robot(line["robot"])
        label = self._world.driven.label_of(robot)
        body = inspection_of(status)

        def send(room: ConsoleRoom, on_result: OnResult) -> None:
            send_on_mission(room.device, robot, label, body, on_result)

        self._room(client, line, on_result, send)

    @does("revoke")
    def _revoke(self, client: str, line: OfDevice, on_result: OnResult) -> None:
        robot = self._driving.robot(line["device"])
        label = self._world.driven.label_of(robot)

        def revoke(room: ConsoleRoom, answer: OnResult) -> None:
            revoke_permission(robot, label, room.agent.ask, answer)

        self._room(client, line, on_result, revoke)

    @does("release_emergency")
    def _release(self, client: str, line: OfSome, on_result: OnResult) -> None:
        """Release robots that an emergency holds; the DVA decides whether this person may."""
        run = self._world.run
        latched = (i for i, robot in run.field.robots.items() if robot.controller.latch.holds)
        robots = [*latched, *self._world.foreign.stopped()]
        named = line.get("robots", "all")
        if named != "all":
            numbers = self._world.feed.numbers
            labels = run.stage.labels
            robots = [r for r in robots if {r, numbers.get(r), labels.get(r)} & set(named)]
        if not robots:
            raise Refused(NOBODY_STOPPED)

        def release(room: ConsoleRoom, answer: OnResult) -> None:
            release_robots(robots, run.stage.labels, room.agent.ask, answer)

        self._room(client, line, on_result, release)

    @does("take_over")
    def _take_over(self, client: str, line: TakeoverAsked, on_result: OnResult) -> None:
        """Take a robot and its task from its driver into the client's own seat."""
        robot = self._driving.robot(line["robot"])
        event = self._rooms.event_of(robot)

        def begin(room: ConsoleRoom, on_result: OnResult) -> None:
            self._driving.take_over(
                client,
                agent=room.agent,
                robot=robot,
                reason=line["reason"],
                event=event,
                on_result=on_result,
            )

        self._room(client, line, on_result, begin)
