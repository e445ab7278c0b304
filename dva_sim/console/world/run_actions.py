"""Actions that people at the pages of a console's own run ask for."""

from __future__ import annotations

from typing_extensions import override

from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.desk.console_actions import ConsoleActions
from dva_sim.console.driving.drive_actions import Driving
from dva_sim.console.guards.guard_actions import GuardActions
from dva_sim.console.robots.robot_actions import RobotActions
from dva_sim.console.wire.actions import ActionPlace
from dva_sim.console.wire.arguments import (
    FASTEST,
    LinkChange,
    MarkAsked,
    Nothing,
    PaceChange,
    SampleBatch,
    TourTime,
)
from dva_sim.console.world.phone_actions import PhoneActions
from dva_sim.console.world.tour import tour_of
from dva_sim.console.world.world import ConsoleWorld


class RunActions(ConsoleActions):
    """Does what lines of the web process ask for, with all that only a bench can do.

    Args:
        world: The run.
    """

    def __init__(self, world: ConsoleWorld) -> None:
        self._world = world
        super().__init__(world, ActionPlace.WORLD, "no action {what!r}")
        world.hold = self._stop_all

    @override
    def holders(self, driving: Driving) -> tuple[object, ...]:
        world = self._world
        self._phones = driving.phones = PhoneActions(world, driving)
        self._at_robots = world.driven.hands = RobotActions(
            world.windows,
            driving.robot,
            why_not=world.driven.why_not,
            labels=world.run.stage.labels,
            deaf=world.run.deafened,
            slow=world.run.slowed,
        )
        guards = GuardActions(world.guards, world.run.stage.site, world.rooms)
        return self._phones, self._at_robots, guards

    # --- what the run adds to driving --------------------------------------------------------

    @override
    def forget(self, client: str) -> None:
        self._phones.forget(client)
        super().forget(client)

    @override
    def hide(self, client: str) -> None:
        self._at_robots.gone(client)
        super().hide(client)

    @override
    def look_for_the_silent(self) -> None:
        self._at_robots.look_for_the_silent()
        super().look_for_the_silent()

    @does("samples")
    def _samples(self, client: str, line: SampleBatch) -> None:
        self._driving.note_drawn(client, line)
        self._phones.samples(client, line)

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
