"""Connections that ask for nothing keep nobody out: an emergency stop and a page get through."""

import json
import socket
import ssl
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

import pytest
from helpers.console.served_console import serving_phones
from helpers.paths import TESTS
from helpers.processes.patience import PATIENCE_S, becomes
from websockets.sync.client import connect

FLOODING = TESTS / "helpers/console/connection_flood.py"
COUNT = 700  # more than there are places


@pytest.fixture(scope="module")
def console(tmp_path_factory):
    with serving_phones(tmp_path_factory.mktemp("certificates")) as served:
        yield served


@contextmanager
def flooded(port, *words):
    """So many connections, and a new one for each that is cut."""
    command = [sys.executable, str(FLOODING), "127.0.0.1", str(port), str(COUNT), *words]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL) as process:
        try:
            assert process.stdout.readline() == b"open\n"
            yield
        finally:
            process.stdin.close()
            process.wait(PATIENCE_S)


def until_let_in(ask, *words):
    """Return the answer to a client that asks again when it is cut."""
    ends = time.monotonic() + PATIENCE_S
    while True:
        try:
            return ask(*words)
        except OSError:
            if time.monotonic() > ends:
                raise


@pytest.mark.system
@pytest.mark.parametrize("tls", [False, True], ids=["the console's port", "the phones' port"])
def test_under_a_flood_of_connections_a_stop_and_a_page_get_through(console, tls):
    port, scheme = (console.phones_port, "wss") if tls else (console.port, "ws")
    context = ssl._create_unverified_context() if tls else None
    more = {"ssl": context} if tls else {}
    headers = {"Authorization": f"Bearer {console.drive}"}

    def page():
        return connect(f"{scheme}://127.0.0.1:{port}/ws/state", additional_headers=headers, **more)

    with page() as before, flooded(port, *(["--tls"] if tls else [])):
        for _ in range(3):
            words = ("/api/emergency", "POST", {}, console.drive, None, context)
            answer, _ = console.answering("emergency", until_let_in, console.ask, *words)
            assert (answer.status, answer.json["ok"]) == (200, True)
        with until_let_in(page) as late:
            assert json.loads(late.recv(PATIENCE_S))["k"] == "you"
        console.say({"k": "story", "t": 1, "who": "a", "what": "b", "kind": "event"})
        while json.loads(before.recv(PATIENCE_S))["k"] != "story":
            pass  # a page that was open stays open


@pytest.mark.system
def test_a_silent_connection_is_cut_within_seconds_and_a_slow_request_too(console):
    silent = socket.create_connection(("127.0.0.1", console.port), PATIENCE_S)
    slow = socket.create_connection(("127.0.0.1", console.port), PATIENCE_S)
    slow.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX-Slow: ")
    for raw in (silent, slow):
        with suppress(ConnectionResetError):
            assert raw.recv(100) == b""
        raw.close()


@pytest.mark.system
def test_a_body_that_does_not_come_is_not_waited_for_forever(console):
    with socket.create_connection(("127.0.0.1", console.port), PATIENCE_S) as raw:
        raw.sendall(
            f"POST /api/actions HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            f"Content-Length: 100\r\nAuthorization: Bearer {console.drive}\r\n\r\n".encode()
        )
        assert raw.recv(100).split()[1] == b"408"


@pytest.mark.system
def test_requests_that_make_no_sense_after_their_answer_fill_no_pipe_and_stop_nothing(console):
    """Each of them was a traceback on standard error, which nobody reads until the end."""
    for _ in range(80):
        with socket.create_connection(("127.0.0.1", console.port), PATIENCE_S) as raw:
            raw.sendall(
                b"POST /api/actions HTTP/1.1\r\nHost: localhost\r\n"
                b"Transfer-Encoding: chunked\r\n\r\n"
            )
            assert raw.recv(4096).split()[1] == b"401"
            with suppress(OSError):
                raw.sendall(b"zz\r\n")
                while raw.recv(4096):
                    pass
    assert console.ask("/").status == 401


@pytest.mark.system
def test_pictures_are_streamed_over_https_and_a_viewer_that_leaves_is_no_mistake(console):
    port = console.phones_port
    console.live()
    plain = socket.create_connection(("127.0.0.1", port), PATIENCE_S)
    with ssl._create_unverified_context().wrap_socket(plain) as raw:
        raw.sendall(
            f"GET /camera/robot-1.mjpg HTTP/1.1\r\nHost: localhost\r\n"
            f"Authorization: Bearer {console.drive}\r\n\r\n".encode()
        )
        assert raw.recv(4096).split()[1] == b"200"
        found = b""
        for number in range(1, 4):
            console.show(0, number, b"\xff\xd8picture %d\xff\xd9" % number)
            while b"picture %d" % number not in found:
                found += raw.recv(4096)
    assert becomes(lambda: console.next_asked("watch")["robots"] == [])
