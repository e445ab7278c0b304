"""State and actions for programs: what a page sees and does, by plain requests."""

from __future__ import annotations

import asyncio
import hashlib
import json
import secrets
import time
from typing import Any

from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from dva_sim.console.web.actions import NotAllowed, asked_of, check_role, id_of, is_id, read
from dva_sim.console.web.hub import Hub
from dva_sim.console.web.simulation import Answer
from dva_sim.console.web.state import RunState
from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.kinds import BadMessage
from dva_sim.console.wire.limits import MAX_BYTES
from dva_sim.console.wire.roles import Role
from dva_sim.kernel.labels import visible
from dva_sim.worlds.geo import GeoFrame

NOT_KEPT = {"Cache-Control": "no-store"}
ROLE = "dva_sim.role"  # what is known of who asks, in a request's scope
BODY_WITHIN = 10.0  # [s]
PROGRAM = "program"  # with its role: the client of a request without a key


def state_of(state: RunState, clients: int) -> dict[str, Any]:
    """Return the newest of everything, with units in the names."""
    rows = state.lines.get("rows", {})
    values = {row["i"]: row for row in rows.get("robots", ())}
    doing = {row["i"]: row for row in rows.get("people", ())}
    robots = []
    people = []
    for thing in (state.scene or {}).get("things", ()):
        place = _place(state, thing["i"])
        about = {"label": thing["label"], "id": thing["id"], "kind": thing["kind"]}
        more = values if thing["kind"] == "robot" else doing
        entry = about | place | _without(more.get(thing["i"], {}), "i")
        if thing["kind"] == "robot":
            robots.append(entry)
        elif thing["kind"] != "dva":
            people.append(entry)
    return {
        "time_s": state.time / 1000,
        "scenario": (state.scene or {}).get("scenario"),
        "clock": rows.get("clock"),
        "link": rows.get("link"),
        "robots": robots,
        "people": people,
        "hazards": state.lines.get("hazards", {}).get("hazards", []),
        "events": state.lines.get("events", {}).get("events", []),
        "seats": state.seats_known(),
        "clients": clients,
        "dropped": rows.get("dropped", 0),
    }


def _place(state: RunState, index: int) -> dict[str, float]:
    """Return a position; empty if off the site."""
    row = state.places.get(index)
    if row is None:
        return {}
    _, x_cm, y_cm, heading, speed = row
    x = x_cm / 100
    y = y_cm / 100
    place = {"x_m": x, "y_m": y}
    if (frame := frame_of(state)) is not None:
        latitude, longitude = frame.to_latlon(x, y)
        place |= {"latitude_deg": round(latitude, 8), "longitude_deg": round(longitude, 8)}
    return place | {"heading_rad": heading / 1000, "speed_mps": speed / 1000}


def frame_of(state: RunState) -> GeoFrame | None:
    """Return the geographic position of the site."""
    origin = (state.scene or {}).get("site", {}).get("origin")
    return GeoFrame(origin["latitude_deg"], origin["longitude_deg"]) if origin else None


def _without(row: dict[str, Any], *names: str) -> dict[str, Any]:
    return {key: value for key, value in row.items() if key not in names}


