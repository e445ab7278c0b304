"""The web process over real sockets: what it lets in, and that nobody delays anybody."""

import json
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from helpers.console.served_console import HOSTILE, Served, places, scene, seat, serving
from helpers.processes.patience import PATIENCE_S, becomes
from helpers.wording import unnamed
from websockets.exceptions import ConnectionClosed, InvalidStatus

from dva_sim.console.web.clients import MAX_CLIENTS

HEADERS = {
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "cross-origin-resource-policy": "same-origin",
}


@pytest.fixture(scope="module")
def console():
    with serving() as served:
        yield served


@pytest.fixture(scope="module")
def free():
    with serving("--no-token") as served:
        yield served


def closed(ws):
    """The code with which a WebSocket is closed, once all before it is read."""
    try:
        while True:
            ws.recv(PATIENCE_S)
    except ConnectionClosed as error:
        return error.rcvd.code if error.rcvd else None


# --- who is let in ------------------------------------------------------------------------


def test_it_says_first_where_it_is(console):
    base = f"http://127.0.0.1:{console.port}/"
    assert console.serving["base"] == base
    assert console.serving["drive"] == f"{base}?token={console.drive}"
    assert console.look != console.drive


@pytest.mark.parametrize(
    "path", ["/", "/static/app.js", "/api/state", "/camera/robot-1.jpg", "/no"]
)
def test_without_a_token_nothing_is_shown(console, path):
    for token in (None, "wrong", console.drive[:-1], console.drive + "x"):
        answer = console.ask(path, token=token)
        assert answer.status == 401
        assert b"token" in answer.body


def test_a_token_in_the_address_becomes_a_cookie_and_leaves_the_address(console):
    answer = console.ask(f"/?token={console.look}")
    assert (answer.status, answer.headers["location"]) == (303, "/")
    cookie = answer.headers["set-cookie"].split("; ")
    assert cookie[0] == f"dva_sim_{console.port}={console.look}"
    assert set(cookie[1:]) == {"HttpOnly", "SameSite=Strict", "Path=/"}
    assert console.ask("/", token=console.look).status == 200
    assert "set-cookie" not in console.ask("/?token=wrong").headers


def test_health_is_open_and_the_rest_is_not(console):
    answer = console.ask("/healthz")
    assert (answer.status, answer.json) == (200, {"status": "ok"})


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:80", "[::9]:1", "a b"])
def test_under_a_foreign_name_nothing_is_answered(console, host):
    for path in ("/healthz", "/", f"/?token={console.drive}", "/api/state"):
        answer = console.ask(path, token=console.drive, host=host)
        assert answer.status in (400, 421), path
        assert "set-cookie" not in answer.headers


def test_two_host_headers_are_none(free):
    with socket.create_connection(("127.0.0.1", free.port), PATIENCE_S) as raw:
        raw.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n")
        assert raw.recv(1000).split()[1] in (b"400", b"421")


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://localhost:1"])
def test_a_foreign_page_reaches_nothing(free, origin):
    """Not even where everybody may drive."""
    for path in ("/", "/api/state", "/camera/robot-1.jpg", "/static/app.js"):
        assert free.ask(path, Origin=origin).status == 403
    body = {"id": "x", "action": "emergency", "arguments": {}}
    assert free.ask("/api/actions", "POST", body, Origin=origin).status == 403
    assert free.ask("/api/emergency", "POST", {}, Origin=origin).status == 403
    for path in ("/ws/state", "/ws/drive"):
        with pytest.raises(InvalidStatus) as error:
            free.socket(path, origin=origin)
        assert error.value.response.status_code == 403
    assert free.acted() == []


def test_a_foreign_page_embeds_no_picture_where_browsers_say_who_asks(free):
    for site in ("cross-site", "same-site"):
        assert free.ask("/api/state", Sec_Fetch_Site=site, Sec_Fetch_Mode="no-cors").status == 403


