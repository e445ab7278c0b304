"""The bench of a run: what can be done to its DVA, and is known of it, beside all messages."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import cast

from dva_sim.agents.device import do_nothing
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.run.real_links import ConsoleSockets
from dva_sim.console.wire.rows import ServerShown
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
        address: Address of its DVA, real or displayed.
        sockets: Sockets of the messages, if the links are real.
        moved: Called when the DVA listens elsewhere.

    Attributes:
        port: Port of the DVA.
        devices: Devices in the book of each DVA, by its id.
        is_modelled: True if its links are modelled, and no real sockets.
    """

    def __init__(
        self,
        run: Run,
        address: str,
        sockets: ConsoleSockets | None,
        moved: Callable[[str], object],
    ) -> None:
        network = cast(VirtualNetwork, run.network) if sockets is None else sockets.network
        self._run = run
        self.devices = {dva: DeviceTable(partial(run.dvas.__getitem__, dva)) for dva in run.dvas}
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

    def is_registered(self, device: str) -> bool:
        """Return True if an id is that of a DVA, or stands in the book of one."""
        return device in self._run.dvas or any(
            device in dva.core.registry.entries for dva in self._run.dvas.values()
        )
