"""Idle guards wait where the next event would find them near."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from typing_extensions import override

from dva_sim.core.dispatch.greedy import Free, serve, waiting
from dva_sim.core.dispatch.situation import Advice, Cover, Floats, Policy, Relocation, Situation
from dva_sim.kernel import options

_UNREACHED = 3600.0  # what a zone counts that nobody covers [s]


class Coverage(Policy):
    """`min_eta` with relocation: idle guards move to where the next response is expected sooner.

    The expected response is the time from the nearest guard to each zone, weighted by how many
    events are expected there. The best single move is made, then the best of those that are
    left, as long as one pays more than `gain_s`.

    It cannot thrash. Each move lowers the expected response by more than `gain_s`, it is never
    negative, and nothing but moves and a change of who is idle changes it: so the moves come to
    an end. Who is on its way to a station counts as being there, and is left to arrive.

    Args:
        gain_s: Smallest gain that justifies a move [s of expected response].
        there_s: Distance from a station that counts as being there [s].

    References:
        R. L. Church and C. S. ReVelle, Theoretical and empirical links between the p-median,
        location set-covering, and maximal covering location models, Geographical Analysis 8,
        1976: the p-median problem, which this improves step by step.
    """

    relocates = True

    def __init__(self, gain_s: float = 2.0, there_s: float = 3.0) -> None:
        self.gain_s = options.number("gain_s", gain_s, above=0)
        self.there_s = options.number("there_s", there_s, least=0)

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        chosen = serve(waiting(situation), situation.eta, Free(situation))
        if situation.cover is None or not situation.cover.stations:
            return chosen
        sent = {choice.responder for choice in chosen}
        guards = [
            index
            for index, responder in enumerate(situation.responders)
            if responder.kind == "guard" and responder.engaged is None and index not in sent
            if np.isfinite(situation.cover.eta[index]).any()
        ]
        return [*chosen, *self._moves(situation.cover, guards)]

    def _moves(self, cover: Cover, guards: Sequence[int]) -> list[Relocation]:
        """Return the best move, then the best of those that are left, while one pays."""
        bound_for = dict(enumerate(cover.bound_for))
        response = self._response(cover, guards, bound_for)
        staying = [row for row, guard in enumerate(guards) if bound_for.get(guard) is None]
        moves = []
        while staying:
            gain = _gains(response, staying, cover)
            gain[~np.isfinite(cover.eta[[guards[row] for row in staying]])] = -np.inf
            if gain.max() <= self.gain_s:
                break
            mover, station = divmod(int(np.argmax(gain)), gain.shape[1])
            row = staying.pop(mover)
            response[row] = np.minimum(cover.reach[station], _UNREACHED)
            moves.append(Relocation(guards[row], station))
        return moves

    def _response(
        self, cover: Cover, guards: Sequence[int], bound_for: Mapping[int, int | None]
    ) -> Floats:
        """Return times from each guard to each zone by way of a station [s], `(guards, zones)`."""
        eta = cover.eta[list(guards)]
        eta = np.where(eta <= self.there_s, 0.0, eta)
        for row, guard in enumerate(guards):
            station = bound_for.get(guard)
            if station is not None:
                eta[row] = np.inf
                eta[row, station] = 0.0
        response: Floats = (eta[:, :, None] + cover.reach[None, :, :]).min(axis=1)
        return np.minimum(response, _UNREACHED)


def _gains(response: Floats, movers: Sequence[int], cover: Cover) -> Floats:
    """Return by how much each move lowers the expected response [s], `(movers, stations)`."""
    reach = np.minimum(cover.reach, _UNREACHED)
    now = response.min(axis=0) @ cover.demand
    gains = np.empty((len(movers), len(reach)))
    for row, mover in enumerate(movers):
        response_without = np.delete(response, mover, axis=0).min(axis=0, initial=_UNREACHED)
        gains[row] = now - np.minimum(response_without, reach) @ cover.demand
    return gains
