"""The cameras of a run in real time, as streams that begin with the first viewer.

The run's process holds the listening socket. A child process that draws and serves starts with the
first viewer, so that pictures cost nothing without viewers and never delay the run.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable

from typing_extensions import override

from dva_sim.cameras.children import END_SOON, PAINTED, PipedChild
from dva_sim.cameras.lines import FrameLine, PictureLine, contained_line, scene_line
from dva_sim.cameras.screens import FilmedRun, OwnScreens, camera_url
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.realtime import LiveClock
from dva_sim.serving.listening import listen
from dva_sim.serving.processes import end_all

MODULE = "dva_sim.cameras"
FLUSH = 0.02  # interval between two attempts to write waiting data [s]
AGAIN_AFTER = 5.0  # pause after a failed process before another one starts [s]


class CameraService:
    """Serves the pictures of a run's robots.

    Args:
        host: Address to listen on.
        port: Port; if it is taken, or 0, any free one.
        clock: Clock of the run.
        tell: Callback that adds a line to the story of the run.

    Attributes:
        base: URL below which the cameras are.

    Raises:
        ConfigError: the host is not this machine.
    """

    def __init__(
        self, host: str, port: int, clock: LiveClock, tell: Callable[[str], object]
    ) -> None:
        try:
            self._listener = listen(host, port)
        except ConfigError:
            self._listener = listen(host, 0)
        self._clock = clock
        self._tell = tell
        self._host = host
        host_text = f"[{host}]" if ":" in host else host
        self.base = f"http://{host_text}:{self._listener.getsockname()[1]}/"
        self._run: FilmedRun | None = None
        self._labels: list[str] = []
        self._child: PipedChild | None = None
        self._numbers = _Numbers()
        self._contained: set[int] = set()

    def url(self, label: str, _: str) -> str:
        """Return the URL of a robot's pictures, by its label."""
        return camera_url(self.base, label)

    def film(self, run: FilmedRun, seed: int) -> None:
        """Serve the cameras of a run from now on."""
        self._run = run
        self._seed = seed
        self._labels = [robot.device.label for robot in run.field.robots.values()]
        for id_tag in run.field.robots:
            self._numbers[id_tag]  # assigns a number: robots first, in the order of their labels
        self._screens = OwnScreens(run, "", self._numbers, self._show)
        self._clock.every(1.0 / run.scenario.camera.rate_hz, self._look)
        self._await_viewers()

    def _await_viewers(self) -> None:
        self._clock.watch(self._listener.fileno(), self._begin)
        self._tell(f"shows pictures of the robots at {camera_url(self.base, 'LABEL')}")

    def _begin(self) -> None:
        """Start the child process, which accepts the first viewer."""
        self._clock.unwatch(self._listener.fileno())
        words = ["--listen-fd", str(self._listener.fileno()), "--host", self._host]
        words += ["--labels", json.dumps(self._labels)]
        child = self._child = PipedChild(
            "the camera process", MODULE, words, [self._listener], PAINTED
        )
        self._clock.watch(child.pipe.fileno(), self._hear)
        self._greet(child)
        self._clock.every(FLUSH, lambda: self._flush(child))

    def _greet(self, child: PipedChild) -> None:
        """Send the scene, which the process needs before the first picture."""
        assert self._run is not None
        scenario = self._run.scenario.model_dump(mode="json")
        child.pipe.put(scene_line(scenario, self._seed))
        self._contained.clear()

    def _watch(self, numbers: list[int]) -> None:
        """Set the watched robots, by number."""
        assert self._run is not None
        ids = list(self._run.field.robots)
        self._screens.watch({ids[n] for n in numbers if 0 <= n < len(ids)})

    def _flush(self, child: PipedChild) -> bool:
        child.pipe.flush()
        return child is self._child

    def _hear(self) -> None:
        """Handle the child's lines; after its end, wait for another viewer."""
        assert self._child is not None
        pipe = self._child.pipe
        for line in pipe.lines():
            if "watch" in line:
                self._watch(line["watch"])
        if not pipe.is_open:
            self._clock.unwatch(pipe.fileno())
            self._watch([])
            self._tell(f"shows no pictures for {AGAIN_AFTER:g} s: {self._child.why()}")
            self._end()
            self._clock.call_after(AGAIN_AFTER, self._wait_again)

    def _wait_again(self) -> None:
        self._clock.watch(self._listener.fileno(), self._begin)

    def _look(self) -> None:
        """Take the pictures of the watched robots."""
        if self._child is None or not self._screens.watched:
            return
        assert self._run is not None
        for number, when in self._run.field.contained.items():
            if number not in self._contained:
                self._contained.add(number)
                self._child.pipe.put(contained_line(number, when))
        self._screens.look()

    def _show(self, line: FrameLine, robot: int) -> None:
        if self._child is not None:
            self._child.pipe.put(line, robot)

    def _end(self) -> None:
        child = self._child
        self._child = None
        if child is not None:
            end_all([child], END_SOON)

    def close(self) -> None:
        """End all streams."""
        if self._child is not None:
            self._clock.unwatch(self._child.pipe.fileno())
        else:
            self._clock.unwatch(self._listener.fileno())
        self._end()
        self._listener.close()


class PictureService(CameraService):
    """Serves the pictures of a real camera, unchanged."""

    def serve(self, label: str) -> None:
        """Serve the camera of one robot from now on."""
        self._labels = [label]
        self._number = 0
        self._is_watched = False
        self._await_viewers()

    def show(self, jpeg: bytes) -> None:
        """Pass a picture to the viewers; without viewers it goes nowhere."""
        self._number += 1
        if self._child is not None and self._is_watched:
            now = round(1000 * self._clock.now)
            line: PictureLine = {
                "k": "picture",
                "t": now,
                "robot": 0,
                "number": self._number,
                "captured_ms": now,
                "jpeg": base64.b64encode(jpeg).decode(),
            }
            self._child.pipe.put(line, 0)

    @override
    def _greet(self, child: PipedChild) -> None:
        child.pipe.put({"k": "ready", "t": 0})

    @override
    def _watch(self, numbers: list[int]) -> None:
        self._is_watched = bool(numbers)


class _Numbers(dict[str, int]):
    """Numbers of the people and robots in pictures, assigned at first use."""

    def __missing__(self, name: str) -> int:
        self[name] = number = len(self)
        return number
