"""Interface of a transport: an end at the operator, which connects, and one at the robot."""

from __future__ import annotations

import shutil
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Final, Literal, TypeVar

from dva_sim.kernel.errors import DvaSimError

Side = Literal["near", "far"]
SIDES: Final[tuple[Side, Side]] = ("near", "far")


class TransportError(DvaSimError):
    """A transport cannot work here, or its ends did not find each other."""


Receive = Callable[[bytes], bytes | None]
"""Takes what has arrived, in any thread; the robot's gives the bytes of the reply to a command."""


@dataclass(frozen=True)
class Rendezvous:
    """Addresses of both ends.

    Attributes:
        near: IPv4 address of the operator's machine.
        far: IPv4 address of the robot's.
        port: The first of three ports in a row that a transport may use at either address.
        folder: A transport's own files, such as the configuration of a broker.
        ready_by: Deadline for the connection, by `time.monotonic` [s].
    """

    near: str
    far: str
    port: int
    folder: Path
    ready_by: float

    def address(self, side: Side) -> str:
        """Return IPv4 address of one side."""
        return self.near if side == "near" else self.far


class TransportEnd(ABC):
    """One end of a transport; it works in the thread of its caller, or in its own."""

    @abstractmethod
    def send(self, data: bytes) -> bool:
        """Hand a command, or at the robot a picture, to the transport.

        Returns:
            False if the transport takes nothing now: an answer is due, or a queue is full.
        """

    def serve(self, until: float) -> None:
        """Do what is pending until a moment of `time.monotonic` [s].

        It may return sooner, for example as soon as a command can be sent again.
        """
        time.sleep(max(0.0, until - time.monotonic()))

    @abstractmethod
    def close(self) -> None:
        """Stop, and end what was started."""


E = TypeVar("E", bound=TransportEnd)


def connected(end: E, connect: Callable[[], object]) -> E:
    """Return the end once it is connected; one that cannot be is closed."""
    try:
        connect()
    except BaseException:
        end.close()
        raise
    return end


class CommandTransport(ABC):
    """Carries commands to a robot and pictures back. Users derive from it.

    Its constructor takes the transport's options; one object makes one end.

    Attributes:
        title: Name in reports.
        library: Python package that it needs besides those of this program; empty for none.
        extra: Extra of this package that installs it.
        program: Program that must be on the path, such as a broker's; empty for none.
        carries_pictures: True if pictures can travel beside the commands.
    """

    title: str = ""
    library: str = ""
    extra: str = ""
    program: str = ""
    carries_pictures: bool = True

    def lacks(self) -> str:
        """Return one line that says what is not installed here; empty if nothing is missing."""
        if self.library and find_spec(self.library) is None:
            how = f": pip install -e '.[{self.extra}]'" if self.extra else ""
            return f"{self.title or type(self).__name__} needs {self.library}{how}"
        if self.program and shutil.which(self.program) is None:
            return f"{self.title or type(self).__name__} needs the program {self.program}"
        return ""

    @abstractmethod
    def near(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        """Connect the operator's end, and wait until commands can be sent.

        Raises:
            TransportError: there is no connection by `place.ready_by`.
        """

    @abstractmethod
    def far(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        """Open the robot's end.

        Raises:
            TransportError: it cannot listen.
        """
