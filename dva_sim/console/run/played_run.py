"""Interface of whatever a console runs: a whole run, or one robot alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.link.link import Link
from dva_sim.network.messaging import Transport
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.full.stage import Stage
from dva_sim.simulation.scenario import Scenario


class PlayedRun(Protocol):
    """Run that is shown to people."""

    @property
    def scenario(self) -> Scenario:
        """Scenario of the run."""

    @property
    def clock(self) -> Clock:
        """Its time."""

    @property
    def recorder(self) -> Recorder:
        """Told what happens."""

    @property
    def network(self) -> Transport:
        """Transport of its messages."""

    @property
    def stage(self) -> Stage:
        """Stage on which it takes place."""

    @property
    def field(self) -> Field:
        """Positions of all bodies."""

    @property
    def links(self) -> Mapping[str, tuple[Link, Link]]:
        """Modelled links to each robot and back, by its id."""
