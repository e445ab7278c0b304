"""The seats of a console: a person's device each, and the page that sits there."""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import suppress

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.operator.handheld import Console
from dva_sim.agents.operator.held_robot import HeldRobot
from dva_sim.agents.operator.person_at_console import PersonAgent
from dva_sim.console.asking.seats import FIRST_OF_PHONES, Seats
from dva_sim.kernel.errors import DvaSimError
from dva_sim.network.realtime import PacedClock

LAST_WORDS = 0.2  # of the run's time, for robots that are told to stop [s]


class Seating:
    """Seats of a console, taken and free.

    Args:
        make: Function that returns the device of a new seat, by its number from 1.
        console: Equipment of persons.
        on_robot: Callback for each robot that a person takes.

    Attributes:
        seats: Assignment of pages to seats.
        persons: Those of all seats, by number.
        client_of: Page in each seat, by number.
    """

    def __init__(
        self,
        make: Callable[[int], AgentDevice],
        console: Console,
        on_robot: Callable[[HeldRobot], object],
    ) -> None:
        self._make = make
        self._on_robot = on_robot
        self.console = console
        self.seats = Seats()
        self.persons: dict[int, PersonAgent] = {}
        self.client_of: dict[int, str] = {}

    def person(self, number: int) -> PersonAgent:
        """Return the person of a seat; seats of the console are made from 0 on, unmanned."""
        while number < FIRST_OF_PHONES and number not in self.persons:
            place = sum(1 for place_taken in self.persons if place_taken < FIRST_OF_PHONES)
            device = self._make(place + 1)
            device.withdrawn = True
            self.let_in(place, PersonAgent(device, self.console))
        return self.persons[number]

    def of_client(self, client: str) -> PersonAgent | None:
        """Return the person whose seat a page has taken, if it has one."""
        seat = self.seats.taken.get(client)
        return None if seat is None else self.person(seat.number)

    def seat_of_order(self, robots: Collection[str]) -> int | None:
        """Return an empty seat in which an order waits for one of these robots."""
        for number, person in self.persons.items():
            waits = person.order is not None and person.order.device in robots
            if waits and not person.attended and number < FIRST_OF_PHONES:
                return number
        return None

    def let_in(self, number: int, person: PersonAgent) -> None:
        """Let a person take part, in a seat of its own."""
        person.on_robot = self._on_robot
        self.persons[number] = person

    def equip(self, console: Console) -> None:
        """Give all persons other equipment, from the next drive on."""
        self.console = console
        for person in self.persons.values():
            person.console = console

    @property
    def held(self) -> set[str]:
        """Robots that are in somebody's hands, by id."""
        return {robot for person in self.persons.values() for robot in person.robots}


def leave_seats(seating: Seating, clock: PacedClock) -> None:
    """Let everybody give back what they hold, and leave a moment for the word of it."""
    for person in seating.persons.values():
        person.release(lambda *_: None)
    clock.pace(paused=False)
    with suppress(DvaSimError):
        clock.run(clock.now + LAST_WORDS)
