"""One end of a TCP connection, as its program sees it."""

from __future__ import annotations

from collections.abc import Callable


def _nothing() -> None:
    return None


class TcpEndpoint:
    """One end of a connection: byte counts in, byte counts out.

    Attributes:
        on_readable: Called when bytes in order have arrived; `read` may be called inside.
        on_writable: Called when the send buffer has room again (a third of it is free)
            after a `write` that could not take everything.
        on_end: Called once when the other end has finished, has reset the connection,
            or has not answered for so long that it is given up.
        readable: Bytes in order that wait to be read [B].
    """

    on_readable: Callable[[], object] = staticmethod(_nothing)
    on_writable: Callable[[], object] = staticmethod(_nothing)
    on_end: Callable[[], object] = staticmethod(_nothing)
    readable: int = 0

    def write(self, count: int) -> int:
        """Hand over up to `count` bytes [B]; returns how many the send buffer took."""
        raise NotImplementedError

    def read(self, count: int) -> int:
        """Take up to `count` bytes in order [B]; returns how many. Opens the receive window."""
        raise NotImplementedError

    def finish(self) -> None:
        """The program closes its socket: what is written is still delivered, then the end.

        What still arrives is thrown away and answered by a reset (`on_end` at the other end).
        """
        raise NotImplementedError
