"""The address for phones: https, a role of its own, and what a phone may not."""

import http.client
import json
import ssl
from contextlib import suppress
from datetime import UTC, datetime, timedelta

import pytest
from helpers.console.served_console import Answer, Served, seat, serving, serving_phones
from helpers.processes.patience import PATIENCE_S
from websockets.exceptions import ConnectionClosed, InvalidMessage, InvalidStatus

from dva_sim.console.pages.qr_code import half_blocks, svg
from dva_sim.console.web.certificate_files import certificates
from dva_sim.console.web.certificates import Hosts

REGISTER = {"server": "127.0.0.1", "port": 5600, "label": "my phone", "type": "Teleoperation"}


@pytest.fixture(scope="module")
def console(tmp_path_factory):
    with serving_phones(tmp_path_factory.mktemp("certificates")) as served:
        yield served


def trusting(served: Served) -> ssl.SSLContext:
    """A client that trusts what `/trust` offers, and nothing else."""
    authority = served.ask("/trust/dva-sim.crt").body
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.load_verify_locations(cadata=authority)
    return context


def ask(served, path, method="GET", body=None, token=None, host=None, **headers) -> Answer:
    """A request of a phone, by https."""
    return served.ask(path, method, body, token, host, trusting(served), **headers)


def wss(served, path, token, origin="own"):
    """A WebSocket of a phone.

    About one of 3,000 requests of this client is never sent over TLS, while its other thread begins
    to read; the server cuts such a silent connection, and another attempt is made.
    """
    for _ in range(3):
        with suppress(InvalidMessage):
            return served.socket(path, token, origin, trusting(served))
    raise AssertionError("no handshake in three attempts")


@pytest.fixture
def phone(console):
    """A phone's two sockets, by https; its name, and its socket for driving."""
    with wss(console, "/ws/state", console.phone) as state:
        you = json.loads(state.recv(PATIENCE_S))
        with wss(console, f"/ws/drive?key={you['key']}", console.phone) as drive:
            yield you, drive


def test_a_phone_that_trusts_the_authority_gets_in_by_https(console):
    answer = ask(console, f"/?token={console.phone}")
    assert (answer.status, answer.headers["location"]) == (303, "/phone")
    cookie = answer.headers["set-cookie"].split("; ")
    assert {"HttpOnly", "SameSite=Strict", "Secure"} <= set(cookie)
    assert ask(console, "/phone", token=console.phone).status == 200


def test_a_phone_that_does_not_trust_it_gets_nothing(console):
    connection = http.client.HTTPSConnection("127.0.0.1", console.phones_port, timeout=PATIENCE_S)
    with pytest.raises(ssl.SSLCertVerificationError):
        connection.request("GET", "/trust")


def test_what_is_no_https_is_closed_and_said_nothing_of(console):
    connection = http.client.HTTPConnection("127.0.0.1", console.phones_port, timeout=PATIENCE_S)
    connection.request("GET", "/")
    with pytest.raises((http.client.HTTPException, OSError)):
        connection.getresponse()
    connection.close()


def test_the_phones_token_opens_the_consoles_own_address_too(console):
    """By `adb reverse`: a browser trusts localhost as it is."""
    assert console.ask("/phone", token=console.phone).status == 200
    assert console.ask("/", token=console.phone).headers["location"] == "/phone"
    assert len({console.phone, console.look, console.drive}) == 3


@pytest.mark.parametrize("path", ["/phone", "/guard", "/", "/api/state", "/api/phones"])
def test_without_the_right_token_a_phone_sees_nothing(console, path):
    for token in (None, "wrong", console.phone[:-1]):
        answer = ask(console, path, token=token)
        assert answer.status == 401
        assert b"token" in answer.body


