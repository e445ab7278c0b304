"""A process of this machine that does what this one asks: this end of it."""

from __future__ import annotations

import pickle
import socket
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from dva_sim.experiments.execution import worker_program
from dva_sim.serving.processes import Child, end_all


class WorkerDied(Exception):
    """A worker process ended while it was at work."""


class WorkerProcess:
    """The parent's end; the process ends when this end is closed, however that comes.

    Raises:
        OSError: the system lets no process start.
    """

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        with ours, theirs:
            number = theirs.fileno()
            self._file = ours.makefile("rwb")
            self._process = Child(
                "the worker process",
                # -P: a file beside this one is not taken for a module of Python.
                [sys.executable, "-P", worker_program.__file__, str(number)],
                self._hang_up,
                keeps_errors=False,  # what a plug-in prints is for the user
                pass_fds=(number,),
                start_new_session=False,  # Ctrl-Z stops all that is at work
            )
        self._file.write(pickle.dumps(sys.path))

    def call(self, task: Callable[[], Any]) -> Any:
        """Have a task done, which is pickled, and so is what it returns.

        Raises:
            WorkerDied: it ended meanwhile, or what it was given is not known there.
        """
        data = pickle.dumps(task)
        try:
            self._file.write(data)
            self._file.flush()
            return pickle.load(self._file)
        except (OSError, EOFError, pickle.UnpicklingError):
            raise WorkerDied from None

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()

    def close(self) -> None:
        """Let it end, and make sure that it has."""
        end_all([self._process])

    def _hang_up(self) -> None:
        with suppress(OSError):
            self._file.close()

    @property
    def is_stopped(self) -> bool:
        """True if a signal has stopped the process; False where the system does not tell."""
        with suppress(OSError):
            stat = Path(f"/proc/{self._process.pid}/stat").read_text()
            return stat.rpartition(")")[2].split()[0] == "T"
        return False