def test_a_form_of_another_site_acts_on_nothing(free):
    """Forms cannot send JSON, whatever they claim about where they come from."""
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data"):
        assert free.ask("/api/emergency", "POST", b"{}", Content_Type=kind).status == 415


def test_a_websocket_needs_a_token_and_to_drive_the_right_one(console):
    for token in (None, "wrong"):
        with pytest.raises(InvalidStatus) as error:
            console.socket("/ws/state", token)
        assert error.value.response.status_code == 401
    page = console.page(console.look)
    assert page.you["role"] == "look"
    with pytest.raises(InvalidStatus) as error:
        console.socket(f"/ws/drive?key={page.key}", console.drive)
    assert error.value.response.status_code == 403
    with pytest.raises(InvalidStatus):
        console.socket("/ws/drive?key=c999", console.drive)
    page.close()


def test_who_looks_cannot_act(console):
    console.asked_so_far()
    body = {"id": "look-1", "action": "take", "arguments": {"robots": [0]}}
    assert console.ask("/api/actions", "POST", body, console.look).status == 403
    assert console.ask("/api/state", token=console.look).status == 200
    assert console.acted() == []


def test_every_answer_has_its_headers(console):
    own = {"token": console.drive}
    answers = [
        console.ask("/", **own),
        console.ask("/"),
        console.ask("/healthz"),
        console.ask("/healthz", host="evil.example"),
        console.ask("/api/state", **own),
        console.ask("/api/state", "DELETE", **own),
        console.ask("/nothing", **own),
        console.ask("/static/nothing.js", **own),
        console.ask(f"/?token={console.drive}"),
        console.ask("/api/actions", "POST", b"rubbish", console.drive),
        console.ask("/camera/nobody.jpg", **own),
    ]
    assert [a.status for a in answers] == [200, 401, 200, 421, 200, 405, 404, 404, 303, 400, 404]
    for answer in answers:
        assert {name: answer.headers.get(name) for name in HEADERS} == HEADERS
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert "cache-control" in answer.headers
        assert "server" not in answer.headers


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("js/store.js", "text/javascript; charset=utf-8"),
        ("palette.css", "text/css; charset=utf-8"),
        ("icon.svg", "image/svg+xml"),
    ],
)
def test_files_of_the_pages_are_asked_for_again_and_sent_once(console, name, kind):
    first = console.ask(f"/static/{name}", token=console.drive)
    assert (first.headers["content-type"], first.headers["cache-control"]) == (kind, "no-cache")
    again = console.ask(f"/static/{name}", token=console.drive, If_None_Match=first.headers["etag"])
    assert (again.status, again.body, again.headers["cache-control"]) == (304, b"", "no-cache")


# --- names and bodies ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "path",
    [
        "/static/../web/app.py",
        "/static/..%2fweb%2fapp.py",
        "/static/%2e%2e/%2e%2e/pyproject.toml",
        "/static//etc/passwd",
        "/static/..\\web\\app.py",
        "/static/%00",
        "/static/",
        "/camera/../healthz.jpg",
        "/camera/..%2f..%2fetc%2fpasswd.jpg",
        "/camera/%00.jpg",
        "/camera/robot-1%0d%0aSet-Cookie:x.mjpg",
        "/camera/.jpg",
        "/camera/robot-9.mjpg",
    ],
)
def test_no_name_is_a_path(console, path):
    answer = console.ask(path, token=console.drive)
    assert answer.status in (400, 404)
    assert b"import" not in answer.body
    assert b"root:" not in answer.body


