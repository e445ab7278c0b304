"""Simple policies: take what is known now, say which responder goes to which event."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.events import Event


@dataclass(frozen=True)
class Responder:
    """Somebody who can go now: a guard, or a robot for which an operator is free.

    Attributes:
        device: Id of the guard or robot.
        kind: `guard` or `robot`.
    """

    device: str
    kind: str


@dataclass(frozen=True)
class Situation:
    """What a policy may look at.

    Attributes:
        events: Pending events, oldest first.
        responders: Idle responders, in order of registration.
        distance: Path length from responder to event [m], shape `(events, responders)`;
            infinite where there is no way.
        eta: Expected time to arrival [s], same shape: mobilisation plus travel.
    """

    events: tuple[Event, ...]
    responders: tuple[Responder, ...]
    distance: NDArray[np.float64]
    eta: NDArray[np.float64]


@dataclass(frozen=True)
class Assignment:
    """Send a responder to an event, by their place in the situation."""

    event: int
    responder: int


class Policy(Protocol):
    """What a user writes to bring an own policy."""

    def assign(self, situation: Situation, rng: np.random.Generator) -> list[Assignment]:
        """Which responders go where; an event left out stays pending."""


class _Greedy:
    """Oldest event first; each takes the responder with the least cost."""

    def cost(self, situation: Situation) -> NDArray[np.float64]:
        """Shape `(events, responders)`; infinite means never."""
        raise NotImplementedError

    def assign(self, situation: Situation, rng: np.random.Generator) -> list[Assignment]:
        """See `Policy`."""
        cost = np.array(self.cost(situation), dtype=np.float64)
        chosen = []
        for event in range(len(situation.events)):
            if not cost.shape[1]:
                break
            best = int(np.argmin(cost[event]))
            if np.isfinite(cost[event, best]):
                chosen.append(Assignment(event, best))
                cost[:, best] = np.inf
        return chosen


class NearestIdle(_Greedy):
    """The shortest way, whoever walks or drives it."""

    def cost(self, situation: Situation) -> NDArray[np.float64]:
        """Path length [m]."""
        return situation.distance


class MinEta(_Greedy):
    """The earliest expected arrival: path length, speed and mobilisation."""

    def cost(self, situation: Situation) -> NDArray[np.float64]:
        """Expected time to arrival [s]."""
        return situation.eta


class RandomChoice:
    """Any idle responder that can get there: the floor that other policies must beat."""

    def assign(self, situation: Situation, rng: np.random.Generator) -> list[Assignment]:
        """See `Policy`."""
        free = list(range(len(situation.responders)))
        chosen = []
        for event in range(len(situation.events)):
            able = [r for r in free if np.isfinite(situation.distance[event, r])]
            if able:
                pick = able[int(rng.integers(len(able)))]
                free.remove(pick)
                chosen.append(Assignment(event, pick))
        return chosen


POLICIES: dict[str, Callable[[], Policy]] = {
    "min_eta": MinEta,
    "nearest_idle": NearestIdle,
    "random": RandomChoice,
}
