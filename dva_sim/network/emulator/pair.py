"""Two commands at the ends of an emulated link, from their start to the last kill.

The link lasts until the near command ends; then the far one is ended. An end is asked for by
signals first, and enforced after a moment, so that nothing of either command is left behind.
"""

from __future__ import annotations

import os
import select
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from dva_sim.network.emulator import publishing
from dva_sim.network.emulator.forwarder import FAR, NEAR
from dva_sim.network.emulator.needs import EmulatorError
from dva_sim.network.emulator.process import LinkProcess
from dva_sim.network.emulator.report import LinkReport
from dva_sim.serving.processes import END_WITHIN, Child, end_all
from dva_sim.serving.signals import caught_signals

GRACE_S = END_WITHIN  # time for a command to end by itself after a signal

Tell = Callable[[str], object]


@dataclass(frozen=True)
class PairOutcome:
    """Results of two commands over a link.

    Attributes:
        code: Exit code of the near command; 128 and the number of the signal that ended it.
        report: The packets of the link.
    """

    code: int
    report: LinkReport


def run_pair(
    link: LinkProcess,
    near: str,
    far: str,
    tell: Tell,
    published: Sequence[socket.socket] = (),
) -> PairOutcome:
    """Run two commands by the shell until the near one ends, or a signal asks for the end.

    SIGINT, SIGTERM and SIGHUP go to both commands; a second one ends them at once.

    Args:
        link: Joins them.
        near: Command whose end is the end; it reads the standard input.
        far: Command that is ended then.
        tell: Callback for a line that should be read at once.
        published: Listening sockets of this machine, led to the same ports of the near end.

    Raises:
        EmulatorError: no shell was found.
        LinkEnded: the link has ended by itself; so have both commands.
    """
    if shutil.which("sh") is None:
        raise EmulatorError("a shell is needed: there is no `sh` on the PATH")
    with ExitStack() as at_end:
        signals = at_end.enter_context(caught_signals())
        if published:
            files = [listener.fileno() for listener in published]
            leading = link.start(NEAR, publishing.words_of(published), pass_fds=files)
            at_end.callback(end_all, [leading], 0.0)
        link.begin()
        commands = {}
        for end, command, stdin in ((FAR, far, subprocess.DEVNULL), (NEAR, near, None)):
            process = link.start(end, ["sh", "-c", command], stdin=stdin)
            at_end.callback(end_all, [process], 0.0)
            commands[end] = _Command(end, process)
            at_end.callback(os.close, commands[end].ended)
        grace = _wait_for(commands[NEAR], commands[FAR], link, signals, tell)
        end_all([commands[NEAR].process], 0.0)
        end_all([commands[FAR].process], grace)
        return PairOutcome(commands[NEAR].process.returncode, link.report())


class _Command:
    """A command that runs.

    Attributes:
        ended: File descriptor that becomes readable when it ends.
    """

    def __init__(self, name: str, process: Child) -> None:
        self.name = name
        self.process = process
        self.ended = os.pidfd_open(process.pid)


def _wait_for(
    near: _Command, far: _Command, link: LinkProcess, signals: socket.socket, tell: Tell
) -> float:
    """Wait until the near command has ended, or has to be; for how long the far one may go on [s].

    Raises:
        LinkEnded: the link has ended by itself.
    """
    watched: list[int] = [near.ended, far.ended, link.fileno(), signals.fileno()]
    deadline: float | None = None
    while True:
        left = None if deadline is None else max(0.0, deadline - time.monotonic())
        ready = select.select(watched, [], [], left)[0]
        if link.fileno() in ready:
            raise link.ended()
        if near.ended in ready or not ready:
            return GRACE_S if deadline is None else max(0.0, deadline - time.monotonic())
        if far.ended in ready:
            watched.remove(far.ended)
            if code := far.process.wait():
                tell(f"the far command has ended with exit code {code}")
        if signals.fileno() in ready:
            signal_bytes = signals.recv(64)
            if deadline is not None or len(signal_bytes) > 1:
                return 0.0
            for command in (near, far):
                command.process.send_signal(signal_bytes[0])
            deadline = time.monotonic() + GRACE_S
