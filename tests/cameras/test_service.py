"""The cameras of a run in real time, looked at by programs that know nothing of ours."""

import http.client
import io
import os
import re
import signal
import socket
from collections.abc import Callable, Iterator, Mapping
from threading import Thread

import pytest
from helpers.processes.patience import PATIENCE_S
from helpers.wording import unnamed
from PIL import Image

from dva_sim.agents.observation import Cameras
from dva_sim.cameras import service as cameras
from dva_sim.cameras.screens import topic_of
from dva_sim.cameras.service import CameraService
from dva_sim.cameras.streams import MAX_VIEWERS
from dva_sim.kernel.recorder import Recorder
from dva_sim.live.parts import WorldPart
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.options.runs import LiveOptions
from dva_sim.protocol import messages as m
from dva_sim.serving.pipes import MAX_WAITING
from dva_sim.simulation.full.stage import DVA, Stage, id_of
from dva_sim.simulation.scenario import build, load

pytestmark = pytest.mark.system

ROBOT = id_of("robot", 1)


class LiveWorld:
    """The world of a live run, and what programs on this machine see of its cameras."""

    def __init__(self, port: int = 0) -> None:
        self.clock, self.reports = LiveClock(), list[str]()
        self.network = SocketNetwork(self.clock)
        self.service = CameraService("127.0.0.1", port, self.clock, self.reports.append)
        scenario = build(load("fire-drill"), {})
        join = lambda kind, number: self.network.join(id_of(kind, number))  # noqa: E731
        shown = Cameras(self.service.url, topic_of)
        stage = Stage(scenario, 1, self.network, Recorder(), join, cameras=shown)
        self.network.introduce(DVA, "127.0.0.1:9")
        part = WorldPart(stage, LiveOptions("fire-drill"))
        part.film(self.service)
        self.robots = part._field.robots
        self.port = int(self.service.base.split(":")[2].strip("/"))

    @property
    def process(self) -> int:
        """The process that draws; 0: there is none."""
        child = self.service._child
        return 0 if child is None else child.pid

    def let(self, work: Callable[[], object]) -> None:
        """Let time pass until some work in a thread is done."""
        problems = list[BaseException]()

        def do() -> None:
            try:
                work()
            except BaseException as error:
                problems.append(error)

        thread = Thread(target=do, daemon=True)
        thread.start()
        self.until(lambda: not thread.is_alive())
        if problems:
            raise problems[0]

    def until(self, condition: Callable[[], object]) -> None:
        def look() -> bool:
            if condition():
                self.clock.stop()
            return not condition()

        self.clock.every(0.02, look)
        self.clock.run(self.clock.now + PATIENCE_S)
        assert condition()

    def asked(self, path: str, headers: Mapping[str, str] | None = None) -> tuple[int, bytes]:
        """The answer to a request that ends."""
        answers = list[tuple[int, bytes]]()

        def ask() -> None:
            connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
            connection.request("GET", path, headers=headers or {})
            answer = connection.getresponse()
            answers.append((answer.status, answer.read()))
            connection.close()

        self.let(ask)
        return answers[0]

    def close(self) -> None:
        self.service.close()
        self.network.close()


@pytest.fixture(scope="module")
def world() -> Iterator[LiveWorld]:
    """One for all tests that leave it as it was: each process that draws takes seconds to begin."""
    live = LiveWorld()
    yield live
    live.close()


