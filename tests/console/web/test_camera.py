"""Camera pictures over HTTP: streams for browsers and players, drawn only while somebody looks."""

import http.client
import io
import json
import select
import socket
import time
from contextlib import suppress
from http.client import HTTPMessage
from threading import Thread

import pytest
from helpers.console.served_console import Served, serving
from helpers.processes.patience import PATIENCE_S, becomes
from PIL import Image

from dva_sim.cameras.frames import Picture, pack

pytestmark = pytest.mark.system


def jpeg(shade: int, size: int = 0) -> bytes:
    """A picture of one shade, filled up to a number of bytes."""
    file = io.BytesIO()
    Image.new("RGB", (64, 48), (shade, shade, shade)).save(file, "JPEG", quality=90)
    data = file.getvalue()
    # What fills it stands in a comment of the format, so that it is a picture still.
    parts = []
    while size > 0:
        length = min(size, 60_000)
        parts.append(b"\xff\xfe" + (length + 2).to_bytes(2, "big") + b"." * length)
        size -= length
    return data[:2] + b"".join(parts) + data[2:]


@pytest.fixture(scope="module")
def console():
    with serving() as served:
        yield served


@pytest.fixture(autouse=True)
def somebody_draws(console):
    """Announce a renderer before each test; it is silent between tests."""
    ready(console)


def ready(served: Served) -> None:
    """Wait until it is known that somebody draws."""

    def looked() -> int:
        served.live()
        return served.ask("/camera/robot-1.mjpg", "HEAD", token=served.look).status

    assert becomes(lambda: looked() == 200)


class Viewer:
    """Somebody who looks at a stream, part by part."""

    def __init__(
        self, served: Served, label: str = "robot-1", small: bool = False, token: str = ""
    ) -> None:
        self.raw = socket.socket()
        self.raw.settimeout(PATIENCE_S)
        if small:
            self.raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.raw.connect(("127.0.0.1", served.port))
        path = f"/camera/{label}.mjpg?token={token or served.look}"
        self.raw.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        self.stream = http.client.HTTPResponse(self.raw, method="GET")
        self.stream.begin()

    def part(self) -> tuple[HTTPMessage, bytes]:
        """The next picture and what it says about itself."""
        assert self.stream.readline() == b"--dva-sim-frame\r\n"
        headers = http.client.parse_headers(self.stream)
        picture = self.stream.read(int(headers["Content-Length"]))
        assert self.stream.readline() == b"\r\n"
        return headers, picture

    def ended(self, wait: bool = True) -> bool:
        """True if the server has closed the connection, after any data."""
        try:
            if wait:
                while self.raw.recv(1 << 16):
                    pass
                return True
            ready = select.poll()
            ready.register(self.raw, select.POLLHUP | select.POLLERR)
            return bool(ready.poll(0))
        except ConnectionResetError:
            return True

    def close(self) -> None:
        with suppress(OSError):
            self.raw.shutdown(socket.SHUT_RDWR)
        self.stream.close()
        self.raw.close()


def watched(served: Served) -> list[int]:
    """Robots that the renderer is asked to draw next."""
    assert select.select([served.pictures], [], [], PATIENCE_S)[0]
    lines = served.pictures.recv(1 << 16).splitlines()
    return list(json.loads(lines[-1])["watch"])


def test_a_stream_is_parts_that_say_when_they_were_taken(console):
    viewer = Viewer(console)
    assert viewer.stream.status == 200
    wanted = {"content-type": "multipart/x-mixed-replace; boundary=dva-sim-frame"}
    wanted |= {"cache-control": "no-store", "referrer-policy": "no-referrer"}
    assert {name: viewer.stream.headers[name] for name in wanted} == wanted
    assert console.next_asked("watch")["robots"] == [0]
    for n in range(3):
        console.show(0, n, jpeg(n), captured=1000 + n)
        headers, picture = viewer.part()
        assert picture == jpeg(n)
        assert headers["X-Frame-Number"] == str(n)
        assert headers["X-Frame-Time-Ms"] == str(1000 + n)
        assert headers["X-Arrived-Ms"] == str(1050 + n)
        assert headers["Content-Type"] == "image/jpeg"
    viewer.close()
    assert console.next_asked("watch")["robots"] == []


def test_nobody_is_drawn_until_somebody_looks_and_once_for_all(console):
    console.asked_so_far()
    viewers = [Viewer(console, "robot-2") for _ in range(3)]
    assert console.next_asked("watch")["robots"] == [1]
    assert watched(console) == [1]
    console.show(1, 5, jpeg(5))
    assert [viewer.part()[1] for viewer in viewers] == [jpeg(5)] * 3
    for viewer in viewers[1:]:
        viewer.close()
    console.show(1, 6, jpeg(6))
    assert viewers[0].part()[1] == jpeg(6)
    assert [line for line in console.asked_so_far() if line["do"] == "watch"] == []
    viewers[0].close()
    assert console.next_asked("watch")["robots"] == []


