"""A TCP connection in virtual time, segment by segment, as Linux behaves under ZeroMQ."""

from dva_sim.network.tcp.connection import TcpConnection
from dva_sim.network.tcp.endpoint import TcpEndpoint
from dva_sim.network.tcp.ordered_messages import OrderedMessages
from dva_sim.network.tcp.parameters import TcpOptions

__all__ = ["OrderedMessages", "TcpConnection", "TcpEndpoint", "TcpOptions"]
