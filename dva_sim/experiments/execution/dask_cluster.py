"""An existing dask.distributed cluster as the workers of a study.

The scheduler itself gives the chunks of a worker that died to the others. Workers may differ from
this machine in nothing that a run's numbers depend on; each says so before its first run. A worker
does its tasks in threads, which nothing can end: it makes runs in a process of its own, as this
machine does, where a run that takes too long is ended and one that crashes takes no worker along.

References:
    M. Rocklin, "Dask: Parallel Computation with Blocked algorithms and Task Scheduling",
    Proceedings of the 14th Python in Science Conference, 2015.
"""

from __future__ import annotations

import asyncio
import logging
import re
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Any, ParamSpec, TypeVar

from typing_extensions import override

from dva_sim.experiments.execution.executors import (
    WorkerDied,
    WorkerProcess,
    Workers,
    WorkersLost,
    local,
)
from dva_sim.experiments.results.manifest import versions
from dva_sim.kernel.errors import ConfigError, DvaSimError

P = ParamSpec("P")
R = TypeVar("R")

_ADDRESS = r"(tcp|tls|ucx|ws|wss)://.+:\d+"
_CONNECT_S = 10.0
_WORKERS_S = 60.0  # how long a cluster may be without any worker
_ONE_AT_A_TIME = threading.Lock()  # in a worker with several threads
_processes: list[WorkerProcess] = []  # at most one: the one in which a worker makes its runs
_STATE = ("commit", "dirty")  # tells nothing of what a run gives; the fingerprint does
_NOISY = ("distributed", "distributed.client", "tornado", "tornado.application", "asyncio")

Versions = dict[str, Any]


class OtherProgram(DvaSimError):
    """A worker has another program, or other packages, than who sent the work."""


