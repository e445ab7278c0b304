"""Interface of a system whose robots are driven from pages: a run, or one that runs elsewhere."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.operator.strategies import Reach
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.driving.seating import Seating
from dva_sim.console.events.decisions import UNKNOWN_ROOM
from dva_sim.network.realtime import PacedClock
from dva_sim.protocol import messages as m
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.site import Site


class DrivenSystem(ABC):
    """The system whose robots are driven.

    Attributes:
        clock: Its time.
        seating: Seats of the console.
        own_pattern: Pattern of its scenario.
        stale_s: Age above which robots refuse what a command was based on [s].
        seeks_orders: True if free seats take part while pages are open: the DVA may order them.
        on_held: Callback for the robots that are in somebody's hands, by id.
        free_seat: Callback for a page that sits nowhere any more.
    """

    clock: PacedClock
    seating: Seating
    own_pattern: str
    stale_s: float
    seeks_orders: bool
    on_held: Callable[[set[str]], object]
    free_seat: Callable[[str], object]

    @property
    @abstractmethod
    def now_ms(self) -> int:
        """Return the time for pages [ms]."""

    @property
    @abstractmethod
    def emergency_device(self) -> AgentDevice:
        """Return the device that stops robots for pages without a seat."""

    @abstractmethod
    def robots(self) -> Sequence[str]:
        """Return the ids of all robots that pages show."""

    @abstractmethod
    def number_of(self, robot: str) -> int | None:
        """Return the number by which pages know a robot."""

    @abstractmethod
    def label_of(self, device: str) -> str:
        """Return the label of a device, by its id."""

    def names_of(self, robot: str) -> set[object]:
        """Return the names that a line may give a robot: its id, number or label."""
        return {robot, self.number_of(robot), self.label_of(robot)}

    @abstractmethod
    def mode_of(self, robot: str) -> str:
        """Return the mode of a robot; empty if it is unknown."""

    @abstractmethod
    def pattern_of(self, robot: str) -> str:
        """Return the name of the pattern by which a robot is driven next, or now."""

    @abstractmethod
    def reach(self, robot: str) -> Reach:
        """Return the limits of a robot."""

    @property
    @abstractmethod
    def site(self) -> Site | None:
        """Return the site, if one is known."""

    @property
    @abstractmethod
    def frame(self) -> GeoFrame:
        """Return the origin of the map."""

    def place_of(self, position: m.Position) -> tuple[float, float, str | None]:
        """Return a position on the map [m], and its room."""
        x, y = self.frame.to_xy(position.latitude, position.longitude)
        return x, y, UNKNOWN_ROOM if self.site is None else self.site.room_at(x, y)

    @abstractmethod
    def stopped(self) -> Sequence[str]:
        """Return the ids of the robots that an emergency holds."""

    @abstractmethod
    def hears(self, robot: str) -> bool:
        """Return False for a robot that was added by hand, and hears nothing."""

    @abstractmethod
    def introduce(self, device: AgentDevice, robots: Sequence[str]) -> None:
        """Let a device know where robots are found."""

    def why_not(self) -> str:
        """Return why nobody may drive now; empty if one may."""
        return ""

    @abstractmethod
    def note_emergency(self, robots: Sequence[str], device: AgentDevice, client: str) -> None:
        """Note who stops robots from a page, before the robots hear of it."""

    @abstractmethod
    def change_pattern(self, robot: str, name: str, on_result: OnResult) -> None:
        """Drive a robot by another pattern from the next drive on, unless it is driven."""
