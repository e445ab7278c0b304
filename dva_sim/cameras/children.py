"""The processes beside the world, which are spoken with by lines."""

from __future__ import annotations

import socket
import sys
from collections.abc import Sequence

from dva_sim.serving.pipes import LineKinds, LinePipe
from dva_sim.serving.processes import Child

END_SOON = 0.8  # time for a process to end by itself, for which the world waits [s]
# Lines for the process that draws pictures.
PAINTED = LineKinds(
    newest=frozenset({"frame", "picture"}), kept=frozenset({"scene", "contain", "ready"})
)


class PipedChild(Child):
    """A process with a pipe to it, by whose end it ends, whatever happens to us.

    Args:
        name: Name for people.
        module: Module to run.
        words: Its further arguments.
        others: Sockets that it gets beside its pipe.
        kinds: The kinds of lines that are sent to it.

    Attributes:
        pipe: Our end.
    """

    def __init__(
        self,
        name: str,
        module: str,
        words: Sequence[str],
        others: Sequence[socket.socket],
        kinds: LineKinds,
    ) -> None:
        ours, theirs = socket.socketpair()
        self.pipe = LinePipe(ours.detach(), kinds)
        with theirs:
            called = [sys.executable, "-m", module, "--fd", str(theirs.fileno()), *words]
            files = [file.fileno() for file in (theirs, *others)]
            super().__init__(name, called, self.pipe.close, pass_fds=files)