class Rest:
    """The requests of programs.

    Args:
        hub: Hub of the pages; knows the simulation.
    """

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._simulation = hub.simulation

    async def state(self, _: Request) -> Response:
        """`GET /api/state`: the state of the run, with units in the names."""
        body = state_of(self._simulation.state, len(self._hub.clients.here()))
        return json_answer(body)

    async def site(self, request: Request) -> Response:
        """`GET /api/site`: the plan of the site, which does not change."""
        scene = self._simulation.state.scene
        if scene is None or "site" not in scene:
            return problem(503, "nothing has begun")
        response = json_answer(scene["site"])
        tag = f'"{hashlib.sha256(response.body).hexdigest()[:32]}"'
        headers = {"ETag": tag, "Cache-Control": "no-cache"}
        if tag in request.headers.get("if-none-match", ""):
            return Response(status_code=304, headers=headers)
        response.headers.update(headers)
        return response

    async def story(self, request: Request) -> Response:
        """`GET /api/story?from=N`: lines of the story from a number on, as far as they are kept."""
        state = self._simulation.state
        start = request.query_params.get("from", "0")
        if not start.isascii() or not start.isdigit() or len(start) > 9:
            return problem(400, "from should be a whole number")
        oldest = state.story_count - len(state.story)
        first = min(max(int(start), oldest), state.story_count)
        lines = list(state.story)[first - oldest :]
        body = {"from": first, "next": state.story_count, "lines": lines}
        return json_answer(body)

    async def action(self, request: Request) -> Response:
        """`POST /api/actions`: the answer to an action; repeating its id does nothing twice."""
        try:
            body = await body_of_request(request)
            role = request.scope[ROLE]
            name = body.get("action")
            check_role(role, name)
            client = self._client(body, role)
            if name == "gone":
                self._simulation.send({"do": "gone", "client": client})
                return json_answer({"ok": True, "text": ""})
            action_request = asked_of(name, body.get("arguments", {}), self._simulation.labels)
            key = id_of(body.get("id"))
            if ACTIONS[action_request["do"]].seats and "key" not in body:
                return await self._do_in_new_seat(action_request, key, role)
            return self._answer(await self._do(action_request, key, client, role))
        except NotAllowed as error:
            return problem(403, str(error))
        except BadMessage as error:
            return problem(400, str(error))

    async def emergency(self, request: Request) -> Response:
        """`POST /api/emergency`: stops all robots, or some, before anything else that waits."""
        try:
            body = await body_of_request(request)
            role = request.scope[ROLE]
            action_request = asked_of("emergency", self._robots_of(body), self._simulation.labels)
            driver = self._hub.clients.find(body.get("key"), role)  # else anybody's, all the same
            client = driver.name if driver is not None else _program(role)
            key = body.get("id")
            key = key if is_id(key) else secrets.token_hex(8)  # a stop is not refused for its id
            return self._answer(await self._do(action_request, key, client, role))
        except BadMessage as error:
            return problem(400, str(error))

    def _robots_of(self, body: dict[str, Any]) -> dict[str, Any]:
        """Return the robots to stop: those that are known of a list, and all if none of it is."""
        named = body.get("robots", "all")
        labels = self._simulation.labels
        if not isinstance(named, list):
            return {"robots": named}
        robots = [
            one
            for one in named
            if (isinstance(one, str) and one in labels)
            or (type(one) is int and one in labels.values())
        ]
        return {"robots": robots or "all"}

    def _client(self, body: dict[str, Any], role: Role) -> str:
        """Return the name of the page or program that asks.

        Raises:
            NotAllowed: it shows no key that belongs to a seat of its role.
        """
        if "key" in body:
            client = self._hub.clients.find(body["key"], role)
            if client is None:
                raise NotAllowed("key: no open page and no program of this role has this key")
            if client.asked:
                client.asked = time.monotonic()
            return client.name
        if "client" in body:
            raise NotAllowed("client: a name opens no seat; send the key of that page or program")
        return _program(role)

    async def _do_in_new_seat(self, action_request: Answer, key: str, role: Role) -> Response:
        """Let a program sit down; the answer has the key for its later requests."""
        program = self._hub.new_program(role)
        if program is None:
            return problem(503, "too many programs have a seat")
        line = await self._do(action_request, key, program.name, role)
        if not line.get("ok"):
            self._hub.dismiss(program)
            return self._answer(line)
        return self._answer(line | {"client": program.name, "key": program.key})

    async def _do(self, action_request: Answer, key: str, client: str, role: Role) -> Answer:
        """Ask the simulation, and wait until it has answered."""
        return await self._simulation.answer(
            action_request | {"id": key, "client": client, "role": role.name.lower()}
        )

    def _answer(self, line: Answer) -> Response:
        body = {"id": line["id"], "ok": bool(line.get("ok")), "text": line.get("text", "")}
        body |= {name: line[name] for name in ("client", "key", "outcome") if name in line}
        return json_answer(body, 504 if line.get("late") else 200)


def _program(role: Role) -> str:
    return f"{PROGRAM}-{role.name.lower()}"


async def body_of_request(request: Request) -> dict[str, Any]:
    """Return the JSON object in a body that is not too long.

    Raises:
        BadMessage: it is something else.
    """
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/json":
        raise TooStrange(415, "the content type should be application/json")
    try:
        return read(await bytes_of_body(request, MAX_BYTES))
    except BadMessage as error:
        raise BadMessage(f"the body {error}") from None


async def bytes_of_body(request: Request, most: int) -> bytes:
    """Return a body that is not too long, and arrives in time.

    Raises:
        TooStrange: it is otherwise.
    """
    length = request.headers.get("content-length", "0")
    if length.isdigit() and int(length) > most:
        raise TooStrange(413, f"the body is longer than {most} bytes")
    data = bytearray()
    try:
        async with asyncio.timeout(BODY_WITHIN):
            async for piece in request.stream():
                data += piece
                if len(data) > most:
                    raise TooStrange(413, f"the body is longer than {most} bytes")
    except TimeoutError:
        raise TooStrange(408, f"the body has not arrived within {BODY_WITHIN:g} s") from None
    except ClientDisconnect:
        raise TooStrange(400, "the body is not whole") from None
    return bytes(data)


class TooStrange(Exception):
    """A request that is answered by its status; not for want of sense in what it asks."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


def json_answer(body: Any, status: int = 200) -> Response:
    """Return an answer that nobody keeps; half characters, as names may hold, are escaped."""
    return Response(json.dumps(body, allow_nan=False), status, NOT_KEPT, "application/json")


def problem(status: int, text: str) -> Response:
    """Return an answer that says in one line why nothing was done."""
    return json_answer({"ok": False, "text": visible(text)}, status)
