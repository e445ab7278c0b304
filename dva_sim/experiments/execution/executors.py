"""Who makes the runs: this process, or processes of this machine; a cluster has its own module.

They give executors of `concurrent.futures`; who hands out runs knows nothing else of them.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, suppress
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from dva_sim.kernel.errors import ConfigError, DvaSimError, RunsFailed
from dva_sim.kernel.rare_collection import collect_rarely

P = ParamSpec("P")
R = TypeVar("R")
_FAMILY = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"


class WorkersLost(RunsFailed):
    """Nobody is left to run anything; what has been run is kept."""


class Workers(ABC):
    """Who makes the runs, wherever that is.

    Attributes:
        is_here: Whether runs are made in this process, one by one.
        deaths: What a future raises whose worker has died.
    """

    is_here = False
    deaths: tuple[type[Exception], ...] = ()

    @property
    @abstractmethod
    def width(self) -> int:
        """Workers."""

    @abstractmethod
    def executor(self, width: int, task: Callable[..., Any]) -> AbstractContextManager[Executor]:
        """Workers that are gone, or have nothing more to do, when the block ends.

        Args:
            width: How many.
            task: What they will do, so that they can prepare for it.
        """

    def guarded(self, task: Callable[P, R]) -> Callable[P, R]:
        """The task as it should be handed out."""
        return task

    def look_after(self, is_idle: bool) -> None:  # noqa: B027
        """Called now and then; nothing has to be done.

        Args:
            is_idle: Whether nothing has come for some seconds.

        Raises:
            WorkersLost: nobody is left.
        """


def local(processes: int | None) -> Workers:
    """Processes of this machine; with one, everything happens in this process.

    Raises:
        ConfigError: less than one.
    """
    width = cores() if processes is None else processes
    if width < 1:
        raise ConfigError(f"number of processes should be at least 1, not {width}")
    return LocalProcesses(width) if width > 1 else ThisProcess()


def cores() -> int:
    """How many processes can run at the same time here."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class ThisProcess(Workers):
    """This process."""

    width, is_here = 1, True

    @contextmanager
    def executor(self, width: int, task: Callable[..., Any]) -> Iterator[Executor]:
        """One that has done what it is given when `submit` returns."""
        yield _AtOnce()


class _AtOnce(Executor):
    def submit(self, fn: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> Future[R]:
        future: Future[R] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


class LocalProcesses(Workers):
    """Processes of this machine."""

    width = 0  # each has its own
    deaths = (BrokenProcessPool,)

    def __init__(self, width: int) -> None:
        self.width = width
        self._stopped: set[int] = set()

    @contextmanager
    def executor(self, width: int, task: Callable[..., Any]) -> Iterator[Executor]:
        """A pool whose processes are gone when the block ends, at once if it ends in an error."""
        context = multiprocessing.get_context(_FAMILY)
        self._others = set(multiprocessing.active_children())
        context.set_forkserver_preload([task.__module__])
        kind = ProcessPoolExecutor if task.__module__ == "__main__" else _WithoutScript
        try:
            pool = kind(min(width, self.width), context, initializer=_begin)
        except OSError as error:  # its locks lie there
            raise DvaSimError(
                f"processes cannot share locks: {error.strerror}; is /dev/shm there and writable? "
                "--jobs 1 needs none"
            ) from None
        with _ctrl_c_held_back(self._kill) as self._let_through:
            try:
                yield pool
            except BaseException:
                self._kill()
                raise
            finally:
                pool.shutdown(wait=True, cancel_futures=True)

    def _processes(self) -> set[BaseProcess]:
        """Processes that were started since the pool was made."""
        return set(multiprocessing.active_children()) - self._others

    def _kill(self) -> None:
        for process in self._processes():
            process.kill()

    def look_after(self, is_idle: bool) -> None:
        """End a process that has been stopped for some time: another one does what it had.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed.
        """
        self._let_through()
        pids = {process.pid for process in self._processes()} if is_idle else set()
        stopped = {pid for pid in pids if pid is not None and _is_stopped(pid)}
        for pid in stopped & self._stopped:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self._stopped = stopped


@contextmanager
def _ctrl_c_held_back(at_once: Callable[[], object]) -> Iterator[Callable[[], None]]:
    """Ctrl-C does something at once, and is raised where the block lets it through, or at its end.

    Raised anywhere, it may leave a lock of the pool locked for ever: the pool's own thread would
    wait for that, and this one for the pool's.
    """
    is_pressed = False

    def press(*_: object) -> None:
        nonlocal is_pressed
        is_pressed = True
        at_once()

    def let_through() -> None:
        if is_pressed:
            raise KeyboardInterrupt

    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield let_through
        return
    signal.signal(signal.SIGINT, press)
    try:
        yield let_through
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    let_through()


class _WithoutScript(ProcessPoolExecutor):
    """Processes that do not run the script of whoever started the study.

    They would run it again to find what it defines, and none of that is needed: without
    `if __name__ == "__main__"` in the script, they would start the same study anew.
    """

    def submit(self, fn: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> Future[R]:
        """Start a process, if need be, while nothing tells it of the script."""
        main = vars(sys.modules["__main__"])
        hidden: dict[str, Any] = {
            name: main.pop(name) for name in ("__file__", "__spec__") if name in main
        }
        main["__spec__"] = None  # as of a script without a name
        try:
            return super().submit(fn, *args, **kwargs)
        finally:
            main.update(hidden)


def _is_stopped(pid: int) -> bool:
    """Whether a signal has stopped a process, where the system tells."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "T"
    return False


def _begin() -> None:
    """Leave Ctrl-C to the parent, and end with it however it ends."""
    collect_rarely()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