def test_a_hostile_label_is_data(console):
    answer = console.ask("/api/state", token=console.look)
    assert answer.headers["content-type"] == "application/json"
    assert HOSTILE in [robot["label"] for robot in answer.json["robots"]]
    other = console.ask(f"/camera/{'%3Cscript%3Ealert(2)'}.jpg", token=console.look)
    assert other.status == 404
    assert b"script" not in other.body


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 400),
        (b"{", 400),
        (b"[]", 400),
        (b"\xff\xfe\x00", 400),
        (b'{"id":"a","action":"take","arguments":{"robots":NaN}}', 400),
        (b"[" * 16000, 400),
        ({"id": "a", "action": "fly", "arguments": {}}, 400),
        ({"id": "a", "action": "input", "arguments": {}}, 400),
        ({"id": "a", "action": "take", "arguments": {"robots": [77]}}, 400),
        ({"id": "", "action": "start", "arguments": {}}, 400),
        ({"action": "start", "arguments": {}}, 400),
        ({"id": "a", "action": "start", "arguments": []}, 400),
        ({"id": "a", "action": "start", "client": "c0-0"}, 403),
        ({"id": "a", "action": "start", "key": "c0-0"}, 403),
        ({"id": "a", "action": "start", "key": None}, 403),
        (b" " * 16385, 413),
    ],
)
def test_a_body_that_makes_no_sense_is_refused_and_nothing_is_asked(console, body, status):
    console.asked_so_far()
    answer = console.ask("/api/actions", "POST", body, console.drive)
    assert answer.status == status
    assert "\n" not in answer.json["text"]
    assert console.acted() == []


def test_a_body_without_end_is_cut_off(console):
    with socket.create_connection(("127.0.0.1", console.port), PATIENCE_S) as raw:
        raw.sendall(
            f"POST /api/actions HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            f"Transfer-Encoding: chunked\r\nAuthorization: Bearer {console.drive}\r\n\r\n".encode()
        )
        for _ in range(40):
            raw.sendall(b"400\r\n" + b" " * 1024 + b"\r\n")
            time.sleep(0)
        assert raw.recv(100).split()[1] == b"413"


def test_headers_without_end_are_refused(console):
    with socket.create_connection(("127.0.0.1", console.port), PATIENCE_S) as raw:
        raw.sendall(b"GET / HTTP/1.1\r\nX: " + b"a" * 40_000)
        assert raw.recv(100).split()[1] == b"400"


# --- acting -----------------------------------------------------------------------------------


def test_an_action_answers_when_the_simulation_has(console):
    arguments = {"robot": "robot-2", "name": "req-rep"}
    body = {"id": "rest-1", "action": "pattern", "arguments": arguments}
    words, refused = ("/api/actions", "POST", body, console.drive), {"ok": False, "text": "BUSY"}
    answer, asked = console.answering("pattern", console.ask, *words, **refused)
    by = {"client": "program-drive", "id": "program-drive/rest-1", "role": "drive"}
    assert asked == {"do": "pattern", "robot": 1, "name": "req-rep", **by}
    assert (answer.status, answer.json) == (200, {"id": "rest-1", **refused})


def test_without_an_answer_an_action_says_so(console):
    """A late answer is one that the web process gives itself."""
    words = ("/api/emergency", "POST", {}, console.drive)
    answer, _ = console.answering("emergency", console.ask, *words, ok=False, late=True)
    assert answer.status == 504


def test_an_action_over_the_driving_socket_and_its_seat(console):
    page = console.page()
    with page.driving() as drive:
        drive.send(json.dumps({"id": "d1", "do": "take", "robots": [0]}))
        asked = console.next_asked("take")
        assert (asked["client"], asked["id"]) == (page.client, f"{page.client}/d1")
        console.say({"k": "done", "t": 5, "id": asked["id"], "ok": True, "text": "taken"})
        console.say(seat(page.client, phase="held"))
        heard = [json.loads(drive.recv(PATIENCE_S)) for _ in range(2)]
        assert [line["k"] for line in heard] == ["done", "seat"]
        assert heard[0]["id"] == "d1"
        drive.send(json.dumps({"do": "input", "n": 1, "speed": 1, "turn": -0.5, "held": True}))
        assert console.next_asked("input")["turn"] == -0.5
        drive.send(json.dumps({"id": "d2", "do": "take", "robots": [99]}))
        refused = json.loads(drive.recv(PATIENCE_S))
        assert (refused["id"], refused["ok"]) == ("d2", False)
    assert console.next_asked("gone")["client"] == page.client
    page.close()


