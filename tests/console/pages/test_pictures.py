"""The process that draws: what was watched, what was true, and no more than there is time for."""

import io
import json
import socket
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from helpers.processes.patience import PATIENCE_S
from PIL import Image

from dva_sim.cameras.drawing import BEST, WORST, Encoder, Eyes
from dva_sim.cameras.frames import ALIVE, Picture, Unpacker
from dva_sim.cameras.painting import MIN_RATE, Painter
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.full.hazards import draw_incidents
from dva_sim.simulation.scenario import Scenario, site_of

SEED = 1
SCENARIO = Scenario.model_validate(
    {"events": [{"kind": "fire", "at_s": 5, "room": "Workshop"}], "horizon_s": 300}
)
FIRE = draw_incidents(SCENARIO.events, site_of(SCENARIO, SEED), Streams(SEED))[0]


def scene() -> dict[str, Any]:
    return {"k": "scene", "scenario": SCENARIO.model_dump(mode="json"), "seed": SEED}


def frame(number: int, captured: float, robot: int = 0, figures: Any = ()) -> dict[str, Any]:
    """A frame of a robot that stands two metres west of where the fire will be, and looks at it."""
    x, y = FIRE.hazard.position
    return {
        "k": "frame",
        "t": round(1000 * captured) + 40,
        "robot": robot,
        "number": number,
        "captured_ms": round(1000 * captured),
        "pose": [x - 2.0, y, 0.0],
        "figures": list(figures),
    }


@pytest.fixture(scope="module")
def eyes() -> Eyes:
    return Eyes(scene()["scenario"], SEED)


def seen(eyes: Eyes, line: dict[str, Any]) -> np.ndarray:
    picture = Image.open(io.BytesIO(eyes.jpeg(line)))
    assert (picture.format, picture.size) == ("JPEG", (320, 240))
    return np.asarray(picture, dtype=int)


def test_a_picture_shows_what_was_true_when_it_was_taken(eyes):
    before, after = seen(eyes, frame(1, 1.0)), seen(eyes, frame(2, 60.0))
    assert np.abs(after - before).mean() > 10  # the fire began at 5 s
    again = seen(eyes, frame(3, 1.0))
    assert np.abs(again - before).mean() < 1


def test_a_picture_shows_who_was_near(eyes):
    x, y = FIRE.hazard.position
    person = ["bystander", 7, x - 0.5, y, 3.1, "walking"]
    alone, with_person = seen(eyes, frame(1, 1.0)), seen(eyes, frame(2, 1.0, figures=[person]))
    assert np.abs(with_person - alone).mean() > 2


def test_a_fire_that_was_dealt_with_is_not_drawn_any_more():
    eyes = Eyes(scene()["scenario"], SEED)
    burning = seen(eyes, frame(1, 20.0))
    eyes.contain(0, 20.5)
    assert np.abs(seen(eyes, frame(2, 21.0)) - burning).mean() > 2
    assert np.abs(seen(eyes, frame(3, 20.0)) - burning).mean() < 1  # it was burning then


def test_a_picture_is_of_no_more_bytes_than_a_frame_if_it_can(eyes):
    noise = np.random.default_rng(1).integers(0, 255, (240, 320, 3), dtype=np.uint8)
    encoder = Encoder(40_000)
    assert len(encoder.encode(Image.fromarray(noise))) <= 40_000
    assert encoder.quality < BEST
    calm = Image.new("RGB", (320, 240))
    for _ in range(100):
        encoder.encode(calm)
    assert encoder.quality == BEST
    tiny = Encoder(100)
    assert len(tiny.encode(Image.fromarray(noise))) > 100  # as small as it gets
    assert tiny.quality == WORST


def painter(*watched: int) -> Painter:
    found = Painter()
    found.hear(scene())
    found.hear({"watch": list(watched)})
    return found


