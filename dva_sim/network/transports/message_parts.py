"""Messages cut into datagrams, and put together again."""

from __future__ import annotations

import math
from typing import NamedTuple

from dva_sim.network.transports.interface import Deliver, TransportMessage

IP_UDP = 28  # size of the headers: RFC 791 and 768 [B]
PACKET = 1500  # largest IP packet of Ethernet: RFC 894 [B]


class MessagePart(NamedTuple):
    """A piece of a message: which of how many, and its size [B]."""

    message: TransportMessage
    place: int
    pieces: int
    size: int


def parts_of(message: TransportMessage, header: int) -> list[MessagePart]:
    """Return the datagrams that a message is cut into, all full but the last.

    Args:
        message: Message to send.
        header: Header of the transport in each datagram [B].
    """
    room = PACKET - IP_UDP - header
    count = max(1, math.ceil(message.size / room))
    sizes = [room] * (count - 1) + [message.size - room * (count - 1)]
    return [MessagePart(message, index, count, size) for index, size in enumerate(sizes)]


class Assembly:
    """Puts parts together again.

    Args:
        deliver: Callback for every complete message.
    """

    def __init__(self, deliver: Deliver) -> None:
        self._deliver = deliver
        self._missing: dict[int, set[int]] = {}

    def add(self, part: MessagePart) -> None:
        """Add a part that has arrived, perhaps once more."""
        number = part.message.number
        missing = self._missing.setdefault(number, set(range(part.pieces)))
        if part.place in missing:
            missing.remove(part.place)
            if not missing:
                self._deliver(number)