def test_how_to_trust_it_is_told_to_everybody_and_holds_no_secret(console):
    for answer in (console.ask("/trust"), ask(console, "/trust")):
        assert answer.status == 200
        for secret in (console.phone, console.drive, console.look):
            assert secret.encode() not in answer.body
        assert b"FINGERPRINT" not in answer.body
    crt = ask(console, "/trust/dva-sim.crt")
    assert crt.headers["content-type"] == "application/x-x509-ca-cert"
    assert b"PRIVATE" not in crt.body
    ssl.DER_cert_to_PEM_cert(crt.body)


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.nip.io:8766"])
def test_under_a_foreign_name_phones_are_not_answered(console, host):
    for path in ("/trust", "/phone", f"/?token={console.phone}"):
        assert ask(console, path, token=console.phone, host=host).status == 421


@pytest.mark.parametrize("origin", ["https://evil.example", "http://127.0.0.1:{port}", "null"])
def test_a_foreign_page_reaches_nothing_by_a_phones_cookie(console, origin):
    origin = origin.format(port=console.phones_port)
    answer = ask(console, "/api/emergency", "POST", {}, console.phone, Origin=origin)
    assert answer.status == 403
    with pytest.raises(InvalidStatus) as error:
        wss(console, "/ws/state", console.phone, origin).__enter__()
    assert error.value.response.status_code == 403


def test_the_code_and_the_address_are_shown_to_who_may_drive_alone(console):
    address = console.ask("/api/phones", token=console.drive).json["address"]
    assert address == console.serving["phone"]
    code = console.ask("/api/phones.svg", token=console.drive)
    assert code.headers["content-type"].startswith("image/svg+xml")
    for token in (console.look, console.phone):
        for path in ("/api/phones", "/api/phones.svg"):
            answer = console.ask(path, token=token)
            assert answer.status == 403
            assert console.phone.encode() not in answer.body


def test_without_phones_there_is_nothing_to_trust():
    with serving() as served:
        assert served.serving["phone"] is None
        assert served.ask("/trust").status == 404
        assert served.ask("/api/phones", token=served.drive).json == {"address": None}


@pytest.mark.parametrize("what", ["take", "link", "pattern", "pace", "tour"])
def test_a_phone_may_not_change_what_is_others(console, phone, what):
    you, drive = phone
    assert you["role"] == "phone"
    console.asked_so_far()
    drive.send(json.dumps({"id": f"p-{what}", "do": what, "robots": [0]}))
    done = json.loads(drive.recv(PATIENCE_S))
    assert (done["ok"], done["id"]) == (False, f"p-{what}")
    assert f"may not {what}" in done["text"]
    body = {"id": "r-1", "action": what, "arguments": {}}
    assert ask(console, "/api/actions", "POST", body, console.phone).status == 403
    assert [line for line in console.asked_so_far() if line["do"] == what] == []


def test_what_a_phone_asks_reaches_the_world_and_the_answer_comes_back_whole(console, phone):
    you, drive = phone
    drive.send(json.dumps({"id": "reg-1", "do": "phone_register", **REGISTER}))
    asked = console.next_asked("phone_register")
    by = {"id": f"{you['client']}/reg-1", "client": you["client"], "role": "phone"}
    assert asked == {"do": "phone_register", **by, **REGISTER}
    more = {"phone": {"id": "02:00", "label": "my phone", "address": "127.0.0.1:5700"}}
    console.say({"k": "done", "id": asked["id"], "ok": True, "text": "registered", **more})
    assert json.loads(drive.recv(PATIENCE_S))["phone"] == more["phone"]


def test_samples_go_on_in_their_order_and_are_not_answered(console, phone):
    you, drive = phone
    for n in range(0, 12, 2):
        xyz = [[0.1, 0.2, 9.8], [0.1, 0.2, 9.7]]
        at = [100.0 + n, 100.5 + n]
        values = {"do": "samples", "n": n, "at": at, "xyz": xyz, "hand": True, "orientation": 90}
        drive.send(json.dumps(values))
    heard = [console.next_asked("samples") for _ in range(6)]
    assert [line["n"] for line in heard] == [0, 2, 4, 6, 8, 10]
    assert heard[0]["client"] == you["client"]


