"""Child processes: start, readiness, failure and end.

Each has a session of its own, so that Ctrl-C in a terminal reaches only the program, which then
ends its children in order.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from tempfile import TemporaryFile
from typing import Any, TypeVar

from dva_sim.kernel.errors import ERROR, DvaSimError, ExitCode, RunsFailed

READY_WITHIN = 30.0  # time from the start of a process to its first message [s]
END_WITHIN = 5.0  # time for a process to end by itself when asked to [s]
EXIT_DELAY_S = 0.8  # time between the end of a process's output and its own end [s]
LOOK = 0.01  # interval of checks while waiting for a process [s]
LAST_WORDS = 10_000  # size of the end of standard error that is searched for its last line [B]

T = TypeVar("T")


class ChildFailed(RunsFailed):
    """Failure of a child process to start, or its unexpected end."""


class Child(subprocess.Popen[bytes]):
    """A process that this one has started.

    Args:
        name: Name for people, such as `the web process`.
        words: Command line.
        lifeline: Function that closes the channel whose end tells the process to end. Without one,
            its standard input is closed if it is a pipe; otherwise it gets SIGTERM.
        keeps_errors: True to keep its standard error, whose last line says why it ended. It is
            written to an unnamed file rather than a pipe, which could fill up and block it.
        options: See `subprocess.Popen`.
    """

    def __init__(
        self,
        name: str,
        words: Sequence[str],
        lifeline: Callable[[], object] | None = None,
        keeps_errors: bool = True,
        **options: Any,
    ) -> None:
        self.name = name
        self._lifeline = lifeline
        self._errors = TemporaryFile() if keeps_errors else None  # noqa: SIM115 - closed by `forget`
        if self._errors is not None:
            options["stderr"] = self._errors
        defaults = {"stdin": subprocess.DEVNULL, "start_new_session": True}
        super().__init__(words, **defaults | options)

    def ready(self, look: Callable[[], T | None], within: float = READY_WITHIN) -> T:
        """Call `look` until it returns something, and return that.

        Raises:
            ChildFailed: the process ended, or `look` returned nothing for `within` seconds.
        """
        deadline = time.monotonic() + within
        while (result := look()) is None:
            if self.poll() is not None:
                raise ChildFailed(self.why())
            if time.monotonic() > deadline:
                raise ChildFailed(f"{self.name} said nothing within {within:g} s")
            time.sleep(LOOK)
        return result

    def why(self) -> str:
        """Return one line on why it ended: its last line of output, or its exit code or signal."""
        with suppress(subprocess.TimeoutExpired):
            self.wait(EXIT_DELAY_S)
        code = self.returncode
        if code is None:
            return f"{self.name} has closed its pipe"
        how = f"killed by signal {-code}" if code < 0 else f"exit code {code}"
        return f"{self.name} has ended by itself: {self._last_line() or how}"

    def failure(self) -> DvaSimError:
        """Return the error for an unexpected end, or for a user's mistake, by the exit code."""
        kind = DvaSimError if self.returncode == ExitCode.MISTAKE else ChildFailed
        return kind(self.why())

    def _last_line(self) -> str:
        if self._errors is None:
            return ""
        file = self._errors.fileno()
        # Both processes share the file offset: `seek` here would misplace the child's next write.
        text = os.pread(file, LAST_WORDS, max(0, os.fstat(file).st_size - LAST_WORDS))
        lines = text.decode(errors="replace").strip().splitlines()
        return lines[-1].removeprefix(ERROR) if lines else ""

    def request_end(self) -> None:
        """Ask the process to end."""
        if self._lifeline is not None:
            self._lifeline()
        elif self.stdin is not None:
            with suppress(OSError):
                self.stdin.close()
        else:
            self.terminate()

    def forget(self) -> None:
        """Close the file of its standard error, once the process has ended."""
        if self._errors is not None:
            self._errors.close()


def end_all(
    children: Iterable[Child],
    within: float = END_WITHIN,
    meanwhile: Callable[[float], object] = time.sleep,
) -> None:
    """End processes: ask each in this order, wait, and kill those that remain.

    Args:
        children: The processes; some may have ended already.
        within: Time after which running ones are killed [s].
        meanwhile: Called repeatedly until all have ended, with the time to wait [s].
    """
    children = list(children)
    for child in children:
        child.request_end()
    deadline = time.monotonic() + within
    while any(child.poll() is None for child in children):
        if time.monotonic() >= deadline:
            for child in children:
                child.kill()
        meanwhile(LOOK)
    for child in children:
        child.forget()
