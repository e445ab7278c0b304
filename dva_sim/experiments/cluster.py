"""An existing dask.distributed cluster as a place for runs.

The scheduler itself gives the chunks of a worker that died to the others. Workers may differ from
this machine in nothing that a run's numbers depend on; each says so before its first run.

References:
    M. Rocklin, "Dask: Parallel Computation with Blocked algorithms and Task Scheduling",
    Proceedings of the 14th Python in Science Conference, 2015.
"""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from functools import cache, partial
from types import TracebackType
from typing import Any, ParamSpec, TypeVar

from dva_sim.errors import ConfigError, DvaSimError
from dva_sim.experiments.manifest import versions

P = ParamSpec("P")
R = TypeVar("R")

_ADDRESS = r"(tcp|tls|ucx|ws|wss)://.+:\d+"
_CONNECT_S = 10.0
_WORKERS_S = 60.0  # how long a cluster may be without any worker
_ONE_AT_A_TIME = threading.Lock()  # in a worker with several threads
_STATE = ("commit", "dirty")  # tells nothing of what a run gives; the fingerprint does
_GO_ON = "finished runs are kept; the same command goes on"

Versions = dict[str, Any]


class OtherProgram(DvaSimError):
    """A worker has another program, or other packages, than who sent the work."""


class Cluster:
    """The workers of a scheduler.

    Args:
        address: Of the scheduler, as in `tcp://10.0.0.1:8786`.

    Raises:
        ConfigError: dask.distributed is not installed, or nobody answers at the address.
    """

    is_here = False

    def __init__(self, address: str) -> None:
        self.address = address
        if not re.fullmatch(_ADDRESS, address):
            raise ConfigError(f"scheduler {address!r} should be like tcp://10.0.0.1:8786")
        try:
            from distributed import Client, KilledWorker
        except ImportError:
            raise ConfigError(
                "--scheduler needs dask.distributed, which is not installed: "
                "pip install 'dva-sim[cluster]'"
            ) from None
        self.deaths: tuple[type[Exception], ...] = (KilledWorker,)
        try:
            self._client = Client(address, timeout=_CONNECT_S, set_as_default=False)
        except (OSError, ImportError) as error:
            reason = str(error).splitlines()[0]
            raise ConfigError(f"no scheduler answers at {address}: {reason}") from None
        self._seen = time.monotonic()

    def __enter__(self) -> Cluster:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._client.close()

    @property
    def width(self) -> int:
        """Workers there are now; a process counts as one, however many threads it has."""
        return max(1, len(self._workers()))

    @contextmanager
    def executor(self, width: int, task: Callable[..., Any]) -> Iterator[Executor]:
        """The whole cluster, whatever the width; what it has not done is called off at the end."""
        executor = self._client.get_executor(pure=False)
        try:
            yield executor
        except (DvaSimError, KeyboardInterrupt, GeneratorExit):
            raise
        except CancelledError:
            raise DvaSimError(f"the scheduler at {self.address} is gone; {_GO_ON}") from None
        except Exception as error:
            raise DvaSimError(
                f"the cluster at {self.address} cannot run this program: {_line(error)}; its "
                "scheduler and workers need the same dva-sim as here"
            ) from error
        finally:
            executor.shutdown(wait=False)

    def guarded(self, task: Callable[P, R]) -> Callable[P, R]:
        """The task, refused by workers of another program."""
        return partial(_checked, task, versions())

    def look_after(self, is_idle: bool) -> None:
        """See whether anybody is left to work.

        Raises:
            DvaSimError: nobody is, and has not been for some time.
        """
        now = time.monotonic()
        if not is_idle or self._workers():
            self._seen = now
        elif self._client.status != "running":
            raise DvaSimError(f"the scheduler at {self.address} is gone; {_GO_ON}")
        elif now - self._seen > _WORKERS_S:
            raise DvaSimError(
                f"the scheduler at {self.address} has had no workers for {_WORKERS_S:g} s: "
                f"start some with 'dask worker {self.address} --nthreads 1' (one that lacks this "
                f"dva-sim leaves at once; its log says so); {_GO_ON}"
            )

    def _workers(self) -> dict[str, Any]:
        return dict(self._client.scheduler_info(n_workers=-1)["workers"])


def _checked(task: Callable[P, R], wanted: Versions, *args: P.args, **kwargs: P.kwargs) -> R:
    """Do the task on a worker, if it has the program wanted."""
    with _ONE_AT_A_TIME:
        if other := differences(wanted, _mine()):
            from distributed import get_worker

            raise OtherProgram(
                f"worker {get_worker().address} has {other}; install the same there, "
                "and start it again"
            )
        return task(*args, **kwargs)


def differences(wanted: Versions, found: Versions) -> str:
    """In what two programs differ; empty if their runs give the same."""
    names = [name for name in {**wanted, **found} if name not in _STATE]
    odd = [name for name in names if wanted.get(name) != found.get(name)]
    return ", ".join(f"{name} {found.get(name)} (here {wanted.get(name)})" for name in odd)


@cache
def _mine() -> Versions:
    """Of this process, as it was when it began: files that change later are not loaded again."""
    return versions()


def _line(error: Exception) -> str:
    cause = error.__cause__ or error
    return f"{type(cause).__name__}: {' '.join(str(cause).split())}"
