"""Pictures of robots elsewhere: motion JPEG is handed on, all else is refused in a line."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress

import pytest

from dva_sim.console.web import relay
from dva_sim.console.web.relay import NoPictures, open_camera

JPEG = b"\xff\xd8 with a thumbnail \xff\xd8...\xff\xd9 inside \xff\xd9"
HEAD = b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=cut\r\n"
PART = b"--cut\r\nContent-Type: image/jpeg\r\nX-Evil: <script>\r\n\r\n" + JPEG + b"\r\n"
PICTURES = HEAD + b"\r\n" + PART + PART + b"--cut\r\n"

Use = Callable[[str], Awaitable[object]]


def with_server(answer: bytes, use: Use, stays: bool = False) -> object:
    """Let a server answer each request so, and use its address."""

    async def answered(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(answer)
        await writer.drain()
        if stays:
            await reader.read()
        writer.close()
        with suppress(OSError):
            await writer.wait_closed()

    async def run() -> object:
        async with await asyncio.start_server(answered, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            return await use(f"http://127.0.0.1:{port}/camera/robot-1.mjpg?size=1")

    return asyncio.run(run())


async def pictures(url: str) -> list[bytes]:
    camera = await open_camera(url)
    return [part async for part in camera.pictures()]


async def refused(url: str) -> str:
    with pytest.raises(NoPictures) as problem:
        await open_camera(url)
    return str(problem.value)


def test_pictures_are_handed_on_whole_and_without_headers_of_the_other_server():
    parts = with_server(PICTURES, pictures)
    assert parts[0] == b"--dva-sim-frame\r\n"
    assert all(JPEG in part for part in parts[1:])
    assert len(parts) > 1
    assert not any(b"X-Evil" in part for part in parts)


@pytest.mark.parametrize(
    "answer",
    [
        b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n",
        b"HTTP/1.1 302 Found\r\nLocation: http://127.0.0.1/\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\n<script>alert(1)</script>",
        HEAD.replace(b"; boundary=cut", b"") + b"\r\n",
        b"SSH-2.0-OpenSSH\r\n\r\n",
        b"",
    ],
)
def test_what_is_no_camera_is_refused_in_a_line(answer):
    assert "127.0.0.1" in with_server(answer, refused)


@pytest.mark.parametrize(
    "url", ["", "zmq+tcp://a:1/x", "file:///etc/passwd", "https://a/b", "http://"]
)
def test_addresses_that_no_page_can_show_are_refused(url):
    assert repr(url) in asyncio.run(refused(url))


@pytest.mark.parametrize(
    "url", ["http://127.0.0.1:1/x", "http://127.0.0.1:99999/x", "http://[::1/x"]
)
def test_where_nobody_answers_that_is_told(url):
    assert asyncio.run(refused(url))


def test_a_camera_that_falls_silent_or_sends_without_end_is_over(monkeypatch):
    monkeypatch.setattr(relay, "SILENCE", 0.05)
    assert len(with_server(PICTURES, pictures, stays=True)) > 1
    monkeypatch.setattr(relay, "MAX_BYTES", 100)
    assert with_server(HEAD + b"\r\n--cut\r\n" + bytes(10_000), pictures, stays=True) == [
        b"--dva-sim-frame\r\n"
    ]
