"""Moves packets between the two TUN devices when the wires say, and notes how late it is."""

from __future__ import annotations

import heapq
import os
import select
import time
from array import array
from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from dva_sim.emulator.wire import Wire

PRIORITY = 20  # real-time, above the programs'
_LARGEST = 65_536
_MOST_AT_ONCE = 32  # packets of one device before what is due is looked at again
_VERSION_4 = 4

Told = dict[str, float | int]


class Forwarder:
    """Both directions of an emulated link.

    Args:
        tuns: Devices of the operator's and of the robot's namespace.
        wires: From the operator to the robot, and back.
    """

    def __init__(self, tuns: tuple[int, int], wires: tuple[Wire, Wire]) -> None:
        self._ways = {tuns[0]: (wires[0], tuns[1]), tuns[1]: (wires[1], tuns[0])}
        self._wires = wires
        self._due: list[tuple[float, int, int, bytes]] = []
        self._number = 0
        self._late = array("d")

    def run(self, watched: Sequence[int], deadline: float) -> int | None:
        """Forward until one of the watched file descriptors has something to say.

        Returns:
            That one; None when the deadline has passed.
        """
        tuns = list(self._ways)
        while (now := time.monotonic()) < deadline:
            self._release(now)
            until = min(deadline, self._due[0][0]) if self._due else deadline
            pause = max(0.0, until - time.monotonic())
            ready = select.select([*tuns, *watched], [], [], pause)[0]
            for file in ready:
                if file not in self._ways:
                    return int(file)
                self._take(file)
        return None

    def told(self) -> Told:
        """The columns of the emulator."""
        return tell(self._wires, self._late)

    def close(self) -> None:
        """Let go of the devices."""
        for tun in self._ways:
            os.close(tun)

    def _take(self, tun: int) -> None:
        """Offer what waits in a device to its wire; what is not IPv4 is not forwarded."""
        wire, out = self._ways[tun]
        with suppress(OSError):  # nothing waits, or the namespace has just ended
            for _ in range(_MOST_AT_ONCE):
                packet = os.read(tun, _LARGEST)
                if not packet or packet[0] >> 4 != _VERSION_4:
                    continue
                release = wire.offer(time.monotonic(), len(packet))
                if release is not None:
                    self._number += 1
                    heapq.heappush(self._due, (release, self._number, out, packet))

    def _release(self, now: float) -> None:
        """Write everything that is due."""
        due = self._due
        while due and due[0][0] <= now:
            release, _, out, packet = heapq.heappop(due)
            with suppress(OSError):  # a namespace that has just ended takes nothing more
                os.write(out, packet)
            now = time.monotonic()
            self._late.append(now - release)


def tell(wires: tuple[Wire, Wire], late: Sequence[float]) -> Told:
    """The columns of the emulator from counts and from the lateness of releases [s]."""
    told: Told = {}
    for way, wire in zip(("ab", "ba"), wires, strict=True):
        counts = wire.counts
        told[f"emu_pkts_{way}"] = counts.offered
        told[f"emu_lost_{way}"] = counts.lost
        told[f"emu_tail_{way}"] = counts.tail
    shares = np.percentile(late, (50, 99, 100)) if len(late) else (np.nan,) * 3
    for name, value in zip(("p50", "p99", "max"), shares, strict=True):
        told[f"emu_late_{name}_ms"] = 1e3 * float(value)
    return told