def test_a_page_that_is_killed_is_told_as_gone(console):
    page = console.page()
    drive = page.driving()
    drive.send(json.dumps({"id": "k1", "do": "start"}))
    assert console.next_asked("start")["client"] == page.client
    drive.socket.shutdown(socket.SHUT_RDWR)  # as if its process had been killed
    assert console.next_asked("gone")["client"] == page.client
    page.ws.socket.shutdown(socket.SHUT_RDWR)
    assert console.next_asked("gone")["client"] == page.client


def test_a_second_driving_socket_of_a_page_takes_over_from_rest(console):
    page = console.page()
    first = page.driving()
    second = page.driving()
    assert console.next_asked("gone")["client"] == page.client
    first.send(json.dumps({"id": "f1", "do": "start"}))
    second.send(json.dumps({"id": "s1", "do": "start"}))
    assert console.next_asked("start")["id"] == f"{page.client}/s1"
    second.close()
    page.close()


def test_a_page_that_says_it_goes_is_heard_as_its_last_request(console):
    page = console.page()
    console.asked_so_far()
    body = {"action": "gone", "key": page.key}
    assert console.ask("/api/actions", "POST", body, console.drive).status == 200
    assert console.next_asked("gone")["client"] == page.client
    page.close()


@pytest.mark.parametrize("path", ["/ws/state", "/ws/drive"])
@pytest.mark.parametrize(
    ("message", "code"),
    [
        ("rubbish", 1008),
        ("[]", 1008),
        ("{" * 9000, 1008),
        ("x" * 20_000, 1009),
        (b"\x00\xff", 1008),
    ],
)
def test_rubbish_closes_the_socket_and_nothing_else(console, path, message, code):
    page = console.page()
    ws = page.ws if path == "/ws/state" else page.driving()
    ws.send(message)
    assert closed(ws) == code
    if path == "/ws/drive":
        page.ws.send(json.dumps({"do": "ping", "at": 5}))
        assert page.next("pong")["at"] == 5
        page.close()
    assert console.ask("/healthz").status == 200


def test_text_that_is_no_text_closes_the_socket(console):
    with console.deaf("/ws/state", console.drive) as raw:
        raw.sendall(b"\x81\x82\x00\x00\x00\x00\xff\xfe")
        data = b""
        while piece := raw.recv(1 << 16):
            data += piece
    assert _closes(data) == 1007


def _closes(data: bytes) -> int | None:
    """The code of the last close frame in what came from a WebSocket."""
    at = data.rfind(b"\x88")
    while at >= 0:
        if at + 4 <= len(data) and at + 2 + data[at + 1] == len(data):
            return int.from_bytes(data[at + 2 : at + 4], "big")
        at = data.rfind(b"\x88", 0, at)
    return None


def test_a_flood_closes_its_socket_and_delays_nobody(console):
    other, page = console.page(), console.page()
    drive = page.driving()
    with suppress(ConnectionClosed):
        for n in range(20_000):
            drive.send(json.dumps({"do": "input", "n": n, "speed": 0, "turn": 0, "held": False}))
    assert closed(drive) in (1008, None)  # to who goes on sending, a reset may come first
    other.ws.send(json.dumps({"do": "ping", "at": 1}))
    assert other.next("pong")["at"] == 1
    other.close(), page.close()


# --- seeing -----------------------------------------------------------------------------------


