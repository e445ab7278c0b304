"""Actions of people at an attached console: each becomes messages, and nothing else.

The DVA decides if that is allowed: it alone knows the role of each control room.
"""

from __future__ import annotations

from functools import partial

from dva_sim.agents.device import do_nothing
from dva_sim.console.asking.dispatcher import ActionDispatcher, does
from dva_sim.console.asking.refusal import NO_ANSWER, OnResult, Refused, unanswered
from dva_sim.console.asking.releases import NOBODY_STOPPED, release_robots, revoke_permission
from dva_sim.console.attached.pages import AttachedPages
from dva_sim.console.attached.people import AttachedPeople
from dva_sim.console.attached.system import AttachedSystem
from dva_sim.console.bench import NOT_HERE, ServerActions
from dva_sim.console.driving.drive_actions import LOOK, Driving, is_gone_for_good
from dva_sim.console.events.alarm_actions import AlarmActions
from dva_sim.console.events.decisions import DECISIONS, answer_of, decision_of, place_of, report_of
from dva_sim.console.events.missions import inspection_of, send_on_mission
from dva_sim.console.views.published_rows import emergency_of
from dva_sim.console.wire.actions import ActionPlace, Asked
from dva_sim.console.wire.arguments import (
    FakeAsked,
    LogsLooked,
    MissionAsked,
    OfDevice,
    OfSome,
    PagesHere,
    ReportAsked,
    RobotsWatched,
    RoomName,
    TakeoverAsked,
)
from dva_sim.console.wire.seats import DoneLine
from dva_sim.protocol import messages as m


class AttachedDecisions:
    """Does what pages ask for about events.

    Args:
        system: System to which the console is attached.
        people: People at the pages.
        driving: Seats, and drives from pages.
    """

    def __init__(self, system: AttachedSystem, people: AttachedPeople, driving: Driving) -> None:
        self._system = system
        self._people = people
        self._driving = driving

    @does("room_join")
    def _join(self, client: str, line: RoomName, on_result: OnResult) -> None:
        """Let a person decide, under a name of their own, in the console's control room."""
        if not self._system.answers:
            raise Refused(NO_ANSWER)
        name = line["name"].strip()
        self._system.let_decide(do_nothing)
        name = self._people.join(client, str(line.get("role", "look")), name)
        on_result(True, f"you are {name}, and may {self._system.role}")

    @does("event_raise")
    def _raise(self, _: str, line: ReportAsked, on_result: OnResult) -> None:
        site = self._system.site
        x, y = (line["x_m"], line["y_m"]) if site is None else place_of(line, site)
        place = self._system.place_of(x, y)
        self._ask(*report_of(line, place), on_result)

    @does(*DECISIONS)
    def decide(self, _: str, line: Asked, on_result: OnResult) -> None:
        """Decide on an event."""
        self._ask(*decision_of(line, self._device, self._seen), on_result)

    # --- robots ------------------------------------------------------------------------------

    @does("mission")
    def _mission(self, _: str, line: MissionAsked, on_result: OnResult) -> None:
        """Have a robot go to an event by itself, and look at it."""
        status = self._system.agent.events.get(line["event"])
        if status is None:
            raise Refused(f"there is no event {line['event']}")
        self._send(self._driving.robot(line["robot"]), status, on_result)

    def _send(self, robot: str, status: m.EventStatus, on_result: OnResult) -> None:
        label = self._system.label_of(robot)
        send_on_mission(self._system.device, robot, label, inspection_of(status), on_result)

    @does("take_over")
    def _take_over(self, client: str, line: TakeoverAsked, on_result: OnResult) -> None:
        """Take a robot and its task from its driver into the client's own seat."""
        robot = self._driving.robot(line["robot"])
        agent = self._system.agent
        sent = (e for e in agent.events.values() if e.closed_for is None and e.responder == robot)
        take_over = partial(
            self._driving.take_over,
            client,
            agent=agent,
            robot=robot,
            reason=line["reason"],
            event=next(sent, None),
            on_result=on_result,
        )
        self._system.let_decide(take_over)

    def _ask(self, body: m.Body, done: str, on_result: OnResult) -> None:
        robots = self._system.robots

        def answered(reply: m.Reply) -> None:
            ok = reply.code == m.OK
            words = reply.text or m.CODE_NAMES.get(reply.code, str(reply.code))
            more = answer_of(reply, lambda device: device in robots()) if ok else {}
            on_result(ok, done if ok else words, **more)

        self._system.decide(body, answered, partial(unanswered, on_result))

    def _seen(self, event: int) -> int | None:
        """Return how many decisions on an event are known here."""
        status = self._system.agent.events.get(event)
        return None if status is None else status.decisions

    def _device(self, label: str) -> str:
        """The id of a device by its label.

        Raises:
            Refused: the DVA has listed none of that label.
        """
        known = self._system.state.devices.items()
        found = next((i for i, entry in known if entry.device.label == label), None)
        if found is None:
            raise Refused(f"there is no device {label!r}")
        return found


