"""Connections that keep a port busy and ask for nothing: silent, half-open, slow and with TLS.

`python connection_flood.py HOST PORT COUNT [--tls]` holds so many open, opens another for each one
that is cut, and prints a line when all have been opened once. It ends with its standard input.
"""

import argparse
import asyncio
import contextlib
import os
import ssl
import sys

HEAD = b"GET /api/state HTTP/1.1\r\nHost: localhost\r\nX-Slow: "
DRIP = 0.5  # interval between two bytes of a slow request [s]
AGAIN = 0.05  # pause after a refused or cut connection [s]
TOGETHER = 200  # number of connections opened at a time


class Flood:
    """Connections to one port.

    Args:
        tls: True if the port speaks TLS.
    """

    def __init__(self, host: str, port: int, tls: bool) -> None:
        self.host, self.port = host, port
        self.context = ssl._create_unverified_context() if tls else None
        self.gate = asyncio.Semaphore(TOGETHER)
        self.kinds = [self.silent, self.half_open, self.slow, self.answered]
        self.opened = 0

    async def run(self, count: int) -> None:
        """Hold a number of connections open."""
        kinds = [self.kinds[i % len(self.kinds)] for i in range(count)]
        self.kept = [asyncio.ensure_future(self.keep(kind)) for kind in kinds]
        while self.opened < count:
            await asyncio.sleep(0.05)
        print("open", flush=True)
        await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
        os._exit(0)  # thousands of tasks are not worth an orderly end

    async def keep(self, kind) -> None:
        """Hold a connection of a kind, and open another whenever it is cut."""
        while True:
            with contextlib.suppress(OSError, asyncio.IncompleteReadError):
                await kind()
            await asyncio.sleep(AGAIN)

    async def connect(self, context: ssl.SSLContext | None):
        """A connection."""
        async with self.gate:
            found = await asyncio.open_connection(self.host, self.port, ssl=context)
        self.opened += 1
        return found

    async def silent(self) -> None:
        """Say nothing; with TLS, after the handshake."""
        reader, writer = await self.connect(self.context)
        await reader.read()
        writer.close()

    async def half_open(self) -> None:
        """Begin and go no further: without TLS's first word, or with half a request."""
        reader, writer = await self.connect(None)
        if self.context is None:
            writer.write(HEAD)
        await reader.read()
        writer.close()

    async def slow(self) -> None:
        """Say a request byte by byte."""
        reader, writer = await self.connect(self.context)
        writer.write(HEAD)
        ended = asyncio.ensure_future(reader.read())
        while not ended.done():
            writer.write(b"x")
            await asyncio.wait({ended}, timeout=DRIP)
        writer.close()

    async def answered(self) -> None:
        """Ask once without a token, and stay."""
        reader, writer = await self.connect(self.context)
        writer.write(HEAD + b"\r\n\r\n")
        while await reader.read(4096):
            pass
        writer.close()


def main() -> None:
    """Flood a port until standard input ends."""
    parser = argparse.ArgumentParser()
    parser.add_argument("host")
    parser.add_argument("port", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--tls", action="store_true")
    given = parser.parse_args()

    async def flood() -> None:
        await Flood(given.host, given.port, given.tls).run(given.count)

    asyncio.run(flood())


if __name__ == "__main__":
    main()
