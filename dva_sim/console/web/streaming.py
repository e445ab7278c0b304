"""A response that goes on until its viewer leaves, or takes nothing for too long."""

from __future__ import annotations

import asyncio
from contextlib import aclosing, suppress

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from dva_sim.console.web.camera import BOUNDARY, CameraStreams

STALLED = 20.0  # a viewer that takes nothing for so long is gone [s]


class PictureStream(Response):
    """Pictures of a robot, one after the other.

    Args:
        cameras: All pictures.
        robot: Whose.
    """

    media_type = f"multipart/x-mixed-replace; boundary={BOUNDARY}"

    def __init__(self, cameras: CameraStreams, robot: int) -> None:
        super().__init__(headers={"Cache-Control": "no-store"})
        del self.headers["content-length"]
        self._cameras, self._robot = cameras, robot

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send until the viewer leaves."""
        start = {"type": "http.response.start", "status": 200, "headers": self.raw_headers}
        await send(start)
        if scope["method"] == "HEAD":
            await send({"type": "http.response.body"})
            return
        tasks = [asyncio.ensure_future(self._send(send)), asyncio.ensure_future(_left(receive))]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _send(self, send: Send) -> None:
        with suppress(OSError, TimeoutError):
            async with aclosing(self._cameras.stream(self._robot)) as parts:
                async for part in parts:
                    message = {"type": "http.response.body", "body": part, "more_body": True}
                    async with asyncio.timeout(STALLED):
                        await send(message)
            await send({"type": "http.response.body", "body": b""})


async def _left(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
