"""Leads connections between programs of this machine across an emulated link, and back.

Programs at neither end of the link listen at sockets of the file system, which are the same in all
networks. A relay at each end takes what is connected at its side, opens a connection of TCP across
the link for it, and the relay at the other end leads that to where it should go. The buffers of the
relays are small, so that what waits does so in TCP's, as without relays.
"""

from __future__ import annotations

import asyncio
import socket
import sys
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from dva_sim.network.emulator import publishing
from dva_sim.network.emulator.forwarder import FAR, NEAR
from dva_sim.network.emulator.needs import EmulatorError
from dva_sim.network.emulator.process import ADDRESSES, LinkEnded, LinkProcess
from dva_sim.network.emulator.report import LinkReport
from dva_sim.network.link import LinkConfig
from dva_sim.serving.processes import Child, end_all

PORT = 7000  # port at which each relay takes connections across the link
ENDS = {NEAR: FAR, FAR: NEAR}
_RETRY_DELAY_S = 0.05  # pause between attempts to reach the relay at the other end [s]
_BUFFER = 4096  # buffer of a relay in each direction [B]
_LONGEST = 90  # maximum length of the folder's name: Linux limits socket names to 107 characters
_BACKLOG = 128  # maximum connections that a relay has not accepted yet
_NUMBER = 2  # size of the number by which a connection states its destination [B]


class CrossedLink:
    """An emulated link, and ways across it; all of it ends with this process.

    Places are known by numbers, such as ports.

    Args:
        config: The link, near to far and back.
        seed: Random seed of its losses and jitter.

    Raises:
        EmulatorError: the link cannot be set up here; the line says what is missing.
    """

    def __init__(self, config: LinkConfig, seed: int) -> None:
        with ExitStack() as undone:
            self._folder = TemporaryDirectory(prefix="dva-sim-")
            undone.callback(self._folder.cleanup)
            if len(self._folder.name) > _LONGEST:
                raise EmulatorError(
                    f"{self._folder.name} is too long for names of sockets; set TMPDIR to a "
                    "shorter one"
                )
            self._link = LinkProcess(config, seed)
            undone.pop_all()
        self._controls: dict[str, socket.socket] = {}  # of the relays, by end
        self._relays = {end: self._started(end) for end in ENDS}
        self._led: set[tuple[str, int]] = set()

    def _started(self, end: str) -> Child:
        words = [sys.executable, "-P", "-m", __name__, self._folder.name, end]
        self._controls[end], far_socket = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with far_socket:
            return self._link.start(end, words, f"the relay at the {end} end", stdin=far_socket)

    def begin(self) -> None:
        """Let the link's time begin now: the moment that outages and recordings count from."""
        self._link.begin()

    def place(self, number: int) -> Path:
        """Return where a program listens that is reached across the link."""
        return _place(self._folder.name, number)

    def way(self, end: str, number: int) -> Path:
        """Return where a program at one end connects to, to reach a place at the other."""
        path = Path(self._folder.name, f"{end}-{number}")
        if (end, number) not in self._led:
            self._led.add((end, number))
            # It is there at once, whatever the relay is doing, which takes it over.
            with socket.socket(socket.AF_UNIX) as listener, suppress(ConnectionError):
                listener.bind(str(path))
                listener.listen(_BACKLOG)
                socket.send_fds(self._controls[end], [str(number).encode()], [listener.fileno()])
        return path

    @property
    def has_ended(self) -> bool:
        """Return True if the link or a relay has ended by itself."""
        return self._link.has_ended or any(r.poll() is not None for r in self._relays.values())

    def ended(self) -> LinkEnded:
        """Make the error of a link that has ended by itself, or whose relay has."""
        relays = () if self._link.has_ended else self._relays.values()
        gone = next((relay for relay in relays if relay.poll() is not None), None)
        return self._link.ended() if gone is None else LinkEnded(gone.why())

    def report(self) -> LinkReport | None:
        """End the link, and count what became of its packets; None if it has ended by itself."""
        with suppress(LinkEnded):
            return self._link.report()
        return None

    def close(self) -> None:
        """End the link and its relays, and remove their files."""
        end_all(self._relays.values(), 0.0)
        for control in self._controls.values():
            control.close()
        self._link.close()
        self._folder.cleanup()


def _place(folder: str, number: int) -> Path:
    return Path(folder, str(number))


class _Relay:
    """The relay at one end."""

    def __init__(self, folder: str, end: str) -> None:
        self._folder = folder
        self._end = end
        self._led: list[asyncio.Task[asyncio.Server]] = []
        self._control = socket.socket(fileno=sys.stdin.fileno())

    async def serve(self) -> None:
        """Lead connections until the standard input ends, by which listening sockets come."""
        server = await asyncio.start_server(self._arrive, ADDRESSES[self._end], PORT, limit=_BUFFER)
        ended = asyncio.Event()
        asyncio.get_running_loop().add_reader(self._control, self._take, ended)
        async with server:
            await ended.wait()

    def _take(self, ended: asyncio.Event) -> None:
        number, files, *_ = socket.recv_fds(self._control, 64, 1)
        if number:
            self._led.append(asyncio.create_task(self._lead(int(number), files[0])))
        else:
            ended.set()

    async def _lead(self, number: int, listener: int) -> asyncio.Server:
        async def leave(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            with suppress(*publishing.BROKEN):
                across = await self._across()
                across[1].write(number.to_bytes(_NUMBER, "big"))
                await self._join((reader, writer), across)
            writer.close()

        listening = socket.socket(fileno=listener)
        return await asyncio.start_unix_server(leave, sock=listening, limit=_BUFFER)

    async def _across(self) -> publishing.Stream:
        """Connect to the relay at the other end, which may begin to listen a little later."""
        while True:
            with suppress(ConnectionRefusedError):
                return await asyncio.open_connection(
                    ADDRESSES[ENDS[self._end]], PORT, limit=_BUFFER
                )
            await asyncio.sleep(_RETRY_DELAY_S)

    async def _arrive(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Lead a connection that has crossed the link to its place."""
        with suppress(*publishing.BROKEN):
            number = int.from_bytes(await reader.readexactly(_NUMBER), "big")
            place = _place(self._folder, number)
            streams = await asyncio.open_unix_connection(place, limit=_BUFFER)
            await self._join((reader, writer), streams)
        writer.close()

    @staticmethod
    async def _join(one: publishing.Stream, other: publishing.Stream) -> None:
        for _, writer in (one, other):
            writer.transport.set_write_buffer_limits(_BUFFER)
        await publishing.join(one, other)


if __name__ == "__main__":
    asyncio.run(_Relay(*sys.argv[1:]).serve())
