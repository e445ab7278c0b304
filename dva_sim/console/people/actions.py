"""Actions that people at pages ask for: each is done once, and answered once.

Seats are given out here. Whatever ends a drive ends it for good: nothing begins again by itself.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from dva_sim.agents.operator.person_at_console import PersonAgent
from dva_sim.console.asking.answers import BYE
from dva_sim.console.asking.dispatcher import ActionDispatcher, does
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.asking.seats import Seats
from dva_sim.console.audit.audited import name_of_page
from dva_sim.console.events.alarm_actions import AlarmActions
from dva_sim.console.guards.guard_actions import GuardActions
from dva_sim.console.people.phone_actions import PhoneActions
from dva_sim.console.people.room_actions import RoomActions
from dva_sim.console.people.tour import tour_of
from dva_sim.console.robots.robot_actions import RobotActions
from dva_sim.console.run.sliders import change_pattern
from dva_sim.console.wire.actions import ActionPlace, Asked
from dva_sim.console.wire.arguments import (
    FASTEST,
    LinkChange,
    LogsLooked,
    MarkAsked,
    Nothing,
    OfRobots,
    OfSome,
    PaceChange,
    PagesHere,
    PatternChoice,
    RobotsWatched,
    SampleBatch,
    TourTime,
    Wish,
)
from dva_sim.console.wire.limits import SILENT_AFTER
from dva_sim.console.wire.seats import DoneLine
from dva_sim.console.world.world import ConsoleWorld
from dva_sim.network.patterns import PATTERNS

LOOK = 0.05  # from one look at who has fallen silent to the next, real time [s]


class Actions:
    """Does what lines of the web process ask for.

    Attributes:
        take: Does what a line asks for.
    """

    def __init__(self, world: ConsoleWorld) -> None:
        self._world = world
        self._seats = Seats()
        self._phones = PhoneActions(world, self._seats, self._robot, self._stop_one)
        self._rooms = RoomActions(world, self._seats, self._robot, self._take)
        self._at_robots = RobotActions(
            world.windows,
            self._robot,
            why_not=self._why_not,
            labels=world.run.stage.labels,
            deaf=world.deafen,
            slow=world.run.slowed,
        )
        guards = GuardActions(world.guards, world.run.stage.site)
        alarms = AlarmActions(world.alarms, world.author, lambda *given: dispatcher.do(*given))
        holders = self, self._phones, self._at_robots, guards, self._rooms, alarms, world.dva
        dispatcher = ActionDispatcher(
            ActionPlace.WORLD,
            holders=holders,
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

    # --- seats -----------------------------------------------------------------------------

    def _person(self, client: str) -> PersonAgent:
        seat = self._seats.taken.get(client)
        if seat is None:
            raise Refused("You are not controlling a robot. Take control first.")
        return self._world.person(seat.number)

    @does("take")
    def _take(self, client: str, line: OfRobots, on_result: OnResult) -> None:
        robots = self._robots(line)
        number = self._seats.sit(client, self._world.seat_of_order(robots))
        if number is None:
            raise Refused("All seats are taken.")
        person = self._world.person(number)
        self._world.client_of[number] = client
        person.sit_down()
        self._man()

        holders = self._holders(robots, person)

        def answered(ok: bool, text: str) -> None:
            if not ok and not person.robots:
                self._leave(client)
            self._hold()
            on_result(ok, text if ok or not holders else f"{text}. {holders}")

        person.take(robots, answered)

    def _holders(self, robots: list[str], person: PersonAgent) -> str:
        """Describe which other pages hold some of these robots, and how to get them; or empty."""
        by_page = {
            robot: self._world.client_of.get(number)
            for number, other in self._world.numbered_persons()
            for robot in other.robots
            if other is not person and robot in robots
        }
        named = [
            f"{self._world.run.stage.labels[robot]} is held on {name_of_page(client)}"
            for robot, client in by_page.items()
            if client is not None
        ]
        if not named:
            return ""
        none = " No robot was taken." if len(robots) > 1 else ""
        return f"{'; '.join(named)}: release it there, or take it over on the page Events.{none}"

    @does("release")
    def _release(self, client: str, line: Asked, on_result: OnResult) -> None:
        if str(line["id"]).startswith(BYE):
            self._phones.forget(client)
            self._rooms.forget(client)
            self._hold()
        if client not in self._seats.taken:
            on_result(True, "released")
            return
        person = self._person(client)
        person.release(on_result)
        self._leave(client)

    def _leave(self, client: str) -> None:
        if self._phones.sits(client):  # its device stays, as long as its page
            self._person(client).attended = True
            self._hold()
            return
        self._phones.leaves(client)
        number = self._seats.stand_up(client)
        if number is not None:
            self._world.person(number).attended = False
            self._world.client_of.pop(number, None)
            self._world.free_seat(client)
        self._hold()

    @does("here")
    def _here(self, _: str, line: PagesHere) -> None:
        self._seats.note_open(line["pages"], time.monotonic())
        self._rooms.attend(line["pages"])
        self._man()

    def _man(self) -> None:
        """Let exactly the seats take part at which somebody is."""
        persons = dict(self._world.numbered_persons())
        manned = self._seats.manned(persons, time.monotonic())
        for number, person in persons.items():
            person.man(number in manned)

    def _hold(self) -> None:
        held = {robot for person in self._world.persons for robot in person.robots}
        self._world.screens.hold(held)

    def _robots(self, line: OfRobots | OfSome) -> list[str]:
        """Ids of the robots that a line names by their numbers or labels."""
        given = line.get("robots", "all")
        if given == "all":
            return list(self._world.run.field.robots)
        if not given:
            raise Refused("No robot was named.")
        return list(dict.fromkeys(self._robot(one) for one in given))

    def _robot(self, given: Any) -> str:
        world = self._world
        for robot in world.run.field.robots.values():
            number = world.feed.numbers[robot.device.id_tag]
            if given in (robot.device.label, robot.device.id_tag, number):
                return robot.device.id_tag
        raise Refused(f"there is no robot {given!r}")

    # --- drives ----------------------------------------------------------------------------

    def _why_not(self) -> str:
        """Return why nobody may drive now; empty if one may."""
        if self._world.lag.held:
            return "held: this machine cannot keep up with real time"
        return "The simulation is paused. Resume it first." if self._world.clock.paused else ""

    @does("start")
    def _start(self, client: str, _: Asked, on_result: OnResult) -> None:
        person = self._person(client)
        if why := self._why_not():
            raise Refused(why)
        person.alert = ""
        person.start(on_result)

    @does("stop")
    def _stop(self, client: str, _: Asked, on_result: OnResult) -> None:
        self._person(client).stop(on_result)

    @does("emergency")
    def _emergency(self, client: str, line: OfSome, on_result: OnResult) -> None:
        seat = self._seats.taken.get(client)
        if "robots" not in line and seat is not None:
            line = {"robots": list(self._world.person(seat.number).robots)}
        joined = self._joined()
        robots = self._to_stop(line, joined)
        self._at_robots.stop(robots)
        # Who drives a robot from here learns of its end at once, whoever pressed the button.
        own = self._world.person(0 if seat is None else seat.number)
        for person in self._world.persons:
            if person is not own or seat is None:
                person.ended_by_others(robots)
        self._note_stopper(robots, own.device.id_tag, client)
        for robot in joined.keys() & set(robots):
            own.device.introduce(robot, joined[robot])
        own.emergency(robots, on_result)

    def _note_stopper(self, robots: Sequence[str], device: str, client: str) -> None:
        """Note the person behind an emergency; of several, the first counts."""
        here = self._world.run.field.robots
        for robot in robots:
            if robot in here and not here[robot].controller.latch.holds:
                self._world.feed.stoppers[robot] = device, self._world.author(client)

    def _joined(self) -> dict[str, str]:
        """Addresses of robots from outside the scenario that can be reached, by id."""
        here = self._world.foreign.addresses()
        fakes = self._world.dva.fakes
        return {robot: address for robot, address in here.items() if robot not in fakes}

    def _to_stop(self, line: OfSome, joined: Mapping[str, str]) -> list[str]:
        """Ids of the robots that a line names, wherever they are from; what is unknown is left."""
        everywhere = [*self._world.run.field.robots, *joined]
        given = line.get("robots", "all")
        if given == "all":
            return everywhere
        if not given:
            raise Refused("No robot was named.")
        numbers = self._world.feed.numbers
        labels = self._world.run.stage.labels
        named = [r for r in everywhere if {r, numbers.get(r), labels.get(r)} & set(given)]
        if not named:
            raise Refused(f"there is no robot {given[0]!r}")
        return named

    def _drew(self, client: str, line: SampleBatch | Wish) -> None:
        """Note which picture of each robot a page has drawn last, if it says so."""
        seat = self._seats.taken.get(client)
        if seat is None or "seen" not in line:
            return
        drawn = {int(number): int(taken) for number, taken in line["seen"]}
        for robot, held in self._world.person(seat.number).robots.items():
            number = self._world.feed.numbers.get(robot)
            held.drew(None if number is None else drawn.get(number))

    @does("samples")
    def _samples(self, client: str, line: SampleBatch) -> None:
        self._drew(client, line)
        self._phones.samples(client, line)

    @does("input")
    def _input(self, client: str, line: Wish) -> None:
        """Steer as a person wants now; a stick that is let go asks for a stop."""
        self._drew(client, line)
        held = line["held"]
        if not held and self._phones.is_tilted(client):
            return  # a stick that nobody touches does not take a tilted phone's place
        speed, turn = (line["speed"], line["turn"]) if held else (0.0, 0.0)
        if self._seats.heard(client, time.monotonic(), held):
            self._person(client).want(line["n"], speed, turn)
            if not held:
                self._phones.let_go(client)

    @does("gone")
    def _gone(self, client: str, _: Asked) -> None:
        """The page is hidden, or its socket closed: nobody has a hand on it."""
        self._at_robots.gone(client)
        self._stop_one(client, "stopped: the page was hidden, left or cut off")

    def _look_for_the_silent(self) -> None:
        self._at_robots.look_for_the_silent()
        why = f"stopped: the page was silent for {SILENT_AFTER:g} s while it held on"
        for client in self._seats.silent(time.monotonic()):
            self._stop_one(client, why)
        self._man()
        self._look_for_old_pictures()

    def _look_for_old_pictures(self) -> None:
        """End the drives of pages that hold on and draw no new pictures."""
        now = self._world.clock.now
        limit = self._world.scenario.robot.max_age_s
        holding = [(c, seat) for c, seat in self._seats.taken.items() if seat.holds]
        for client, seat in holding:
            for held in self._world.person(seat.number).robots.values():
                if held.is_driven and held.drawn is not None and now - held.drawn > limit:
                    self._stop_one(
                        client,
                        f"stopped: your page has drawn no new picture of {held.label} for "
                        f"{now - held.drawn:.1f} s",
                    )
                    break

    def _stop_one(self, client: str, why: str) -> None:
        seat = self._seats.taken.get(client)
        if seat is not None:
            seat.holds = False
            self._world.person(seat.number).stop(_nobody, why)

    def _stop_all(self, why: str) -> None:
        self._at_robots.stop(self._world.run.field.robots)
        for client in list(self._seats.taken):
            self._stop_one(client, why)

    @does("confirm")
    def _confirm(self, client: str, _: Asked, on_result: OnResult) -> None:
        self._person(client).report("confirmed", on_result)

    @does("refute")
    def _refute(self, client: str, _: Asked, on_result: OnResult) -> None:
        self._person(client).report("refuted", on_result)

    @does("decline")
    def _decline(self, client: str, _: Asked, on_result: OnResult) -> None:
        """Decline the order of one's own seat, or of a seat in which nobody sits."""
        if client in self._seats.taken:
            self._person(client).decline(on_result)
            return
        free = [p for p in self._world.persons if p.order is not None and not p.attended]
        if not free:
            raise Refused("You have no order.")
        free[0].decline(on_result)

    # --- what can be changed ---------------------------------------------------------------

    @does("link")
    def _link(self, _: str, line: LinkChange, on_result: OnResult) -> None:
        on_result(True, self._world.change_link(line))

    @does("pattern")
    def _pattern(self, _: str, line: PatternChoice, on_result: OnResult) -> None:
        robot = self._robot(line.get("robot"))
        name = line.get("name")
        world = self._world
        if name not in PATTERNS and name != world.scenario.pattern:
            raise Refused(f"there is no pattern {name!r}; patterns: {', '.join(PATTERNS)}")
        label = world.run.stage.labels[robot]

        def changed(ok: bool, text: str = "") -> None:
            on_result(ok, f"{label} will use {name} for its next drive" if ok else text)

        change_pattern(world.run, world.persons, robot, str(name), changed)

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
        robot = self._robot(line["robot"])
        took = line["took_s"]
        log = self._world.recorder.newest_drive.get(robot)
        if log is None or log.operator != self._person(client).device.id_tag:
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


def _nobody(ok: bool, text: str) -> None:
    """Takes the answer to what nobody asked for."""