def test_only_who_is_watched_is_drawn():
    here = painter(1)
    here.hear(frame(1, 1.0, robot=0))
    assert here.draw(0.0) is None
    here.hear(frame(1, 1.0, robot=1))
    picture = here.draw(0.0)
    assert picture[:4] == (1, 1, 1000, 1040)
    here.hear(frame(2, 1.1, robot=1))
    here.hear({"watch": []})
    assert here.draw(9.0) is None


def test_of_frames_that_wait_the_newest_is_drawn_and_the_others_are_counted():
    here = painter(0)
    for number in range(5):
        here.hear(frame(number, 1.0))
    assert here.draw(0.0).number == 4
    assert here.draw(9.0) is None
    assert here.dropped == 4


def test_robots_have_their_turns_and_no_more_pictures_than_their_rate():
    here = painter(0, 1)
    drawn, now, step = [], 0.0, 0.01
    for number in range(100):  # a second of a run at twenty times its pace
        for robot in (0, 1):
            here.hear(frame(number, number / 5, robot))
        if picture := here.draw(now):
            drawn.append(picture.robot)
        now += step
    most = max(MIN_RATE, 1.25 * SCENARIO.camera.rate_hz) + 1
    assert 8 <= drawn.count(0) <= most
    assert abs(drawn.count(0) - drawn.count(1)) <= 1


class Drawing:
    """The process itself, between a run and a web process that are the test."""

    def __init__(self) -> None:
        self.world, theirs = socket.socketpair()
        self.web, self._web_end = socket.socketpair()
        for end in (self.world, self.web):
            end.settimeout(PATIENCE_S)
        self._theirs = theirs
        self._unpacker = Unpacker()
        self._found: list[Picture] = []
        self.process = self.start()

    def start(self) -> subprocess.Popen[bytes]:
        numbers = self._theirs.fileno(), self._web_end.fileno()
        words = ["--fd", str(numbers[0]), "--web-fd", str(numbers[1])]
        command = [sys.executable, "-m", "dva_sim.console.pages.pictures", *words]
        return subprocess.Popen(command, pass_fds=numbers, stderr=subprocess.PIPE)

    def say(self, *lines: dict[str, Any]) -> None:
        for line in lines:
            self.world.sendall(json.dumps(line).encode() + b"\n")

    def watch(self, *robots: int) -> None:
        self.web.sendall(json.dumps({"do": "watch", "watch": robots}).encode() + b"\n")

    def next(self) -> Picture:
        while True:
            while self._found:
                picture = self._found.pop(0)
                if picture.robot != ALIVE:
                    return picture
            self._found += self._unpacker.feed(self.web.recv(1 << 16))

    def alive(self) -> None:
        """Wait for a sign of life."""
        self._found.clear()
        while not any(picture.robot == ALIVE for picture in self._found):
            self._found += self._unpacker.feed(self.web.recv(1 << 16))

    def end(self) -> str:
        self.process.kill()
        _, errors = self.process.communicate()
        for end in (self.world, self.web, self._theirs, self._web_end):
            end.close()
        return errors.decode()


@pytest.fixture
def drawing():
    found = Drawing()
    yield found
    assert found.end() == ""


@pytest.mark.system
def test_one_that_was_killed_is_replaced_on_the_same_sockets_and_ends_with_the_run(drawing):
    for time in (1, 2):
        drawing.watch(0)
        drawing.say(scene())
        drawing.alive()
        drawing.say(frame(time, 1.0))
        picture = drawing.next()
        assert picture.number == time
        assert Image.open(io.BytesIO(picture.jpeg)).size == (320, 240)
        if time == 1:
            drawing.process.kill()
            drawing.process.communicate()
            drawing.process = drawing.start()
    drawing.world.shutdown(socket.SHUT_RDWR)
    assert drawing.process.wait(PATIENCE_S) == 0


@pytest.mark.system
def test_whoever_does_not_read_pictures_does_not_stop_it(drawing):
    drawing.watch(0)
    drawing.say(scene())
    drawing.alive()
    for number in range(400):  # as many as no socket holds
        drawing.say(frame(number, 1.0 + number / 10))
    drawing.world.shutdown(socket.SHUT_RDWR)
    assert drawing.process.wait(PATIENCE_S) == 0
