"""An end whose library is asynchronous: its event loop runs while the end serves."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import suppress
from typing import Any, Final, TypeVar

from typing_extensions import override

from dva_sim.network.middleware.ends import TransportEnd, TransportError

T = TypeVar("T")
_FAREWELL: Final = 0.5  # time for the last messages to leave [s]
_AGAIN: Final = 0.1  # interval between two attempts to connect [s]


class LoopEnd(TransportEnd):
    """Runs coroutines in the thread that serves it."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._tasks: set[asyncio.Task[Any]] = set()

    def run(self, awaited: Awaitable[T]) -> T:
        """Wait for a result; everything that was begun goes on meanwhile."""

        async def wait() -> T:
            return await awaited

        return self._loop.run_until_complete(wait())

    def reach(self, connect: Callable[[], Awaitable[T]], ready_by: float) -> T:
        """Try to connect until the other end is there.

        Raises:
            TransportError: it is not by `ready_by`, by `time.monotonic` [s].
        """

        async def tried() -> T:
            while True:
                try:
                    return await connect()
                except OSError:
                    await asyncio.sleep(_AGAIN)

        try:
            return self.run(asyncio.wait_for(tried(), ready_by - time.monotonic()))
        except TimeoutError:
            raise TransportError("the robot does not answer") from None

    def begin(self, work: Coroutine[Any, Any, object]) -> None:
        """Let something go on while this end serves; its failure is that of the connection."""
        task = self._loop.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._ended)

    def soon(self, act: Callable[..., object], *arguments: object) -> None:
        """Call something as soon as the loop runs, for a library that looks for a running one."""
        self._loop.call_soon(act, *arguments)

    def _ended(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()  # seen: what was sent over a connection that broke is lost

    @override
    def serve(self, until: float) -> None:
        self._loop.run_until_complete(asyncio.sleep(max(0.0, until - time.monotonic())))

    @override
    def close(self) -> None:
        while tasks := asyncio.all_tasks(self._loop):  # what is cancelled may begin something
            for task in tasks:
                task.cancel()
            self._loop.run_until_complete(asyncio.wait(tasks))
        self._loop.close()

    def finish(self, last: Awaitable[object]) -> None:
        """Wait a moment for a last exchange with the other end, which may have gone."""
        with suppress(OSError, TimeoutError):
            self.run(asyncio.wait_for(last, _FAREWELL))
