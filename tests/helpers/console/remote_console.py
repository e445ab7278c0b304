"""A console at the DVA of a world that runs in virtual time, and what one does at its page."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from helpers.console.declared_lines import checked
from helpers.console.simulated_phone import FIRE, PhonePage
from helpers.console.waiting_for_disk import take_what_is_safe

from dva_sim.agents.device import do_nothing
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.bench import NOT_HERE
from dva_sim.console.desk.console_actions import ConsoleActions
from dva_sim.console.remote.links import RemoteLinks
from dva_sim.console.remote.remote_pages import RemotePages
from dva_sim.console.wire.actions import ActionPlace
from dva_sim.kernel.recorder import Recorder
from dva_sim.options.runs import ConsoleOptions
from dva_sim.recordings.audit_log import AuditRow, read_rows
from dva_sim.simulation.full.stage import id_of

OWN = id_of("control-room", 900)
DVA_HERE = "198.51.100.1:5600"


class RemotePage:
    """A console at a remote DVA beside the world of its DVA.

    Args:
        world: World of the DVA.
        audit: File of the audit log.
        role: Role that the DVA gives its control room.
        number: Number of its control room.
        scenario: Name or path of the world's scenario.

    Attributes:
        lines: Lines sent to the page.
    """

    def __init__(
        self,
        world: PhonePage,
        audit: Path,
        role: str = "supervise",
        number: int = 900,
        scenario: str = "hands-on",
    ) -> None:
        self.world, run = world, world.world.run
        rooms = [id_of("control-room", number + 100 * order) for order in range(len(run.dvas))]
        for dva in run.dvas.values():
            for room in rooms:
                dva.core.roles.appoint(room, role)
        links = RemoteLinks(
            clock=world.world.clock,
            recorder=Recorder(),
            network=run.network,
            own=rooms[0],
            others=tuple(rooms[1:]),
            dvas=tuple(run.dvas),
            address=f"198.51.100.9:{number}",
            seat_id=lambda seat: id_of("console", number + seat),
            join=lambda _: f"198.51.100.9:{number + 100}",
        )
        options = ConsoleOptions(dva=DVA_HERE, scenario=scenario, audit=audit)
        self.keeper = AuditKeeper(audit, lambda: world.world.clock.now, {})
        self.pages = RemotePages(options, links, self.keeper)
        self.system = self.pages.system
        self.lines: list[dict[str, Any]] = []
        self.pages.tell = lambda line, _="": self.lines.append(checked(line))
        self.actions = ConsoleActions(self.pages, ActionPlace.REMOTE, NOT_HERE)
        self.pages.begin()
        world.world.clock.every(0.05, lambda: take_what_is_safe(self.keeper))
        self._count = 0

    def let(self, seconds: float) -> None:
        """Let a time pass [s]."""
        self.world.let(seconds)

    def lines_of(self, kind: str) -> list[dict[str, Any]]:
        """All lines of a kind."""
        return [line for line in self.lines if line["k"] == kind]

    def ask(self, what: str, /, within: float = 60.0, **about: Any) -> dict[str, Any]:
        """Send an action; return its complete answer."""
        self._count += 1
        number = f"action {self._count}"
        usual = {"id": number, "client": "c1", "role": "supervise", "do": what}
        self.actions.take(usual | about)
        end = self.world.world.clock.now + within
        while self.world.world.clock.now < end:
            for line in self.lines_of("done"):
                if line["id"] == number:
                    return line
            self.let(0.01)
        raise AssertionError(f"{what}: no answer within {within} s")

    def seat_device(self, number: int = 0) -> str:
        """Return the id of the device of a seat."""
        return self.pages.driven.seating.persons[number].device.id_tag

    def events(self) -> list[dict[str, Any]]:
        """Events as the page shows them now."""
        shown = self.lines_of("events")
        return list(shown[-1]["events"]) if shown else []

    def alarms(self) -> list[str]:
        """The texts of the list, the gravest first."""
        self.let(1.0)
        return [row["text"] for row in self.lines_of("alarms")[-1]["alarms"]]

    def until(self, seen: Any, within: float = 120.0) -> None:
        """Let time pass until a condition holds."""
        self.world.until(seen, within)

    def written(self) -> list[AuditRow]:
        """The rows of the audit log, which ends by that."""
        self.keeper.close()
        return read_rows(self.keeper.path)


class NotedBench:
    """A bench that appoints the console of a page, and notes its requests."""

    def __init__(self, page: RemotePage) -> None:
        self._dva = page.world.world.run.dva
        self._roles = self._dva.core.roles
        self._own = page.system.device.id_tag
        self.asked: list[str] = []

    def server(self) -> dict[str, Any]:
        """See `Bench`, as all others."""
        return {"listens": True, "address": DVA_HERE, "port": 5600, "modelled": False}

    def open_server(self, port: int, on_result: Any) -> None:
        self.asked.append(f"start {port}")
        on_result(True, "started")

    def close_server(self, on_result: Any) -> None:
        self.asked.append("stop")
        on_result(True, "stopped")

    def appoint(self, room: str, role: Any, then: Any = do_nothing) -> None:
        assert room == self._own
        self.asked.append(str(role))
        self._roles.appoint(room, role)
        then()

    def forget(self, device: str, then: Any = do_nothing) -> None:
        self._dva.dismiss(device)
        then()


@contextmanager
def attached(
    monkeypatch: pytest.MonkeyPatch, folder: Path, role: str = "supervise", **changes: Any
) -> Iterator[RemotePage]:
    """An attached console that has heard of a fire; the policy asks first."""
    usual = {"bystander__count": 0, "events": FIRE, "dispatch__mode": "ask_first"}
    world = PhonePage(monkeypatch, client="w1", **usual | changes)
    page = RemotePage(world, folder / "audit.sqlite", role)
    page.until(page.events)
    yield page
    page.keeper.close()