def test_an_emergency_of_a_phone_is_for_its_own_robot_unless_it_says_otherwise(console, phone):
    you, drive = phone
    drive.send(json.dumps({"id": "e-1", "do": "emergency"}))
    assert "robots" not in console.next_asked("emergency")
    drive.send(json.dumps({"id": "e-2", "do": "emergency", "robots": [1]}))
    asked = console.next_asked("emergency")
    assert (asked["robots"], asked["client"]) == ([1], you["client"])


def test_an_emergency_goes_through_though_the_socket_of_its_page_is_gone(console):
    body = {"robots": [0], "key": "of-a-page-that-is-gone", "id": "late-1"}
    words = (console, "/api/emergency", "POST", body, console.phone)
    answer, asked = console.answering("emergency", ask, *words)
    assert answer.json["ok"]
    assert (asked["client"], asked["robots"]) == ("program-phone", [0])


def test_a_phone_that_is_gone_stops(console):
    with wss(console, "/ws/state", console.phone) as state:
        you = json.loads(state.recv(PATIENCE_S))
        with wss(console, f"/ws/drive?key={you['key']}", console.phone):
            pass
        assert console.next_asked("gone")["client"] == you["client"]


def test_a_page_that_lost_its_connection_unnoticed_keeps_its_name_and_a_copy_gets_another(console):
    """Simulates a change of network: the old connection is dead but not reported closed."""
    with wss(console, "/ws/state?page=one", console.phone) as old:
        you = json.loads(old.recv(PATIENCE_S))
        name, key = you["client"], you["key"]
        with wss(console, f"/ws/state?key={key}&page=copy", console.phone) as copy:
            assert json.loads(copy.recv(PATIENCE_S))["client"] != name
        with wss(console, f"/ws/state?key={key}&page=one", console.phone) as again:
            assert json.loads(again.recv(PATIENCE_S))["client"] == name
            with pytest.raises(ConnectionClosed):
                list(old)
            with wss(console, f"/ws/drive?key={key}", console.phone):  # it is still here
                console.say(seat(name, phase="held"))
                while json.loads(again.recv(PATIENCE_S)).get("phase") != "held":
                    pass


def test_the_line_of_a_guard_reaches_its_page_alone(console):
    one, other = console.page(console.phone), console.page(console.phone)
    console.say({"k": "guard", "t": 5, "seat": one.client, "guard": 9, "label": "guard-1"})
    assert one.next("guard")["label"] == "guard-1"
    console.say({"k": "story", "t": 6, "who": "x", "what": "y", "kind": "event"})
    seen = set()
    while "story" not in seen:
        seen.add(json.loads(other.ws.recv(PATIENCE_S))["k"])
    assert "guard" not in seen
    one.close()
    other.close()


def test_a_folder_that_cannot_be_written_leaves_all_else_as_it_is(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with serving("--phones-port", "0", "--certificates", str(tmp_path / "file" / "x")) as served:
        assert served.serving["phone"] is None
        assert len(served.serving["notices"]) == 1
        assert "certificate" in served.serving["notices"][0]
        assert served.ask("/healthz").status == 200


def test_an_expired_certificate_is_renewed_at_the_start_and_a_phone_gets_in(tmp_path):
    hosts = Hosts.of(["127.0.0.1", "localhost"])
    long_ago = datetime.now(UTC) - timedelta(days=500)
    certificates(tmp_path, hosts, long_ago)
    words = ("--phones-host", "127.0.0.1", "--phones-port", "0", "--certificates", str(tmp_path))
    with serving(*words) as served:
        text = " ".join(served.serving["notices"])
        assert "certificate" in text
        assert ask(served, "/phone", token=served.phone).status == 200  # verified


@pytest.mark.system
def test_codes_are_dark_on_light_with_a_rim():
    address = "https://192.168.1.7:8766/?token=" + "x" * 32
    picture = svg(address).decode()
    assert picture.startswith("<?xml")
    assert 'fill="#fff"' in picture
    assert "style" not in picture
    plain, coloured = half_blocks(address, False), half_blocks(address, True)
    rows = plain.split("\n")
    assert len({len(row) for row in rows}) == 1
    assert set(rows[0]) == {"█"}
    assert coloured.split("\n")[0].strip("\x1b[0123456789;m ") == ""
