"""One direction of a link: drop-tail queue, serialisation, loss, delay.

A packet's fate is known when it is sent, because the queue is first-in-first-out:
no event is spent inside the link. Random draws are keyed by virtual time, so that two
patterns that send at different moments still meet the same conditions. A link may end in a last hop
through the air, whose quality depends on the place, and a partition may keep two nodes apart.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from fnmatch import fnmatchcase
from functools import partial
from typing import Any, Protocol

from typing_extensions import override

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.suggestions import hint
from dva_sim.network.link.config import Direction, LinkConfig
from dva_sim.network.link.delay_logs import read_delay_log
from dva_sim.network.link.delays import Wobble, by_quantile
from dva_sim.network.link.losses import Fate, chance
from dva_sim.network.link.outages import Gap, Partition, lose_in_gaps
from dva_sim.network.link.rates import ConstantRate, PacketQueue, Serialiser, TraceRate
from dva_sim.network.link.recorded import read_trace
from dva_sim.network.link.replay import Replay, find_period
from dva_sim.network.link.time_noise import FastNoise, MakeNumbers, PacketNumbers

MIN_PACKET = 40  # IPv4 and TCP headers alone [B]


class Link:
    """One direction of a link.

    Args:
        serialiser: Model of the line's rate.
        streams: Random streams of the run.
        name: Name of this direction, which selects its random stream; `x/up` and `x/down` are one
            link's.
        direction: Direction; `up` is towards the robot.
        by_packet: Loss and jitter depend on the number of a packet, not on the time: for real
            packets, which never leave at the same moment twice.

    Attributes:
        offered: Packets so far.
        lost: Those lost by chance, or because there was no link then.
        cut: Those of them that met an outage or a partition.
        dropped: Those that found the queue full.
        bytes: Those that entered the line [B].
        delay: Mean one-way delay without waiting [s].
        rate_bps: Rate of the line [bit/s]; None where it varies.
        room: Size of the queue [B]; if it counts packets, its capacity in the smallest ones.
    """

    def __init__(
        self,
        config: LinkConfig,
        serialiser: Serialiser,
        streams: Streams,
        name: str,
        direction: Direction = "up",
        by_packet: bool = False,
    ) -> None:
        link = config.toward(direction)
        self.offered = self.lost = self.cut = self.dropped = self.bytes = 0
        self._make_numbers: MakeNumbers = FastNoise
        if by_packet:
            self._make_numbers = partial(PacketNumbers, number=lambda: self.offered)
        self.name = name
        self.rate_bps = serialiser.rate_bps
        self.room = link.queue_bytes
        self._line = serialiser
        self._streams = streams
        self._direction = direction
        if link.queue_packets is not None:
            serialiser = PacketQueue(serialiser, link.queue_packets)
            self.room = link.queue_packets * MIN_PACKET
        self._serialiser = serialiser
        self._offer = serialiser.offer
        self._counts_packets = link.queue_packets is not None
        self._last_arrival = 0.0
        self._take(link)

    def _take(self, link: LinkConfig) -> None:
        """Adopt the properties of a configuration, except for the queue."""
        replay = _make_replay(link, self._direction, self._streams, self.name)
        self.delay = link.moments()[0]
        self._base = link.delay_s
        drawing = self._streams, self.name, self._make_numbers
        self._fates = _make_fates(link, replay, *drawing)
        self._outage = lose_in_gaps(link.outages) if link.outages else None
        self._wobble = replay.deviation if replay else _make_wobble(link, *drawing)
        self._may_overtake = link.reorder
        self._is_steady = not self._fates and self._outage is None and self._wobble is None
        self._takes_trains = self._is_steady and not self._counts_packets

    def change(self, now: float, config: LinkConfig) -> None:
        """Adopt delay, law, loss and rate of another configuration from `now` on [s].

        Packets already sent keep their fate, and nothing overtakes it, unless the link may reorder.
        What is sent from now on finds as many bytes in the queue, at the new rate where a rate is
        constant. The room of the queue stays.

        Raises:
            ConfigError: a recorded delay cannot be read.
        """
        link = config.toward(self._direction)
        before = self._last_arrival
        if self._wobble is None:
            before = max(before, self._serialiser.last_departure() + self._base)
        self._take(link)
        if isinstance(self._line, ConstantRate):
            self._line.change_rate(now, link.rate_bps)
            self.rate_bps = link.rate_bps
        if not self._may_overtake:
            # A deviation, even of zero, makes `carry` keep packets behind those sent before.
            self._last_arrival = max(self._last_arrival, before)
            self._wobble = self._wobble or _no_deviation
            self._is_steady = self._takes_trains = False

    def is_ideal(self) -> bool:
        """Return True if it neither loses, spreads nor reorders packets, at a constant rate."""
        return self._is_steady and self.rate_bps is not None

    def carry(self, now: float, size: int) -> float | None:
        """Send one packet.

        Args:
            now: Time at which it is offered [s]; never before an earlier one.
            size: Its size with all headers [B].

        Returns:
            When it arrives [s], or None if it is lost or the queue is full.
        """
        self.offered += 1
        left_at = self._offer(now, size, self.room)
        if left_at is None:
            self.dropped += 1
            return None
        # Packets are lost behind the queue: they have taken its room and the line's time.
        self.bytes += size
        is_out = self._outage is not None and self._outage(now, left_at)
        for fate in self._fates:
            if fate(now, left_at):
                self.lost += 1
                self.cut += is_out
                return None
        if is_out:
            self.lost += 1
            self.cut += 1
            return None
        arrival = left_at + self._base
        if self._wobble is None:
            return arrival
        arrival += self._wobble(now)
        if not self._may_overtake:
            arrival = self._last_arrival = max(arrival, self._last_arrival)
        return arrival

    def carry_train(self, now: float, packets: int, size: int) -> float | None:
        """Send packets back to back as one, where that makes no difference.

        Args:
            now: Time at which they are offered [s].
            packets: Number of packets.
            size: Total size with all headers [B].

        Returns:
            When the last of them arrives [s]; None, and nothing is sent, where each must
            be looked at by itself: with loss, a law of the delay, a queue that counts packets,
            or one that they do not fit into.
        """
        if not self._takes_trains:
            return None
        left_at = self._offer(now, size, self.room)
        if left_at is None:
            return None
        self.offered += packets
        self.bytes += size
        return left_at + self._base

    def backlog_bytes(self, now: float) -> float:
        """Return bytes that wait before the link at `now` [B]."""
        return self._serialiser.backlog_bytes(now)

    def has_room(self, now: float, size: int) -> bool:
        """Return True if the queue takes a packet of this size [B] at `now` [s]."""
        return self._serialiser.has_room(now, size, self.room)


def _no_deviation(now: float) -> float:
    """Return no deviation, for a constant delay in which the order of packets still matters."""
    return 0.0


def make_serialiser(
    config: LinkConfig, direction: Direction, streams: Streams, name: str
) -> Serialiser:
    """Return the serialiser of the `up` or `down` direction of a configured link.

    A run begins somewhere in a trace; two that were recorded together begin at the same moment.

    Raises:
        ConfigError: the trace cannot be read.
    """
    trace = config.trace_up if direction == "up" else config.trace_down
    if trace is None:
        return ConstantRate(config.toward(direction).rate_bps)
    lasts = read_trace(config.trace_up or trace)[-1]
    offset = float(streams.fresh(f"{name}/trace-offset").uniform(0.0, lasts))
    return TraceRate(read_trace(trace), offset)


def _make_fates(
    link: LinkConfig, replay: Replay | None, streams: Streams, name: str, make: MakeNumbers
) -> tuple[Fate, ...]:
    """Return the causes of random loss in one direction."""
    fates: list[Fate] = [replay.takes] if replay else []
    if link.loss:
        uniforms = make(streams, f"{name}/loss")
        bursts = link.bursts and link.bursts.play(link.loss, streams, f"{name}/bursts", uniforms)
        fates.append(bursts or chance(link.loss, uniforms))
    return tuple(fates)


def _make_wobble(link: LinkConfig, streams: Streams, name: str, make: MakeNumbers) -> Wobble | None:
    """Return the random deviation of the delay of one direction, if it has any."""
    if link.jitter_s:
        width = link.jitter_s
        return by_quantile(lambda u: width * (2.0 * u - 1.0), make(streams, f"{name}/jitter"))
    if link.law is not None:
        return link.law.play(link.delay_s, streams, f"{name}/delay", make)
    return None


def _make_replay(
    link: LinkConfig, direction: Direction, streams: Streams, name: str
) -> Replay | None:
    """Return one direction's part of a delay log; both directions play the same moment of it.

    A lost round trip is lost in one direction only, chosen at random.
    """
    if link.delay_log is None:
        return None
    log = read_delay_log(link.delay_log)
    rng = streams.fresh(f"{name.removesuffix(f'/{direction}')}/delay-log")
    offset = rng.random() * find_period(log)
    coins = rng.random(len(log.times))
    share = link.delay_log_share
    here = coins < share if direction == "up" else coins >= 1.0 - share
    return Replay(log, share, here, offset)


class PartedLink(Link):
    """A link that others use too, seen by a pair of nodes that it does not always serve.

    Queue, delay, loss and counters are those of the whole link; a packet that a partition drops
    takes no room.

    Args:
        whole: The link.
        gaps: Times at which it carries nothing for this pair.
    """

    def __init__(self, whole: Link, gaps: Sequence[Gap]) -> None:
        self._whole = whole
        self._gaps = gaps

    def __getattr__(self, name: str) -> Any:
        return getattr(self._whole, name)

    @override
    def is_ideal(self) -> bool:
        return False

    @override
    def carry(self, now: float, size: int) -> float | None:
        if any(gap.covers(now) for gap in self._gaps):
            self._whole.offered += 1
            self._whole.lost += 1
            self._whole.cut += 1
            return None
        return self._whole.carry(now, size)

    @override
    def carry_train(self, now: float, packets: int, size: int) -> float | None:
        # Packets that a partition drops are counted one by one.
        if any(gap.covers(now) for gap in self._gaps):
            return None
        return self._whole.carry_train(now, packets, size)

    @override
    def backlog_bytes(self, now: float) -> float:
        return self._whole.backlog_bytes(now)

    @override
    def has_room(self, now: float, size: int) -> bool:
        return self._whole.has_room(now, size)


def check_partitions(partitions: Sequence[Partition], names: Collection[str]) -> None:
    """Refuse a partition that separates no nodes.

    Raises:
        ConfigError: no node has a name that it gives.
    """
    for partition in partitions:
        for key, pattern in (("source", partition.source), ("destination", partition.destination)):
            if not any(fnmatchcase(name, pattern) for name in names):
                problem = f"{key} {pattern!r} of a partition is nobody"
                raise ConfigError(f"{problem}; {hint(pattern, sorted(names))}")


def part_links(
    links: tuple[Link, Link], source: str, destination: str, partitions: Sequence[Partition]
) -> tuple[Link, Link]:
    """Return the link from one node to another and back, as far as partitions allow.

    Args:
        links: Links without partitions.
        source: Name of one node.
        destination: Name of the other.
        partitions: Partitions: pairs of nodes, and times.
    """
    out = [p for p in partitions if p.parts(source, destination)]
    back = [p for p in partitions if p.parts(destination, source)]
    return (
        PartedLink(links[0], out) if out else links[0],
        PartedLink(links[1], back) if back else links[1],
    )


class Reception(Protocol):
    """Quality of a radio link at one place, in addition to the link's own."""

    @property
    def loss(self) -> float:
        """Probability that a packet is lost, each way; 1 without reception."""

    @property
    def rate_bps(self) -> float:
        """Upper bound of the rate [bit/s]."""

    @property
    def extra_delay_s(self) -> float:
        """One-way delay added [s]."""


