"""Every role may press the emergency stop, on every path by which a page or a program sends it."""

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from helpers.console.served_console import Served, serving_phones
from helpers.processes.patience import PATIENCE_S

from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.roles import Role

ROLES = [role for role in Role if role is not Role.NOBODY]
REFUSED = [(Role.LOOK, "stop"), (Role.PHONE, "take"), (Role.DRIVE, "event_assign")]
REFUSED += [(Role.DISPATCH, "take_over")]


@pytest.fixture(scope="module")
def console(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with serving_phones(tmp_path_factory.mktemp("certificates")) as served:
        yield served


def token(console: Served, role: Role) -> str:
    return str(console.serving[role.name.lower()]).partition("?token=")[2]


def over_request(console: Served, role: Role, action: str) -> tuple[int, Any]:
    body = {"id": "e", "action": action, "arguments": {}}
    answer = console.ask("/api/actions", "POST", body, token(console, role))
    return answer.status, answer.json


def over_emergency_request(console: Served, role: Role, action: str) -> tuple[int, Any]:
    answer = console.ask(f"/api/{action}", "POST", {"id": "e"}, token(console, role))
    return answer.status, answer.json


def over_socket(console: Served, role: Role, action: str) -> tuple[int, Any]:
    page = console.page(token(console, role))
    with page.driving() as drive:
        drive.send(json.dumps({"id": "e", "do": action}))
        while (line := json.loads(drive.recv(PATIENCE_S)))["k"] != "done":
            pass
    page.close()
    return 200, line


Path = Callable[[Served, Role, str], tuple[int, Any]]


@pytest.mark.parametrize("path", [over_emergency_request, over_request, over_socket])
@pytest.mark.parametrize("role", ROLES, ids=lambda role: role.name.lower())
def test_every_role_stops_robots_on_every_path(console: Served, role: Role, path: Path) -> None:
    (status, answer), asked = console.answering("emergency", path, console, role, "emergency")
    assert (status, answer["ok"]) == (200, True)
    assert asked["role"] == role.name.lower()


@pytest.mark.parametrize(("role", "action"), REFUSED)
def test_what_a_role_may_not_do_is_refused_with_a_reason(
    console: Served, role: Role, action: str
) -> None:
    assert ACTIONS[action].role > role
    console.asked_so_far()
    status, body = over_request(console, role, action)
    assert (status, body["ok"]) == (403, False)
    _, line = over_socket(console, role, action)
    assert (line["ok"], line["outcome"]) == (False, "refused")
    assert body["text"] == line["text"] != ""
    assert action not in [line["do"] for line in console.acted()]


def test_a_view_only_page_that_closes_stops_nobody(console: Served) -> None:
    console.asked_so_far()
    page = console.page(console.look)
    with page.driving():
        pass
    page.close()
    assert "gone" not in [line["do"] for line in console.acted()]
