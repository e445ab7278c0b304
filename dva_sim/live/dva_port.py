"""The port of a DVA in this process, which can be closed and reopened while the DVA runs."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.network.real_network import NetworkError, RealNetwork
from dva_sim.network.sockets import split_address
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.simulation.full.dva_server import DvaAgent
from dva_sim.simulation.full.stage import DVA


class DvaPort:
    """Port of a DVA.

    In a modelled network no real port is opened: the DVA joins or leaves the network.

    Args:
        agent: Function that returns the DVA, which is replaced after a crash.
        network: Network of the DVA.
        address: Address of the DVA; in a modelled network it is only displayed.

    Attributes:
        address: Current or future address.
        listens: True while it listens.
    """

    def __init__(
        self,
        agent: Callable[[], DvaAgent],
        network: RealNetwork | VirtualNetwork,
        address: str,
    ) -> None:
        self._agent = agent
        self._network = network
        self.address = address
        self.listens = True

    @property
    def number(self) -> int:
        """Port number for requests."""
        return split_address(self.address)[1]

    def close(self) -> None:
        """Take no more requests and send nothing; devices notice by their time-outs.

        Raises:
            NetworkError: the port is closed already.
        """
        if not self.listens:
            raise NetworkError("The server is already stopped.")
        self._network.leave(DVA)
        self._agent().silence(True)
        self.listens = False
        self._agent().device.tell(f"listens on port {self.number} no more", "link")

    def open(self, port: int) -> None:
        """Take requests on a port.

        Raises:
            NetworkError: a port is open already, or this one is not available.
        """
        if self.listens:
            raise NetworkError(f"The server is already listening on {self.address}.")
        host = split_address(self.address)[0]
        if isinstance(self._network, VirtualNetwork):
            self._network.come_back(DVA)
            self.address = f"{host}:{port}"
        else:
            self.address = self._network.join(DVA, host, port)
        self._agent().silence(False)
        self.listens = True
        self._agent().device.tell(f"listens on port {self.number}", "link")
