"""What units are at, and what they may ask of the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from dva_sim.protocol import messages as m
from dva_sim.timed.incident import Incident
from dva_sim.timed.places import Place

if TYPE_CHECKING:
    from dva_sim.timed.units import Unit


class World(Protocol):
    """What a unit may ask of the world, and tell it."""

    @property
    def now(self) -> float:
        """Time [s]."""

    def after(self, delay: float, action: Any, *args: Any) -> None:
        """Do something later [s]."""

    def say(self, source: str, body: m.Body) -> None:
        """Say something to the DVA."""

    def says_arrived(self, unit: Unit, job: Job) -> None:
        """Tell the DVA that a unit is where it was sent."""

    def stands(self, unit: Unit, activity: str) -> None:
        """Publish where a unit is."""

    def incident_at(self, event: int) -> Incident:
        """What an event of the DVA really is."""

    def length(self, a: Place, b: Place) -> float:
        """Length of the way [m]; infinite if there is none."""

    def place_at(self, position: m.Position) -> Place:
        """The place a message speaks of."""

    def along(self, a: Place, b: Place, gone: float) -> Place:
        """Where somebody is who has gone so far [m]."""

    def mobilisation(self, unit: Unit, incident: Incident) -> float:
        """What it takes this unit this time to get ready [s]."""

    def trip(self, unit: Unit, start: Place, goal: Place) -> float:
        """Time to get somewhere [s]; infinite if there is no way."""

    def look(self, unit: Unit, incident: Incident) -> float:
        """From arrival to being sure [s]."""

    def act(self, unit: Unit, incident: Incident) -> float:
        """What it takes to contain it [s]."""

    def needs_people(self, incident: Incident) -> bool:
        """Whether a person will be called to contain it."""

    def spent(self, unit: Unit, phase: str, since: float) -> None:
        """A unit has been at something until now."""

    def freed(self, unit: Unit, job: Job) -> None:
        """A job is over, or broken off."""

    def exposed(self, unit: Unit, stage: str, seconds: float) -> None:
        """A guard has been within a danger radius for so long."""

    def moving(self, unit: Unit, moves: bool) -> None:
        """A unit begins or ceases to move in a way that the DVA should be told of."""


@dataclass(slots=True)
class Job:
    """What a unit is at.

    Attributes:
        order: The DVA's.
        incident: What it is about.
        voice: Device that answers for it: the guard's, or the operator's.
        begun: When [s].
        phase: `ready`, `travel`, `look`, `act`, `stand by` or `return`.
        inside: Whether it is within the danger, not standing by.
    """

    order: m.Order
    incident: Incident
    voice: str
    begun: float
    phase: str = "ready"
    inside: bool = True


@dataclass(slots=True)
class Leg:
    """A way under way: from where to where, since when [s], how long [m] and until when [s]."""

    start: Place
    goal: Place
    since: float
    length: float
    until: float
