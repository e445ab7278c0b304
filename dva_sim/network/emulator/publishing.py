"""Leads connections to ports of this machine to the same ports at the near end of a link.

The listening sockets belong to the network of this machine, the process that passes on their
connections to that of the near end: so bytes get from one to the other, past the emulated link.
"""

from __future__ import annotations

import asyncio
import socket
import sys
from collections.abc import Sequence
from contextlib import suppress

from dva_sim.network.emulator.linux_calls import NEAR_END

_HOSTS = "127.0.0.1", NEAR_END.address  # addresses at which a program of the near end may listen
_CHUNK = 65_536
BROKEN = OSError, asyncio.IncompleteReadError, asyncio.CancelledError
"""Errors that end a connection; before Python 3.12, a server prints a traceback of the last one."""


def words_of(listeners: Sequence[socket.socket]) -> list[str]:
    """Return the command line of the process that passes on what these sockets accept."""
    ports = [f"{listener.fileno()}:{listener.getsockname()[1]}" for listener in listeners]
    # -P: a file of the user that is called like a module of Python is not imported.
    return [sys.executable, "-P", "-m", __name__, *ports]


async def _serve(words: Sequence[str]) -> None:
    servers = []
    for file, port in (map(int, word.split(":")) for word in words):
        leader = _Leader(port)
        listener = socket.socket(fileno=file)
        servers.append(await asyncio.start_server(leader.lead, sock=listener))
    await asyncio.gather(*(server.serve_forever() for server in servers))


class _Leader:
    """Passes on the connections to one port."""

    def __init__(self, port: int) -> None:
        self._port = port

    async def lead(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Pass on the bytes of a connection both ways; it is closed if nobody listens there."""
        with suppress(*BROKEN):
            for host in _HOSTS:
                with suppress(ConnectionRefusedError):
                    streams = await asyncio.open_connection(host, self._port)
                    await join((reader, writer), streams)
                    break
        writer.close()


Stream = tuple[asyncio.StreamReader, asyncio.StreamWriter]


async def join(one: Stream, other: Stream) -> None:
    """Pass on the bytes of two connections to each other until both have ended; close them."""
    await asyncio.gather(_copy(one[0], other[1]), _copy(other[0], one[1]))
    one[1].close()
    other[1].close()


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Pass on bytes and the end of a stream; a connection that breaks ends both directions."""
    try:
        while data := await reader.read(_CHUNK):
            writer.write(data)
            await writer.drain()
        writer.write_eof()
    except OSError:
        writer.transport.abort()


if __name__ == "__main__":
    asyncio.run(_serve(sys.argv[1:]))
