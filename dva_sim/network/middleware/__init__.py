"""Commands and pictures over real middleware: the promise of a transport, and those shipped.

Each transport is a pair of ends, the operator's and the robot's, in processes of their own. The
library that it needs is loaded by its ends alone, so that a list of transports loads none.
"""

from dva_sim.network.middleware.ends import (
    SIDES,
    CommandTransport,
    Receive,
    Rendezvous,
    Side,
    TransportEnd,
    TransportError,
)
from dva_sim.network.middleware.registry import PLUGINS, known_transports, load_transport

__all__ = [
    "PLUGINS",
    "SIDES",
    "CommandTransport",
    "Receive",
    "Rendezvous",
    "Side",
    "TransportEnd",
    "TransportError",
    "known_transports",
    "load_transport",
]
