"""What a transport of teleoperation carries, and what every transport offers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from dva_sim.network.link import Link

Deliver = Callable[[int], object]
"""Called with the number of a message once all of it has arrived."""


@dataclass(frozen=True, slots=True)
class Message:
    """A command or a picture.

    Attributes:
        number: Counts the messages of its direction from 0.
        size: Without any header [B].
        crucial: Whether it must arrive, as a stop must.
    """

    number: int
    size: int
    crucial: bool = False


@dataclass(frozen=True)
class Ends:
    """What a transport stands between.

    Attributes:
        up: The link that commands take.
        down: The link that pictures take.
        on_command: Told of every command at the robot.
        on_picture: Told of every picture at the operator.
    """

    up: Link
    down: Link
    on_command: Deliver
    on_picture: Deliver


class Transport(Protocol):
    """A session between operator and robot."""

    def command(self, message: Message) -> None:
        """The operator has a command."""

    def picture(self, message: Message) -> None:
        """The robot has a picture."""
