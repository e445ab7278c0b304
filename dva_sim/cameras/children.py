"""The processes beside the world: how each is started, spoken with, and ended."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from dva_sim.kernel.errors import ERROR, RunsFailed
from dva_sim.serving.pipes import LineKinds, LinePipe

SERVING_WITHIN = 30.0  # from the start of the web process to its first word [s]
END_WITHIN = 0.8  # for a child to end by itself once it is asked to [s]
MOST_STDERR = 10_000  # of what a child says on standard error [B]
# Lines for the process that draws pictures.
PAINTED = LineKinds(
    newest=frozenset({"frame", "picture"}), kept=frozenset({"scene", "contain", "ready"})
)


class ChildFailed(RunsFailed):
    """A process beside the world could not begin, or ended by itself."""


class Child:
    """A process of our own, with a pipe to it.

    It ends when its pipe does, whatever happens to us. Ctrl-C of a terminal reaches us alone.

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
        self.name, self.pipe = name, LinePipe(ours.detach(), kinds)
        self.process = subprocess.Popen(
            [sys.executable, "-m", module, "--fd", str(theirs.fileno()), *words],
            stdin=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,
            pass_fds=(theirs.fileno(), *(other.fileno() for other in others)),
        )
        theirs.close()

    def first_line(self, within: float = SERVING_WITHIN) -> dict[str, Any]:
        """Wait for its first word.

        Raises:
            ChildFailed: it ended, or said nothing.
        """
        deadline = time.monotonic() + within
        while time.monotonic() < deadline:
            for line in self.pipe.lines():
                return line
            if not self.pipe.is_open or self.process.poll() is not None:
                raise ChildFailed(self.why())
            time.sleep(0.01)
        raise ChildFailed(f"the {self.name} said nothing within {within:g} s")

    def why(self) -> str:
        """Return why it has ended, in a line."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(END_WITHIN)
        code = self.process.poll()
        if code is None:
            return f"the {self.name} has closed its pipe"
        output = self._error_lines()
        text = output[-1].removeprefix("dva-sim: ").removeprefix(ERROR) if output else _code(code)
        return f"the {self.name} has ended: {text}"

    def _error_lines(self) -> list[str]:
        assert self.process.stderr is not None
        return self.process.stderr.read()[-MOST_STDERR:].decode(errors="replace").split("\n")[:-1]

    def end(self) -> None:
        """Close its pipe: it ends by that."""
        self.pipe.close()

    def make_sure(self, deadline: float) -> None:
        """Wait for its end up to a moment of `time.monotonic` [s], and no longer."""
        try:
            self.process.wait(max(0.01, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        assert self.process.stderr is not None
        self.process.stderr.close()


def _code(code: int) -> str:
    return f"killed by signal {-code}" if code < 0 else f"exit code {code}"
