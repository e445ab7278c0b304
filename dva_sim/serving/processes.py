"""Processes that a program starts: how each becomes ready, is found to have ended, and is ended.

Each is in a session of its own, so that Ctrl-C of a terminal reaches the program alone, which then
ends them in good order.
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
LOOK = 0.01  # interval of checks of a process that is awaited [s]
LAST_WORDS = 10_000  # end of the standard error in which the last line is looked for [B]

T = TypeVar("T")


class ChildFailed(RunsFailed):
    """A process that was started could not begin, or ended by itself."""


class Child(subprocess.Popen[bytes]):
    """A process that this one has started.

    Args:
        name: Name for people, as `the web process`.
        words: Its command line.
        lifeline: Closes the channel whose end tells the process to end. Without one, its standard
            input is closed if that is a pipe; else it gets SIGTERM.
        keeps_errors: True to keep what it says on standard error, whose last line tells why it
            ended. That goes to a file without a name: it never waits until somebody reads.
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
        usual = {"stdin": subprocess.DEVNULL, "start_new_session": True}
        super().__init__(words, **usual | options)

    def ready(self, look: Callable[[], T | None], within: float = READY_WITHIN) -> T:
        """Call `look` until it returns something, and return that.

        Raises:
            ChildFailed: it ended, or there was nothing for `within` seconds.
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
        """Return in one line that it has ended, and why: its last words, or how it ended."""
        with suppress(subprocess.TimeoutExpired):
            self.wait(EXIT_DELAY_S)
        code = self.returncode
        if code is None:
            return f"{self.name} has closed its pipe"
        how = f"killed by signal {-code}" if code < 0 else f"exit code {code}"
        return f"{self.name} has ended by itself: {self._last_line() or how}"

    def failure(self) -> DvaSimError:
        """Make the error of a process that has ended by itself; a user's mistake stays one."""
        kind = DvaSimError if self.returncode == ExitCode.MISTAKE else ChildFailed
        return kind(self.why())

    def _last_line(self) -> str:
        if self._errors is None:
            return ""
        file = self._errors.fileno()
        # Both processes share one place in the file: to move it would spoil what is written next.
        text = os.pread(file, LAST_WORDS, max(0, os.fstat(file).st_size - LAST_WORDS))
        lines = text.decode(errors="replace").strip().splitlines()
        return lines[-1].removeprefix(ERROR) if lines else ""

    def ask(self) -> None:
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
    """Ask processes to end, in this order, and make sure that they have.

    Args:
        children: The processes; those that have ended already are welcome.
        within: Time until those that are still there are killed [s].
        meanwhile: Called with a time to spend [s], again and again until they have ended.
    """
    children = list(children)
    for child in children:
        child.ask()
    deadline = time.monotonic() + within
    while any(child.poll() is None for child in children):
        if time.monotonic() >= deadline:
            for child in children:
                child.kill()
        meanwhile(LOOK)
    for child in children:
        child.forget()
