"""A process of this machine that does what another one asks: both ends.

It is a program of its own, so it neither knows nor runs the script that started a study. Until it
has been sent where modules lie, it loads Python's own alone.
"""

import os
import pickle
import select
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any


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
            self._process = subprocess.Popen(
                # -P: a file beside this one is not taken for a module of Python.
                [sys.executable, "-P", __file__, str(number)],
                stdin=subprocess.DEVNULL,
                pass_fds=(number,),
            )
            self._file = ours.makefile("rwb")
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
        """Let it end, and wait for that."""
        with suppress(OSError):
            self._file.close()
        self._process.wait()

    @property
    def is_stopped(self) -> bool:
        """True if a signal has stopped the process; False where the system does not tell."""
        with suppress(OSError):
            stat = Path(f"/proc/{self._process.pid}/stat").read_text()
            return stat.rpartition(")")[2].split()[0] == "T"
        return False


def serve(number: int) -> None:
    """Do what comes through a socket, until that is closed at the other end."""
    with socket.socket(fileno=number) as channel, channel.makefile("rwb") as file:
        threading.Thread(target=_end_with_parent, args=(number,), daemon=True).start()
        with suppress(EOFError, ConnectionError):
            sys.path[:] = pickle.load(file)
            while True:
                answer = pickle.load(file)()
                file.write(pickle.dumps(answer))
                file.flush()


def _end_with_parent(number: int) -> None:
    """Whatever is being done: nobody waits for it any more."""
    hang_up = select.poll()
    hang_up.register(number, 0)
    hang_up.poll()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(0)


if __name__ == "__main__":
    serve(int(sys.argv[1]))