class DaskCluster(Workers):
    """The workers of a scheduler.

    Args:
        address: Address of the scheduler, as in `tcp://10.0.0.1:8786`.

    Raises:
        ConfigError: dask.distributed is not installed, or nobody answers at the address.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        if not re.fullmatch(_ADDRESS, address):
            raise ConfigError(f"scheduler {address!r} should be like tcp://10.0.0.1:8786")
        try:
            from distributed import Client, KilledWorker
        except ImportError:
            raise ConfigError(
                "--scheduler needs dask.distributed, which is not installed: "
                "pip install -e '.[cluster]'"
            ) from None
        self.deaths = (KilledWorker, WorkerDied)
        self._open = ExitStack()
        with self._open:
            self._open.enter_context(_quiet())
            _knock(address)
            self._client = Client(address, timeout=_CONNECT_S, set_as_default=False)
            self._open.callback(self._client.close)
            self._open = self._open.pop_all()
        self._seen = time.monotonic()

    @override
    def close(self) -> None:
        self._open.close()

    @property
    def width(self) -> int:
        """Workers there are now; a process counts as one, however many threads it has."""
        return max(1, len(self._workers() or ()))

    def wait_for(self, workers: int) -> None:
        """Wait until the cluster has this number of workers.

        Raises:
            ConfigError: it has fewer after ten seconds.
        """
        try:
            self._client.wait_for_workers(workers, timeout=_CONNECT_S)
        except TimeoutError:
            raise ConfigError(
                f"the scheduler at {self.address} has {self.width} workers; {workers} are needed"
            ) from None

    @contextmanager
    def executor(self, width: int, task: Callable[..., Any]) -> Iterator[Executor]:
        """Yield the whole cluster, whatever the width.

        What it has not done is called off at the end.
        """
        executor = self._client.get_executor(pure=False)
        try:
            yield executor
        except (DvaSimError, KeyboardInterrupt, GeneratorExit):
            raise
        except Exception as error:
            if isinstance(error, CancelledError) or not self._is_connected():
                raise WorkersLost(f"the scheduler at {self.address} is gone") from None
            cause = error.__cause__ or error
            text = f"{type(cause).__name__}: {' '.join(str(cause).split())}"
            raise DvaSimError(
                f"the cluster at {self.address} cannot run this program: {text}; its "
                "scheduler and workers need the same dva-sim as here"
            ) from error
        finally:
            executor.shutdown(wait=False)

    def guarded(self, task: Callable[P, R]) -> Callable[P, R]:
        """Return a task that workers with other versions of the program refuse."""
        return partial(_checked, task, versions())

    def look_after(self, is_idle: bool) -> None:
        """See whether anybody is left to work.

        Raises:
            WorkersLost: nobody is, and has not been for some time.
        """
        now = time.monotonic()
        workers = self._workers() if is_idle else None
        if workers or not is_idle:
            self._seen = now
        elif not self._is_connected():
            raise WorkersLost(f"the scheduler at {self.address} is gone")
        elif now - self._seen > _WORKERS_S:
            raise WorkersLost(f"the scheduler at {self.address} {self._lacking(workers)}")

    def _lacking(self, workers: dict[str, Any] | None) -> str:
        if workers is None:
            return f"has not answered for {_WORKERS_S:g} s"
        return (
            f"has had no workers for {_WORKERS_S:g} s: start some with 'dask worker "
            f"{self.address} --nthreads 1' (one that lacks this dva-sim leaves at once; its log "
            "says so)"
        )

    def _workers(self) -> dict[str, Any] | None:
        """Return those there are; None if the scheduler does not say."""
        if not self._is_connected():
            return None
        ask = self._client.scheduler.identity
        try:
            return dict(
                self._client.sync(ask, n_workers=-1, callback_timeout=_CONNECT_S)["workers"]
            )
        except OSError:  # a lost connection, or the time is over
            return None

    def _is_connected(self) -> bool:
        """Return True if connected or reconnecting."""
        return self._client.status in ("running", "connecting")


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the library's log; one line at the end of the block says the same."""
    loggers = [logging.getLogger(name) for name in _NOISY]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _knock(address: str) -> None:
    """See whether a scheduler is at home, whatever else may listen there.

    Raises:
        ConfigError: none is.
    """
    with ThreadPoolExecutor(1) as thread:  # a notebook has a loop of its own in this one
        try:
            kind = thread.submit(asyncio.run, _kind_at(address)).result()
        except OSError as error:
            reason = " ".join(str(error).split()) or f"nothing within {_CONNECT_S:g} s"
        except Exception:  # whatever another program's answer may be taken for
            reason = "what listens there is something else"
        else:
            reason = "" if kind == "Scheduler" else f"it is a {kind}"
    if reason:
        raise ConfigError(f"no scheduler answers at {address}: {reason}")


def workers_at(scheduler: str | None, jobs: int | None) -> Workers:
    """Return the workers of a scheduler, or processes of this machine.

    Raises:
        ConfigError: both are given, there are less than one, or no scheduler answers.
    """
    if scheduler is None:
        return local(jobs)
    if jobs is not None:
        raise ConfigError("give the number of processes or a scheduler, not both")
    return DaskCluster(scheduler)


async def _kind_at(address: str) -> str:
    from distributed.core import rpc

    async with asyncio.timeout(_CONNECT_S), rpc(address) as server:
        return str((await server.identity())["type"])


def _checked(task: Callable[P, R], ours: Versions, *args: P.args, **kwargs: P.kwargs) -> R:
    """Do the task on a worker, if it has the program wanted."""
    with _ONE_AT_A_TIME:
        if mismatch := differences(ours, versions()):
            from distributed import get_worker

            raise OtherProgram(
                f"worker {get_worker().address} has {mismatch}; install the same there, "
                "and start it again"
            )
        if not _processes:
            _processes.append(WorkerProcess())
        try:
            result: R = _processes[0].call(partial(task, *args, **kwargs))
        except BaseException:
            process = _processes.pop()
            process.kill()
            process.close()
            raise
        return result


def differences(ours: Versions, theirs: Versions) -> str:
    """Return in what two programs differ; empty if their runs give the same."""
    names = [name for name in {**ours, **theirs} if name not in _STATE]
    odd = [name for name in names if ours.get(name) != theirs.get(name)]
    return ", ".join(f"{name} {theirs.get(name)} (here {ours.get(name)})" for name in odd)
