"""Pages Main and Devices: what they show of the DVA, and their actions."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any, cast

from dva_sim.agents.device import AgentDevice
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.dva.device_rows import DeviceRows
from dva_sim.console.dva.fake_devices import NOWHERE, FakeDevices
from dva_sim.console.run.real_links import ConsoleSockets
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import FakeAsked, OfDevice, PortAsked
from dva_sim.console.wire.rows import DevicesLine, ServerShown
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.real_network import NetworkError
from dva_sim.network.sockets import split_address
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, address_of, id_of


class DvaPort:
    """Port of a run's DVA, which can be opened and closed.

    On real links the port is closed and opened; on modelled ones no port ever opens: the DVA takes
    part in the modelled network, or does not.

    Args:
        recorder: Recorder of the run, which notes opening and closing.
        address: Address of the DVA, real or displayed.
        sockets: Sockets of the messages, if the links are real.

    Attributes:
        address: Current or future address.
        listens: True while it listens.
    """

    def __init__(
        self, run: Run, recorder: Recorder, address: str, sockets: ConsoleSockets | None
    ) -> None:
        self._run = run
        self._recorder = recorder
        self._sockets = sockets
        self.address = address
        self.listens = True

    def line(self) -> ServerShown:
        """Return its state for a page."""
        return {
            "listens": self.listens,
            "address": self.address,
            "port": split_address(self.address)[1],
            "modelled": self._sockets is None,
        }

    def stop(self) -> None:
        """Take no more requests and say nothing; the devices find out by their time-outs.

        Raises:
            Refused: it does not listen.
        """
        if not self.listens:
            raise Refused("The server is already stopped.")
        self._network.leave(DVA)
        self._run.dva.silence(True)
        self.listens = False
        self._tell(f"listens on port {split_address(self.address)[1]} no more")

    def start(self, port: int) -> None:
        """Take requests on a port.

        Raises:
            Refused: it listens already, or the port cannot be had.
        """
        if self.listens:
            raise Refused(f"The server is already listening on {self.address}.")
        host = split_address(self.address)[0]
        if self._sockets is None:
            self._network.come_back(DVA)
            self.address = f"{host}:{port}"
        else:
            try:
                self.address = self._sockets.network.join(DVA, host, port)
            except NetworkError as error:
                raise Refused(str(error)) from None
        self._run.dva.silence(False)
        self.listens = True
        self._tell(f"listens on port {split_address(self.address)[1]}")

    @property
    def _network(self) -> Any:
        if self._sockets is not None:
            return self._sockets.network
        return cast(VirtualNetwork, self._run.network)

    def _tell(self, what: str) -> None:
        self._recorder.tell(self._run.clock.now, "dva", what, "link")


class DvaPages:
    """The DVA of a run as people see and serve it.

    Args:
        address: Address of the DVA, real or displayed.
        sockets: Sockets of the messages, if the links are real.
        moved: Called when the DVA listens elsewhere.

    Attributes:
        port: Port of the DVA.
        looked: True while somebody looks at the table of devices.
    """

    def __init__(
        self,
        run: Run,
        address: str,
        sockets: ConsoleSockets | None,
        moved: Callable[[str], object],
    ) -> None:
        self._run = run
        self._is_real = sockets is not None
        self._moved = moved
        self.port = DvaPort(run, run.recorder, address, sockets)
        self.looked = False
        self._rows = DeviceRows(run)
        entries = run.dva.core.registry.entries
        self._fakes = FakeDevices(
            self._make, lambda i: i == DVA or i in entries, self._identity, self._dismiss
        )

    @property
    def fakes(self) -> Collection[str]:
        """Ids of the devices that were added by hand, which hear nothing."""
        return self._fakes.devices.keys()

    def devices(self, now_ms: int) -> DevicesLine | None:
        """The table, once a second; None if nobody looks."""
        if not self.looked:
            return None
        rows = self._rows.rows(self._fakes.devices)
        return {"k": "devices", "t": now_ms, "devices": rows}

    @does("server_start")
    def _start(self, _: str, line: PortAsked, on_result: OnResult) -> None:
        self.port.start(line["port"])
        self._moved(self.port.address)
        on_result(True, f"the server listens on {self.port.address}")

    @does("server_stop")
    def _stop(self, _: str, __: Asked, on_result: OnResult) -> None:
        self.port.stop()
        on_result(True, "the server is stopped")

    @does("revoke")
    def _revoke(self, _: str, line: OfDevice, on_result: OnResult) -> None:
        robot = line["device"]
        grant = self._run.dva.core.sessions.permissions.grants.get(robot)
        if grant is None:
            raise Refused(f"nobody has a permission for {robot}")
        self._run.dva.revoke(grant.robot, None, notify_holder=True)
        labels = self._run.stage.labels
        holder = labels.get(grant.holder, grant.holder)
        on_result(
            True, f"{holder} has no permission for {labels.get(grant.robot, grant.robot)} any more"
        )

    @does("fake_add")
    def _add(self, _: str, line: FakeAsked, on_result: OnResult) -> None:
        self._fakes.add(line, on_result)

    @does("fake_remove")
    def _remove(self, _: str, line: OfDevice, on_result: OnResult) -> None:
        on_result(True, f"{self._fakes.remove(line['device'])} is removed")

    # --- fake devices ----------------------------------------------------------------------

    def _make(self, id_tag: str, label: str, kind: str, address: str) -> AgentDevice:
        stage = self._run.stage
        dva = self._run.dva.device
        device = AgentDevice(
            id_tag=id_tag,
            label=label,
            device_type=kind,
            address=address,
            dva=DVA,
            network=stage.network,
            recorder=stage.recorder,
            frame=stage.site.frame,
            timeout=dva.timeout,
            attempts=dva.attempts,
            labels=stage.labels,
            time_of_day=stage.time_of_day,
        )
        stage.devices.append(device)
        return device

    def _identity(self, number: int) -> tuple[str, str]:
        nowhere = NOWHERE.format(number % 250 + 1)
        return id_of("fake", number), nowhere if self._is_real else address_of("fake", number)

    def _dismiss(self, id_tag: str) -> None:
        stage = self._run.stage
        stage.devices[:] = [d for d in stage.devices if d.id_tag != id_tag]
        stage.labels.pop(id_tag, None)
        self._run.dva.dismiss(id_tag)
