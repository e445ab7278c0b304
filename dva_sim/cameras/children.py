"""Child processes of a run that exchange lines with it through a pipe."""

from __future__ import annotations

import socket
import sys
from collections.abc import Sequence

from dva_sim.serving.pipes import LineKinds, LinePipe
from dva_sim.serving.processes import Child

END_SOON = 0.8  # time for a process to end by itself, while the run waits [s]
# Kinds of lines for the process that draws pictures.
PAINTED = LineKinds(
    newest=frozenset({"frame", "picture"}), kept=frozenset({"scene", "contain", "ready"})
)


class PipedChild(Child):
    """A child process that ends when its pipe closes, even if this process is killed.

    Args:
        name: Name for people.
        module: Module to run.
        words: Further arguments of the command line.
        sockets: Sockets that it inherits, besides its pipe.
        kinds: Kinds of the lines that are sent to it.

    Attributes:
        pipe: This process's end of the pipe.
    """

    def __init__(
        self,
        name: str,
        module: str,
        words: Sequence[str],
        sockets: Sequence[socket.socket],
        kinds: LineKinds,
    ) -> None:
        near, far = socket.socketpair()
        self.pipe = LinePipe(near.detach(), kinds)
        with far:
            called = [sys.executable, "-m", module, "--fd", str(far.fileno()), *words]
            files = [file.fileno() for file in (far, *sockets)]
            super().__init__(name, called, self.pipe.close, pass_fds=files)
