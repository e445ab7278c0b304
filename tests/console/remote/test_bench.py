"""A bench over a pipe, and what an attached console asks of it."""

import socket
from collections.abc import Iterator
from typing import Any

import pytest
from helpers.console.remote_console import OWN, NotedBench, attached

from dva_sim.console.asking.answers import FAREWELL_PREFIX
from dva_sim.console.bench import NOT_HERE, UNATTENDED
from dva_sim.console.desk.console_actions import ConsoleActions
from dva_sim.console.remote.piped_bench import PLAIN, PipedBench
from dva_sim.console.wire.actions import ActionPlace
from dva_sim.network.realtime import LiveClock
from dva_sim.protocol.devices import ControlRoomRole
from dva_sim.serving.pipes import LinePipe

SUPERVISE = ControlRoomRole.SUPERVISE
HERE = "127.0.0.1:5600"


class OtherEnd:
    """A bench, and the process at the other end of its pipe.

    Attributes:
        answers: Answers to `ok` and `text`, in the order of the questions.
        moves: Addresses that the bench has told of.
    """

    def __init__(self) -> None:
        ours, theirs = (LinePipe(end.detach(), PLAIN) for end in socket.socketpair())
        self._pipe = theirs
        self.clock = LiveClock()
        self.bench = PipedBench(ours, HERE)
        self.moves: list[str] = []
        self.bench.follow(self.clock, self.moves.append)
        self.answers: list[tuple[bool, str]] = []

    def asked(self) -> list[dict[str, Any]]:
        """Questions since the last call."""
        return self._pipe.lines()

    def answer(self, number: int, ok: bool, text: str, address: str = HERE, **more: bool) -> None:
        line = {"k": "done", "n": number, "ok": ok, "text": text, "address": address}
        self._pipe.put({**line, "listens": True, **more})
        self.clock.run(self.clock.now + 0.05)

    def note(self, ok: bool, text: str) -> None:
        self.answers.append((ok, text))

    def close(self) -> None:
        self._pipe.close()


@pytest.fixture
def other() -> Iterator[OtherEnd]:
    end = OtherEnd()
    yield end
    end.close()


def test_the_server_is_stopped_and_started_there_and_the_move_is_told(other):
    other.bench.close_server(other.note)
    assert other.asked() == [{"k": "ask", "n": 1, "what": "stop"}]
    other.answer(1, True, "stopped", listens=False)
    assert (other.answers, other.bench.server()["listens"]) == ([(True, "stopped")], False)
    other.bench.open_server(5700, other.note)
    assert other.asked() == [{"k": "ask", "n": 2, "what": "start", "port": 5700}]
    other.answer(2, True, "started", "127.0.0.1:5700")
    assert other.moves == ["127.0.0.1:5700"]
    shown = other.bench.server()
    assert (shown["listens"], shown["port"], shown["modelled"]) == (True, 5700, False)


def test_a_refusal_of_the_other_end_is_one_here(other):
    other.bench.open_server(80, other.note)
    other.answer(1, False, "port 80 is taken")
    assert other.answers == [(False, "port 80 is taken")]
    assert other.moves == []


def test_it_is_appointed_once_for_all_decisions_until_nobody_is_there(other):
    done = list[int]()
    other.bench.appoint(OWN, SUPERVISE, lambda: done.append(1))
    assert done == []  # a decision waits until the DVA knows
    other.answer(1, True, "")
    other.bench.appoint(OWN, SUPERVISE, lambda: done.append(2))
    assert done == [1, 2]
    other.bench.appoint(OWN, UNATTENDED)
    other.bench.appoint(OWN, UNATTENDED)
    assert [(one["what"], one["room"], one["role"]) for one in other.asked()] == [
        ("appoint", OWN, "supervise"),
        ("appoint", OWN, "drive"),
    ]


def test_the_clock_stops_when_the_other_end_is_gone(other):
    other.close()
    other.clock.run(60.0)
    assert other.clock.now < 1.0


# --- at a page ---------------------------------------------------------------------------------


@pytest.fixture
def page(monkeypatch, tmp_path):
    with attached(monkeypatch, tmp_path, role="drive") as page:
        page.system.bench = NotedBench(page)
        page.actions = ConsoleActions(page.pages, ActionPlace.REMOTE, NOT_HERE)
        yield page


def test_on_a_bench_the_server_is_the_pages_and_elsewhere_it_is_not(page, monkeypatch, tmp_path):
    assert page.ask("server_start", port=5700)["ok"]
    assert page.ask("server_stop")["ok"]
    assert page.system.bench.asked == ["start 5700", "stop"]
    page.let(1.0)
    server = page.lines_of("rows")[-1]["server"]
    assert (server.get("own", True), server["role"], server["port"]) == (True, "supervise", 5600)
    page.system.bench = None
    page.actions = ConsoleActions(page.pages, ActionPlace.REMOTE, NOT_HERE)
    assert not page.ask("server_stop")["ok"]


@pytest.mark.parametrize(
    ("action", "about"),
    [
        ("event_acknowledge", {"event": 1}),
        ("dispatch_mode", {"mode": "automatic"}),
        ("take_over", {"robot": "robot-1", "reason": "to see"}),
    ],
)
def test_the_dva_learns_that_somebody_decides_before_the_first_decision(page, action, about):
    if action == "take_over":
        about = about | {"robot": page.system.numbers[page.system.robots()[0]]}
    assert page.ask(action, **about)["ok"]
    assert "supervise" in page.system.bench.asked


def test_the_dva_relies_on_nobody_once_the_last_page_is_gone(page):
    page.ask("room_join", name="ana")
    page.actions.take(
        {"do": "release", "id": f"{FAREWELL_PREFIX}c1", "client": "c1", "role": "supervise"}
    )
    assert page.system.bench.asked == ["supervise", "drive"]


def test_a_fake_device_that_is_removed_is_on_no_list_at_once(page):
    page.actions.take({"do": "look", "logs": {}, "tables": ["devices"]})

    def listed() -> set[str]:
        return {row["id"] for line in page.lines_of("devices")[-1:] for row in line["devices"]}

    ghost = page.ask("fake_add", label="ghost", type="Robot")["device"]
    page.until(lambda: ghost in listed())
    assert page.ask("fake_remove", device=ghost)["ok"]
    page.let(1.1)
    assert ghost not in listed()
    page.let(5.0)
    assert ghost not in listed()
