"""Teleoperation session besides TCP flows on a congested link: arrivals, and the share of the rate.

Each flow has a link of its own onto the same line, which is first-in-first-out with a drop-tail
queue. If the queue is that of the end hosts themselves, packets of a flow with priority pass
those of the others in it.

The driver does not change the traffic, so the network can be simulated first and the drive
afterwards, with the fates of commands and pictures as they were.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from typing_extensions import override

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.config import Config, Key
from dva_sim.kernel.streams import Streams
from dva_sim.network.link import ConstantRate, Direction, Link, LinkConfig, Serialiser
from dva_sim.network.tcp import TcpConnection
from dva_sim.network.transports.config import Datagrams, TransportConfig, Udp
from dva_sim.network.transports.interface import Ends, TransportMessage, TransportSession
from dva_sim.network.transports.sessions import open_session

WAYS: tuple[Direction, Direction] = ("up", "down")
ALL = 1 << 30  # more than a connection ever takes at once [B]


class BottleneckConfig(Config):
    """The congested link; both directions are alike.

    Attributes:
        rate_bps: Rate of the line.
        queue_bytes: Room in its drop-tail queue.
        delay_s: One-way delay, without queue and line.
        loss: Probability that a packet is lost on the way, besides those that find no room.
        place: Location of its queue: in the `network`, or in the end `hosts` whose own line it is.
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
        streams: Random streams of the run.
    """

    def __init__(self, config: BottleneckConfig, streams: Streams) -> None:
        self._config = config
        self._streams = streams
        self._link = LinkConfig(
            delay_s=config.delay_s,
            loss=config.loss,
            rate_bps=config.rate_bps,
            queue_bytes=config.queue_bytes,
        )
        self._lines = {direction: SharedLine(config.rate_bps) for direction in WAYS}

    def link(self, flow: str, direction: Direction, priority: bool = False) -> Link:
        """Return the way of a flow over the link; it counts only what is the flow's own.

        Args:
            flow: Name of the flow, which selects its random stream.
            priority: True if the end hosts prefer its packets; matters in their queue only.
        """
        line: Serialiser = self._lines[direction]
        if priority and self._config.place == "hosts":
            line = Passing(self._lines[direction], self._config.rate_bps)
        return Link(self._link, line, self._streams, f"{flow}/{direction}", direction)


class SharedLine(Serialiser):
    """A serial line that knows when the packet under way has left it.

    Args:
        rate_bps: [bit/s]
    """

    def __init__(self, rate_bps: float) -> None:
        self.rate_bps = rate_bps
        self._line = ConstantRate(rate_bps)
        self._ends: deque[float] = deque()

    @override
    def backlog_bytes(self, now: float) -> float:
        return self._line.backlog_bytes(now)

    @override
    def depart(self, now: float, size: int) -> float:
        self.next_end(now)
        end = self._line.depart(now, size)
        self._ends.append(end)
        return end

    @override
    def last_departure(self) -> float:
        return self._line.last_departure()

    def next_end(self, now: float) -> float:
        """Return when the packet under way has left [s]; `now` if there is none."""
        while self._ends and self._ends[0] <= now:
            self._ends.popleft()
        return self._ends[0] if self._ends else now


class Passing(Serialiser):
    """A line for packets with priority: they wait only for the one under way, and for each other.

    The time that they take is taken from the line. Simplification: packets that already wait are
    not delayed by one that passes them; those that come later are.

    Args:
        line: Line shared with the other packets.
        rate_bps: Rate of the line [bit/s].
    """

    def __init__(self, line: SharedLine, rate_bps: float) -> None:
        self.rate_bps = rate_bps
        self._line = line
        self._seconds_per_byte = 8.0 / rate_bps
        self._free_at = 0.0

    @override
    def backlog_bytes(self, now: float) -> float:
        # Packets without priority make way, so only these count.
        return max(0.0, self._free_at - now) / self._seconds_per_byte

    @override
    def depart(self, now: float, size: int) -> float:
        start = self._free_at if self._free_at > now else self._line.next_end(now)
        self._line.depart(now, size)
        self._free_at = start + size * self._seconds_per_byte
        return self._free_at

    @override
    def last_departure(self) -> float:
        return self._free_at


class Bulk:
    """A TCP flow that always has more to send.

    Args:
        clock: Virtual time.
        out: The link that its data take.
        back: The link that its acknowledgements take.
    """

    def __init__(self, clock: Clock, out: Link, back: Link) -> None:
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
        peer.read(peer.readable)


DRAIN_S = 5.0  # time in which the last messages that count may still arrive; assumed
Rate = Annotated[float, Field(gt=0, le=200)]
Floats = NDArray[np.float64]


class CommandsConfig(Config):
    """Commands of the operator.

    Attributes:
        rate_hz: Rate of new commands.
        bytes: Size of a command.
        crucial_every: Each so many is one that must arrive, such as a stop; 0: none is.
    """

    rate_hz: Annotated[Rate, Key("commands per second")] = 20.0
    bytes: Annotated[int, Field(ge=1, le=60_000), Key("size of a command")] = 400
    crucial_every: Annotated[int, Field(ge=0)] = 0


class PicturesConfig(Config):
    """Pictures of the robot.

    Attributes:
        rate_hz: Rate of new pictures.
        bytes: Size of a picture, with the state sent along.
    """

    rate_hz: Annotated[Rate, Key("pictures per second")] = 10.0
    bytes: Annotated[int, Field(ge=1, le=1_000_000), Key("size of a picture")] = 4_000


class BulkConfig(Config):
    """TCP flows that always have more to send, over the same link.

    Attributes:
        up: Number of flows that send in the direction of the commands.
        down: Number of flows that send in the direction of the pictures.
    """

    up: Annotated[int, Field(ge=0, le=50)] = 0
    down: Annotated[int, Field(ge=0, le=50)] = 0


class ContestConfig(Config):
    """A session and its competitors.

    Attributes:
        transport: Transport of the session.
        warm_up_s: Initial time that is not counted, so that all flows find their rate.
        measure_s: Counted.
    """

    transport: Annotated[TransportConfig, Key("transport")] = Udp()
    commands: CommandsConfig = CommandsConfig()
    pictures: PicturesConfig = PicturesConfig()
    bottleneck: BottleneckConfig = BottleneckConfig()
    bulk: BulkConfig = BulkConfig()
    warm_up_s: Annotated[float, Field(ge=0, le=600)] = 10.0
    measure_s: Annotated[float, Field(gt=0, le=3600)] = 60.0


@dataclass
class Fates:
    """Fates of the messages of one direction.

    Attributes:
        made: Time at which each was ready to be sent [s].
        arrived: Time at which each had arrived completely [s]; infinity if never.
        crucial: True for messages that had to arrive.
    """

    made: list[float] = field(default_factory=list)
    arrived: list[float] = field(default_factory=list)
    crucial: list[bool] = field(default_factory=list)

    def add(self, now: float, *, crucial: bool = False) -> int:
        """Add a new message; return its number."""
        self.made.append(now)
        self.arrived.append(math.inf)
        self.crucial.append(crucial)
        return len(self.made) - 1


@dataclass(frozen=True)
class Contest:
    """Outcome of a contest.

    Attributes:
        since: Start of the counted time [s].
        until: End of the counted time [s].
        commands: Fates of the commands.
        pictures: Fates of the pictures.
        session_bytes: Bytes that the session put on the line in each direction, with all headers,
            within the counted time [B].
        bulk_bytes: Bytes of each TCP flow, in the direction of its data [B].
    """

    since: float
    until: float
    commands: Fates
    pictures: Fates
    session_bytes: dict[Direction, int]
    bulk_bytes: dict[Direction, list[int]]


def play(config: ContestConfig, seed: int) -> Contest:
    """Let them send.

    Args:
        config: Senders, receivers and link.
        seed: Seed of start times and of the link's random numbers.
    """
    clock = Clock()
    streams = Streams(seed)
    bottleneck = Bottleneck(config.bottleneck, streams)
    commands = Fates()
    pictures = Fates()

    def applied(number: int) -> None:
        commands.arrived[number] = clock.now

    def shown(number: int) -> None:
        pictures.arrived[number] = clock.now

    ends = ends_at(bottleneck, config.transport, applied, shown)
    session = open_session(clock, config.transport, ends)
    bulk = _bulk(clock, config, bottleneck, streams)
    _feed(clock, config, session, (commands, pictures), streams)
    links = {"session": [ends.up, ends.down]} | {direction: bulk[direction] for direction in WAYS}
    clock.run(config.warm_up_s)
    before = {name: [link.bytes for link in some] for name, some in links.items()}
    until = config.warm_up_s + config.measure_s
    clock.run(until)
    took = {
        name: [link.bytes - was for link, was in zip(some, before[name], strict=True)]
        for name, some in links.items()
    }
    clock.run(until + DRAIN_S)
    return Contest(
        since=config.warm_up_s,
        until=until,
        commands=commands,
        pictures=pictures,
        session_bytes=dict(zip(WAYS, took["session"], strict=True)),
        bulk_bytes={direction: took[direction] for direction in WAYS},
    )


def _bulk(
    clock: Clock, config: ContestConfig, bottleneck: Bottleneck, streams: Streams
) -> dict[Direction, list[Link]]:
    """Start the TCP flows at times of their own; the links that their data take."""
    links: dict[Direction, list[Link]] = {direction: [] for direction in WAYS}
    for direction, count in zip(WAYS, (config.bulk.up, config.bulk.down), strict=True):
        back: Direction = "down" if direction == "up" else "up"
        for number in range(count):
            name = f"bulk-{direction}-{number}"
            out = bottleneck.link(name, direction)
            flow = Bulk(clock, out, bottleneck.link(name, back))
            clock.call_at(float(streams[name].uniform(0.0, 1.0)), flow.start)
            links[direction].append(out)
    return links


def _feed(
    clock: Clock,
    config: ContestConfig,
    session: TransportSession,
    fates: tuple[Fates, Fates],
    streams: Streams,
) -> None:
    """Feed commands and pictures at their rates, from times of their own on."""
    commands, pictures = fates
    every = config.commands.crucial_every

    def command() -> None:
        crucial = every > 0 and len(commands.made) % every == every - 1
        number = commands.add(clock.now, crucial=crucial)
        session.command(TransportMessage(number, config.commands.bytes, crucial))

    def picture() -> None:
        number = pictures.add(clock.now)
        session.picture(TransportMessage(number, config.pictures.bytes))

    for action, rate in ((command, config.commands.rate_hz), (picture, config.pictures.rate_hz)):
        period = 1.0 / rate
        clock.every(period, action, float(streams["phase"].uniform(0.0, period)))


NAME = "teleoperation"


def ends_at(
    bottleneck: Bottleneck,
    config: TransportConfig,
    on_command: Callable[[int], object],
    on_picture: Callable[[int], object],
) -> Ends:
    """Return the two links of a session, with priority at the hosts if it has that."""
    first = isinstance(config, Datagrams) and config.priority
    up = bottleneck.link(NAME, "up", first)
    down = bottleneck.link(NAME, "down", first)
    return Ends(up, down, on_command, on_picture)
