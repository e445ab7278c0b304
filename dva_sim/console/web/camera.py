"""Robots' cameras for viewers of a console; the world learns which of them are watched."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterable

from dva_sim.cameras.streams import CameraStreams
from dva_sim.console.web.simulation import Simulation
from dva_sim.serving.pipes import WatchedEnd

REPEATED = 1.0  # so often is said again who is watched [s]


class ConsoleCameras(CameraStreams):
    """The newest picture of each robot that is looked at.

    Args:
        simulation: Simulation, which gets the list of watched robots.
        watched_elsewhere: Robots watched by pages that say so.
    """

    def __init__(
        self, simulation: Simulation, watched_elsewhere: Callable[[], Iterable[int]]
    ) -> None:
        super().__init__(self._say_watched, watched_elsewhere)
        self._simulation = simulation
        self._pipe: WatchedEnd | None = None
        self._ok = True

    def open(self, number: int) -> None:
        """Use the pipe of that number; the end of who draws shows by silence."""
        self._pipe = WatchedEnd(asyncio.get_running_loop(), number, self.take)
        self.begin()

    @property
    def draws(self) -> bool:
        """True while a painter reports."""
        return self._pipe is not None and self._pipe.is_open and super().draws

    def _say_watched(self, robots: list[int], is_new: bool) -> None:
        if is_new:
            self._simulation.send({"do": "watch", "robots": robots})
        if self._pipe is not None:
            self._pipe.offer(json.dumps({"watch": robots}).encode() + b"\n")

    async def keep_telling(self) -> None:
        """Repeat which robot is watched: the renderer may have restarted."""
        while True:
            self.tell(again=True)
            if self.draws != self._ok:
                self._ok = self.draws
                text = "" if self._ok else "no picture: nobody draws"
                line = {"k": "pictures", "ok": self._ok, "text": text}
                self._simulation.changed(self._simulation.state.take(line), line)
            await asyncio.sleep(REPEATED)

    def close(self) -> None:
        """Take no more pictures, and end all streams."""
        if self._pipe is not None:
            self._pipe.close()
        super().close()
