"""Forwards packets between both ends of a link for as long as another process wants it."""

from __future__ import annotations

import gc
import os
import socket
import time
from collections.abc import Sequence
from typing import Any

from dva_sim.network.emulator import linux_calls
from dva_sim.network.emulator.forwarder import FORWARDER_PRIORITY, Forwarder, links_of
from dva_sim.network.link import LinkConfig

BEGIN = b"begin"
END = b"end"
_A_WHILE_S = 60.0  # longest wait in a system call


def hold(
    channel: socket.socket,
    job: dict[str, Any],
    tuns: tuple[int, int],
    drops: Sequence[linux_calls.DroppedPackets],
    spaces: Sequence[int],
) -> None:
    """Hand over the namespaces, forward until asked to end, and report.

    Args:
        channel: Socket to the process that wants the link.
        job: Configuration and seed of the link.
        tuns: Devices of the near and the far namespace.
        drops: Counts of what the kernel dropped at each of them.
        spaces: Open files of the namespaces.
    """
    links = links_of(LinkConfig.model_validate(job["link"]), job["seed"])
    forwarder = Forwarder(tuns, links)
    linux_calls.be_punctual(FORWARDER_PRIORITY)
    gc.freeze()
    gc.disable()  # a pause would look like delay
    socket.send_fds(channel, [b"{}"], list(spaces))
    for space in spaces:
        os.close(space)  # a namespace ends with the last process that uses it
    while (message := _listen(forwarder, channel)) == BEGIN:
        forwarder.begin()
    if message == END:
        overrun = sum(dropped.count() for dropped in drops)
        channel.send(forwarder.report(overrun).to_json().encode())


def _listen(forwarder: Forwarder, channel: socket.socket) -> bytes:
    """Forward until the next word; nothing if the other process has ended."""
    while forwarder.run([channel.fileno()], time.monotonic() + _A_WHILE_S) is None:
        pass
    return channel.recv(64)
