"""Lines between a console and a page, changed on their way: hostile names, lag, silence, loss."""

from collections.abc import Callable
from typing import Any

from playwright.sync_api import BrowserContext, Page, WebSocketRoute

HOSTILE = "<img src=x onerror=alert(1)>"


def sockets_of(
    page: Page | BrowserContext,
    name: str,
    change: Callable[[str], str | None] = str,
    asked: Callable[[str], Any] = str,
) -> list[WebSocketRoute]:
    """Return the sockets of a name that pages open from now on.

    Args:
        change: Function that returns the line for the page in place of one; None: no line.
        asked: Callback for each line of a page.
    """
    sockets: list[WebSocketRoute] = []

    def route(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()
        sockets.append(socket)

        def to_page(text: str | bytes) -> None:
            new = change(str(text))
            if new is not None:
                socket.send(new)

        def to_console(text: str | bytes) -> None:
            asked(str(text))
            server.send(text)

        server.on_message(to_page)
        socket.on_message(to_console)

    page.route_web_socket(f"**/ws/{name}*", route)
    return sockets


def renamed(label: str, name: str = HOSTILE) -> Callable[[str], str]:
    """Return a change that replaces a label wherever it stands alone."""
    return lambda text: text.replace(f'"{label}"', f'"{name}"')
