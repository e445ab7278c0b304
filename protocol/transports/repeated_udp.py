"""An example of an own transport: copy this file, change it, and name it in a scenario.

    transport: {name: repeated_udp.py:RepeatedUdp, options: {copies: 3}}

`dva-sim check transport repeated_udp.py:RepeatedUdp` tells whether it keeps what every transport
promises.
"""

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.middleware import CommandTransport, TransportEnd
from dva_sim.network.middleware.udp import UdpTransport


class RepeatedUdp(CommandTransport):
    """UDP that carries each command again in the next datagrams.

    A lost command then arrives with the next one. The robot drops what it has had.

    Args:
        copies: Datagrams that carry each command.
    """

    title = "repeated UDP"

    def __init__(self, copies=2):
        if isinstance(copies, bool) or not isinstance(copies, int) or not 1 <= copies <= 9:
            raise ConfigError(f"option 'copies' is {copies!r}; should be a whole number, 1 to 9")
        self.copies = copies

    def near(self, place, receive):
        """Connect the operator's end."""
        return _Repeating(UdpTransport().near(place, receive), self.copies)

    def far(self, place, receive):
        """Open the robot's end."""
        return UdpTransport().far(place, receive)


class _Repeating(TransportEnd):
    def __init__(self, end, copies):
        self._end, self._recent, self._copies = end, [], copies

    def send(self, data):
        """Send the newest command, and those before it once more, the oldest first."""
        self._recent = [*self._recent, data][-self._copies :]
        sent = [self._end.send(one) for one in self._recent]
        return all(sent)

    def serve(self, until):
        """Take what comes."""
        self._end.serve(until)

    def close(self):
        """Close the socket."""
        self._end.close()