def pictures(port: int, path: str, count: int) -> list[tuple[dict[str, str], bytes]]:
    """Headers and bodies of the first parts of a stream, as any player reads it."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    connection.request("GET", path)
    answer = connection.getresponse()
    kind = answer.getheader("Content-Type") or ""
    boundary = re.fullmatch(r"multipart/x-mixed-replace; boundary=(\S+)", kind)
    assert answer.status == 200
    assert boundary is not None
    found = list[tuple[dict[str, str], bytes]]()
    while len(found) < count:
        assert answer.readline().strip() == f"--{boundary[1]}".encode()
        headers = dict[str, str]()
        while line := answer.readline().strip():
            name, _, value = line.decode().partition(": ")
            headers[name] = value
        found.append((headers, answer.read(int(headers["Content-Length"]))))
        assert answer.readline() == b"\r\n"
    answer.close()
    connection.close()
    return found


def test_the_url_that_a_robot_tells_is_a_stream_that_any_player_shows(world):
    reported = world.robots[ROBOT].controller.camera_url
    assert reported == f"http://127.0.0.1:{world.port}/camera/robot-1.mjpg"
    assert m.SensorInfo(reported, ()).camera_url == reported
    (line,) = world.reports
    assert unnamed(line, f"http://127.0.0.1:{world.port}/camera/LABEL.mjpg") == []
    seen = list[tuple[dict[str, str], bytes]]()
    world.let(lambda: seen.extend(pictures(world.port, "/camera/robot-1.mjpg", 3)))
    for headers, data in seen:
        assert headers["Content-Type"] == "image/jpeg"
        with Image.open(io.BytesIO(data)) as picture:
            assert picture.size == (320, 240)
            assert len(picture.getcolors(1 << 17) or ()) > 50  # more than one grey field
    numbers = [int(headers["X-Frame-Number"]) for headers, _ in seen]
    assert numbers == sorted(set(numbers))


def test_a_single_picture_and_what_there_is_not(world):
    status, data = world.asked("/camera/robot-2.jpg")
    assert status == 200
    assert data.startswith(b"\xff\xd8")
    status, data = world.asked("/camera/robot-9.jpg")
    assert status == 404
    assert unnamed(data.decode(), "robot-1", "robot-2") == []
    assert world.asked("/")[0] == 404
    assert world.asked("/camera/..%2f..%2fetc/passwd.jpg")[0] == 404


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Origin": "https://evil.example"}, 403),
        ({"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"}, 403),
        ({"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}, 200),
        ({"Sec-Fetch-Site": "same-origin"}, 200),
    ],
    ids=str,
)
def test_a_page_of_another_site_sees_no_pictures(world, headers, status):
    assert world.asked("/camera/robot-1.jpg", headers)[0] == status


def test_more_viewers_than_there_is_room_for_are_refused(world):
    viewers = [socket.create_connection(("127.0.0.1", world.port)) for _ in range(MAX_VIEWERS)]

    def look() -> None:
        for viewer in viewers:
            viewer.settimeout(PATIENCE_S)
            viewer.sendall(b"GET /camera/robot-1.mjpg HTTP/1.1\r\nHost: localhost\r\n\r\n")
        for viewer in viewers:
            assert viewer.recv(100).startswith(b"HTTP/1.1 200")

    try:
        world.let(look)
        status, data = world.asked("/camera/robot-1.mjpg")
        assert (status, unnamed(data.decode(), MAX_VIEWERS)) == (503, [])
    finally:
        for viewer in viewers:
            viewer.close()
    while world.asked("/camera/robot-1.jpg")[0] != 200:
        pass


def test_the_world_waits_for_nobody_who_draws(world):
    """The process is stopped and reads nothing while hundreds of frames are sent to it."""
    world.let(lambda: pictures(world.port, "/camera/robot-1.mjpg", 1))
    os.kill(world.process, signal.SIGSTOP)
    try:
        pipe = world.service._child.pipe  # type: ignore[union-attr]
        world.service._screens.watch({ROBOT})
        for _ in range(5000):
            world.service._look()
        assert len(pipe.outbox) <= MAX_WAITING
        ticks = list[float]()
        world.clock.every(0.02, lambda: ticks.append(world.clock.now))
        world.until(lambda: len(ticks) > 20)
    finally:
        os.kill(world.process, signal.SIGCONT)


def test_a_process_is_there_while_somebody_looks_and_replaced_when_it_was_killed(monkeypatch):
    monkeypatch.setattr(cameras, "AGAIN_AFTER", 0.05)
    world, taken = LiveWorld(), list[float]()
    robot = world.robots[ROBOT]
    observe = robot.observe
    robot.observe = lambda: (taken.append(world.clock.now), observe())[1]  # type: ignore
    world.clock.run(world.clock.now + 0.5)
    assert world.process == 0
    assert not taken

    world.let(lambda: pictures(world.port, "/camera/robot-1.mjpg", 1))
    assert taken
    first = world.process
    world.until(lambda: not world.service._screens.watched)
    before = len(taken)
    world.clock.run(world.clock.now + 0.5)
    assert len(taken) == before

    os.kill(first, signal.SIGKILL)
    world.until(lambda: world.process == 0)
    assert unnamed(world.reports[-1], "0.05 s", "killed") == []
    world.let(lambda: pictures(world.port, "/camera/robot-1.mjpg", 1))
    second = world.process
    assert second not in (0, first)

    world.close()
    with pytest.raises(ProcessLookupError):
        os.kill(second, 0)


def test_a_port_that_is_taken_is_replaced_by_a_free_one():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        world = LiveWorld(port)
        assert world.port not in (0, port)
        world.close()


def test_who_runs_with_keys_shows_no_pictures_unless_asked_to(tmp_path):
    assert LiveOptions("fire-drill").shows_pictures
    assert not LiveOptions("fire-drill", keys=tmp_path).shows_pictures
    assert LiveOptions("fire-drill", keys=tmp_path, camera_port=0).shows_pictures
