"""View and advice of a policy: values only, so that a policy can change nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def _empty() -> Floats:
    return np.empty((0, 0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """Something that somebody should do about an event.

    Attributes:
        event: The DVA's number of the event.
        kind: `fire`, `gas_leak` or `flood`.
        stage: `confirm`: go and look. `contain`: a person goes and deals with it.
        due: True if it can be done now. A `contain` task before the confirmation is not due: its
            responder stands by outside until then.
        severity: 0 (harmless) to 1, the highest reported, or more where the rules let it rise.
        confidence: Confidence that the event is real, 0 to 1.
        detected: Time of the first report [s].
        waiting_since: Start of the wait for a responder [s].
        engaged: Place in `Situation.responders` of who is under way to it; only a policy
            that `preempts` is shown such tasks.
        auction: `open` while bids may come, `over` when all have come or the time is up.
    """

    event: int
    kind: str
    stage: Literal["confirm", "contain"]
    due: bool
    severity: float
    confidence: float
    detected: float
    waiting_since: float
    engaged: int | None = None
    auction: Literal["open", "over"] | None = None


@dataclass(frozen=True, slots=True)
class Responder:
    """Somebody who can go.

    Attributes:
        device: Id of the guard or robot.
        kind: `guard` or `robot`.
        engaged: Place in `Situation.tasks` of what it is under way to; None if it is idle.
    """

    device: str
    kind: Literal["guard", "robot"]
    engaged: int | None = None


@dataclass(frozen=True)
class Cover:
    """Positions where idle guards can wait, and the benefit of each.

    Attributes:
        stations: Names of the places to wait at.
        eta: Way from each responder to each station [s], shape `(responders, stations)`,
            without mobilisation; infinite for who cannot be sent to wait.
        reach: Travel time from each station to each zone [s], shape `(stations, zones)`.
        demand: Share of events expected in each zone, shape `(zones,)`; they add up to 1.
        bound_for: Station that each responder is on its way to, to wait there; None if none.
    """

    stations: tuple[str, ...]
    eta: Floats
    reach: Floats
    demand: Floats
    bound_for: tuple[int | None, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Situation:
    """Knowledge of the DVA at one moment.

    Attributes:
        now: [s]
        tasks: Open tasks, longest detected first.
        responders: Available responders in order of registration: guards, then robots.
        distance: Path length [m], shape `(tasks, responders)`; infinite where no path exists,
            or where the responder cannot do the task.
        eta: Expected time to arrival [s], same shape: mobilisation plus travel.
        preference: Place of each responder on the list of the event's zone, same shape, from 0;
            infinite if it is not on it. Empty if no lists are configured.
        bids: Arrival that each responder has offered [s from now], same shape; nan without
            a bid. Empty unless the policy `auctions`.
        operators: Number of robots that operators can take on; each robot sent takes one.
        cover: Waiting places for guards; None unless the policy `relocates`.
    """

    now: float
    tasks: tuple[Task, ...]
    responders: tuple[Responder, ...]
    distance: Floats
    eta: Floats
    preference: Floats = field(default_factory=_empty)
    bids: Floats = field(default_factory=_empty)
    operators: int = 0
    cover: Cover | None = None


@dataclass(frozen=True, slots=True)
class Assignment:
    """Give a task to a responder, by their places in the situation.

    If the responder is engaged elsewhere, its former task is open again (`preempts`).
    """

    task: int
    responder: int


@dataclass(frozen=True, slots=True)
class Announcement:
    """Ask all idle responders for bids on a task (`auctions`)."""

    task: int


@dataclass(frozen=True, slots=True)
class Relocation:
    """Let an idle guard wait elsewhere (`relocates`): a station by its place in the cover."""

    responder: int
    station: int


Advice = Assignment | Announcement | Relocation


class Policy:
    """Base class of dispatch policies. Derive your own from it, and name it by file and class.

    A policy only advises: the core takes what the rules allow and counts the rest. It is asked
    whenever something has changed, and must not rely on its last advice having been taken.

    Attributes:
        preempts: True if it wants to see responders under way, and may redirect them.
        auctions: True if it announces tasks and wants to see the bids.
        relocates: True if it moves idle guards.
    """

    preempts: bool = False
    auctions: bool = False
    relocates: bool = False

    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        """Return the advice for now; tasks without advice wait.

        Args:
            rng: Random generator of the run for policies; use no other.
        """
        raise NotImplementedError
