"""Messages on one TCP connection, and flows of bulk data beside it."""

from __future__ import annotations

from collections import deque

from dva_sim.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.tcp import TcpConnection, TcpEndpoint, TcpOptions
from dva_sim.network.transports.messages import Deliver, Ends, Message

ALL = 1 << 30  # more than is ever readable [B]


class OneWay:
    """Messages written to one end of a connection and read from the other, in order.

    What the send buffer has no room for waits in the program, without end.

    Args:
        writer: Where they are written.
        reader: Where they are read.
        deliver: Told of every message once all of it is read.
    """

    def __init__(self, writer: TcpEndpoint, reader: TcpEndpoint, deliver: Deliver) -> None:
        self._writer, self._reader, self._deliver = writer, reader, deliver
        self._unwritten, self._read, self._ends_at = 0, 0, 0
        self._ends: deque[tuple[int, int]] = deque()  # of the messages under way
        self._is_open = False
        writer.on_writable = self._write
        reader.on_readable = self._take

    def open(self) -> None:
        """From now on the connection takes what is written."""
        self._is_open = True
        self._write()

    def send(self, message: Message) -> None:
        """Write a message, or as much as there is room for."""
        self._ends_at += message.size
        self._ends.append((self._ends_at, message.number))
        self._unwritten += message.size
        self._write()

    def _write(self) -> None:
        if self._is_open and self._unwritten:
            self._unwritten -= self._writer.write(self._unwritten)

    def _take(self) -> None:
        self._read += self._reader.read(self._reader.readable)
        while self._ends and self._ends[0][0] <= self._read:
            self._deliver(self._ends.popleft()[1])


class TcpTransport:
    """One connection for both directions; nothing frames the messages.

    Args:
        clock: Virtual time.
        ends: What it stands between.
        options: Of the connection, alike at both ends.
    """

    def __init__(self, clock: Clock, ends: Ends, options: TcpOptions) -> None:
        self._connection = TcpConnection(clock, ends.up, ends.down, options, options)
        operator, robot = self._connection.opener, self._connection.peer
        self._up = OneWay(operator, robot, ends.on_command)
        self._down = OneWay(robot, operator, ends.on_picture)
        self._connection.open(self._up.open, self._down.open)

    def command(self, message: Message) -> None:
        """See `Transport`."""
        self._up.send(message)

    def picture(self, message: Message) -> None:
        """See `Transport`."""
        self._down.send(message)


class Bulk:
    """A TCP flow that always has more to send.

    Args:
        clock: Virtual time.
        out: The link that its data take.
        back: The link that its acknowledgements take.

    Attributes:
        received: Bytes read at the other end [B].
    """

    def __init__(self, clock: Clock, out: Link, back: Link) -> None:
        self.received = 0
        self._connection = TcpConnection(clock, out, back)
        self._connection.opener.on_writable = self._write
        self._connection.peer.on_readable = self._take

    def start(self) -> None:
        """Open the connection and begin."""
        self._connection.open(self._write)

    def _write(self) -> None:
        while self._connection.opener.write(ALL):
            pass

    def _take(self) -> None:
        peer = self._connection.peer
        self.received += peer.read(peer.readable)
