"""The web process by itself: `python -m dva_sim.console.web --fd N`."""

from __future__ import annotations

import argparse
import asyncio
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dva_sim.console.pages.addresses import address_of, own_address
from dva_sim.console.web.access import Entrance, Tokens, rules
from dva_sim.console.web.app import make_app
from dva_sim.console.web.audit import AuditPages
from dva_sim.console.web.camera import ConsoleCameras
from dva_sim.console.web.hub import Hub
from dva_sim.console.web.logins import Logins
from dva_sim.console.web.phones import NoCertificate
from dva_sim.console.web.simulation import Simulation
from dva_sim.console.wire.actions import prepare_checks
from dva_sim.console.wire.roles import Role
from dva_sim.kernel.errors import DvaSimError, error_line
from dva_sim.serving.listening import listen
from dva_sim.serving.port_listener import fitting_places
from dva_sim.serving.server import serve

if TYPE_CHECKING:
    from dva_sim.console.web.phone_listener import PhoneListener
from starlette.types import ASGIApp

from dva_sim.console.wire.limits import MAX_BYTES
from dva_sim.serving.server import Server
from dva_sim.serving.web_sockets import WireProtocol

PING = 10.0  # [s]


def make_server(app: ASGIApp, certificate: Path | None = None) -> Server:
    """Return the server of an application; by https where it has a certificate, with its key."""
    return Server.of(
        app,
        MAX_BYTES,
        ssl_certfile=certificate,
        ws=WireProtocol,
        ws_max_size=MAX_BYTES,
        ws_ping_interval=PING,
        ws_ping_timeout=PING,
        ws_per_message_deflate=False,
    )


FAREWELL = 0.2  # for last words on their way [s]


def main(words: Sequence[str] | None = None) -> int:
    """Serve until the simulation has ended; 0, or 1 if nothing can be served."""
    options = _parser().parse_args(words)
    try:
        asyncio.run(run(options))
    except DvaSimError as error:
        print(error_line(error), file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="dva_sim.console.web", description=__doc__)
    parser.add_argument("--fd", type=int, required=True, help="socket to the simulation")
    parser.add_argument("--pictures-fd", type=int, help="socket to who draws pictures")
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on")
    parser.add_argument("--port", type=int, default=0, help="0 for any that is free")
    parser.add_argument("--phones-host", default="0.0.0.0", help="address for phones")
    parser.add_argument("--phones-port", type=int, help="https for phones; 0 for any; else none")
    parser.add_argument("--certificates", type=Path, help="folder of those for phones")
    parser.add_argument("--name", action="append", default=[], help="another name of this machine")
    parser.add_argument("--report", type=Path, help="a study's report that may be shown")
    parser.add_argument("--audit", type=Path, help="file of the audit log")
    parser.add_argument("--users", type=Path, help="file of the users who may log in")
    parser.add_argument("--no-token", action="store_true", help="everybody may do everything")
    return parser


async def run(options: argparse.Namespace) -> None:
    """Open all, say where, serve, end."""
    # Ctrl-C may reach all processes; the simulation says when it is over.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sock = listen(options.host, options.port)
    port = sock.getsockname()[1]
    tokens = Tokens() if options.no_token else Tokens.drawn()
    logins = None if options.users is None else Logins(options.users, time.monotonic)
    access = rules(options.host, port, options.name, tokens, logins=logins)
    phones, notices = _phones(options, tokens, logins)
    simulation = Simulation()
    hub = Hub(simulation)
    if logins is not None:
        hub.is_logged_in = lambda token: logins.user_of(token) is not None
    cameras = ConsoleCameras(simulation, hub.clients.watched)
    hub.watching = cameras.tell
    ended = simulation.ended
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ended.set)
    simulation.open(options.fd)
    door = phones.door if phones else None
    about = {"phone": door.address if door else None, "notices": notices}
    simulation.send(serving(access, options.host, port) | about)
    if options.pictures_fd is not None:
        cameras.open(options.pictures_fd)
    telling = asyncio.gather(
        cameras.keep_telling(), hub.keep_tidy(), asyncio.to_thread(prepare_checks)
    )
    closing = asyncio.ensure_future(_close_when(ended, hub, cameras))
    over = _after(closing)
    audit = AuditPages(options.audit)
    app = make_app(access, hub, cameras, door=door, audit=audit, report=options.report)
    listeners = 2 if phones else 1
    serves = [serve(make_server(app), sock, fitting_places(listeners), over)]
    if phones:
        app = make_app(phones.access, hub, cameras, door=door, audit=audit)
        server = make_server(app, phones.certificate)
        serves.append(serve(server, phones.sock, fitting_places(listeners), over))
    await asyncio.gather(*serves)
    telling.cancel()
    simulation.close()


def _phones(
    options: argparse.Namespace, tokens: Tokens, logins: Logins | None
) -> tuple[PhoneListener | None, list[str]]:
    """Return the listener for phones, and what people should know of it.

    Without a certificate all else goes on.
    """
    if options.phones_port is None:
        return None, []
    from dva_sim.console.web.phone_listener import listen_for_phones  # late: start-up

    try:
        listener = listen_for_phones(
            options.phones_host,
            options.phones_port,
            options.name,
            tokens=tokens,
            folder=options.certificates,
            logins=logins,
        )
    except NoCertificate as error:
        return None, [f"no address for phones: {error}"]
    return listener, list(listener.notices)


async def _close_when(ended: asyncio.Event, hub: Hub, cameras: ConsoleCameras) -> None:
    await ended.wait()
    cameras.close()
    await hub.close(hub.simulation.why or "the console was ended")
    await asyncio.sleep(FAREWELL)


def _after(task: asyncio.Task[None]) -> asyncio.Event:
    done = asyncio.Event()
    task.add_done_callback(lambda _: done.set())
    return done


def serving(access: Entrance, host: str, port: int) -> dict[str, object]:
    """Return the first message to the simulation: the console's address and its secrets."""
    base = address_of(own_address(host) if access.own.any_address else host.strip("[]"), port)
    needs_token = access.tokens.are_asked
    addresses = {
        role.name.lower(): f"{base}?token={access.tokens.of(role)}" if needs_token else base
        for role in (Role.LOOK, Role.DRIVE, Role.DISPATCH, Role.SUPERVISE)
    }
    return {"do": "serving", "port": port, "base": base, **addresses}


if __name__ == "__main__":
    sys.exit(main())
