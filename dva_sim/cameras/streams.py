"""Streams of robots' pictures that any browser or player can show.

Each picture is drawn once for all viewers, and none without a viewer. A slow viewer gets
the newest picture whenever it is ready for one, and misses those between.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import AsyncGenerator, Callable, Iterable
from dataclasses import dataclass

from dva_sim.cameras.frames import ALIVE, Picture, Unpacker

BOUNDARY = "dva-sim-frame"
LINGERS = 1.0  # time for which a robot is still drawn after its last viewer left [s]
SILENCE = 3.0  # silence of the drawing process after which there is no picture [s]
STARTING = 60.0  # maximum wait for the drawing process to build the site [s]
ONE_WITHIN = 8.0  # maximum wait for a single picture [s]; links may be slow
FRESH_FOR_S = 1.0  # a picture younger than this is returned without waiting [s]
MAX_VIEWERS = 64


@dataclass(eq=False)
class Viewer:
    """A viewer of the pictures of a robot.

    Attributes:
        robot: Index of the robot.
        rank: Rank of the viewer's role; a viewer of a higher rank may take the place.
        is_over: True once the viewer has to leave, or has left.
    """

    robot: int
    rank: int
    is_over: bool = False


class CameraStreams:
    """The newest picture of each watched robot.

    Args:
        watch: Called with the numbers of the robots that are watched, and True if they changed.
        watched_elsewhere: Function that returns the robots watched by other means.

    Attributes:
        skipped: Pictures that viewers were too slow for.
    """

    def __init__(
        self,
        watch: Callable[[list[int], bool], object],
        watched_elsewhere: Callable[[], Iterable[int]] = tuple,
    ) -> None:
        self._watch = watch
        self._watched_elsewhere = watched_elsewhere
        self._unpacker = Unpacker()
        self._newest: dict[int, tuple[Picture, float]] = {}
        self._has_changed = asyncio.Condition()
        self._viewers: dict[Viewer, None] = {}  # in the order of admission
        self._lingering: Counter[int] = Counter()
        self._last_sent: frozenset[int] = frozenset()
        self._deadline = 0.0
        self._notified: set[asyncio.Task[None]] = set()
        self._is_over = False
        self.skipped = 0

    def begin(self) -> None:
        """Wait for a painter, which reports once it has built the site."""
        self._deadline = time.monotonic() + STARTING

    @property
    def draws(self) -> bool:
        """True while a painter reports."""
        return not self._is_over and time.monotonic() < self._deadline

    # --- incoming pictures ---------------------------------------------------------------

    def take(self, data: bytes) -> None:
        """Take bytes that the painter has written."""
        now = time.monotonic()
        self._deadline = max(self._deadline, now + SILENCE)
        for picture in self._unpacker.feed(data):
            if picture.robot != ALIVE:
                self._newest[picture.robot] = picture, now
        self._wake()

    def _wake(self) -> None:
        task = asyncio.ensure_future(self._notify())
        self._notified.add(task)
        task.add_done_callback(self._notified.discard)

    async def _notify(self) -> None:
        async with self._has_changed:
            self._has_changed.notify_all()

    # --- viewers -------------------------------------------------------------------------

    def tell(self, again: bool = False) -> None:
        """Report the robots that are watched, if they have changed."""
        looked_at = {viewer.robot for viewer in self._viewers}
        robots = frozenset(looked_at | self._lingering.keys()) | frozenset(
            self._watched_elsewhere()
        )
        new = robots != self._last_sent
        self._last_sent = robots
        if new or (again and robots):
            self._watch(sorted(robots), new)

    def admit(self, robot: int, rank: int) -> Viewer | None:
        """Return a new viewer; None if there are too many of the same or a higher rank.

        If there are too many, one of a lower rank has to leave.
        """
        if len(self._viewers) >= MAX_VIEWERS:
            least = min(self._viewers, key=lambda viewer: viewer.rank)
            if least.rank >= rank:
                return None
            least.is_over = True
            self.leave(least)
            self._wake()
        viewer = Viewer(robot, rank)
        self._viewers[viewer] = None
        self.tell()
        return viewer

    def leave(self, viewer: Viewer) -> None:
        """Remove a viewer; the robot is drawn a little longer. May be repeated."""
        if viewer in self._viewers:
            del self._viewers[viewer]
            self._lingering[viewer.robot] += 1
            asyncio.get_running_loop().call_later(LINGERS, self._linger_no_more, viewer.robot)

    def _linger_no_more(self, robot: int) -> None:
        self._lingering[robot] -= 1
        self._lingering = +self._lingering
        if robot not in self._lingering and all(v.robot != robot for v in self._viewers):
            self._newest.pop(robot, None)
        self.tell()

    # --- outgoing pictures ---------------------------------------------------------------

    async def stream(self, viewer: Viewer) -> AsyncGenerator[bytes, None]:
        """Yield pictures as parts of a response, each newer than the one before."""
        try:
            yield f"--{BOUNDARY}\r\n".encode()
            last: Picture | None = None
            while (picture := await self._after(viewer, last)) is not None:
                if last is not None and picture.number > last.number + 1:
                    self.skipped += picture.number - last.number - 1
                last = picture
                yield part(picture)
        finally:
            self.leave(viewer)

    async def one(self, viewer: Viewer) -> Picture | None:
        """Return the newest picture; None if none arrives within `ONE_WITHIN`."""
        try:
            newest = self._newest.get(viewer.robot)
            if newest is not None and time.monotonic() - newest[1] < FRESH_FOR_S:
                return newest[0]
            async with asyncio.timeout(ONE_WITHIN if self.draws else 0.0):
                return await self._after(viewer, newest[0] if newest else None)
        except TimeoutError:
            return None
        finally:
            self.leave(viewer)

    async def _after(self, viewer: Viewer, shown: Picture | None) -> Picture | None:
        """Wait for a picture other than `shown`; return None if there will be no more."""
        robot = viewer.robot

        def is_new() -> bool:
            return robot in self._newest and self._newest[robot][0] is not shown

        def is_over() -> bool:
            return self._is_over or viewer.is_over

        async with self._has_changed:
            await self._has_changed.wait_for(lambda: is_over() or is_new())
        return None if is_over() else self._newest[robot][0]

    def close(self) -> None:
        """End all streams, and take no more pictures."""
        self._is_over = True
        self._wake()


def part(picture: Picture) -> bytes:
    """Return a picture as a part of a multipart response, followed by the boundary.

    A player shows a picture once it is complete, which the next boundary tells at once.
    """
    head = "".join(f"{name}: {value}\r\n" for name, value in headers_of(picture).items())
    head += f"Content-Type: image/jpeg\r\nContent-Length: {len(picture.jpeg)}\r\n\r\n"
    return head.encode() + picture.jpeg + f"\r\n--{BOUNDARY}\r\n".encode()


def headers_of(picture: Picture) -> dict[str, str]:
    """Return the HTTP headers of a picture: its number and its times in virtual time [ms]."""
    return {
        "X-Frame-Number": str(picture.number),
        "X-Frame-Time-Ms": str(picture.captured_ms),
        "X-Arrived-Ms": str(picture.arrived_ms),
    }
