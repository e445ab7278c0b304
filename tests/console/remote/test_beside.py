"""The page beside a DVA that runs alone: its server, its log, and what becomes of either."""

import json
import os
import re
import signal
import urllib.request
from contextlib import suppress
from http.client import HTTPResponse
from typing import Any

import pytest
import zmq
from helpers.network.free_ports import free_port
from helpers.processes.command_line import call
from helpers.processes.patience import PATIENCE_S, becomes
from helpers.processes.programs import Program, Programs
from helpers.wording import unnamed

from dva_sim.network.keys import create_keys
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.serving.listening import listen
from dva_sim.serving.users import UserFile
from dva_sim.simulation.full.stage import DVA, id_of, team_of
from dva_sim.simulation.scenario import build, load

pytestmark = pytest.mark.system

PHONE = "56:2B:04:E4:56:D8"


class BareDva:
    """A DVA that runs alone, and its page.

    Attributes:
        dva: Address of the DVA.
    """

    def __init__(self, programs: Programs, *words: str) -> None:
        self.programs = programs
        self.dva = f"127.0.0.1:{free_port()}"
        usual = ("--dva", self.dva, "--page", "0", "--for", "1000")
        self.program: Program = programs.start("live", "hands-on", "--only", "dva", *usual, *words)
        self.program.wait_to_say("Look only:")
        self._count = 0

    def _open(self, path: str, body: object = None) -> HTTPResponse:
        address = re.findall(r"^Console: +(\S+)$", self.program.output, re.MULTILINE)[0]
        base, _, token = address.partition("?token=")
        headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(base.rstrip("/") + path, data, headers)
        answer: HTTPResponse = urllib.request.urlopen(request, timeout=PATIENCE_S)
        return answer

    def act(self, action: str, **arguments: object) -> dict[str, Any]:
        self._count += 1
        body = {"id": f"a-{self._count}", "action": action, "arguments": arguments}
        with self._open("/api/actions", body) as answer:
            done: dict[str, Any] = json.load(answer)
        return done

    def log(self, **wanted: str) -> list[dict[str, Any]]:
        """Lines of the log that match, once there is one."""
        query = "&".join(f"{key}={value}" for key, value in wanted.items())
        with suppress(OSError), self._open(f"/api/logs/dva?{query}") as answer:
            lines: list[dict[str, Any]] = json.load(answer)["lines"]
            return lines
        return []

    def child(self, module: str) -> int:
        """The process of a module, as soon as there is one."""
        found = list[int]()

        def look() -> bool:
            running = self.programs.processes().items()
            found[:] = [pid for pid, command in running if f"-m {module} " in command]
            return bool(found)

        assert becomes(look)
        return found[0]


def answer_of(dva: str, data: bytes) -> m.Reply:
    """The reply to a request of a client that is none of ours."""
    with zmq.Context() as context, context.socket(zmq.REQ) as socket:
        socket.linger = 0
        socket.connect(f"tcp://{dva}")
        socket.send(data)
        assert socket.poll(1000 * PATIENCE_S)
        reply = decode(socket.recv()).body
    assert isinstance(reply, m.Reply)
    return reply


def registration() -> bytes:
    body = m.Registration("tablet", "TeleOp", "127.0.0.1:9")
    return encode(m.Message(DVA, 1, PHONE, "12:00:00", 0, body))