def test_pages_say_themselves_what_they_look_at(console):
    page = console.page(console.look)
    page.ws.send(json.dumps({"do": "watch", "robots": ["robot-2", 0]}))
    assert console.next_asked("watch")["robots"] == [0, 1]
    page.close()
    assert console.next_asked("watch")["robots"] == []


def test_a_slow_viewer_skips_pictures_and_delays_nobody(console):
    slow, quick = Viewer(console, small=True), Viewer(console)
    console.show(0, 0, jpeg(0))
    assert slow.part()[1] == quick.part()[1] == jpeg(0)
    count = 60
    for n in range(1, count):
        console.show(0, n, jpeg(n, 100_000))
        assert quick.part()[0]["X-Frame-Number"] == str(n)
    numbers = []
    while not numbers or numbers[-1] != count - 1:
        numbers.append(int(slow.part()[0]["X-Frame-Number"]))
    assert numbers == sorted(numbers)
    assert len(numbers) < count / 2
    slow.close(), quick.close()


def test_one_picture_waits_for_one_that_is_drawn_now(console):
    found = []
    path = f"/camera/%3Cscript%3Ealert(1)%3C%2Fscript%3E.jpg?token={console.look}"
    thread = Thread(target=lambda: found.append(console.ask(path)))
    thread.start()
    while 2 not in console.next_asked("watch")["robots"]:
        pass
    console.show(2, 9, jpeg(9))
    thread.join(PATIENCE_S)
    (answer,) = found
    assert (answer.status, answer.body) == (200, jpeg(9))
    assert answer.headers["content-type"] == "image/jpeg"
    assert answer.headers["x-frame-number"] == "9"


def test_a_picture_in_pieces_is_shown_when_it_is_whole(console):
    viewer = Viewer(console, "robot-4")
    while 3 not in console.next_asked("watch")["robots"]:
        pass
    data = pack(Picture(3, 77, 1, 2, jpeg(7)))
    for byte in data:
        console.pictures.sendall(bytes([byte]))
    assert viewer.part()[1] == jpeg(7)
    viewer.close()


def test_while_nobody_draws_there_is_no_picture_and_pages_are_told():
    with serving() as served:
        page = served.page()
        ready(served)
        served.pictures.close()
        line = page.next("pictures")
        while line["ok"]:
            line = page.next("pictures")
        assert "no picture" in line["text"]
        for kind in ("jpg", "mjpg"):
            answer = served.ask(f"/camera/robot-1.{kind}", token=served.look)
            assert answer.status == 503
            assert "no picture" in answer.json["text"]
        assert served.ask("/healthz").status == 200
        page.close()


def test_who_draws_may_break_off_and_begin_again(console):
    viewer = Viewer(console, "robot-5")
    console.show(4, 1, jpeg(1))
    assert viewer.part()[1] == jpeg(1)
    console.pictures.sendall(pack(Picture(4, 2, 0, 0, jpeg(2)))[:400])
    console.live()
    console.show(4, 3, jpeg(3))
    assert viewer.part()[0]["X-Frame-Number"] == "3"
    viewer.close()


def test_a_stream_ends_with_the_console_and_without_a_word():
    served = Served()
    ready(served)
    viewer = Viewer(served)
    served.show(0, 1, jpeg(1))
    viewer.part()
    assert served.stop() == ""
    assert served.process.returncode == 0
    viewer.close()


def test_a_question_about_the_stream_is_answered_without_it(console):
    answer = console.ask("/camera/robot-1.mjpg", "HEAD", token=console.look)
    assert answer.status == 200
    assert answer.headers["content-type"].startswith("multipart/x-mixed-replace")


def test_64_viewers_keep_out_their_like_and_not_a_higher_role(console):
    console.asked_so_far()
    viewers = [Viewer(console, "robot-4") for _ in range(64)]
    path = "/camera/robot-4.mjpg"
    assert console.ask(path, token=console.look).status == 503
    late = Viewer(console, "robot-4", token=console.drive)
    assert late.stream.status == 200
    console.show(3, 1, jpeg(1))
    assert late.part()[1] == jpeg(1)
    assert viewers[0].ended()
    assert viewers[1].part()[1] == jpeg(1)
    for viewer in (late, *viewers):
        viewer.close()
    while console.next_asked("watch")["robots"] != []:
        pass


def test_a_viewer_that_does_not_take_its_pictures_is_cut(console):
    stuck = Viewer(console, "robot-5", small=True)
    quick = Viewer(console, "robot-5")
    number, ends = 0, time.monotonic() + PATIENCE_S
    while not stuck.ended(wait=False) and time.monotonic() < ends:
        number += 1
        console.show(4, number, jpeg(number % 200, 200_000))
        assert quick.part()[0]["X-Frame-Number"] == str(number)
        time.sleep(0.05)
    assert time.monotonic() < ends
    stuck.close(), quick.close()