class RadioLink(Link):
    """A link whose quality depends on where the robot is.

    Packets keep their order when reception changes, unless the link may reorder them. While there
    is none every packet is lost, and what rides on the link has to send again. The queue before
    the air counts bytes.

    Args:
        config: Delay, loss, queue of the link as such.
        serialiser: Model of the line's rate.
        streams: Random streams of the run.
        name: Name of this direction, which selects its random stream.
        reception: The quality where the robot is now; None: nothing is added.
    """

    def __init__(
        self,
        config: LinkConfig,
        serialiser: Serialiser,
        streams: Streams,
        name: str,
        direction: Direction,
        reception: Callable[[], Reception | None],
    ) -> None:
        self._deviation = 0.0  # of the last packet, by the link's law
        super().__init__(config, serialiser, streams, name, direction)
        link = config.toward(direction)
        self._reception = reception
        self._uniforms = FastNoise(streams, f"{name}/radio")
        self._air = ConstantRate(link.rate_bps)
        self._air_room = link.queue_bytes
        self._newest = 0.0

    @override
    def _take(self, link: LinkConfig) -> None:
        super()._take(link)
        self._law = None if link.jitter_s else self._wobble
        if self._law is not None:
            self._wobble = self._noted

    @override
    def is_ideal(self) -> bool:
        # The next place may have no reception.
        return False

    @override
    def carry(self, now: float, size: int) -> float | None:
        here = self._reception()
        if here is not None and self._full(now, size, here.rate_bps):
            self.offered += 1
            self.dropped += 1
            return None
        arrival = super().carry(now, size)
        if arrival is None:
            return None
        if here is not None:
            if here.loss and self._uniforms.draw(now) < here.loss:
                self.lost += 1
                return None
            # The last packet's lag by the law of the link; uniform jitter counts by its mean.
            lag = self.delay if self._law is None else self._base + self._deviation
            arrival = max(arrival, self._air.depart(now, size) + lag) + here.extra_delay_s
        if self._may_overtake:
            return arrival
        self._newest = max(self._newest, arrival)
        return self._newest

    @override
    def carry_train(self, now: float, packets: int, size: int) -> float | None:
        # In the air each packet has a fate of its own.
        return None

    @override
    def backlog_bytes(self, now: float) -> float:
        return max(super().backlog_bytes(now), self._air.backlog_bytes(now))

    def _noted(self, now: float) -> float:
        assert self._law is not None
        self._deviation = self._law(now)
        return self._deviation

    def _full(self, now: float, size: int, rate_bps: float) -> bool:
        """Return True if the queue before the radio is full; the radio has its place's rate."""
        if rate_bps != self._air.rate_bps:
            self._air.change_rate(now, rate_bps)
        return self._air.backlog_bytes(now) + size > self._air_room


def make_link(
    config: LinkConfig,
    direction: Direction,
    streams: Streams,
    name: str,
    reception: Callable[[], Reception | None] | None = None,
    by_packet: bool = False,
) -> Link:
    """Return the `up` or `down` direction of a configured link.

    Args:
        direction: `up` or `down`.
        streams: Random streams of the run.
        name: Name of the link, which selects its random streams.
        reception: The quality of its radio hop now, if it has one.
        by_packet: See `Link`; not for radio links.

    Raises:
        ConfigError: a file that it names cannot be read.
    """
    serialiser = make_serialiser(config, direction, streams, name)
    own_name = f"{name}/{direction}"
    if reception is None:
        return Link(config, serialiser, streams, own_name, direction, by_packet)
    return RadioLink(config, serialiser, streams, own_name, direction, reception)
