"""`dva-sim console` as users start it: its processes, its address, its end."""

import json
import os
import re
import shutil
import signal
import socket
import urllib.error
import urllib.request
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from http.cookiejar import CookieJar

import pytest
from helpers.console.console_program import started
from helpers.processes.command_line import call
from helpers.processes.programs import wait_until
from helpers.wording import unnamed
from websockets.sync.client import connect

import dva_sim
from dva_sim.experiments.execution.checkpoint import load_so_far
from dva_sim.simulation.full.verdicts import RULES

pytestmark = pytest.mark.system

QUIET = ("--no-open", "--port", "0")


@pytest.fixture
def console(programs):
    return running(programs)


def running(programs, *words):
    return started(programs, *words)[0]


def address_of(program):
    return re.search(r"^Console: (http://127\.0\.0\.1:\d+/\S*)$", program.output, re.MULTILINE)[1]


class Client:
    """A browser's two sockets."""

    def __init__(self, address):
        jar = CookieJar()
        opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(jar))
        base = address.split("?")[0].rstrip("/")
        with closing(opener.open(address)):
            cookie = "; ".join(f"{c.name}={c.value}" for c in jar)
        headers = {"Cookie": cookie, "Origin": base}
        web = base.replace("http", "ws")
        self._open = ExitStack()
        reach = partial(connect, additional_headers=headers, max_size=None)
        self._state = self._open.enter_context(reach(f"{web}/ws/state"))
        you = json.loads(self._state.recv())
        self.id = you["client"]
        self._drive = self._open.enter_context(reach(f"{web}/ws/drive?key={you['key']}"))
        self._count, self.seat = 0, None

    def do(self, what, **about):
        self._count += 1
        number = f"{self.id}-{self._count}"
        self._drive.send(json.dumps({"id": number, "do": what, **about}))
        while True:
            line = self._hear(60.0)
            if line.get("k") == "done" and line["id"] == number:
                return line["ok"], line["text"]

    def want(self, speed, turn=0.0):
        self._count += 1
        values = {"do": "input", "n": self._count, "speed": speed, "turn": turn, "held": True}
        self._drive.send(json.dumps(values))
        self._hear(0.02)

    def _hear(self, wait):
        try:
            line = json.loads(self._drive.recv(timeout=wait))
        except TimeoutError:
            return {}
        if line.get("k") == "seat":
            self.seat = line
        return line

    def close(self):
        self._open.close()


@contextmanager
def client(address):
    with closing(Client(address)) as one:
        yield one


def test_asked_to_end_it_ends_all_its_processes_and_leaves_nothing(programs, console, tmp_path):
    assert len(programs.processes()) == 3
    console.send(signal.SIGTERM)
    assert console.ends() == 0
    assert console.complained == []
    programs.wait_for_none()
    assert {path.suffix for path in tmp_path.iterdir()} <= {".out", ".errors"}


def test_a_web_process_that_is_killed_ends_it_in_one_line(programs, console):
    web = next(pid for pid, words in programs.processes().items() if "console.web" in words)
    os.kill(web, signal.SIGKILL)
    assert console.ends() == 3
    (complaint,) = console.complained
    assert unnamed(complaint, "error: ", "web process", "signal 9") == []
    programs.wait_for_none()


def test_without_the_process_that_draws_all_else_goes_on_without_a_token_for_everybody(programs):
    console = running(programs, "--no-token")
    assert "token" not in address_of(console)
    pictures = next(p for p, words in programs.processes().items() if "pages.pictures" in words)
    os.kill(pictures, signal.SIGKILL)
    wait_until(lambda: pictures not in programs.processes(), "it ends")
    with client(address_of(console)) as page:
        assert page.do("take", robots=[0]) == (True, "robot-1 is yours")
    console.send(signal.SIGINT)
    assert console.ends() == 0
    assert console.complained == []
    programs.wait_for_none()


def test_a_world_that_is_killed_takes_the_others_with_it(programs, console):
    console.process.kill()
    console.process.wait()
    programs.wait_for_none()


def test_killed_it_loses_the_last_seconds_alone(programs, tmp_path):
    out = tmp_path / "mine"
    console = running(programs, "-o", out)
    second = call("console", *QUIET, "-o", out)
    assert second.returncode == 2
    (line,) = second.stderr.splitlines()
    assert unnamed(line, "error: ", out, f"process {console.process.pid} ") == []
    wait_until(lambda: shown(out) > 2.0, "two seconds are kept")
    console.process.kill()
    console.process.wait()
    assert shown(out) > 2.0
    assert dva_sim.load(out).runs.rows == 1
    programs.wait_for_none()


def test_what_an_earlier_run_left_of_a_recording_is_not_replaced(tmp_path):
    left = tmp_path / "run.mcap.part"
    left.write_text("lines")
    ended = call("console", *QUIET, "--record", "run.mcap", cwd=tmp_path)
    assert ended.returncode == 2
    (line,) = ended.stderr.splitlines()
    assert unnamed(line, "run.mcap.part", "--mcap", "--overwrite") == []
    assert left.read_text() == "lines"


def shown(out):
    """Simulated time in a results folder [s]; 0 before its first row."""
    results = load_so_far(out)
    return results.runs["simulated_s"][0] if results.has("runs") else 0.0


def test_its_results_are_written_though_the_recording_breaks_off(programs, tmp_path):
    (tmp_path / "film").mkdir()
    console = running(programs, "-o", tmp_path / "mine", "--record", tmp_path / "film" / "run.mcap")
    shutil.rmtree(tmp_path / "film")
    (tmp_path / "film").write_text("a file where the folder was")
    console.send(signal.SIGINT)
    assert console.ends() == 2
    (line,) = console.complained
    assert "run.mcap was not recorded: " in line
    assert "is left" not in line
    assert dva_sim.load(tmp_path / "mine").runs.rows == 1


