"""Travel times: what the core may know of the site, as values rather than a map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dva_sim.protocol import messages as m

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Start:
    """Starting point of a responder.

    Attributes:
        device: Its id.
        kind: `guard` or `robot`.
        position: Current position.
        under_way: True if it is already travelling elsewhere: it needs no mobilisation.
    """

    device: str
    kind: str
    position: m.Position
    under_way: bool = False


class Travel(Protocol):
    """Travel times and distances, provided by the world."""

    def __call__(
        self, starts: Sequence[Start], goals: Sequence[m.Position]
    ) -> tuple[Floats, Floats]:
        """Return the path length [m], and expected time to arrival with mobilisation [s].

        Both of shape `(goals, starts)`; infinite where no path exists.
        """


@dataclass(frozen=True, slots=True)
class WaitingPlace:
    """A place where idle guards may wait."""

    name: str
    position: m.Position


@dataclass(frozen=True)
class SiteKnowledge:
    """Knowledge of the site that does not change.

    Attributes:
        preference: Rank of each device on the list for events at a position, from 0;
            infinite for a device that is not on it. None without such lists.
        stations: Waiting places for guards.
        reach: Travel time from each station to each zone [s], shape `(stations, zones)`.
        demand: Share of events expected in each zone, shape `(zones,)`.
    """

    preference: Callable[[m.Position, Sequence[str]], Sequence[float]] | None = None
    stations: tuple[WaitingPlace, ...] = ()
    reach: Floats = field(default_factory=lambda: np.empty((0, 0)))
    demand: Floats = field(default_factory=lambda: np.empty(0))
