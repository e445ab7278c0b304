"""The DVA's server under a person's hand: it listens on a port, or is silent."""

from __future__ import annotations

from typing import Any, cast

from dva_sim.console.asking.refusal import Refused
from dva_sim.console.run.real_links import ConsoleSockets
from dva_sim.console.wire.rows import ServerShown
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.real_network import NetworkError
from dva_sim.network.sockets import split_address
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA


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
        self._run, self._recorder, self._sockets = run, recorder, sockets
        self.address, self.listens = address, True

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
