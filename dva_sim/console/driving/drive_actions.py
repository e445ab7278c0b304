"""Driving from pages: seats, robots in hand, input, and all that ends a drive.

Whatever ends a drive ends it for good: nothing begins again by itself. Any robot that is listed can
be taken, of any origin: a seat knows it by its messages.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol, Unpack

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.operator.handheld import Gathered
from dva_sim.agents.operator.held_robot import HeldRobot
from dva_sim.agents.operator.person_at_console import PersonAgent
from dva_sim.agents.operator.steps import ask_emergency
from dva_sim.console.asking.answers import FAREWELL_PREFIX
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused, unanswered
from dva_sim.console.audit.audited import name_of_page
from dva_sim.console.driving.driven_system import DrivenSystem
from dva_sim.console.events.takeover import Takeover
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import (
    OfRobot,
    OfRobots,
    OfSome,
    PagesHere,
    PatternChoice,
    SampleBatch,
    TakeAsked,
    Wish,
)
from dva_sim.console.wire.limits import SILENT_AFTER
from dva_sim.console.wire.seats import Answered
from dva_sim.kernel.errors import DvaSimError
from dva_sim.network.patterns import PATTERNS
from dva_sim.protocol import messages as m

LOOK = 0.05  # from one look at who has fallen silent to the next, real time [s]
TURNED_WITHIN = 10.0  # a DVA has registered a seat by then, or does not answer [s]
ONE_REGION = "one person drives in one region at a time: give back what you have in the other"


class Handhelds(Protocol):
    """Phones in the hands of people at pages."""

    def sits(self, client: str) -> bool:
        """Return True if a page has the seat of a phone, and none of the console."""

    def is_tilted(self, client: str) -> bool:
        """Return True for the page of a phone that is steered by tilt now."""

    def let_go(self, client: str) -> None:
        """Let go of the stick on a screen, if it is that of a phone."""

    def leaves(self, client: str) -> None:
        """Note that a page has left its seat of the console."""


class NoHandhelds:
    """A console without phones."""

    def sits(self, client: str) -> bool:
        """Return False: nobody has a phone."""
        return False

    is_tilted = sits

    def let_go(self, client: str) -> None:
        """Take a phone that is not tilted."""

    leaves = let_go


class Driving:
    """Does what pages ask for to drive robots.

    Args:
        system: System whose robots are driven.

    Attributes:
        phones: Phones of the console.
    """

    def __init__(self, system: DrivenSystem) -> None:
        self._system = system
        self._seating = system.seating
        self._seats = system.seating.seats
        self.phones: Handhelds = NoHandhelds()

    # --- seats -----------------------------------------------------------------------------

    def person(self, client: str) -> PersonAgent:
        """Return the person in a page's seat.

        Raises:
            Refused: the page has none.
        """
        person = self._seating.of_client(client)
        if person is None:
            raise Refused("You are not controlling a robot. Take control first.")
        return person

    @does("take")
    def take(self, client: str, line: TakeAsked, on_result: OnResult) -> None:
        """Take robots into the seat of a page, which gets one."""
        robots = self.robots_in(line)
        number = self._sit(client, self._seating.seat_of_order(robots))
        person = self._seating.person(number)
        self._seating.client_of[number] = client
        person.sit_down()
        self.man()

        holders = self._holders(robots, person)

        def answered(ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
            if not ok and not person.robots:
                self.leave(client)
            self.hold()
            on_result(ok, text if ok or not holders else f"{text}. {holders}", **more)

        self._system.introduce(person.device, robots)
        take = partial(person.take, robots, answered, line.get("level", "teleoperation"))
        self.turn(person, robots, take, answered)

    def turn(
        self,
        person: PersonAgent,
        robots: Sequence[str],
        then: Callable[[], object],
        on_result: OnResult,
    ) -> None:
        """Call `then` once a person is registered with the DVA of the first of some robots.

        Who has something to do at another DVA stays there, and is refused.
        """
        device = person.device
        dva = next(filter(None, map(self._system.system.dva_of, robots)), device.dva)
        ends = device.clock.now + TURNED_WITHIN

        def looks_again() -> bool:
            if device.dva == dva:
                then()
            elif device.clock.now >= ends:
                unanswered(on_result)
            return device.dva != dva and device.clock.now < ends

        if dva != device.dva and (person.robots or person.order is not None):
            on_result(False, ONE_REGION)
        elif looks_again():
            device.turn_to(dva)
            device.clock.every(LOOK, looks_again)

    def _sit(self, client: str, rather: int | None = None) -> int:
        """Return the number of a page's seat, which has a person from then on.

        Raises:
            Refused: all seats are taken, or a new one cannot take part.
        """
        number = self._seats.sit(client, rather)
        if number is None:
            raise Refused("All seats are taken.")
        try:
            self._seating.person(number)
        except (Refused, DvaSimError):
            self._seats.stand_up(client)
            raise
        return number

    def _holders(self, robots: Sequence[str], person: PersonAgent) -> str:
        """Describe which other pages hold some of these robots, and how to get them; or empty."""
        by_page = {
            robot: self._seating.client_of.get(number)
            for number, other in self._seating.persons.items()
            for robot in other.robots
            if other is not person and robot in robots
        }
        named = [
            f"{self._system.label_of(robot)} is held on {name_of_page(client)}"
            for robot, client in by_page.items()
            if client is not None
        ]
        if not named:
            return ""
        none = " No robot was taken." if len(robots) > 1 else ""
        return f"{'; '.join(named)}: release it there, or take it over on the page Events.{none}"

    def sits(self, client: str) -> bool:
        """Return True if a page has a seat."""
        return client in self._seats.taken

    def release(self, client: str, on_result: OnResult) -> None:
        """Give back all that a page holds."""
        if not self.sits(client):
            self.hold()
            on_result(True, "released")
            return
        self.person(client).release(on_result)
        self.leave(client)

    def leave(self, client: str) -> None:
        """Let a page leave its seat."""
        if self.phones.sits(client):  # its device stays, as long as its page
            self.person(client).attended = True
            self.hold()
            return
        self.phones.leaves(client)
        number = self._seats.stand_up(client)
        if number is not None:
            self._seating.person(number).attended = False
            self._seating.client_of.pop(number, None)
            self._system.free_seat(client)
        self.hold()

    def attend(self, line: PagesHere) -> None:
        """Note which pages are open."""
        self._seats.note_open(line["pages"], time.monotonic())
        self.man()

    def man(self) -> None:
        """Let exactly the seats take part at which somebody is."""
        persons = self._seating.persons
        free = persons if self._system.seeks_orders else ()
        manned = self._seats.manned(free, time.monotonic())
        for number, person in list(persons.items()):
            person.man(number in manned)

    def hold(self) -> None:
        """Say which robots are in somebody's hands."""
        self._system.on_held(self._seating.held)

    # --- who is meant ----------------------------------------------------------------------

    def robots_in(self, line: OfRobots | OfSome) -> list[str]:
        """Return ids of the robots that a line names by their numbers or labels.

        Raises:
            Refused: it names none, or one that nobody knows.
        """
        names = line.get("robots", "all")
        if names == "all":
            return list(self._system.robots())
        if not names:
            raise Refused("No robot was named.")
        return list(dict.fromkeys(self.robot(one) for one in names))

    def held(self, client: str, line: OfRobot) -> HeldRobot:
        """Return the robot that a line names, in the hands of a page's person.

        Raises:
            Refused: the person does not hold it.
        """
        robot = self.robot(line["robot"])
        held = self.person(client).robots.get(robot)
        if held is None:
            raise Refused(f"You do not hold {self._system.label_of(robot)}.")
        return held

    def robot(self, name: Any) -> str:
        """Return the id of a robot by its number or label.

        Raises:
            Refused: nobody knows it.
        """
        for robot in self._system.robots():
            if name in self._system.names_of(robot):
                return robot
        raise Refused(f"there is no robot {name!r}")

    # --- drives ----------------------------------------------------------------------------

    @does("start")
    def start(self, client: str, _: Asked, on_result: OnResult) -> None:
        """Begin to drive what a page holds."""
        person = self.person(client)
        if why := self._system.why_not():
            raise Refused(why)
        person.alert = ""
        person.start(on_result)

    @does("stop")
    def stop(self, client: str, _: Asked, on_result: OnResult) -> None:
        """End the drive of a page."""
        self.person(client).stop(on_result)

    @does("emergency")
    def emergency(self, client: str, line: OfSome, on_result: OnResult) -> None:
        """Stop robots, each over its own connection; those that do not answer are named."""
        own = self._seating.of_client(client)
        if "robots" not in line and own is not None:
            line = {"robots": list(own.robots)}
        robots = self._known_robots(line)
        device = self._system.emergency_device if own is None else own.device
        self._system.note_emergency(robots, device, client)
        # Drivers at this console learn at once that somebody has stopped their robot.
        for person in self._seating.persons.values():
            if person is not own:
                person.ended_by_others(robots)
        self._system.introduce(device, robots)

        def answered(ok: bool, text: str) -> None:
            if ok:
                on_result(True, text)
            else:
                unanswered(on_result, text)

        if own is not None:
            own.emergency(robots, answered)
            return
        each = Gathered(len(robots), answered)
        for robot in robots:
            ask_emergency(device, robot, 0, each)

    def _known_robots(self, line: OfSome) -> list[str]:
        """Return ids of the robots that an emergency is for; names that nobody knows are left out.

        Raises:
            Refused: nobody knows any of them.
        """
        names = line.get("robots", "all")
        everywhere = [robot for robot in self._system.robots() if self._system.hears(robot)]
        if names == "all":
            named = everywhere
        elif not names:
            raise Refused("No robot was named.")
        else:
            named = [r for r in everywhere if self._system.names_of(r) & set(names)]
        if not named:
            raise Refused(
                "no robot is listed" if names == "all" else f"there is no robot {names[0]!r}"
            )
        return named

    def note_drawn(self, client: str, line: SampleBatch | Wish) -> None:
        """Note which picture of each robot a page has drawn last, if it says so."""
        person = self._seating.of_client(client)
        if person is None or "seen" not in line:
            return
        drawn = {int(number): int(taken) for number, taken in line["seen"]}
        for robot, held in person.robots.items():
            numbers = self._system.names_of(robot)
            held.drew(next((at for number, at in drawn.items() if number in numbers), None))

    @does("input")
    def steer(self, client: str, line: Wish) -> None:
        """Steer as a person wants now; a stick that is let go asks for a stop."""
        self.note_drawn(client, line)
        held = line["held"]
        if not held and self.phones.is_tilted(client):
            return  # a stick that nobody touches does not take a tilted phone's place
        speed, turn = (line["speed"], line["turn"]) if held else (0.0, 0.0)
        if self._seats.heard(client, time.monotonic(), held):
            self.person(client).want(line["n"], speed, turn)
            if not held:
                self.phones.let_go(client)

    def end_hidden(self, client: str) -> None:
        """End what a hidden page, or one with a closed socket, has in hand."""
        self.stop_client(client, "stopped: the page was hidden, left or cut off")

    def look(self) -> None:
        """End the drives of pages that are silent, or draw no new pictures; call it often."""
        why = f"stopped: the page was silent for {SILENT_AFTER:g} s while it held on"
        for client in self._seats.silent(time.monotonic()):
            self.stop_client(client, why)
        self.man()
        self._look_for_old_pictures()

    def _look_for_old_pictures(self) -> None:
        now = self._system.clock.now
        holding = [(c, seat) for c, seat in self._seats.taken.items() if seat.holds]
        for client, seat in holding:
            for held in self._seating.person(seat.number).robots.values():
                is_old = held.drawn is not None and now - held.drawn > self._system.stale_s
                if held.is_driven and held.drawn is not None and is_old:
                    self.stop_client(
                        client,
                        f"stopped: your page has drawn no new picture of {held.label} for "
                        f"{now - held.drawn:.1f} s",
                    )
                    break

    def stop_client(self, client: str, why: str) -> None:
        """End the drive of a page, which did not ask for it."""
        seat = self._seats.taken.get(client)
        if seat is not None:
            seat.holds = False
            self._seating.person(seat.number).stop(_nobody, why)

    def stop_all(self, why: str) -> None:
        """End all drives."""
        for client in list(self._seats.taken):
            self.stop_client(client, why)

    def take_over(
        self,
        client: str,
        *,
        agent: ControlRoomAgent,
        robot: str,
        reason: str,
        event: m.EventStatus | None,
        on_result: OnResult,
    ) -> None:
        """Take a robot and its task from its driver into a page's seat.

        Args:
            client: The page.
            agent: Control room that decides.
            robot: Id of the robot.
            reason: Reason in words.
            event: Event that the robot was sent to, if any.
            on_result: Callback for the result.
        """
        try:
            seat = self._seating.person(self._sit(client))
        except (Refused, DvaSimError) as error:
            on_result(False, str(error))
            return
        take = partial(self.take, client, TakeAsked(robots=[robot]))

        def ended(ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
            if not ok and not seat.robots:
                self._seats.stand_up(client)
                seat.attended = client in self._seating.client_of.values()
            on_result(ok, text, **more)

        takeover = Takeover(
            agent=agent,
            robot=robot,
            reason=reason,
            event=event,
            seat=seat.device.id_tag,
            take=take,
            on_result=ended,
        )
        self.turn(seat, [robot], takeover.begin, ended)

    # --- orders ----------------------------------------------------------------------------

    @does("confirm")
    def confirm(self, client: str, _: Asked, on_result: OnResult) -> None:
        """Report the event of a page's order as real."""
        self.person(client).report("confirmed", on_result)

    @does("refute")
    def refute(self, client: str, _: Asked, on_result: OnResult) -> None:
        """Report the event of a page's order as false."""
        self.person(client).report("refuted", on_result)

    @does("decline")
    def decline(self, client: str, _: Asked, on_result: OnResult) -> None:
        """Decline the order of one's own seat, or of a seat in which nobody sits."""
        if self.sits(client):
            self.person(client).decline(on_result)
            return
        persons = self._seating.persons.values()
        free = [p for p in persons if p.order is not None and not p.attended]
        if not free:
            raise Refused("You have no order.")
        free[0].decline(on_result)

    # --- the pattern -----------------------------------------------------------------------

    @does("pattern")
    def choose_pattern(self, _: str, line: PatternChoice, on_result: OnResult) -> None:
        """Drive a robot by another pattern from the next drive on; a drive is stopped first."""
        robot = self.robot(line.get("robot"))
        name = str(line.get("name"))
        if name not in PATTERNS and name != self._system.own_pattern:
            raise Refused(f"there is no pattern {name!r}; patterns: {', '.join(PATTERNS)}")
        label = self._system.label_of(robot)

        def changed(ok: bool, text: str = "") -> None:
            on_result(ok, f"{label} will use {name} for its next drive" if ok else text)

        def change(ok: bool = True, text: str = "") -> None:
            problem = "" if ok else text
            self._system.change_pattern(
                robot, name, lambda ok, text, **_: changed(ok, problem or text)
            )

        holders = (p.robots[robot] for p in self._seating.persons.values() if robot in p.robots)
        holder = next(holders, None)
        if holder is not None and holder.is_driven:
            holder.stop("stopped", change)
        else:
            change()


def is_gone_for_good(line: Asked) -> bool:
    """Return True for a release in the name of a page that will never come back."""
    return str(line["id"]).startswith(FAREWELL_PREFIX)


def _nobody(ok: bool, text: str) -> None:
    """Take the answer to what nobody asked for."""
