"""The DVA's log of requests at an attached console, and whether the DVA is heard."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.console.remote_console import OWN, RemotePage, attached
from helpers.console.simulated_phone import PhonePage

from dva_sim.console.system.request_reader import REFUSED, RequestReader
from dva_sim.console.web.log_entries import Entry
from dva_sim.console.web.logs import KeptLogs
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.stage import DVA, id_of

OPERATOR = id_of("operator", 1)


@pytest.fixture
def page(monkeypatch, tmp_path):
    with attached(monkeypatch, tmp_path) as page:
        page.actions.take({"do": "look", "logs": {"dva": True}, "tables": []})
        page.let(1.0)
        yield page


def entries(page: RemotePage) -> list[Entry]:
    """The log as the web process keeps it."""
    logs = KeptLogs()
    for line in page.lines_of("log"):
        logs.take(line)
    return list(logs.of("dva").entries.values())


def server(page: RemotePage) -> dict[str, Any]:
    shown: dict[str, Any] = page.lines_of("rows")[-1]["server"]
    return shown


def test_requests_of_others_come_with_header_code_and_service_time(page):
    device = page.world.world.seating.persons[0].device
    device.ask(DVA, m.GetDeviceList())
    device.ask(DVA, m.PermissionRevocation(id_of("robot", 9), device.id_tag, 77 << 32 | 5))
    page.let(1.0)
    found = [one for one in entries(page) if one.header["SourceID"] == device.id_tag]
    listed, revoked = found[-2:]
    assert (listed.kind, listed.code, listed.service_us) == ("GetDeviceList", m.OK, 0)
    assert revoked.kind == "PermissionRevocation"
    assert str(77 << 32) in revoked.data.decode()
    assert str(77 << 32 | 5) not in revoked.data.decode()
    assert server(page)["log"] == "kept"


def test_what_the_dva_refuses_is_in_the_log_even_if_it_cannot_be_read(page):
    network = page.world.world.run.network
    wire = network.connect(OPERATOR, DVA, lambda *_: None, pipelined=False)
    wire.send(1, b"<msg>hello")
    page.let(1.0)
    (broken,) = [one for one in entries(page) if one.data == b"<msg>hello"]
    assert (broken.code, broken.header) == (m.BAD_MESSAGE, {})


def test_no_question_for_the_log_is_in_it(page):
    page.let(5.0)
    assert "GetRequestLog" not in {one.kind for one in entries(page)}
    assert OWN in {one.header["SourceID"] for one in entries(page)}


@pytest.mark.parametrize(("role", "shown"), [("look", "not_permitted"), ("drive", "kept")])
def test_the_log_is_shown_to_control_rooms_that_may_drive(monkeypatch, tmp_path, role, shown):
    with attached(monkeypatch, tmp_path, role) as page:
        page.let(3.0)
        assert server(page)["log"] == shown


# --- another DVA, as its answers show it -------------------------------------------------------


class ScriptedRoom:
    """A control room whose questions are answered as a test wants, at once.

    Attributes:
        asked: Numbers above which requests were asked for.
    """

    def __init__(self, answer: Callable[[int], m.Reply]) -> None:
        self._answer = answer
        self.asked: list[int] = []
        self.dispatch = None
        self.device = SimpleNamespace(clock=SimpleNamespace(now=100.0))

    def ask(self, body: m.GetRequestLog, then: Callable[[m.Reply], object], _: object) -> None:
        self.asked.append(body.request_number or 0)
        then(self._answer(self.asked[-1]))


def log_of(newest: int, oldest: int = 1) -> Callable[[int], m.Reply]:
    """Answers with a log of two requests at once."""

    def answer(above: int) -> m.Reply:
        some = range(max(above + 1, oldest), min(max(above + 1, oldest) + 2, newest + 1))
        rows = tuple(m.LoggedRequest(n, 1.0, 3, "YWJj", 0.001, m.OK) for n in some)
        return m.Reply(1, m.OK, "", m.RequestLog(newest, rows))

    return answer


@pytest.mark.parametrize("code", [m.NOT_SUPPORTED, m.BAD_MESSAGE])
def test_a_dva_that_knows_no_log_is_asked_every_10_s_and_said_to_keep_none(code):
    room = ScriptedRoom(lambda _: m.Reply(1, code, "no"))
    reader = RequestReader(room, lambda _: None)
    for _ in range(100):  # 20 s
        reader.go_on()
        room.device.clock.now += 0.2
    assert reader.shown == "not_kept"
    assert len(room.asked) == 20 / REFUSED


def test_all_that_waits_is_read_at_once_and_each_request_told_once():
    lines = list[dict[str, Any]]()
    room = ScriptedRoom(log_of(7))
    RequestReader(room, lines.append).go_on()
    assert room.asked == [0, 2, 4, 6, 7]
    assert [row[0] for line in lines for row in line["lines"]] == [1, 2, 3, 4, 5, 6, 7]


def test_a_dva_that_has_restarted_begins_a_new_log():
    lines = list[dict[str, Any]]()
    room = ScriptedRoom(log_of(7))
    reader = RequestReader(room, lines.append)
    reader.go_on()
    room._answer = log_of(2)
    room.device.clock.now += 5.0
    reader.go_on()
    assert [line.get("replaces", False) for line in lines] == [True, False, False, False, True]
    assert [row[0] for row in lines[-1]["lines"]] == [1, 2]


def test_of_a_long_request_the_size_is_told_beside_its_first_bytes():
    entry = Entry.of([4, 0, "abc", None, 1000, 0, m.BAD_MESSAGE, "too long", 9000])
    assert entry.is_cut
    assert (entry.code, entry.text, entry.payload) == (m.BAD_MESSAGE, "too long", "9000 bytes")


# --- whether it is heard -----------------------------------------------------------------------


def take_away(page: PhonePage) -> None:
    page.world.run.network.leave(DVA)
    page.world.run.dva.silence(True)


def test_a_dva_that_falls_silent_is_shown_as_that_within_2_s_and_back_within_3(page):
    page.let(5.0)
    assert server(page)["hearing"] == "answers"
    for phase in range(4):  # wherever between two heartbeats it falls silent
        page.let(4.0 + 0.5 * phase)
        take_away(page.world)
        page.let(2.0)
        assert (server(page)["hearing"], server(page)["listens"]) == ("silent", False)
        page.world.world.run.network.come_back(DVA)
        page.world.world.run.dva.silence(False)
        page.let(3.0)
        assert server(page)["hearing"] == "answers"


def test_a_dva_that_is_there_is_never_called_silent(page):
    page.lines.clear()
    page.let(30.0)
    assert {line["server"]["hearing"] for line in page.lines_of("rows")} == {"answers"}


def test_a_dva_that_was_never_there_is_told_from_one_that_is_silent(monkeypatch, tmp_path):
    world = PhonePage(monkeypatch, client="w1", bystander__count=0)
    take_away(world)
    page = RemotePage(world, tmp_path / "audit.sqlite")
    page.let(5.0)
    assert server(page)["hearing"] == "never"
    page.keeper.close()