def test_two_pages_agree_and_a_reload_sees_the_same(console):
    console.say(places(1000, [0, 100, 200, 0, 0]), {"k": "events", "t": 1000, "events": [{"n": 1}]})
    one = console.page()
    assert becomes(lambda: console.ask("/api/state", token=console.look).json["time_s"] == 1.0)
    two = console.page(console.look)
    again = console.page()
    snaps = [two.next("snap")["state"], again.next("snap")["state"]]
    assert snaps[0]["pos"] == snaps[1]["pos"] == [[0, 100, 200, 0, 0]]
    console.say(places(1100, [0, 110, 200, 0, 0]))
    for page in (one, two, again):
        while (line := page.next("d"))["t"] != 1100:
            pass
        assert line["p"] == [[0, 110, 200, 0, 0]]
        page.close()


def test_a_page_that_asks_again_gets_all_there_is(console):
    page = console.page()
    page.next("snap")
    page.ws.send(json.dumps({"do": "resync"}))
    assert page.next("snap")["scene"]["scenario"] == "test"
    page.close()


def test_a_page_that_comes_back_has_its_old_name(console):
    page = console.page()
    page.close()
    console.next_asked("gone")
    back = console.socket(f"/ws/state?key={page.key}", console.drive)
    assert json.loads(back.recv(PATIENCE_S))["client"] == page.client
    twin = console.socket(f"/ws/state?key={page.key}", console.drive)
    assert json.loads(twin.recv(PATIENCE_S))["client"] != page.client  # a copy of an open page
    twin.close(), back.close()
    other = console.socket(f"/ws/state?key={page.key}", console.look)
    assert json.loads(other.recv(PATIENCE_S))["client"] != page.client
    other.close()


def test_the_state_has_units_in_its_names(console):
    console.say(
        places(2000, [0, 150, -50, 1571, 250]),
        {
            "k": "rows",
            "t": 2000,
            "clock": {"factor": 1},
            "link": {"delay_s": 0.25},
            "dropped": 3,
            "robots": [{"i": 0, "mode": "Idle"}],
            "people": [],
        },
    )
    assert becomes(lambda: console.ask("/api/state", token=console.look).json["dropped"] == 3)
    state = console.ask("/api/state", token=console.look).json
    robot = state["robots"][0]
    assert (robot["label"], robot["x_m"], robot["y_m"]) == ("robot-1", 1.5, -0.5)
    assert (robot["heading_rad"], robot["speed_mps"], robot["mode"]) == (1.571, 0.25, "Idle")
    assert robot["latitude_deg"] == pytest.approx(38.66, abs=1e-4)
    assert state["link"] == {"delay_s": 0.25}
    assert "x_m" not in state["robots"][1]  # nobody has said where it is


def test_the_plan_is_sent_once(console):
    first = console.ask("/api/site", token=console.look)
    assert first.json["name"] == "nowhere"
    again = console.ask("/api/site", token=console.look, If_None_Match=first.headers["etag"])
    assert (again.status, again.body) == (304, b"")


def test_the_story_from_a_line_on(free):
    free.say(*({"k": "story", "t": n, "what": f"{n}"} for n in range(5)))
    assert becomes(lambda: free.ask("/api/story").json["next"] == 5)
    assert [line["what"] for line in free.ask("/api/story?from=3").json["lines"]] == ["3", "4"]
    assert free.ask("/api/story?from=99").json["lines"] == []
    for wrong in ("-1", "x", "1e9", "%D9%A3", "9" * 30):
        assert free.ask(f"/api/story?from={wrong}").status == 400


@pytest.mark.system
def test_of_a_slow_page_the_rest_knows_nothing_and_it_is_dropped_in_the_end():
    wide = {
        "k": "rows",
        "clock": {},
        "link": {},
        "robots": [],
        "people": [{"i": 9, "doing": "x" * 200_000}],
    }
    with serving() as served, served.deaf("/ws/state", served.drive) as raw:
        page = served.page()
        page.next("snap")
        begun, n = time.monotonic(), 0
        while served.ask("/api/state", token=served.look).json["clients"] == 2:
            n += 1
            served.say(wide | {"t": n}, places(n, [0, n, 0, 0, 0]))
            assert page.next("rows")["t"] <= n  # who reads goes on
            assert time.monotonic() - begun < PATIENCE_S
        assert n > 5
        data = b""
        raw.settimeout(PATIENCE_S)
        while piece := raw.recv(1 << 20):
            data += piece
        assert _closes(data) == 1013
        page.close()


