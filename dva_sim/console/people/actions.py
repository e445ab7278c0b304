"""Actions that people at the pages of a console's own run ask for."""

from __future__ import annotations

from dva_sim.console.asking.dispatcher import ActionDispatcher, does
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.driving.decision_actions import DecisionActions
from dva_sim.console.driving.drive_actions import LOOK, Driving, is_gone_for_good
from dva_sim.console.events.alarm_actions import AlarmActions
from dva_sim.console.guards.guard_actions import GuardActions
from dva_sim.console.people.phone_actions import PhoneActions
from dva_sim.console.people.tour import tour_of
from dva_sim.console.robots.robot_actions import RobotActions
from dva_sim.console.wire.actions import ActionPlace, Asked
from dva_sim.console.wire.arguments import (
    FASTEST,
    LinkChange,
    LogsLooked,
    MarkAsked,
    Nothing,
    PaceChange,
    PagesHere,
    RobotsWatched,
    SampleBatch,
    TourTime,
)
from dva_sim.console.wire.seats import DoneLine
from dva_sim.console.world.world import ConsoleWorld


class Actions:
    """Does what lines of the web process ask for.

    Attributes:
        take: Does what a line asks for.
    """

    def __init__(self, world: ConsoleWorld) -> None:
        self._world = world
        self._driving = driving = Driving(world.driven)
        self._phones = driving.phones = PhoneActions(world, driving)
        decisions = DecisionActions(world.driven, world.rooms, driving)
        self._at_robots = RobotActions(
            world.windows,
            driving.robot,
            why_not=world.driven.why_not,
            labels=world.run.stage.labels,
            deaf=world.deafen,
            slow=world.run.slowed,
        )
        world.driven.hands = self._at_robots
        guards = GuardActions(world.guards, world.run.stage.site)
        alarms = AlarmActions(world.alarms, world.author, lambda *given: dispatcher.do(*given))
        holders = self, driving, self._phones, self._at_robots, guards, decisions, alarms
        dispatcher = ActionDispatcher(
            ActionPlace.WORLD,
            holders=(*holders, world.dva, world.dva.fakes),
            tell=self._tell,
            elsewhere="no action {what!r}",
            audited=lambda: world.audited,
        )
        self.take = dispatcher.take
        world.hold = self._stop_all
        world.clock.pulse(LOOK, self._look_for_the_silent)

    def _tell(self, answer: DoneLine) -> None:
        self._world.tell({**answer, "t": self._world.feed.now_ms})
        self._world.tell_now()

    # --- what the world adds to driving ------------------------------------------------------

    @does("release")
    def _release(self, client: str, line: Asked, on_result: OnResult) -> None:
        if is_gone_for_good(line):
            self._phones.forget(client)
            self._world.rooms.leave(client)
        self._driving.release(client, on_result)

    @does("here")
    def _here(self, _: str, line: PagesHere) -> None:
        self._driving.attend(line)
        self._world.rooms.attend(line["pages"])

    @does("samples")
    def _samples(self, client: str, line: SampleBatch) -> None:
        self._driving.note_drawn(client, line)
        self._phones.samples(client, line)

    @does("gone")
    def _gone(self, client: str, _: Asked) -> None:
        self._at_robots.gone(client)
        self._driving.end_hidden(client)

    def _look_for_the_silent(self) -> None:
        self._at_robots.look_for_the_silent()
        self._driving.look()

    def _stop_all(self, why: str) -> None:
        self._at_robots.stop(self._world.run.field.robots)
        self._driving.stop_all(why)

    # --- what can be changed ---------------------------------------------------------------

    @does("link")
    def _link(self, _: str, line: LinkChange, on_result: OnResult) -> None:
        on_result(True, self._world.change_link(line))

    @does("pace")
    def _pace(self, _: str, line: PaceChange, on_result: OnResult) -> None:
        factor = line.get("factor")
        paused = line.get("paused")
        if self._world.run.is_real:
            raise Refused("The simulation runs in real time because its links are real sockets.")
        if factor is not None and factor < 1.0:
            raise Refused(f"factor should be a number from 1 to {FASTEST:g}")
        if paused:
            self._stop_all("stopped: time stands still")
        clock = self._world.clock
        clock.pace(factor, paused)
        now = "time stands still" if clock.paused else f"{clock.factor:g} times real time"
        on_result(True, now)

    @does("tour")
    def _tour(self, _: str, line: Nothing, on_result: OnResult) -> None:
        plan = tour_of(self._world.run, self._world.feed.numbers)
        if plan is None:
            raise Refused(
                "the tour needs two robots with 3 m of free way: drive them into the open"
            )
        on_result(True, "two goals", tour=plan)

    @does("tour_time")
    def _tour_time(self, client: str, line: TourTime, on_result: OnResult) -> None:
        robot = self._driving.robot(line["robot"])
        took = line["took_s"]
        log = self._world.recorder.newest_drive.get(robot)
        if log is None or log.operator != self._driving.person(client).device.id_tag:
            raise Refused("You have not driven this robot.")
        log.by = log.by._replace(tour_time=took)
        on_result(True, f"{took:.1f} s noted")

    @does("mark")
    def _mark(self, client: str, line: MarkAsked, on_result: OnResult) -> None:
        world = self._world
        world.recorder.tell(world.clock.now, world.author(client), f"marks: {line['text']}")
        on_result(True, "marked")

    @does("watch")
    def _watch(self, _: str, line: RobotsWatched) -> None:
        ids = {t["id"] for t in self._world.feed.things.all if t["i"] in line["robots"]}
        self._world.screens.watch(ids)

    @does("look")
    def _look(self, _: str, line: LogsLooked) -> None:
        self._world.logs.look(line["logs"])
        self._world.dva.looked = "devices" in line["tables"]
