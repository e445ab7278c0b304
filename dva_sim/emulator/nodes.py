"""The two ends of a link: a process each, with a network of its own where packets are emulated.

A namespace here has no name: it ends with its process, and the process ends with the one that
started it. So nothing can be left behind, whoever is killed.
"""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import socket
import traceback
from collections.abc import Callable
from dataclasses import dataclass

from dva_sim.emulator import kernel
from dva_sim.emulator.notes import Notes

PRIORITY = 10  # real-time, below the forwarder's
_PATIENCE_S = 20.0  # for a node to be ready

Program = Callable[[socket.socket, Notes], None]
"""Runs in a node: with a connection to whoever started it, and a place for its notes."""


@dataclass(frozen=True)
class Node:
    """A process at one end.

    Attributes:
        name: `operator` or `robot`.
        pid: Process.
        ended: File descriptor that becomes readable when the process ends.
        channel: Connection to it.
        notes: What it noted.
    """

    name: str
    pid: int
    ended: int
    channel: socket.socket
    notes: Notes

    def hear(self) -> tuple[bytes, list[int]]:
        """Wait for the next word of the node: what it says, and file descriptors it hands over.

        Raises:
            ChildProcessError: it ended or said nothing.
        """
        with contextlib.suppress(OSError):
            said, handed, *_ = socket.recv_fds(self.channel, 256, 1)
            if said:
                return said, handed
        raise ChildProcessError(f"the {self.name} did not become ready")

    def end(self) -> int:
        """Kill the process and wait for it; its exit code, negative if it was killed."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)
        status = os.waitpid(self.pid, 0)[1]
        self.channel.close()
        os.close(self.ended)
        return os.waitstatus_to_exitcode(status)


def start_node(name: str, program: Program, room: int) -> Node:
    """A process that runs a program and then ends.

    Args:
        name: What it is called.
        program: What it runs.
        room: Notes that find room.
    """
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    here.settimeout(_PATIENCE_S)
    notes = Notes(room)
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        here.close()
        _live(parent, program, there, notes)
    there.close()
    return Node(name, pid, os.pidfd_open(pid), here, notes)


def _live(parent: int, program: Program, channel: socket.socket, notes: Notes) -> None:
    """All that a node's process does; it never returns."""
    code = 1
    try:
        kernel.die_with_parent(parent)
        gc.disable()  # a pause would look like delay
        kernel.be_punctual(PRIORITY)
        program(channel, notes)
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)
