"""Ask those who could go, and take the best offer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from typing_extensions import override

from dva_sim.core.dispatch.greedy import Free, waiting
from dva_sim.core.dispatch.situation import (
    Advice,
    Announcement,
    Assignment,
    Floats,
    Policy,
    Situation,
)


class Auction(Policy):
    """Sequential auctions of one task each: the responders say when they could be there.

    The oldest task to confirm is announced; when its auction is over it goes to the earliest
    arrival on offer; then comes the next. There is one auction at a time, so that nobody
    wins two. A task that nobody offered for is announced again when its auction has been
    cleared away; until then others have their turn. Nobody is asked to contain: the earliest
    expected arrival goes.

    References:
        S. Koenig et al., The power of sequential single-item auctions for agent coordination,
        AAAI 2006.
    """

    auctions = True

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        free = Free(situation)
        chosen: list[Advice] = []
        for task in waiting(situation):
            best = free.best(_cost(situation, task))
            if best is not None:
                free.take(best)
                chosen.append(Assignment(task, best))
        return [*chosen, *_announce(situation, free)]


def _cost(situation: Situation, task: int) -> Floats:
    """Return the cost of each responder: its bid, or its expected arrival where none was asked."""
    what = situation.tasks[task]
    eta: Floats = situation.eta[task]
    if what.stage == "contain":
        return eta
    if what.auction != "over" or not situation.bids.size:
        return np.full_like(eta, np.inf)
    bids = situation.bids[task]
    return np.where(np.isfinite(bids) & np.isfinite(eta), bids, np.inf)


def _announce(situation: Situation, free: Free) -> list[Announcement]:
    """Return the oldest task that has not been announced and that somebody free could do."""
    if any(task.auction == "open" for task in situation.tasks):
        return []
    for index in waiting(situation):
        task = situation.tasks[index]
        new = task.stage == "confirm" and task.auction is None
        if new and free.best(situation.eta[index]) is not None:
            return [Announcement(index)]
    return []
