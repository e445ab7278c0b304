"""The bench of a run: what can be done to its DVA, and is known of it, beside all messages."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable
from functools import partial
from typing import cast

from dva_sim.agents.device import do_nothing
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.dva.device_rows import rounded
from dva_sim.console.run.real_links import ConsoleSockets
from dva_sim.console.views.feed import Feed
from dva_sim.console.wire.rows import DeviceRow, ServerShown
from dva_sim.live.dva_port import DvaPort
from dva_sim.network.real_network import NetworkError
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol.devices import ControlRoomRole
from dva_sim.simulation.full.device_table import DeviceTable
from dva_sim.simulation.full.run import Run


class RunBench:
    """The bench of a run in this process, which alone reads what its DVA knows; see `Bench`.

    Args:
        run: The run.
        feed: View of its bodies.
        address: Address of its DVA, real or displayed.
        sockets: Sockets of the messages, if the links are real.
        moved: Called when the DVA listens elsewhere.

    Attributes:
        port: Port of the DVA.
        is_modelled: True if its links are modelled, and no real sockets.
    """

    def __init__(
        self,
        run: Run,
        feed: Feed,
        address: str,
        sockets: ConsoleSockets | None,
        moved: Callable[[str], object],
    ) -> None:
        network = cast(VirtualNetwork, run.network) if sockets is None else sockets.network
        self._run = run
        self._feed = feed
        self._tables = {dva: DeviceTable(partial(run.dvas.__getitem__, dva)) for dva in run.dvas}
        self.port = DvaPort(lambda: run.dva, network, address)
        self.is_modelled = sockets is None
        self._moved = moved

    def server(self) -> ServerShown:
        """Implement `Bench`."""
        return {
            "listens": self.port.listens,
            "address": self.port.address,
            "port": self.port.number,
            "modelled": self.is_modelled,
        }

    def open_server(self, port: int, on_result: OnResult) -> None:
        """Implement `Bench`."""
        try:
            self.port.open(port)
        except NetworkError as error:
            raise Refused(str(error)) from None
        self._moved(self.port.address)
        on_result(True, f"the server listens on {self.port.address}")

    def close_server(self, on_result: OnResult) -> None:
        """Implement `Bench`."""
        try:
            self.port.close()
        except NetworkError as error:
            raise Refused(str(error)) from None
        on_result(True, "the server is stopped")

    def appoint(
        self, room: str, role: ControlRoomRole, then: Callable[[], object] = do_nothing
    ) -> None:
        """Implement `Bench`."""
        for dva in self._run.dvas.values():
            dva.core.roles.appoint(room, role)
        then()

    def forget(self, device: str, then: Callable[[], object] = do_nothing) -> None:
        """Implement `Bench`."""
        for dva in self._run.dvas.values():
            dva.dismiss(device)
        then()

    # --- what no message tells or asks for -------------------------------------------------

    def complete(self, rows: Iterable[DeviceRow], dva_of: Callable[[str], str | None]) -> None:
        """Add to the rows of devices what no message tells; to be asked for once a second.

        Args:
            rows: Rows.
            dva_of: Function that returns the id of the DVA that lists a device.
        """
        robots = self._run.field.robots
        books = {
            (dva, booked.device.id_tag): booked
            for dva, table in self._tables.items()
            for booked in table.rows()
        }
        trips = {device.id_tag: device.round_trips for device in self._run.stage.devices}
        for row in rows:
            id_tag = row["id"]
            if trips.get(id_tag):
                row["round_trip_s"] = round(statistics.median(trips[id_tag]), 4)
            if (robot := robots.get(id_tag)) is not None:
                row["commands_hz"] = rate = self._feed.commands_hz(id_tag)
                row["refused"] = robot.refused
                row["picture_age_s"] = rounded(robot.picture_age, 2) if rate else None
            booked = books.get((dva_of(id_tag) or "", id_tag))
            if booked is None:
                continue
            if row["heard_s"] is None:  # one that is deaf and publishes nothing
                row["heard_s"] = rounded(booked.heard_s, 1)
            if booked.grant is not None:
                row["level"] = booked.grant.level
                row["ends_s"] = rounded(booked.ends_in, 1)

    def is_registered(self, device: str) -> bool:
        """Return True if an id is that of a DVA, or stands in the book of one."""
        return device in self._run.dvas or any(
            device in dva.core.registry.entries for dva in self._run.dvas.values()
        )
