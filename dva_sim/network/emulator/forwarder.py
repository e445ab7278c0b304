"""Moves real packets over a modelled link: each comes out when the model says, or never.

The link is the model's own, in the time since the forwarder began. It decides the fate of a packet
by the packet's number where the model in virtual time does so by the time, so that the same seed
loses and delays the same packets. What is a matter of time by itself (bursts, outages, recorded
links, correlated delays) stays so.
"""

from __future__ import annotations

import heapq
import os
import select
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from contextlib import suppress
from typing import Generic, TypeVar

from typing_extensions import override

from dva_sim.kernel.streams import Streams
from dva_sim.network.emulator.report import Durations, LinkFlow, LinkReport
from dva_sim.network.link import Link, LinkConfig, make_link, part_links

FORWARDER_PRIORITY = 20  # real-time, above the programs'
NEAR = "near"
FAR = "far"
_LARGEST = 65_536
_MAX_AT_ONCE = 32  # maximum packets of one device before due ones are sent
_VERSION_4 = 4

Links = tuple[Link, Link]
T = TypeVar("T")


def links_of(config: LinkConfig, seed: int, by_packet: bool = True) -> Links:
    """Return both directions of a link for real packets: near to far (`up`), and back (`down`).

    Args:
        config: Both directions.
        seed: Random seed of losses and jitter.
        by_packet: See `Link`.

    Raises:
        ConfigError: a file that the link names cannot be read.
    """
    streams = Streams(seed)
    up = make_link(config, "up", streams, "emulator", by_packet=by_packet)
    down = make_link(config, "down", streams, "emulator", by_packet=by_packet)
    return part_links((up, down), NEAR, FAR, config.partitions)


class EmulatedLink(ABC, Generic[T]):
    """Joins both ends while they run: holds what is on its way, and hands it on when it is due.

    Args:
        links: From the near end to the far one, and back.
    """

    def __init__(self, links: Links) -> None:
        self._flows = LinkFlow(links[0]), LinkFlow(links[1])
        self._due: list[tuple[float, int, float, LinkFlow, T, bytes]] = []
        self._number = 0
        self._late = Durations()
        self._epoch = time.monotonic()

    def begin(self) -> None:
        """Let the link's time begin now: the moment that outages and recordings count from."""
        self._epoch = time.monotonic()

    @abstractmethod
    def run(self, watched: Sequence[int], deadline: float) -> int | None:
        """Forward until one of the watched file descriptors has something to say.

        Returns:
            That one; None when the deadline has passed.
        """

    @abstractmethod
    def close(self) -> None:
        """Let go of devices and sockets."""

    @abstractmethod
    def _put(self, out: T, data: bytes) -> None:
        """Deliver the packets that are due."""

    def report(self, overrun: int = 0) -> LinkReport:
        """Count as far as it has come; chunks of a relay count as packets.

        Args:
            overrun: Packets that the kernel dropped before the forwarder could read them.
        """
        up, down = (flow.report() for flow in self._flows)
        late = self._late
        shares = late.quantile(0.5), late.quantile(0.99), late.longest_s
        return LinkReport(up, down, *shares, overrun)

    @property
    def _time(self) -> float:
        """The link's time now [s]."""
        return time.monotonic() - self._epoch

    def _offer(self, flow: LinkFlow, size: int, out: T, data: bytes) -> None:
        """Let the link decide when something of so many bytes comes out, if at all."""
        now = time.monotonic()
        release = flow.link.carry(now - self._epoch, size)
        if release is not None:
            self._number += 1
            entry = (self._epoch + release, self._number, now, flow, out, data)
            heapq.heappush(self._due, entry)

    def _release(self, now: float, deadline: float) -> float:
        """Hand on everything that is due; when there is something to do next [s]."""
        while self._due and self._due[0][0] <= now:
            release, _, entered, flow, out, data = heapq.heappop(self._due)
            self._put(out, data)
            now = time.monotonic()
            self._late.add(now - release)
            flow.passed += 1
            flow.passed_bytes += len(data)
            flow.waits.add(now - entered)
        return min(deadline, self._due[0][0]) if self._due else deadline


class Forwarder(EmulatedLink[int]):
    """Both directions of an emulated link.

    Args:
        tuns: Devices of the near and of the far namespace.
        links: From the near end to the far one, and back.
    """

    def __init__(self, tuns: tuple[int, int], links: Links) -> None:
        super().__init__(links)
        up, down = self._flows
        self._ways = {tuns[0]: (up, tuns[1]), tuns[1]: (down, tuns[0])}

    @override
    def run(self, watched: Sequence[int], deadline: float) -> int | None:
        tuns = list(self._ways)
        while (now := time.monotonic()) < deadline:
            until = self._release(now, deadline)
            pause = max(0.0, until - time.monotonic())
            ready = select.select([*tuns, *watched], [], [], pause)[0]
            for file in ready:
                if file not in self._ways:
                    return int(file)
                self._take(file)
        return None

    @override
    def close(self) -> None:
        for tun in self._ways:
            os.close(tun)

    def _take(self, tun: int) -> None:
        """Offer what waits in a device to its link; what is not IPv4 is not forwarded."""
        flow, out = self._ways[tun]
        with suppress(OSError):  # nothing waits, or the namespace has just ended
            for _ in range(_MAX_AT_ONCE):
                packet = os.read(tun, _LARGEST)
                if not packet or packet[0] >> 4 != _VERSION_4:
                    continue
                self._offer(flow, len(packet), out, packet)

    def _put(self, out: int, data: bytes) -> None:
        with suppress(OSError):  # a namespace that has just ended takes nothing more
            os.write(out, data)
