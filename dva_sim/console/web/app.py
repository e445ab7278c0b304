"""Routes of the console, and what guards all of them: access control and headers."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection, Request
from starlette.responses import (
    HTMLResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
)
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from dva_sim.cameras.streaming import PictureStream
from dva_sim.cameras.streams import CameraStreams, headers_of
from dva_sim.console.web import static_files
from dva_sim.console.web.access import Entrance
from dva_sim.console.web.audit import AuditPages
from dva_sim.console.web.hub import LOGIN, USER, Hub
from dva_sim.console.web.log_requests import LogRequests
from dva_sim.console.web.login_pages import LOGIN_PAGE, LOGIN_STYLE, LOGOUT, LoginPages
from dva_sim.console.web.phones import AUTHORITY, UNGUARDED, PhoneDoor, PhonePages
from dva_sim.console.web.relay import NoPictures, open_camera
from dva_sim.console.web.rest import NOT_KEPT, ROLE, Rest, TooStrange, json_answer, problem
from dva_sim.console.wire.roles import Role
from dva_sim.serving.connection import place_of
from dva_sim.serving.port_guard import facts_of


class StudyReport:
    """A study's report: one file with styles and pictures of its own, and no scripts.

    Args:
        path: File of the report; None without one.
    """

    POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'"

    def __init__(self, path: Path | None) -> None:
        self._path = path

    async def page(self, _: Request) -> Response:
        """`GET /report`: the report of a study that is shown."""
        try:
            data = None if self._path is None else self._path.read_bytes()
        except OSError:
            data = None
        if data is None:
            raise HTTPException(404)
        return HTMLResponse(data, headers=NOT_KEPT | {"Content-Security-Policy": self.POLICY})


POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; font-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
OPEN = "/healthz"
EMERGENCY = "/api/emergency"
UNLIMITED = (OPEN, EMERGENCY)  # answered however many connections are in use
# Pages that people open, each with the file that is shown.
PAGES = {"/": "index.html", "/phone": "phone.html", "/guard": "guard.html"}
_WORDS = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>dva-sim console</title></head>
<body><h1>This console asks for its token</h1>
<p>Open the address that <code>dva-sim console</code> printed on the line that begins with
<code>Console:</code>, or scan the code below the line that begins with <code>Phone:</code>.
The address ends with <code>?token=</code> and the token.</p>
<p>If you have just done so: <a href="/">go on</a>.</p></body></html>
"""
_NO_PAGE = "<!doctype html><title>dva-sim console</title><p>The pages are not installed.</p>"


class Doorkeeper:
    """Stands before the application: refuses, finds the role, and sets headers on each answer.

    Args:
        app: Application to guard.
        access: The rules.
    """

    def __init__(self, app: ASGIApp, access: Entrance) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] in _STARTS:
                message["headers"] = _with_headers(message.get("headers", ()))
            await send(message)

        answer = self._refusal(scope)
        place = place_of(scope)
        role = scope.get(ROLE, Role.NOBODY)
        is_limited = scope["path"] not in UNLIMITED
        if not place.begin(role, time.monotonic(), is_limited=is_limited):
            answer = answer or problem(503, "too many connections are in use")
        try:
            if answer is None:
                await self._app(scope, receive, send_with_headers)
            elif scope["type"] == "http":
                await answer(scope, receive, send_with_headers)
            else:
                ws = WebSocket(scope, receive, send_with_headers)
                await ws.send_denial_response(answer)
        finally:
            place.end(time.monotonic())

    def _refusal(self, scope: Scope) -> Response | None:
        """Response to a request without permission; else the role is noted in the scope."""
        asking = HTTPConnection(scope)
        is_page = scope["path"] in PAGES or scope["path"] == "/trust"
        refusal = self._access.own.refusal(facts_of(scope, is_page=is_page))
        if refusal is not None:
            return PlainTextResponse(refusal[1] + "\n", refusal[0], headers=NOT_KEPT)
        scope[ROLE] = role = self._access.role(asking.headers, asking.query_params)
        user = self._access.user(asking.headers)
        scope[USER] = "" if user is None else user.name
        scope[LOGIN] = "" if user is None else self._access.session(asking.headers)
        if role is Role.NOBODY and scope["path"] not in (OPEN, *UNGUARDED):
            return self._unknown(scope["path"])
        return None

    def _unknown(self, path: str) -> Response | None:
        """Response to somebody without permission; None: the page may be seen all the same."""
        if self._access.logins is not None:
            if path in (LOGIN_PAGE, LOGIN_STYLE):
                return None
            if path in PAGES:
                return RedirectResponse(f"{LOGIN_PAGE}?next={path}", 303, headers=NOT_KEPT)
        return _unknown(path)


