"""Ask what listens at an endpoint whether it wants keys, by the greeting of ZMTP 3 (RFC 37).

When one end has keys and the other has none, each hangs up as soon as it sees that. The quicker
one knows why, and the slower one may be cut off before it has read a word. This greets slowly:
it waits until it has heard the other end before it names its own mechanism, and never hangs up
first on a stranger. So both ends come to know.
"""

from __future__ import annotations

import zmq

_SIGNATURE = b"\xff" + bytes(7) + b"\x01\x7f"
_VERSION = b"\x03\x00"
_MECHANISM = slice(12, 32)  # where it stands in a greeting, filled up with zeros
_LENGTH = 64


class Greeting:
    """A greeting under way.

    Args:
        context: Where its socket lives.
        endpoint: Whom to greet.
        mechanism: What this end speaks: `NULL` or `CURVE`.

    Attributes:
        socket: To be polled; `read` takes what has arrived.
        theirs: What the other end speaks, once it is known.
        done: Whether there is nothing more to wait for.
    """

    def __init__(
        self, context: zmq.Context[zmq.Socket[bytes]], endpoint: str, mechanism: str
    ) -> None:
        self.mechanism = mechanism
        self.theirs: str | None = None
        self.done = False
        self._heard = b""
        self._is_open = False
        self.socket = context.socket(zmq.STREAM)
        self.socket.setsockopt(zmq.LINGER, 0)
        self.socket.setsockopt(zmq.RECONNECT_IVL, -1)
        self.socket.connect(endpoint)

    def read(self) -> None:
        """Take what has arrived, and go on."""
        while not self.done:
            try:
                who, data = self.socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            if data:
                self._hear(who, data)
            elif self._is_open:  # an empty message tells of an end, too
                self.done = True
            else:
                self._is_open = True
                self._say(who, _SIGNATURE + _VERSION)

    def _hear(self, who: bytes, data: bytes) -> None:
        if self.theirs is not None:
            return
        self._heard += data
        if len(self._heard) < _MECHANISM.stop:
            return
        self.theirs = self._heard[_MECHANISM].rstrip(b"\0").decode("ascii", "replace")
        if self.theirs == self.mechanism:
            self.done = True
        else:
            rest = self.mechanism.encode().ljust(20, b"\0")
            self._say(who, rest.ljust(_LENGTH - _MECHANISM.start, b"\0"))

    def _say(self, who: bytes, data: bytes) -> None:
        try:
            self.socket.send_multipart([who, data], zmq.NOBLOCK)
        except zmq.ZMQError:  # the other end has gone meanwhile
            self.done = True
