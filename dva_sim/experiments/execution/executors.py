"""Workers in this process or in processes of this machine; a cluster has its own module.

They give executors of `concurrent.futures`; who hands out runs knows nothing else of them.
"""

from __future__ import annotations

import os
import pickle
import signal
import socket
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, ParamSpec, Self, TypeVar

from typing_extensions import override

from dva_sim.experiments.execution import worker_program
from dva_sim.kernel.early_stop import STOPS
from dva_sim.kernel.errors import ConfigError, DvaSimError, RunsFailed
from dva_sim.kernel.rare_collection import collect_rarely
from dva_sim.serving.processes import Child, end_all


class WorkerDied(RunsFailed):
    """A worker process ended while it was at work."""

    def __init__(self) -> None:
        super().__init__(
            "a worker process was killed, or out of memory; what is finished is kept: run the "
            "same command again"
        )


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
            # A process inherits what is blocked: Ctrl-C is for this one alone.
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                self._process = Child(
                    "the worker process",
                    # -P: a file beside this one is not taken for a module of Python.
                    [sys.executable, "-P", worker_program.__file__, str(number)],
                    self._hang_up,
                    keeps_errors=False,  # what a plug-in prints is for the user
                    pass_fds=(number,),
                    start_new_session=False,  # Ctrl-Z stops all that is at work
                )
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
        self._file.write(pickle.dumps(sys.path))

    def call(self, task: Callable[[], Any]) -> Any:
        """Run a task in a worker; the task and its result are pickled.

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


P = ParamSpec("P")
R = TypeVar("R")


class WorkersLost(RunsFailed):
    """Error: no worker is left; finished runs are kept."""


class Workers(ABC):
    """Interface of everything that makes runs.

    Attributes:
        is_here: True if runs are made in this process, one by one.
        deaths: Exceptions raised by a future whose worker has died.
    """

    is_here = False
    deaths: tuple[type[Exception], ...] = ()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:  # noqa: B027
        """Let the workers go; nothing has to be done."""

    @property
    @abstractmethod
    def width(self) -> int:
        """Workers."""

    @abstractmethod
    def executor(self, width: int, task: Callable[..., Any]) -> AbstractContextManager[Executor]:
        """Return workers that are gone, or have nothing more to do, when the block ends.

        Args:
            width: Number of workers.
            task: Task that they will run, so that they can prepare for it.
        """

    def guarded(self, task: Callable[P, R]) -> Callable[P, R]:
        """Return the task as it should be handed out."""
        return task

    def look_after(self, is_idle: bool) -> None:  # noqa: B027
        """Look after the workers, now and then; nothing has to be done.

        Args:
            is_idle: True if no result has come for some seconds.

        Raises:
            WorkersLost: nobody is left.
        """


def local(processes: int | None) -> Workers:
    """Return processes of this machine; with one, everything happens in this process.

    Raises:
        ConfigError: less than one.
    """
    width = cores() if processes is None else processes
    if width < 1:
        raise ConfigError(f"number of processes should be at least 1, not {width}")
    return LocalProcesses(width) if width > 1 else ThisProcess()


def cores() -> int:
    """Return the number of CPU cores available to this process."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class ThisProcess(Workers):
    """This process."""

    width = 1
    is_here = True

    @contextmanager
    def executor(self, width: int, task: Callable[..., Any]) -> Iterator[Executor]:
        """Yield an executor whose `submit` runs the task before it returns."""
        yield _AtOnce()


class _AtOnce(Executor):
    def submit(self, fn: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> Future[R]:
        future: Future[R] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


class LocalProcesses(Workers):
    """Processes of this machine."""

    width = 0  # each has its own
    deaths = (WorkerDied,)

    def __init__(self, width: int) -> None:
        self.width = width
        self._all: set[WorkerProcess] = set()
        self._idle: list[WorkerProcess] = []
        self._stopped: set[WorkerProcess] = set()
        self._is_over = False

    @contextmanager
    def executor(self, width: int, task: Callable[..., Any]) -> Iterator[Executor]:
        """Yield threads that each wait for a process; an error in the block ends these at once.

        Raises:
            ConfigError: the task is defined in the script that was started.
        """
        defined = getattr(task, "func", task)  # of a partial
        if defined.__module__ == "__main__":
            raise ConfigError(
                f"other processes know nothing of a script, so not its {defined.__qualname__} "
                "either: put that into a module of its own, or use one process (jobs=1)"
            )
        pool = _Handing(self._do, min(width, self.width))
        with _ctrl_c_held_back(self._kill) as self._let_through:
            try:
                yield pool
            except BaseException:
                self._kill()
                raise
            finally:
                pool.shutdown(wait=True, cancel_futures=True)

    def _do(self, task: Callable[[], R]) -> R:
        """Have a task done by a process that is idle, or by a new one.

        Raises:
            WorkerDied: the process did not live to answer.
            DvaSimError: no more processes can be started.
        """
        process = self._idle.pop() if self._idle else self._started()
        try:
            answer: R = process.call(task)
        except BaseException:
            process.kill()
            process.close()
            raise
        self._idle.append(process)
        return answer

    def _started(self) -> WorkerProcess:
        try:
            process = WorkerProcess()
        except OSError as error:
            raise DvaSimError(
                f"no further process can be started: {error.strerror}; give fewer --jobs"
            ) from None
        self._all.add(process)
        if self._is_over:
            process.kill()
        process.call(collect_rarely)
        return process

    def _kill(self) -> None:
        self._is_over = True
        for process in list(self._all):
            process.kill()

    @override
    def close(self) -> None:
        for process in self._all:
            process.close()

    @override
    def look_after(self, is_idle: bool) -> None:
        """End a process that has been stopped for some time; another one takes its task.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed.
        """
        self._let_through()
        stopped = {each for each in list(self._all) if is_idle and each.is_stopped}
        for process in stopped & self._stopped:
            process.kill()
        self._stopped = stopped


class _Handing(ThreadPoolExecutor):
    """Threads that pass tasks on to workers."""

    def __init__(self, do: Callable[[Callable[[], Any]], Any], width: int) -> None:
        super().__init__(width, "worker")
        self._do = do

    @override
    def submit(self, fn: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> Future[R]:
        return super().submit(self._do, partial(fn, *args, **kwargs))


@contextmanager
def _ctrl_c_held_back(at_once: Callable[[], object]) -> Iterator[Callable[[], None]]:
    """Hold Ctrl-C and SIGTERM back until the block lets them through, or ends.

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
    raising = [n for n in STOPS if signal.getsignal(n) is signal.default_int_handler]
    held_back = raising if is_main else []
    for number in held_back:
        signal.signal(number, press)
    try:
        yield let_through
    finally:
        for number in held_back:
            signal.signal(number, signal.default_int_handler)
        let_through()  # also if workers that it has ended have raised an error
