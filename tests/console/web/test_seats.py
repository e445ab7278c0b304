"""A seat opens with its key alone: names are public, and a lesser token does nothing in it."""

import json

import pytest
from helpers.console.served_console import seat, serving
from helpers.processes.patience import PATIENCE_S
from websockets.exceptions import InvalidStatus

from dva_sim.console.web.clients import MAX_CLIENTS


@pytest.fixture(scope="module")
def console():
    with serving() as served:
        served.supervise = served.serving["supervise"].partition("?token=")[2]
        yield served


@pytest.fixture
def page(console):
    """A supervisor's page that drives."""
    page = console.page(console.supervise)
    console.say(seat(page.client, phase="driving"))
    with page.driving() as page.drive:
        console.asked_so_far()
        yield page
    page.close()


def act(console, token, action, ok=True, **about):
    """An action of a program: the answer, and what the simulation was asked."""
    arguments = about.pop("arguments", {})
    body = {"id": "a-1", "action": action, "arguments": arguments, **about}
    words = ("/api/actions", "POST", body, token)
    answer, asked = console.answering(action, console.ask, *words, ok=ok)
    return answer.json, asked


@pytest.mark.parametrize(
    ("role", "shown"), [("supervise", "supervise"), ("drive", "drive"), ("look", None)]
)
def test_the_simulation_hears_which_pages_are_open_that_may_drive(console, role, shown):
    console.asked_so_far()
    page = console.page(getattr(console, role))
    if shown:
        assert console.next_asked("here")["pages"][page.client] == shown
    page.close()
    assert page.client not in console.next_asked("here")["pages"]


def test_a_program_is_there_but_takes_no_free_seat(console):
    answer, _ = act(console, console.drive, "take", arguments={"robots": [0]})
    assert console.ask("/api/state", token=console.drive).status == 200
    console.page(console.drive).close()
    (program,) = [
        drives for name, drives in console.next_asked("here")["pages"].items() if name[0] == "p"
    ]
    assert (answer["ok"], program) == (True, "")


def test_a_name_is_public_and_a_key_is_nowhere_but_with_its_owner(console, page):
    looker = console.page(console.look)
    seen = [looker.next("snap"), console.ask("/api/state", token=console.look).json]
    assert all(page.client in json.dumps(line) for line in seen)
    assert page.key not in json.dumps(seen)
    assert looker.key != page.key
    looker.close()


@pytest.mark.parametrize("role", ["drive", "supervise"])
@pytest.mark.parametrize("action", ["release", "stop", "gone", "decline"])
def test_by_its_name_nobody_acts_in_the_seat_of_a_page(console, page, role, action):
    token = getattr(console, role)
    for shown in (
        {"client": page.client},
        {"key": page.client},
        {"client": page.client, "key": ""},
    ):
        body = {"id": "x", "action": action, "arguments": {}, **shown}
        answer = console.ask("/api/actions", "POST", body, token)
        assert answer.status == 403
        assert "key" in answer.json["text"]
    assert console.acted() == []


def test_a_lesser_token_does_nothing_in_a_seat_whose_key_it_has(console, page):
    body = {"id": "x", "action": "release", "arguments": {}, "key": page.key}
    assert console.ask("/api/actions", "POST", body, console.drive).status == 403
    with pytest.raises(InvalidStatus) as error:
        console.socket(f"/ws/drive?key={page.key}", console.drive)
    assert error.value.response.status_code == 403
    assert console.acted() == []


def test_by_its_name_nobody_replaces_the_driving_socket_of_a_page(console, page):
    for shown in (f"client={page.client}", f"key={page.client}", ""):
        with pytest.raises(InvalidStatus) as error:
            console.socket(f"/ws/drive?{shown}", console.supervise)
        assert error.value.response.status_code == 403
    back = console.socket(f"/ws/state?client={page.client}&page=", console.supervise)
    assert json.loads(back.recv(PATIENCE_S))["client"] != page.client
    back.close()
    assert page.client not in [line.get("client") for line in console.asked_so_far()]


def test_an_emergency_with_a_foreign_name_stops_and_is_of_a_program_of_its_own_role(console, page):
    body = {"id": "e-1", "client": page.client}
    words = ("/api/emergency", "POST", body, console.drive)
    answer, asked = console.answering("emergency", console.ask, *words)
    assert answer.json["ok"]
    assert (asked["client"], asked["role"]) == ("program-drive", "drive")


def test_each_program_that_takes_a_robot_sits_in_a_seat_of_its_own(console):
    take = {"arguments": {"robots": ["robot-1"]}}
    one, first = act(console, console.drive, "take", **take)
    two, second = act(console, console.drive, "take", **take)
    assert one["key"] != two["key"]
    assert first["client"] != second["client"]
    assert (one["client"], one["id"]) == (first["client"], "a-1")
    assert first["id"] != second["id"]  # the same id of two programs is asked twice
    _, released = act(console, console.drive, "release", key=two["key"])
    assert released["client"] == second["client"]
    answer, stopped = act(console, console.drive, "stop")
    assert stopped["client"] == "program-drive"
    assert "key" not in answer


def test_a_program_that_gets_no_robot_gets_no_seat(console):
    take = {"arguments": {"robots": ["robot-1"]}}
    answer, _ = act(console, console.drive, "take", ok=False, **take)
    assert "key" not in answer
    assert console.next_asked("release")["client"].startswith("p")


@pytest.mark.system
def test_a_page_of_a_lower_role_makes_room_for_a_supervisors():
    with serving() as served:
        supervise = served.serving["supervise"].partition("?token=")[2]
        drivers = [served.page(served.drive) for _ in range(4)]
        pages = [served.page(served.look) for _ in range(MAX_CLIENTS - 4)]
        with pytest.raises(InvalidStatus):
            served.socket("/ws/state", served.look)
        late = served.page(supervise)
        assert late.you["role"] == "supervise"
        assert served.ask("/api/state", token=served.look).json["clients"] == MAX_CLIENTS
        for page in (*drivers, *pages[1:]):
            page.next("snap")  # the others are still served
        for page in (late, *drivers, *pages):
            page.close()
