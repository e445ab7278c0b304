"""Acts and views that need a bench, beside all that goes by the protocol."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final, Protocol

from dva_sim.agents.device import do_nothing
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import PortAsked
from dva_sim.console.wire.rows import DoingShown, RobotRow, ServerShown
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import ControlRoomRole

Status = m.RobotStatus | m.PersonStatus


class Bench(Protocol):
    """A system whose DVA runs on this bench, so that more can be done than messages can.

    A DVA that runs elsewhere has no bench. A recording can be looked at and cannot act: a bench of
    one refuses everything.
    """

    def server(self) -> ServerShown:
        """Return the address of the DVA's server, and whether it listens."""

    def open_server(self, port: int, on_result: OnResult) -> None:
        """Let the server listen on a port.

        Raises:
            Refused: it cannot.
        """

    def close_server(self, on_result: OnResult) -> None:
        """Let the server take no more requests.

        Raises:
            Refused: it takes none already.
        """

    def appoint(
        self, room: str, role: ControlRoomRole, then: Callable[[], object] = do_nothing
    ) -> None:
        """Give a control room of the console a role, and call `then` once the DVA knows.

        No device states its own role. The DVA relies on nobody here while no control room may
        decide.
        """

    def forget(self, device: str, then: Callable[[], object] = do_nothing) -> None:
        """Have the DVA forget a device at once, and call `then` once it has."""


class BenchView:
    """View of the bodies on a bench: empty, where all is known by messages alone.

    Pages move bodies ten times a second and follow modes at once, while a status is published once
    a second. All else that is seen is in no message.
    """

    def team(self) -> Iterable[tuple[m.Device, str]]:
        """Return the devices that are there from the start, each with the id of its DVA."""
        return ()

    def status(self, _: str) -> Status | None:
        """Return the status of a device of now, by its id; None if it cannot be seen."""
        return None

    def places(self) -> list[list[int]]:
        """Return the positions of people on foot: no message tells where one looks."""
        return []

    def people(self) -> list[DoingShown]:
        """Return the activities of people on foot, who need not be devices."""
        return []

    def complete(self, robot: str, row: RobotRow) -> None:
        """Add to the row of a robot what no message tells."""


UNATTENDED: Final = ControlRoomRole.DRIVE  # of a control room at which nobody decides
NOT_HERE: Final = "this console is attached to a DVA that runs elsewhere: that cannot be done here"


class ServerActions:
    """Does what pages ask of the DVA's server.

    Args:
        bench: Bench on which the DVA runs; None: it runs elsewhere.
    """

    def __init__(self, bench: Bench | None) -> None:
        self._bench = bench

    @does("server_start")
    def _open(self, _: str, line: PortAsked, on_result: OnResult) -> None:
        self._own_bench.open_server(line["port"], on_result)

    @does("server_stop")
    def _close(self, _: str, __: Asked, on_result: OnResult) -> None:
        self._own_bench.close_server(on_result)

    @property
    def _own_bench(self) -> Bench:
        if self._bench is None:
            raise Refused(NOT_HERE)
        return self._bench