def test_a_client_is_tried_out_against_it_as_against_the_simulator_of_the_dissertation(programs):
    bare = BareDva(programs)

    def is_refused_and_logged() -> bool:  # requests are kept once the page has asked for them
        is_refused = answer_of(bare.dva, b"<msg>hello").code == m.BAD_MESSAGE
        return is_refused and bool(bare.log(code="refused"))

    assert becomes(is_refused_and_logged)
    assert answer_of(bare.dva, registration()).code == m.OK
    assert becomes(lambda: bare.log(kind="RegMsg", device=PHONE))
    (line,) = bare.log(kind="RegMsg", device=PHONE)
    assert (line["from_label"], line["code"], line["to"]) == ("tablet", m.OK, DVA)

    assert becomes(lambda: bare.act("fake_add", label="ghost", type="Robot")["ok"])
    assert bare.act("event_raise", kind="fire", severity="high", x_m=5.0, y_m=5.0)["ok"]
    assert becomes(lambda: bare.act("event_acknowledge", event=1)["ok"])

    assert bare.act("server_stop")["ok"]
    with zmq.Context() as context, context.socket(zmq.REQ) as socket:
        socket.linger = 0
        socket.connect(f"tcp://{bare.dva}")
        socket.send(registration())
        assert not socket.poll(500)
    other = free_port()
    assert unnamed(bare.act("server_start", port=other)["text"], str(other)) == []
    assert answer_of(f"127.0.0.1:{other}", registration()).code == m.OK
    assert becomes(lambda: bare.act("event_note", event=1, text="after the move")["ok"])

    bare.program.send(signal.SIGINT)
    assert bare.program.ends() == 0
    assert bare.program.complained == []
    programs.wait_for_none()


@pytest.mark.parametrize("module", ["dva_sim.console.web", "dva_sim.console.remote"])
def test_the_dva_outlives_its_page_and_says_that_it_has_ended(programs, module):
    bare = BareDva(programs)
    os.kill(bare.child(module), signal.SIGKILL)
    bare.program.wait_to_say("the DVA goes on without it")
    assert answer_of(bare.dva, registration()).code == m.OK
    bare.program.send(signal.SIGINT)
    assert bare.program.ends() == 0
    programs.wait_for_none()


def test_a_dva_that_is_killed_takes_its_page_along(programs):
    bare = BareDva(programs)
    bare.program.send(signal.SIGKILL)
    programs.wait_for_none()


def test_with_keys_the_page_is_the_control_room_whose_key_is_in_the_folder(programs, tmp_path):
    keys = tmp_path / "keys"
    create_keys(keys, [*team_of(build(load("hands-on"))), id_of("control-room", 1)])
    bare = BareDva(programs, "--keys", str(keys))
    assert becomes(lambda: bare.log(device=id_of("control-room", 1)))


def test_users_log_in_to_the_page(programs, tmp_path):
    users = tmp_path / "users.json"
    UserFile(users).add("ana", "supervise", "correct horse")
    bare = BareDva(programs, "--users", str(users))
    address = re.findall(r"^Console: +(\S+?)/?[?]", bare.program.output, re.MULTILINE)[0]
    with urllib.request.urlopen(address, timeout=PATIENCE_S) as answer:
        page = answer.read().decode()
    assert "/login?next=/" in answer.url
    assert "Log in" in page


def test_without_a_key_for_it_there_is_no_page_and_a_line_says_which_is_missing(programs, tmp_path):
    keys = tmp_path / "keys"
    create_keys(keys, [DVA])
    words = ("--dva", f"127.0.0.1:{free_port()}", "--keys", str(keys), "--for", "1000")
    program = programs.start("live", "hands-on", "--only", "dva", *words)
    program.wait_to_say("no page:", "control-room-1", "DVA: ")
    assert "Console:" not in program.output


def test_only_the_dva_runs_without_its_page(programs):
    words = ("--dva", f"127.0.0.1:{free_port()}", "--for", "1", "--no-page")
    program = programs.start("live", "hands-on", "--only", "dva", *words)
    assert program.ends() == 3  # nobody came
    assert "Console:" not in program.output


def test_the_page_is_no_company_for_a_dva_that_nobody_joins(programs):
    words = ("--dva", f"127.0.0.1:{free_port()}", "--for", "15", "--page", "0")
    program = programs.start("live", "hands-on", "--only", "dva", *words)
    assert program.ends() == 3
    assert "Console:" in program.output


def test_what_cannot_be_is_told_in_a_line():
    with listen("127.0.0.1", 0) as taken:
        port = str(taken.getsockname()[1])
        for words, names in (
            (("--page", "0"), ["--page", "--only dva"]),
            (("--no-page",), ["--no-page", "--only dva"]),
            (("--only", "dva", "--page", port), ["--page", port]),
            (("--users", "users.json"), ["--users", "--only dva"]),
        ):
            ended = call("live", "hands-on", *words)
            assert ended.returncode == 2
            (line,) = ended.stderr.splitlines()
            assert unnamed(line, *names) == []