_STARTS = ("http.response.start", "websocket.accept", "websocket.http.response.start")


def _with_headers(headers: Any) -> list[tuple[bytes, bytes]]:
    names = {name.lower() for name, _ in headers}
    more = [(k.lower().encode(), v.encode()) for k, v in HEADERS.items()]
    return [*headers, *(pair for pair in more if pair[0] not in names)]


def _unknown(path: str) -> Response:
    if path in PAGES:
        return HTMLResponse(_WORDS, 401, headers=NOT_KEPT)
    if path.startswith("/api/"):
        return problem(401, "this console asks for its token")
    return PlainTextResponse("this console asks for its token\n", 401, headers=NOT_KEPT)


class Pages:
    """The page, its files, its pictures, and whether all is well.

    Args:
        access: Knows the cookie.
        hub: Knows the simulation.
        cameras: Pictures.
    """

    def __init__(self, access: Entrance, hub: Hub, cameras: CameraStreams) -> None:
        self._access = access
        self._simulation = hub.simulation
        self._cameras = cameras

    async def index(self, request: Request) -> Response:
        """`GET /`: the page; a token in the address becomes a cookie and leaves the address."""
        path = request.url.path
        token = request.query_params.get("token")
        if path == "/" and request.scope[ROLE] is Role.PHONE:
            path = "/phone"
        if token is not None or path != request.url.path:
            answer = RedirectResponse(path, 303, headers=NOT_KEPT)
            role = self._access.tokens.role_of(token or "")
            if self._access.tokens.are_asked and role is not Role.NOBODY:
                answer.headers["Set-Cookie"] = self._access.cookie_for(role)
            return answer
        return HTMLResponse(static_files.read(PAGES[path]) or _NO_PAGE, headers=NOT_KEPT)

    async def health(self, _: Request) -> Response:
        """`GET /healthz`: 200 while the simulation runs, else 503."""
        runs = self._simulation.runs
        body = {"status": "ok" if runs else "the simulation does not run"}
        return json_answer(body, 200 if runs else 503)

    async def stream(self, request: Request) -> Response:
        """`GET /camera/LABEL.mjpg`: a stream of JPEGs of a robot's camera."""
        robot = self._robot(request)
        row = self._simulation.state.row_of(robot)
        if "camera" in row:  # of a robot elsewhere, which states it or not
            return await self._relayed(request, robot, row["camera"])
        if not self._cameras.draws:
            return problem(503, "no picture: nobody draws")
        if request.method == "HEAD":
            return Response(headers=NOT_KEPT, media_type=PictureStream.media_type)
        viewer = self._cameras.admit(robot, request.scope[ROLE])
        if viewer is None:
            return problem(503, "64 viewers are looking already")
        return PictureStream(self._cameras.stream(viewer), partial(self._cameras.leave, viewer))

    async def _relayed(self, request: Request, robot: int, url: str | None) -> Response:
        """Return a stream from the address that a robot elsewhere has stated."""
        if not url:
            return Response(status_code=204, headers=NOT_KEPT)
        viewer = self._cameras.admit(robot, request.scope[ROLE])
        if viewer is None:
            return problem(503, "64 viewers are looking already")
        try:
            camera = await open_camera(url)
        except NoPictures as error:
            self._cameras.leave(viewer)
            return problem(503, f"no picture: {error}")

        def leave() -> None:
            self._cameras.leave(viewer)
            camera.writer.close()  # also if the viewer left before the first picture

        return PictureStream(camera.pictures(), leave)

    async def still(self, request: Request) -> Response:
        """`GET /camera/LABEL.jpg`: one picture of a robot's camera."""
        robot = self._robot(request)
        viewer = self._cameras.admit(robot, request.scope[ROLE])
        picture = None if viewer is None else await self._cameras.one(viewer)
        if picture is None:
            return problem(503, "no picture")
        headers = headers_of(picture) | NOT_KEPT
        return Response(picture.jpeg, headers=headers, media_type="image/jpeg")

    def _robot(self, request: Request) -> int:
        """Return the robot whose label is asked for: one of the scene's, or nothing is found."""
        robot: int | None = self._simulation.labels.get(request.path_params["label"])
        if robot is None:
            raise HTTPException(404)
        return robot


