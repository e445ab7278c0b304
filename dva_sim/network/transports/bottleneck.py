"""One congested link that several flows share: each has a link of its own onto the same line.

The line is first-in-first-out with a drop-tail queue. If the queue is that of the end hosts
themselves, packets of a flow with priority pass those of the others in it.

Messages on one TCP connection, and flows of bulk data beside it.
"""

from __future__ import annotations

from collections import deque
from typing import Annotated, Literal

from pydantic import Field

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.config import Config, Key
from dva_sim.kernel.streams import Streams
from dva_sim.network.link import ConstantRate, Direction, Link, LinkConfig, Serialiser
from dva_sim.network.tcp import TcpConnection, TcpEndpoint, TcpOptions
from dva_sim.network.transports.config import Deliver, Ends, TransportMessage

WAYS: tuple[Direction, Direction] = ("up", "down")


class BottleneckConfig(Config):
    """The congested link; both directions are alike.

    Attributes:
        rate_bps: Of the line.
        queue_bytes: Room in its drop-tail queue.
        delay_s: One way, besides queue and line.
        loss: Probability that a packet is lost on the way, besides those that find no room.
        place: Where its queue is: in the `network`, or in the end `hosts` whose own line it is.
    """

    rate_bps: Annotated[float, Field(ge=1e4), Key("rate of the shared link")] = 1e6
    queue_bytes: Annotated[
        int, Field(ge=3_000), Key("queue of the shared link", stated="its queue")
    ] = 25_000
    delay_s: Annotated[
        float, Field(ge=0, le=10), Key("delay of the shared link", stated="its one-way delay")
    ] = 0.02
    loss: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    place: Literal["network", "hosts"] = "network"


class Bottleneck:
    """Both directions of the congested link.

    Args:
        config: Of the link.
        streams: The run's luck.
    """

    def __init__(self, config: BottleneckConfig, streams: Streams) -> None:
        self._config, self._streams = config, streams
        self._link = LinkConfig(
            delay_s=config.delay_s,
            loss=config.loss,
            rate_bps=config.rate_bps,
            queue_bytes=config.queue_bytes,
        )
        self._lines = {way: SharedLine(config.rate_bps) for way in WAYS}

    def link(self, flow: str, way: Direction, priority: bool = False) -> Link:
        """The way of a flow over the link; it counts only what is the flow's own.

        Args:
            flow: Its name, for its luck.
            way: Which direction.
            priority: Whether the end hosts prefer its packets, which matters in their queue only.
        """
        line: Serialiser = self._lines[way]
        if priority and self._config.place == "hosts":
            line = Passing(self._lines[way], self._config.rate_bps)
        return Link(self._link, line, self._streams, f"{flow}/{way}", way)


class SharedLine(Serialiser):
    """A serial line that knows when the packet under way has left it.

    Args:
        rate_bps: [bit/s]
    """

    def __init__(self, rate_bps: float) -> None:
        self.rate_bps, self._line = rate_bps, ConstantRate(rate_bps)
        self._ends: deque[float] = deque()

    def backlog_bytes(self, now: float) -> float:
        """See `Serialiser`."""
        return self._line.backlog_bytes(now)

    def depart(self, now: float, size: int) -> float:
        """See `Serialiser`."""
        self.next_end(now)
        end = self._line.depart(now, size)
        self._ends.append(end)
        return end

    def next_end(self, now: float) -> float:
        """When the packet under way has left [s]; `now` if there is none."""
        while self._ends and self._ends[0] <= now:
            self._ends.popleft()
        return self._ends[0] if self._ends else now


class Passing(Serialiser):
    """A line for packets with priority: they wait only for the one under way, and for each other.

    The time that they take is taken from the line. Simplification: packets that already wait are
    not delayed by one that passes them; those that come later are.

    Args:
        line: Where the others are.
        rate_bps: Of the line [bit/s].
    """

    def __init__(self, line: SharedLine, rate_bps: float) -> None:
        self.rate_bps, self._line = rate_bps, line
        self._seconds_per_byte, self._free_at = 8.0 / rate_bps, 0.0

    def backlog_bytes(self, now: float) -> float:
        """See `Serialiser`; packets without priority make way, so only these count."""
        return max(0.0, self._free_at - now) / self._seconds_per_byte

    def depart(self, now: float, size: int) -> float:
        """See `Serialiser`."""
        start = self._free_at if self._free_at > now else self._line.next_end(now)
        self._line.depart(now, size)
        self._free_at = start + size * self._seconds_per_byte
        return self._free_at


ALL = 1 << 30  # more than is ever readable [B]


class OrderedMessages:
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

    def send(self, message: TransportMessage) -> None:
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
        self._up = OrderedMessages(operator, robot, ends.on_command)
        self._down = OrderedMessages(robot, operator, ends.on_picture)
        self._connection.open(self._up.open, self._down.open)

    def command(self, message: TransportMessage) -> None:
        """See `Transport`."""
        self._up.send(message)

    def picture(self, message: TransportMessage) -> None:
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
