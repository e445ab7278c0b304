"""The interface of transports of teleoperation: messages, ends and sessions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from dva_sim.network.link import Link

Deliver = Callable[[int], object]


@dataclass(frozen=True, slots=True)
class TransportMessage:
    """A command or a picture.

    Attributes:
        number: Counts the messages of its direction from 0.
        size: Without any header [B].
        crucial: True if it must arrive, as a stop must.
    """

    number: int
    size: int
    crucial: bool = False


@dataclass(frozen=True)
class Ends:
    """Endpoints that a transport connects.

    Attributes:
        up: The link that commands take.
        down: The link that pictures take.
        on_command: Callback for every command at the robot.
        on_picture: Callback for every picture at the operator.
    """

    up: Link
    down: Link
    on_command: Deliver
    on_picture: Deliver


class TransportSession(NamedTuple):
    """A session over a transport.

    Attributes:
        command: Sends a command to the robot.
        picture: Sends a picture to the operator.
    """

    command: Callable[[TransportMessage], object]
    picture: Callable[[TransportMessage], object]