async def _strange(_: Request, error: Exception) -> Response:
    assert isinstance(error, TooStrange)
    return problem(error.status, str(error))


async def _status(_: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    text = f"{error.detail}\n".lower()
    return PlainTextResponse(text, error.status_code, headers=dict(error.headers or {}) | NOT_KEPT)


def _for(least: Role, endpoint: Any) -> Any:
    """Return an endpoint for those who may do so much."""

    async def guarded(request: Request) -> Response:
        if request.scope[ROLE] < least:
            role = request.scope[ROLE]
            return problem(403, f"this token may only {_ONLY.get(role, 'look')}")
        answer: Response = await endpoint(request)
        return answer

    return guarded


_ONLY = {Role.PHONE: "drive by phone", Role.DRIVE: "drive", Role.DISPATCH: "dispatch"}


def make_app(
    access: Entrance,
    hub: Hub,
    cameras: CameraStreams,
    door: PhoneDoor | None = None,
    audit: AuditPages | None = None,
    report: Path | None = None,
) -> ASGIApp:
    """Return the whole application.

    Args:
        access: Its rules.
        hub: Hub of all pages, regardless of the listener that opened them.
        cameras: Pictures.
        door: Entrance for phones, if there is one.
        audit: Audit log, if it is kept.
        report: A study's report that is shown as it is.
    """
    study_report = StudyReport(report)
    pages = Pages(access, hub, cameras)
    rest = Rest(hub)
    phones = PhonePages(door)
    log = audit or AuditPages(None)
    logs = LogRequests(hub)
    login = LoginPages(access, hub, PAGES)

    async def see(ws: WebSocket) -> None:
        await hub.see(ws, ws.scope[ROLE])

    async def drive(ws: WebSocket) -> None:
        await hub.drive(ws, ws.scope[ROLE])

    routes = [
        *(Route(path, pages.index) for path in PAGES),
        Route(LOGIN_PAGE, login.page, methods=["GET", "POST"]),
        Route(LOGOUT, login.leave, methods=["POST"]),
        Route("/trust", phones.trust),
        Route(AUTHORITY, phones.authority),
        Route("/api/phones", _for(Role.DRIVE, phones.about)),
        Route("/api/phones.svg", _for(Role.DRIVE, phones.code)),
        Mount("/static", static_files.PageFiles()),
        Route(OPEN, pages.health),
        Route("/report", study_report.page),
        Route("/camera/{label:path}.mjpg", pages.stream),
        Route("/camera/{label:path}.jpg", pages.still),
        Route("/api/state", rest.state),
        Route("/api/site", rest.site),
        Route("/api/story", rest.story),
        Route("/api/audit", log.rows),
        Route("/api/audit/check", log.check),
        Route("/api/audit/measures", log.measures),
        Route("/api/audit.csv", log.as_csv),
        Route("/api/audit.json", log.as_json),
        Route("/api/logs/{name}", _for(Role.LOOK, logs.lines)),
        Route("/api/logs/{name}/export", _for(Role.DRIVE, logs.export)),
        Route("/api/logs/{name}/{number:int}", _for(Role.DRIVE, logs.entry)),
        Route("/api/actions", rest.action, methods=["POST"]),
        Route(EMERGENCY, rest.emergency, methods=["POST"]),
        WebSocketRoute("/ws/state", see),
        WebSocketRoute("/ws/drive", drive),
    ]
    handlers: Any = {TooStrange: _strange, HTTPException: _status}
    return Doorkeeper(Starlette(routes=routes, exception_handlers=handlers), access)
