"""The page beside a DVA that runs alone: a console attached to it, in a process of its own.

The DVA goes on without it: whatever becomes of the page, the DVA's process only tells of it.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, Final

from dva_sim.agents.device import do_nothing
from dva_sim.cameras.children import PipedChild
from dva_sim.console.bench import UNATTENDED
from dva_sim.console.remote.options import own_ids
from dva_sim.console.remote.piped_bench import PLAIN
from dva_sim.kernel.errors import ConfigError
from dva_sim.live.dva_port import DvaPort
from dva_sim.live.process import ServedDva
from dva_sim.network.keys import KeyRing
from dva_sim.network.real_network import NetworkError
from dva_sim.options.runs import LiveOptions
from dva_sim.protocol.devices import ControlRoomRole
from dva_sim.serving.listening import listen
from dva_sim.serving.processes import end_all

MODULE: Final = "dva_sim.console.remote"
USUAL_PORT: Final = 8765  # of the page; if it is taken, any that is free
END_WITHIN: Final = 3.0  # for the page's processes to end by themselves [s]

Say = Callable[[str], object]


class PageBeside:
    """Page of a DVA that runs alone; implements `Beside`.

    Args:
        options: Options of the DVA, and of its page.
        say: Prints a line.

    Raises:
        ConfigError: the page's port is taken.
    """

    def __init__(self, options: LiveOptions, say: Say) -> None:
        self._options = options
        self._say = say
        self._page = _free_port(options)
        self._child: PipedChild | None = None
        self._dva: ServedDva | None = None
        self._close: Callable[[], object] = do_nothing

    def begin(self, dva: ServedDva) -> None:
        """Start the page's process; without a key it is not served, and a line says so."""
        keys = self._options.keys
        try:
            (own,) = own_ids(None if keys is None else KeyRing(keys))
        except ConfigError as error:
            self._say(f"no page: {error}")
            return
        self._dva = dva
        dva.appoint(own, UNATTENDED)
        dva.agent.keep_requests()  # else those that come before the page does are in no log
        port = DvaPort(lambda: dva.agent, dva.network, dva.address)
        child = self._child = PipedChild("the page", MODULE, [self._argument(own)], [], PLAIN)

        def hear() -> None:
            for line in child.pipe.lines():
                self._hear(line, port)
            if not child.pipe.is_open:
                self._close()
                dva.tell(f"{child.why()}; the DVA goes on without it")

        clock = dva.network.clock
        number = child.pipe.fileno()
        clock.watch(number, hear)
        self._close = lambda: clock.unwatch(number)

    def end(self) -> None:
        """End the page's process."""
        if self._child is not None:
            self._close()
            end_all([self._child], END_WITHIN)

    def _argument(self, own: str) -> str:
        options = self._options
        assert self._dva is not None
        page = {
            "dva": self._dva.address,
            "scenario": str(options.scenario),
            "set": options.set,
            "host": options.host,
            "port": self._page,
            "no_open": True,
            "no_token": options.no_token,
        }
        files = {"keys": options.keys, "users": options.users}
        paths = {name: str(file) for name, file in files.items() if file is not None}
        return json.dumps({"options": page, "files": paths, "own": own})

    def _hear(self, line: dict[str, Any], port: DvaPort) -> None:
        if line["k"] == "say":
            self._say(line["text"])
            return
        ok, text = self._do(line, port)
        assert self._child is not None
        answer = {"k": "done", "n": line["n"], "ok": ok, "text": text}
        self._child.pipe.put({**answer, "listens": port.listens, "address": port.address})

    def _do(self, line: dict[str, Any], port: DvaPort) -> tuple[bool, str]:
        """Do what the page asks for; whether it is done, and what there is to say of it."""
        assert self._dva is not None
        try:
            if line["what"] == "stop":
                port.close()
                return True, "the server is stopped"
            if line["what"] == "start":
                port.open(line["port"])
                return True, f"the server listens on {port.address}"
        except NetworkError as error:
            return False, str(error)
        if line["what"] == "forget":
            self._dva.agent.dismiss(line["device"])
            return True, ""
        self._dva.appoint(line["room"], ControlRoomRole(line["role"]))
        return True, ""


def _free_port(options: LiveOptions) -> int:
    """Return the wanted port, or the usual one; 0: any, if that is taken.

    Raises:
        ConfigError: the wanted port is taken.
    """
    try:
        listen(options.host, USUAL_PORT if options.page is None else options.page, "--page").close()
    except ConfigError:
        if options.page is not None:
            raise
        return 0
    return USUAL_PORT if options.page is None else options.page