class AttachedActions:
    """Does what lines of the web process ask for.

    Args:
        pages: Pages of the system to which the console is attached.

    Attributes:
        take: Does what a line asks for.
    """

    def __init__(self, pages: AttachedPages) -> None:
        self._pages = pages
        self._system = pages.system
        self._driving = driving = Driving(pages.driven)
        decisions = AttachedDecisions(self._system, pages.people, driving)
        author = pages.people.author
        alarms = AlarmActions(pages.alarms, author, lambda *given: dispatcher.do(*given))
        dispatcher = ActionDispatcher(
            ActionPlace.ATTACHED,
            holders=(self, driving, decisions, alarms, ServerActions(self._system.bench)),
            tell=self._tell,
            elsewhere=NOT_HERE,
            audited=lambda: pages.audited,
        )
        self.take = dispatcher.take
        pages.clock.pulse(LOOK, driving.look)

    @does("look")
    def _look(self, _: str, line: LogsLooked) -> None:
        self._pages.look(line)

    @does("watch")
    def _watch(self, _: str, line: RobotsWatched) -> None:
        self._pages.sensors.watch(line["robots"])

    def _tell(self, answer: DoneLine) -> None:
        self._pages.tell({**answer, "t": self._system.now_ms})

    @does("release")
    def _release(self, client: str, line: Asked, on_result: OnResult) -> None:
        if is_gone_for_good(line):
            self._pages.people.leave(client)
            self._pages.let_go()
        self._driving.release(client, on_result)

    @does("here")
    def _here(self, _: str, line: PagesHere) -> None:
        self._driving.attend(line)

    @does("gone")
    def _gone(self, client: str, _: Asked) -> None:
        self._driving.end_hidden(client)

    @does("release_emergency")
    def _release_emergency(self, _: str, line: OfSome, on_result: OnResult) -> None:
        """Release robots that an emergency holds; the DVA decides whether this console may."""
        system = self._system
        now = system.clock.now
        devices = system.state.devices
        named = self._driving.robots_in(line)
        robots = [i for i in named if emergency_of(devices[i], now, {}) is not None]
        if not robots:
            raise Refused(NOBODY_STOPPED)
        labels = {robot: system.label_of(robot) for robot in robots}
        release_robots(robots, labels, system.decide, on_result)

    @does("revoke")
    def _revoke(self, _: str, line: OfDevice, on_result: OnResult) -> None:
        robot = self._driving.robot(line["device"])
        label = self._system.label_of(robot)
        revoke_permission(robot, label, self._system.decide, on_result)

    @does("fake_add")
    def _add_fake(self, _: str, line: FakeAsked, on_result: OnResult) -> None:
        if self._system.options.keys is not None:
            raise Refused("with --keys, a fake device would need a key of its own")
        self._system.fakes.add(line, on_result)

    @does("fake_remove")
    def _remove_fake(self, _: str, line: OfDevice, on_result: OnResult) -> None:
        label = self._system.fakes.remove(line["device"])
        on_result(
            True, f"{label} speaks no more: the DVA takes it from its list within some seconds"
        )
