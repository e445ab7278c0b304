"""The process that draws and serves the pictures of a run: `python -m dva_sim.cameras --fd N ...`.

It ends when its socket to the run closes. Drawing has its own thread; serving runs in the main one.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import signal
import socket
import sys
import threading
from collections.abc import Sequence
from functools import partial

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from dva_sim.cameras.painting import NICENESS, run
from dva_sim.cameras.streaming import PictureStream
from dva_sim.cameras.streams import MAX_VIEWERS, CameraStreams, headers_of
from dva_sim.serving.admission import Admission, own_names
from dva_sim.serving.pipes import PipeEnd, WatchedEnd
from dva_sim.serving.port_guard import CLIENT, PortGuard
from dva_sim.serving.port_listener import fitting_places
from dva_sim.serving.server import Server, serve

MAX_REQUEST = 16 * 1024  # maximum size of a request with its path and headers [B]
REPEATED = 1.0  # interval at which the watched robots are repeated [s]
NOT_KEPT = {"Cache-Control": "no-store"}


class CameraPages:
    """The HTTP handlers of streams and single pictures.

    Args:
        streams: Source of the pictures.
        labels: Labels of the robots, in the order of their numbers.
    """

    def __init__(self, streams: CameraStreams, labels: Sequence[str]) -> None:
        self._streams = streams
        self._numbers = {label: number for number, label in enumerate(labels)}

    async def stream(self, request: Request) -> Response:
        """`GET /camera/LABEL.mjpg`."""
        robot = self._robot(request)
        if request.method == "HEAD":
            return Response(headers=NOT_KEPT, media_type=PictureStream.media_type)
        viewer = self._streams.admit(robot, CLIENT)
        if viewer is None:
            raise HTTPException(503, f"all {MAX_VIEWERS} places for viewers are taken")
        return PictureStream(self._streams.stream(viewer), partial(self._streams.leave, viewer))

    async def still(self, request: Request) -> Response:
        """`GET /camera/LABEL.jpg`."""
        robot = self._robot(request)
        viewer = self._streams.admit(robot, CLIENT)
        picture = None if viewer is None else await self._streams.one(viewer)
        if picture is None:
            raise HTTPException(503, "no picture")
        headers = headers_of(picture) | NOT_KEPT
        return Response(picture.jpeg, headers=headers, media_type="image/jpeg")

    def _robot(self, request: Request) -> int:
        number = self._numbers.get(request.path_params["label"])
        if number is None:
            raise HTTPException(
                404, f"there is no such robot; there are: {', '.join(self._numbers)}"
            )
        return number


async def _refused(_: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    headers = dict(error.headers or {}) | NOT_KEPT
    return PlainTextResponse(f"{error.detail}\n", error.status_code, headers=headers)


async def _serve(world: int, listener: socket.socket, host: str, labels: Sequence[str]) -> None:
    loop = asyncio.get_running_loop()
    ended = asyncio.Event()
    painter, ours = socket.socketpair()

    def watch(robots: list[int], _: bool) -> None:
        """Send the watched robots to the run and to the drawing thread."""
        for end in (to_world, pictures):
            end.offer(json.dumps({"watch": robots}).encode() + b"\n")

    streams = CameraStreams(watch)
    to_world = PipeEnd(os.dup(world))
    pictures = WatchedEnd(loop, ours.detach(), streams.take)
    streams.begin()

    def draw() -> None:
        try:
            run(PipeEnd(world), PipeEnd(painter.detach()))
        finally:
            loop.call_soon_threadsafe(ended.set)

    async def say_again() -> None:
        while True:
            streams.tell(again=True)
            await asyncio.sleep(REPEATED)

    threading.Thread(target=draw, daemon=True).start()
    saying = asyncio.ensure_future(say_again())
    pages = CameraPages(streams, labels)
    routes = [
        Route("/camera/{label:path}.mjpg", pages.stream),
        Route("/camera/{label:path}.jpg", pages.still),
    ]
    app = Starlette(routes=routes, exception_handlers={HTTPException: _refused})
    closing = asyncio.ensure_future(_close_when(ended, streams))
    # Pictures have no token: all devices may see them, and get their address from the DVA.
    guarded = PortGuard(app, Admission(own_names(host, any_port=True)))
    server = Server.of(guarded, MAX_REQUEST, ws="none")
    await serve(server, listener, fitting_places(1), ended)
    for task in (saying, closing):
        task.cancel()
    pictures.close()


async def _close_when(ended: asyncio.Event, streams: CameraStreams) -> None:
    await ended.wait()
    streams.close()


def main(words: Sequence[str] | None = None) -> int:
    """Draw and serve until the run has ended."""
    parser = argparse.ArgumentParser(prog="dva_sim.cameras", description=__doc__)
    parser.add_argument("--fd", type=int, required=True, help="socket to the run")
    parser.add_argument("--listen-fd", type=int, required=True, help="listening socket")
    parser.add_argument("--host", required=True, help="host that it listens on")
    parser.add_argument("--labels", type=json.loads, required=True, help="of the robots, as JSON")
    options = parser.parse_args(words)
    # Ctrl-C may reach all processes, but the run decides when to end.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(NICENESS)
    listener = socket.socket(fileno=options.listen_fd)
    listener.setblocking(False)
    asyncio.run(_serve(options.fd, listener, options.host, options.labels))
    return 0


if __name__ == "__main__":
    sys.exit(main())
