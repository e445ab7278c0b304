"""The sockets of pages: who is let in."""

import asyncio

from starlette.responses import Response

from dva_sim.console.web.access import Role
from dva_sim.console.web.hub import Hub
from dva_sim.console.web.simulation import Simulation


class Asking:
    """A WebSocket that asks to be let in."""

    def __init__(self, **query: str) -> None:
        self.query_params = query
        self.told: Response | None = None

    async def send_denial_response(self, response: Response) -> None:
        self.told = response

    async def accept(self) -> None:
        raise AssertionError("it was let in")


def test_after_the_end_no_page_is_let_in_that_would_take_the_world_for_lost():
    async def story() -> list[Response | None]:
        hub = Hub(Simulation())
        client = hub.clients.join(Role.DRIVE, "")
        hub.simulation.why = "the console was ended"
        hub.simulation.ended.set()
        sees, drives = Asking(), Asking(key=client.key)
        await hub.see(sees, Role.DRIVE)
        await hub.drive(drives, Role.DRIVE)
        return [sees.told, drives.told]

    for told in asyncio.run(story()):
        assert told is not None
        assert (told.status_code, told.body) == (503, b"the console was ended")
