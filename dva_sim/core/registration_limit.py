"""The number of registrations that the DVA takes from each peer, an address and a key."""

from __future__ import annotations

from collections import OrderedDict
from typing import Final, NamedTuple

RATE: Final = 500.0  # design: on average; 5000 devices renew as often [1/s]
BURST: Final = 2000  # design: at once, so that a whole fleet comes back in seconds
MOST_PEERS: Final = 10_000  # of which that is remembered


class RegistrationAllowance(NamedTuple):
    """Number of registrations that a peer may send at a time [s]."""

    number: float
    time: float


class RegistrationLimit:
    """Counts the registrations of each peer; the peers that were quiet longest are forgotten."""

    def __init__(self) -> None:
        self._left: OrderedDict[str, RegistrationAllowance] = OrderedDict()

    def takes(self, peer: str, now: float) -> bool:
        """Return True if a peer may register once more at a time [s]."""
        before = self._left.pop(peer, RegistrationAllowance(BURST, now))
        number = min(BURST, before.number + (now - before.time) * RATE)
        self._left[peer] = RegistrationAllowance(max(number - 1.0, 0.0), now)
        if len(self._left) > MOST_PEERS:
            self._left.popitem(last=False)
        return number >= 1.0
