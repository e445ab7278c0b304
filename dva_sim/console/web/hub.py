"""The two WebSockets of a page: what it sees, and what it does.

Seeing and driving have a socket each, so that a page that draws slowly still stops at once.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from starlette.responses import PlainTextResponse
from starlette.websockets import WebSocket

from dva_sim.console.web.actions import Bucket, asked_of, check_role, id_of, read
from dva_sim.console.web.clients import MAX_CLIENTS, REMEMBERED, Client, Clients, Driver
from dva_sim.console.web.simulation import Simulation
from dva_sim.console.web.state import body_of, encode
from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.arguments import OfRobots
from dva_sim.console.wire.kinds import BadMessage, read_arguments
from dva_sim.console.wire.limits import DRIVES_BURST, DRIVES_RATE, LOOKS_BURST, LOOKS_RATE
from dva_sim.console.wire.roles import Role
from dva_sim.console.wire.seats import REFUSAL
from dva_sim.serving.connection import wire_of
from dva_sim.serving.web_sockets import heard, say

TIDY = 10.0  # from one look at silent programs to the next [s]
WITHOUT_PAGE = ("emergency", "stop", "gone")  # what is done though a page sees nothing
REFUSED, STUCK, LEAVING = 1008, 1013, 1001  # why a socket is closed

USER = "dva_sim.user"  # name of the user who is logged in, in a request's scope
LOGIN = "dva_sim.login"  # token of the login, likewise
LOGIN_OVER = "the login is over"

Next = Callable[[], str | None]
Hear = Callable[[str], None]


class Hub:
    """All pages and their sockets.

    Args:
        simulation: The simulation.

    Attributes:
        watching: Callback when pages look at other robots.
        is_logged_in: Predicate of the token of a login: True while that goes on.
    """

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.clients = Clients(simulation.state)
        self.watching: Callable[[], None] = lambda: None
        self.is_logged_in: Callable[[str], bool] = lambda _: True
        self._open: set[WebSocket] = set()
        self._later: set[asyncio.Task[None]] = set()
        simulation.changed = self._changed

    def _changed(self, kind: str, line: dict[str, Any]) -> None:
        """Send something new: who drives gets the newest of its seat at once."""
        if kind == "seat":
            client = self.clients.named(str(line["seat"]))
            if client is not None and client.driver is not None:
                client.driver.seat("{" + body_of(line))
        self.clients.wake()

    # --- seeing --------------------------------------------------------------------------

    async def see(self, ws: WebSocket, role: Role) -> None:
        """Serve a state socket until it closes."""
        key, page = (ws.query_params.get(name, "")[:64] for name in ("key", "page"))
        if self.clients.find(key, role) is None and not self._make_room(role):
            await ws.send_denial_response(
                PlainTextResponse(f"{MAX_CLIENTS} pages are open already", 503)
            )
            return
        if await self._is_over(ws):
            return
        client = self.clients.join(role, key, page)
        if client.ws is not None:  # the page has lost that one, and we did not know
            wire_of(client.ws.scope).drop(STUCK, "this page was opened again")
        client.ws = ws
        client.user = ws.scope.get(USER, "")
        client.login = ws.scope.get(LOGIN, "")
        self._tell_here()
        you = {"k": "you", "client": client.name, "key": client.key, "role": role.name.lower()}
        you["user"] = client.user
        client.feed.put(you)

        def hear(text: str) -> None:
            self._hear_looker(client, text)

        try:
            await ws.accept()
            bucket = Bucket(LOOKS_RATE, LOOKS_BURST)
            await self._serve(ws, client.wake, client.feed.next, hear, bucket)
        finally:
            if client.ws is ws:
                self._leave(client)

    def _make_room(self, role: Role) -> bool:
        """Return True if a page of a role may come in; one of a lower role may have to leave."""
        if not self.clients.is_full():
            return True
        least = self.clients.yielding(role)
        if least is None or least.ws is None:
            return False
        least.is_here = False
        wire_of(least.ws.scope).drop(STUCK, "somebody with a higher role took this place")
        return True

    def _hear_looker(self, client: Client, text: str) -> None:
        message = read(text)
        what = message.get("do")
        if what == "ping":
            line = {"k": "pong", "at": message.get("at"), "now": round(time.time() * 1000, 3)}
            client.feed.put(line)
        elif what == "resync":
            client.feed.resync()
        elif what == "watch":
            look = read_arguments(
                OfRobots, {"robots": message.get("robots")}, self.simulation.labels
            )
            client.watches = frozenset(look["robots"])
            client.feed.watches = client.watches
            self.watching()
        elif what == "look" and client.role is not Role.PHONE:
            client.feed.looks.look(message.get("logs", {}), message.get("tables", []))
            self._tell_looks()
        else:
            raise BadMessage("no such message; there are: ping, resync, watch, look")
        client.wake.set()

    def _tell_looks(self) -> None:
        """Tell the simulation what somebody looks at, and no more."""
        logs, tables = self.clients.looked()
        self.simulation.send({"do": "look", "logs": logs, "tables": tables})

    def _tell_here(self) -> None:
        """Tell the simulation who is there, so that the DVA orders nobody who is not."""
        users = {client.name: client.user for client in self.clients.here() if client.user}
        self.simulation.send({"do": "here", "pages": self.clients.acting(), "users": users})

    def _leave(self, client: Client) -> None:
        """Let a page go: its robots stop, and after a while others may have them."""
        self.clients.leave(client)
        self._tell_here()
        self._tell_looks()
        self.watching()
        self._stop_drive(client)
        task = asyncio.ensure_future(self._forget(client))
        self._later.add(task)
        task.add_done_callback(self._later.discard)

    async def _forget(self, client: Client) -> None:
        await asyncio.sleep(REMEMBERED)
        if self.clients.forget(client) and client.role.acts:
            self._replace(client)
            client.driver = None
            self._give_back(client)

    def _give_back(self, client: Client) -> None:
        """Release the robots and guard of a page or program that does not come back."""
        state = self.simulation.state
        for what in ("release", "guard_leave")[: 1 + (client.name in state.guards)]:
            key = f"bye-{what}-{client.name}"
            self.simulation.send({"id": key, "client": client.name, "do": what})
        state.forget_seat(client.name)

    async def keep_tidy(self) -> None:
        """Give back what programs hold that have asked for nothing in a long time."""
        while True:
            await asyncio.sleep(TIDY)
            for silent in self.clients.silent_programs(time.monotonic()):
                self._give_back(silent)
            self.close_ended()

    def close_ended(self) -> None:
        """Close the pages of users whose login is over."""
        for client in self.clients.here():
            if client.login and client.ws is not None and not self.is_logged_in(client.login):
                wire_of(client.ws.scope).drop(REFUSED, LOGIN_OVER)

    def new_program(self, role: Role) -> Client | None:
        """Return a seat for a program; None if there are too many of its role or above."""
        program, least = self.clients.add_program(role, time.monotonic())
        if least is not None:
            self._give_back(least)
        self._tell_here()
        return program

    def dismiss(self, program: Client) -> None:
        """Take back a seat that a program has not come to use."""
        self.clients.remove(program)
        self._give_back(program)

    # --- driving -------------------------------------------------------------------------

    async def drive(self, ws: WebSocket, role: Role) -> None:
        """Serve a driving socket until it closes; then its robots stop."""
        client = self.clients.find(ws.query_params.get("key", ""), role)
        if client is None or not client.is_here:
            await ws.send_denial_response(PlainTextResponse("no open page has this key", 403))
            return
        if await self._is_over(ws):
            return
        self._replace(client)
        driver = client.driver = Driver()
        if seat_line := self.simulation.state.seats.get(client.name):
            driver.seat("{" + seat_line.body)

        def hear(text: str) -> None:
            self._hear_driver(client, driver, text)

        try:
            await ws.accept()
            bucket = Bucket(DRIVES_RATE, DRIVES_BURST)
            await self._serve(ws, driver.wake, driver.next, hear, bucket)
        finally:
            if client.driver is driver:
                client.driver = None
                self._stop_drive(client)

    def _replace(self, client: Client) -> None:
        """Replace a page's driving socket; the newest counts, and begins at rest."""
        if client.driver is not None:
            client.driver.replaced = True
            client.driver.wake.set()
            self._stop_drive(client)

    def _stop_drive(self, client: Client) -> None:
        """Stop what a page drives; a view-only one drives nothing."""
        if client.role.acts:
            self.simulation.send({"client": client.name, "do": "gone"})

    def _hear_driver(self, client: Client, driver: Driver, text: str) -> None:
        if driver.replaced:
            return
        message = read(text)
        name = message.pop("do", None)
        key = message.pop("id", None)
        try:
            if not client.is_here and name not in WITHOUT_PAGE:
                raise BadMessage("this page has lost its other connection; it may only stop")
            check_role(client.role, name)
            request = asked_of(name, message, self.simulation.labels, silent=True)
            request["client"] = client.name
            if not ACTIONS[name].has_answer:
                self.simulation.send(request)
                return
            if client.role is Role.PHONE and "robots" not in message:
                request.pop("robots", None)  # an emergency is for its own robot
            request |= {"id": id_of(key), "role": client.role.name.lower()}
            self.simulation.ask(request, lambda line: driver.answer(encode(line)))
        except BadMessage as error:
            line = {"k": "done", "id": key if isinstance(key, str) else None, "ok": False}
            driver.answer(encode(line | {"text": str(error), "outcome": REFUSAL}))

    # --- both ----------------------------------------------------------------------------

    async def _is_over(self, ws: WebSocket) -> bool:
        """Return True if the world has ended, so that a client that returns is not let in again."""
        if self.simulation.ended.is_set():
            await ws.send_denial_response(PlainTextResponse(self.simulation.why, 503))
            return True
        return False

    async def _serve(
        self, ws: WebSocket, wake: asyncio.Event, following: Next, hear: Hear, bucket: Bucket
    ) -> None:
        """Send and receive until one of both ends; nothing of it is left behind."""
        self._open.add(ws)
        if self.simulation.ended.is_set():  # while it was being accepted
            wire_of(ws.scope).drop(LEAVING, self.simulation.why)
        tasks = [
            asyncio.ensure_future(self._send(ws, wake, following)),
            asyncio.ensure_future(self._receive(ws, hear, bucket)),
        ]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._open.discard(ws)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _send(self, ws: WebSocket, wake: asyncio.Event, following: Next) -> None:
        """Send one message at a time; the next one is chosen when there is room for it."""
        with suppress(Exception):
            while True:
                wake.clear()
                text = following()
                if text is None:
                    await wake.wait()
                elif not await say(ws, text):
                    wire_of(ws.scope).drop(STUCK, "nothing was read for 5 s")
                    return

    async def _receive(self, ws: WebSocket, hear: Hear, bucket: Bucket) -> None:
        """Receive messages of a page, as long as they make sense and are not too many."""
        while (text := await heard(ws)) is not None:
            try:
                if isinstance(text, bytes):
                    raise BadMessage("is not text")
                if not bucket.takes(time.monotonic()):
                    raise BadMessage("too many messages")
                hear(text)
            except BadMessage as error:
                wire_of(ws.scope).drop(REFUSED, str(error)[:100])
                return

    async def close(self, why: str) -> None:
        """Tell all pages that it is over."""
        line = encode({"k": "bye", "why": why})
        for ws in list(self._open):
            wire = wire_of(ws.scope)
            if not wire.waiting:
                with suppress(Exception):
                    await ws.send_text(line)
            wire.drop(LEAVING, "the console has ended")
        for task in list(self._later):
            task.cancel()