@pytest.mark.system
def test_as_many_pages_as_may_be_open_are_served_and_one_more_is_told_so():
    with serving() as served, ExitStack() as stack:
        pages = [stack.enter_context(served.page(served.look).ws) for _ in range(MAX_CLIENTS)]
        with pytest.raises(InvalidStatus) as error:
            served.socket("/ws/state", served.look)
        assert error.value.response.status_code == 503
        assert error.value.response.headers["referrer-policy"] == "no-referrer"
        served.say(places(7, [0, 1, 1, 1, 1]))
        for ws in pages:
            while json.loads(ws.recv(PATIENCE_S)).get("t") != 7:
                pass
        pages[0].close()
        assert becomes(
            lambda: served.ask("/api/state", token=served.look).json["clients"] == MAX_CLIENTS - 1
        )
        served.page().close()


# --- beginning and end ------------------------------------------------------------------------


def test_before_the_run_begins_it_serves_and_waits():
    with serving(begins=False) as served:
        assert served.ask("/healthz").status == 200
        page = served.page()
        assert page.next("snap")["scene"] is None
        assert served.ask("/api/state", token=served.look).json["robots"] == []
        assert served.ask("/api/site", token=served.look).status == 503
        assert served.ask("/camera/robot-1.jpg", token=served.look).status == 404
        served.say(scene())
        assert page.next("snap")["scene"]["scenario"] == "test"
        page.close()


@pytest.mark.parametrize("how", ["bye", "closed", "SIGTERM"])
def test_it_ends_at_once_and_says_so_to_its_pages(how):
    served = Served()
    page, drive = served.page(), None
    page.next("snap")
    drive = page.driving()
    begun = time.monotonic()
    if how == "bye":
        served.say({"k": "bye", "why": "Ctrl-C"})
    elif how == "closed":
        served.end.shutdown(socket.SHUT_RDWR)
    else:
        served.process.terminate()
    assert page.next("bye")["why"]
    assert closed(page.ws) == 1001
    assert served.process.wait(PATIENCE_S) == 0
    assert time.monotonic() - begun < 30  # a second where nothing else runs
    drive.close()
    assert served.stop() == ""


def test_ctrl_c_is_for_the_simulation():
    with serving() as served:
        served.process.send_signal(signal.SIGINT)
        assert served.ask("/healthz").status == 200


def test_a_line_that_makes_no_sense_is_left_out():
    served = Served()
    served.say({"k": "pos", "t": 1}, {"k": "seat"}, [], places(2, [0, 7, 7, 0, 0]))
    served.end.sendall(b"rubbish\n")
    assert becomes(lambda: served.ask("/api/state", token=served.look).json["time_s"] == 0.002)
    assert served.stop().count("makes no sense") == 4


def test_a_taken_port_is_said_in_one_line():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        mine, theirs = socket.socketpair()
        words = ["--fd", str(theirs.fileno()), "--port", str(port)]
        found = subprocess.run(
            [sys.executable, "-m", "dva_sim.console.web", *words],
            pass_fds=[theirs.fileno()],
            stderr=subprocess.PIPE,
            timeout=PATIENCE_S,
        )
        mine.close(), theirs.close()
    assert found.returncode == 1
    (line,) = found.stderr.decode().splitlines()
    assert unnamed(line, "127.0.0.1", port, "Address already in use") == []


@pytest.mark.system
def test_no_list_of_processes_shows_a_token(console):
    for line in ("cmdline", "environ"):
        shown = Path(f"/proc/{console.process.pid}/{line}")
        assert console.drive.encode() not in (shown.read_bytes() if shown.exists() else b"")
