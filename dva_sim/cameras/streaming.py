"""A response that ends when its viewer leaves or is too slow."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing, suppress

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from dva_sim.cameras.streams import BOUNDARY
from dva_sim.serving.connection import wire_of

STALLED = 5.0  # time within which a viewer must take a picture [s]


class PictureStream(Response):
    """Pictures of a robot, one after the other.

    Args:
        parts: Pictures, as parts of a multipart response.
        leave: Callback once the viewer is gone.
    """

    media_type = f"multipart/x-mixed-replace; boundary={BOUNDARY}"

    def __init__(self, parts: AsyncGenerator[bytes, None], leave: Callable[[], object]) -> None:
        super().__init__(headers={"Cache-Control": "no-store", "Connection": "close"})
        del self.headers["content-length"]
        self._parts = parts
        self._leave = leave

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send until the viewer leaves, or is cut."""
        wire = wire_of(scope)
        tasks: list[asyncio.Task[None]] = []
        try:
            wire.take_one_by_one()
            await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
            for work in (self._send(send), _left(receive)):
                tasks.append(asyncio.ensure_future(work))
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self._leave()
            if wire.waiting:
                wire.cut()

    async def _send(self, send: Send) -> None:
        with suppress(OSError, TimeoutError):
            async with aclosing(self._parts) as parts:
                async for part in parts:
                    message = {"type": "http.response.body", "body": part, "more_body": True}
                    async with asyncio.timeout(STALLED):
                        await send(message)
            async with asyncio.timeout(STALLED):
                await send({"type": "http.response.body", "body": b""})


async def _left(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
