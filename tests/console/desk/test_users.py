"""Names of users who have logged in, in the log of the DVA and in the audit log."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.console.remote_console import RemotePage
from helpers.console.simulated_phone import FIRE, PhonePage
from helpers.console.waiting_for_disk import take_what_is_safe

from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.recordings.audit_log import AuditRow, read_rows

HERE = {"do": "here", "pages": {"c1": "supervise"}, "users": {"c1": "ana"}}


class Desk:
    """A page at which ana has logged in.

    Args:
        page: Page of the console.
        keeper: Keeper of its audit log.
    """

    def __init__(self, page: Any, keeper: AuditKeeper) -> None:
        self.page = page
        self._keeper = keeper
        page.actions.take(HERE)

    def written(self) -> list[AuditRow]:
        """The rows of the audit log, which ends by that."""
        self._keeper.close()
        return read_rows(self._keeper.path)


@pytest.fixture(params=["beside", "elsewhere"])
def desk(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Iterator[Desk]:
    world = PhonePage(monkeypatch, client="c1", bystander__count=0, events=FIRE)
    if request.param == "elsewhere":
        remote = RemotePage(world, tmp_path / "audit.sqlite")
        remote.until(remote.events)
        yield Desk(remote, remote.keeper)
        return
    keeper = AuditKeeper(tmp_path / "audit.sqlite", lambda: world.world.clock.now, {})
    world.world.keep_audit(keeper)
    world.world.clock.every(0.05, lambda: take_what_is_safe(keeper))
    world.until(lambda: world.lines_of("events") and world.lines_of("events")[-1]["events"])
    yield Desk(world, keeper)


def act(desk: Desk, what: str, **about: Any) -> None:
    if isinstance(desk.page, RemotePage):
        assert desk.page.ask(what, **about)["ok"]
    else:
        assert desk.page.do(what, role="supervise", **about)[0]
    desk.page.let(1.0)


def test_who_has_logged_in_stands_in_the_log_whatever_name_a_page_gives(desk):
    act(desk, "room_join", name="somebody else")
    act(desk, "event_acknowledge", event=1)
    act(desk, "take", robots=["robot-1"])
    control = desk.page.lines_of("control")[-1]
    assert [room["label"] for room in control["rooms"]] == ["ana"]
    authors = {(row.action, row.author) for row in desk.written()}
    assert {("acknowledge", "ana"), ("take", "ana")} <= authors
    assert "somebody else" not in {author for _, author in authors}