def test_a_port_that_is_taken_is_told_in_a_line(programs):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        second = programs.start("console", "--no-open", "--port", port)
        assert second.ends() == 2
    (line,) = second.complained
    assert unnamed(line, port, "--port 0") == []


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("no-such-place",), "no-such-place"),
        (("small-shift",), "a console shows the model"),
        (("--set", "link.delay_s=-1"), "--set link.delay_s=-1"),
        (("--set", "robot.count=99"), "robot.count"),
        (("--record", "run.avi"), "should end in .mcap"),
        (("--port", "70000"), "--port"),
        (("--links", "imagined"), "--links 'imagined' should be modelled or real"),
    ],
)
def test_a_mistake_is_told_before_anything_starts(words, expected):
    ended = call("console", "--no-open", *words)
    assert (ended.returncode, ended.stdout) == (2, "")
    (line,) = ended.stderr.splitlines()
    assert expected in line


@pytest.mark.parametrize("links", ["modelled", "real"])
def test_what_was_driven_and_recorded_holds_every_rule(programs, tmp_path, links):
    console = running(programs, "--record", tmp_path / "run.mcap", "--links", links)
    with client(address_of(console)) as page:
        assert page.do("link", delay_s=0.1)[0] is (links == "modelled")
        assert page.do("take", robots=[0, 1])[0]
        # On a machine that lags nobody may start: again and again, until it does not.
        wait_until(lambda: page.do("start")[0], "is driven")
        for _ in range(40):
            page.want(0.5, 0.1)
        assert page.do("stop")[0]
        assert page.do("emergency", robots="all")[0]
    console.send(signal.SIGINT)
    assert console.ends() == 0
    assert "run.mcap written" in console.output
    assert all(f"\n{rule} held: " in console.output for rule in RULES)
    check = call("check", tmp_path / "run.mcap")
    assert check.returncode == 0, check.stdout + check.stderr
    replay = call("replay", tmp_path / "run.mcap")
    assert replay.returncode == 0
    assert "drives robot-1" in replay.stdout
    assert not list(tmp_path.glob("*.part"))


RUNS_AWAY = """
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.worlds.bodies import TickTarget

honest = RobotAgent.start

def start(self):
    honest(self)
    self.body._asked.put(0, TickTarget(2.0, 0.0, 1e9))
    self.body._world.wake(self.body)

RobotAgent.start = start
"""


@pytest.mark.parametrize("links", ["modelled", "real"])
def test_a_console_whose_robots_break_rules_says_so_at_once_and_at_its_end(
    programs, tmp_path, monkeypatch, links
):
    (tmp_path / "sitecustomize.py").write_text(RUNS_AWAY)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    console = running(programs, "--links", links, "--no-token", "--record", tmp_path / "run.mcap")

    def story():
        with urllib.request.urlopen(f"{address_of(console)}api/story?from=0") as answer:
            return answer.read().decode()

    wait_until(lambda: "S1 broken: " in story(), "it is told")
    assert unnamed(story(), "S4 broken: ", "2.00 m/s", "0.00 rad/s") == []
    console.send(signal.SIGINT)
    assert console.ends() == 1
    (complaint,) = console.complained
    assert unnamed(complaint, "error: ", "S1, S4") == []
    assert "S4 broken: robot-1, at" in console.output
    check = call("check", tmp_path / "run.mcap")
    assert check.returncode == 1
    assert "S4 broken: robot-1, at" in check.stdout


def test_a_second_address_is_for_those_who_only_look(programs, console):
    address = address_of(console)
    console.wait_to_say("Look only: ")
    look = re.search(r"^Look only: (\S+)$", console.output, re.MULTILINE)[1]
    base, _, token = look.partition("?token=")
    headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
    assert address.partition("?token=")[0] == base
    assert address.partition("?token=")[2] != token

    seen = urllib.request.Request(f"{base}api/state", headers=headers)
    with urllib.request.urlopen(seen) as answer:
        assert answer.status == 200
    body = b'{"id": "a", "action": "pace", "arguments": {"paused": true}}'
    acts = urllib.request.Request(f"{base}api/actions", body, headers)
    with pytest.raises(urllib.error.HTTPError) as error:
        urllib.request.urlopen(acts)
    with error.value as refused:
        assert refused.code == 403


PHONES = ("--phones", "--phones-host", "127.0.0.1", "--phones-port", "0")


def test_phones_get_an_address_by_https_and_a_code(programs, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    console = running(programs, *PHONES)
    console.wait_to_say("Each phone must trust this computer once: https://127.0.0.1:")
    address = re.search(r"^Phone: (https://127\.0\.0\.1:\d+/\?token=\S{32})$", console.output, re.M)
    assert address
    assert "█▀" in console.output
    kept = tmp_path / "data" / "dva-sim" / "phones"
    assert {path.name for path in kept.iterdir()} == {"authority.pem", "console.pem"}
    assert address[1].partition("=")[2] not in "".join(console.complained)
    console.send(signal.SIGINT)
    assert console.ends() == 0


def test_where_no_certificate_can_be_kept_all_else_goes_on(programs, monkeypatch, tmp_path):
    (tmp_path / "data").write_text("in the way")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    console = running(programs, *PHONES)
    console.wait_to_say("no address for phones: no certificate can be kept in")
    assert "Phone:" not in console.output
    with client(address_of(console)) as page:
        assert page.do("take", robots=[0])[0]
    console.send(signal.SIGINT)
    assert console.ends() == 0
