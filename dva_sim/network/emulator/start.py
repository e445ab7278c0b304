"""The process of an emulated link: first the namespaces, then everything else.

A user namespace is refused to a process with several threads, and numerical libraries start
some when they are imported; so this module imports none before the namespaces are made.
"""

from __future__ import annotations

import json
import os
import socket
import sys

from dva_sim.network.emulator.linux_calls import (
    FAR_END,
    NEAR_END,
    DroppedPackets,
    End,
    become_owner,
    die_with_parent,
    enter_network_namespace,
    open_tun,
    raise_loopback,
)


def main(parent: int, control: int) -> None:
    """Make both ends of a link, hand over their namespaces, and forward until asked to end.

    Args:
        parent: Process that started this one.
        control: Number of the open socket to it.
    """
    with socket.socket(fileno=control) as channel:
        job = json.loads(channel.recv(1 << 20))
        os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
        try:
            rights = become_owner(job["rootless"])
            die_with_parent(parent)
            spaces = [] if rights == "root" else [os.open("/proc/self/ns/user", os.O_RDONLY)]
            ends = [_make_end(end) for end in (NEAR_END, FAR_END)]
        except OSError as error:
            channel.send(json.dumps({"problem": error.strerror or str(error)}).encode())
            return
        spaces += [space for _, space, _ in ends]

        from dva_sim.network.emulator.holder import hold  # late: start-up

        tuns = (ends[0][0], ends[1][0])
        drops = [dropped for *_, dropped in ends]
        hold(channel, job, tuns, drops, spaces)


def _make_end(end: End) -> tuple[int, int, DroppedPackets]:
    """Return the device of a new network namespace, the namespace, and what is dropped there."""
    enter_network_namespace()
    raise_loopback()
    tun = open_tun(end, "cubic")
    return tun, os.open("/proc/thread-self/ns/net", os.O_RDONLY), DroppedPackets()


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
