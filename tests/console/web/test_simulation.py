"""State of the simulation and requests to it: alive, hung, ended, and access."""

import asyncio
import json
import socket
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager

from helpers.console.served_console import scene
from starlette.responses import Response

from dva_sim.console.web.access import Role
from dva_sim.console.web.hub import Hub
from dva_sim.console.web.simulation import Simulation
from dva_sim.console.wire import actions as declared
from dva_sim.console.wire.limits import MAX_PENDING, SILENCE


class Clock:
    """Clock that advances on demand [s]."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@contextmanager
def ends() -> Iterator[tuple[socket.socket, int]]:
    ours, theirs = socket.socketpair()
    with ours:
        yield ours, theirs.detach()


async def until(condition: Callable[[], object]) -> None:
    while not condition():
        await asyncio.sleep(0.001)


def play(story: Callable[[Simulation, Clock, socket.socket], Awaitable[None]]) -> None:
    """Tell a story of a simulation."""

    async def received() -> None:
        clock = Clock()
        simulation = Simulation(clock)
        simulation.open(number)
        await story(simulation, clock, ours)
        simulation.close()
        await asyncio.sleep(0)

    with ends() as (ours, number):
        asyncio.run(received())


def say(end: socket.socket, *lines: dict[str, object]) -> None:
    for line in lines:
        end.sendall(json.dumps(line).encode() + b"\n")


def test_it_may_take_its_time_to_begin_but_then_its_silence_counts():
    async def story(simulation, clock, end):
        assert simulation.runs
        clock.now += 10 * SILENCE
        assert simulation.runs
        say(end, scene())
        await until(lambda: simulation.state.scene)
        clock.now += SILENCE - 0.1
        assert simulation.runs
        clock.now += 0.2
        assert not simulation.runs
        say(end, {"k": "rows", "t": 1})
        await until(lambda: simulation.state.latest)
        assert simulation.runs

    play(story)


def test_it_has_ended_when_it_says_so_or_is_gone():
    async def says(simulation, clock, end):
        say(end, {"k": "bye", "why": "Ctrl-C"})
        await simulation.ended.wait()
        assert simulation.why == "Ctrl-C"
        assert not simulation.runs

    async def goes(simulation, clock, end):
        end.shutdown(socket.SHUT_RDWR)
        await simulation.ended.wait()
        assert simulation.why == "the simulation has ended"

    play(says)
    play(goes)


def test_who_waits_in_vain_is_told_after_a_while_and_longer_for_what_crosses_the_link(monkeypatch):
    monkeypatch.setattr(declared, "ANSWER_WAIT_S", 0.001)
    monkeypatch.setattr(declared, "LONG", 0.002)

    async def story(simulation, clock, end):
        reports = []
        for action in ("emergency", "pattern"):
            simulation.ask({"id": action, "do": action, "client": "c1"}, reports.append)
        await until(lambda: len(reports) == 2)
        assert [line["id"] for line in reports] == ["pattern", "emergency"]
        assert [line["late"] for line in reports] == [True, True]
        assert ["0.001 s" in reports[0]["text"], "0.002 s" in reports[1]["text"]] == [True, True]

    play(story)


def test_an_answer_goes_to_all_who_asked_the_same():
    async def story(simulation, clock, end):
        asked = {"id": "a", "do": "start", "client": "c1"}
        waiting = [asyncio.ensure_future(simulation.answer(asked)) for _ in range(2)]
        await asyncio.sleep(0)
        say(end, {"k": "done", "id": "c1/a", "ok": True, "text": "yes"})
        found = [(line["id"], line["text"]) for line in await asyncio.gather(*waiting)]
        assert found == [("a", "yes"), ("a", "yes")]
        end.setblocking(False)
        assert end.recv(1000).count(b"\n") == 1

    play(story)


def test_an_emergency_asked_for_again_and_again_is_answered_by_the_world_alone():
    """A busy refusal would look as if the stop had been refused."""

    async def story(simulation, clock, end):
        reports = []
        asked = {"id": "e", "do": "emergency", "robots": "all", "client": "c1"}
        for _ in range(20):
            simulation.ask(asked, reports.append)
        assert reports == []
        end.setblocking(False)
        assert end.recv(1000).count(b"\n") == 1
        say(end, {"k": "done", "id": "c1/e", "ok": True, "text": "stopped"})
        await until(lambda: reports)
        assert {line["text"] for line in reports} == {"stopped"}

    play(story)


def test_questions_without_an_answer_are_bounded_and_end_with_the_simulation():
    async def story(simulation, clock, end):
        reports = []
        for number in range(MAX_PENDING):
            simulation.ask({"id": f"{number}", "do": "start", "client": "c1"}, reports.append)
            end.recv(1000)
        simulation.ask({"id": f"{MAX_PENDING}", "do": "start", "client": "c1"}, reports.append)
        assert [line["id"] for line in reports] == [f"{MAX_PENDING}"]
        assert "too many" in reports[0]["text"]
        say(end, {"k": "bye", "why": "over"})
        await simulation.ended.wait()
        assert [line["text"] for line in reports[1:]] == ["over"] * MAX_PENDING
        simulation.ask({"id": "after", "do": "start", "client": "c1"}, reports.append)
        assert (reports[-1]["id"], reports[-1]["text"]) == ("after", "over")

    play(story)


class Asking:
    """A WebSocket that asks to be let in."""

    def __init__(self, **query: str) -> None:
        self.query_params = query
        self.received: Response | None = None

    async def send_denial_response(self, response: Response) -> None:
        self.received = response

    async def accept(self) -> None:
        raise AssertionError("it was let in")


def test_after_the_end_no_page_is_let_in_that_would_take_the_world_for_lost():
    async def story() -> list[Response | None]:
        hub = Hub(Simulation())
        client = hub.clients.join(Role.DRIVE, "")
        hub.simulation.why = "the console was ended"
        hub.simulation.ended.set()
        sees, drives = Asking(), Asking(key=client.key)
        await hub.see(sees, Role.DRIVE)
        await hub.drive(drives, Role.DRIVE)
        return [sees.received, drives.received]

    for entry in asyncio.run(story()):
        assert entry is not None
        assert (entry.status_code, entry.body) == (503, b"the console was ended")
