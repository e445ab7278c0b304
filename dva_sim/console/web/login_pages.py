"""The page on which users log in, and the way out."""

from __future__ import annotations

from collections.abc import Collection
from html import escape
from string import Template
from typing import Final
from urllib.parse import parse_qs

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response

from dva_sim.console.web import static_files
from dva_sim.console.web.access import Entrance
from dva_sim.console.web.hub import LOGIN, Hub
from dva_sim.console.web.logins import TooSoon
from dva_sim.console.web.rest import NOT_KEPT, TooStrange, bytes_of_body

LOGIN_PAGE: Final = "/login"
LOGOUT: Final = "/logout"
LOGIN_STYLE: Final = "/static/css/trust.css"
MAX_BYTES: Final = 4096  # of a form
POLICY: Final = (
    "default-src 'none'; style-src 'self'; img-src 'self'; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'"
)
WRONG: Final = "Name and password do not fit, or the user is locked."


class LoginPages:
    """Login and logout of users.

    Args:
        access: Rules of the console.
        hub: Hub of the pages, which close when their login is over.
        pages: Paths to which a login may lead.
    """

    def __init__(self, access: Entrance, hub: Hub, pages: Collection[str]) -> None:
        self._access = access
        self._hub = hub
        self._pages = pages

    async def page(self, request: Request) -> Response:
        """`GET /login`: the page with the form, which `POST /login` takes."""
        logins = self._access.logins
        if logins is None:
            raise HTTPException(404)
        target = request.query_params.get("next", "/")
        target = target if target in self._pages else "/"
        if request.method != "POST":
            return _page(target)
        form = await _form(request)
        name = form.get("name", "")
        address = request.client.host if request.client is not None else ""
        try:
            token = await logins.log_in(name, form.get("password", ""), address)
        except TooSoon as error:
            answer = _page(target, name, f"{str(error).capitalize()}.", 429)
            answer.headers["Retry-After"] = str(round(error.wait_s))
            return answer
        if token is None:
            return _page(target, name, WRONG, 403)
        answer = RedirectResponse(target, 303, headers=NOT_KEPT)
        answer.headers["Set-Cookie"] = self._access.cookie_of_login(token)
        return answer

    async def leave(self, request: Request) -> Response:
        """`POST /logout`: the login is over, and the pages that it opened close."""
        if self._access.logins is None:
            raise HTTPException(404)
        self._access.logins.log_out(request.scope[LOGIN])
        self._hub.close_ended()
        answer = RedirectResponse(LOGIN_PAGE, 303, headers=NOT_KEPT)
        answer.headers["Set-Cookie"] = self._access.cookie_of_login("")
        return answer


def _page(target: str, name: str = "", problem: str = "", status: int = 200) -> Response:
    words = {"target": target, "name": name, "problem": problem}
    page = Template(static_files.read("login.html") or "")
    text = page.substitute({key: escape(word) for key, word in words.items()})
    # A browser says that a form comes from here only if the page may say where it is.
    headers = NOT_KEPT | {"Content-Security-Policy": POLICY, "Referrer-Policy": "same-origin"}
    return HTMLResponse(text, status, headers=headers)


async def _form(request: Request) -> dict[str, str]:
    """Return the fields of a form, the first of each name.

    Raises:
        TooStrange: it is too long, or none.
    """
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/x-www-form-urlencoded":
        raise TooStrange(415, "the content type should be application/x-www-form-urlencoded")
    data = await bytes_of_body(request, MAX_BYTES)
    try:
        fields = parse_qs(data.decode(), max_num_fields=10)
    except ValueError:
        raise TooStrange(400, "the form is not as it should be") from None
    return {key: values[0] for key, values in fields.items()}
