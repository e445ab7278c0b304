"""A console from its start to its end: the world here, the web and the pictures beside it."""

from __future__ import annotations

import gc
import os
import socket
import sys
import time
import webbrowser
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

from dva_sim.console.actions import Actions
from dva_sim.console.children import END_WITHIN, Child, ChildFailed
from dva_sim.console.options import ConsoleOptions
from dva_sim.console.recorder import keep_run
from dva_sim.console.world import ConsoleWorld
from dva_sim.kernel.errors import DvaSimError
from dva_sim.live.process import ending_when_asked
from dva_sim.live.recording import Keeper, LiveRecorder, Outlet

# What else is printed at the start: an address for each of those who may do less than everything.
ROLES = ("Dispatch only", "dispatch"), ("Drive only", "drive"), ("Look only", "look")
WEB, PICTURES = "dva_sim.console.web", "dva_sim.console.pictures"
LAST_WORDS = 0.2  # of virtual time, for robots that are told to stop [s]
BROWSERLESS = ("CI", "PYTEST_CURRENT_TEST", "DVA_SIM_NO_BROWSER")  # where none is opened
FLUSH = 0.05  # from one look at what waits to be written to the next, real time [s]
MOST_RESTARTS = 5  # of the process that draws
NO_DISPLAY = ("DISPLAY", "WAYLAND_DISPLAY")

Say = Callable[[str], object]


class ConsoleSupervisor:
    """One console.

    Args:
        options: What to run, and where it is to be seen.
        say: Prints a line.
    """

    def __init__(self, options: ConsoleOptions, say: Say) -> None:
        self._options, self._say = options, say
        self._children: list[Child] = []
        self._to_web: socket.socket | None = None
        self._failed, self._restarts = "", 0

    def run(self) -> None:
        """Run until Ctrl-C, SIGTERM, or the end of the web process.

        Raises:
            ConfigError: the scenario cannot be run, or not recorded as wanted.
            ChildFailed: the web process could not begin, or has ended by itself.
            DvaSimError: what was to be recorded is not, or not all of it.
        """
        options, scenario, seed = self._options, self._options.read(), self._options.seed
        results = options.kept_results()
        if results is not None:
            scenario, seed = results.scenario, results.seed
        measured = results is not None
        world = ConsoleWorld(
            *(scenario, options.scenario, seed), sockets=options.sockets(), measured=measured
        )
        world.phones.motion_folder = options.motion_folder()
        if results is not None:
            results.follow(world)
        with self._recorded(world):
            self._run(world)
        if results is not None:
            results.write()
            self._say(f"{options.results} written")
        if self._failed:
            raise ChildFailed(self._failed)
        if options.record is not None:
            self._say(f"{options.record} written")

    @contextmanager
    def _recorded(self, world: ConsoleWorld) -> Iterator[None]:
        """Keep a recording of what happens, if one is wanted; in the end all is closed."""
        options, keeper, outlet = self._options, None, None
        if options.record is not None:
            keeper = Keeper(options.record, world.scenario, world.seed)
            outlet = Outlet(keeper.inlet())
            world.recorder.kept = LiveRecorder(world.clock, outlet)
            world.recorder.kept.is_own = lambda _: True
            keep_run(world.run, world.recorder)
        try:
            yield
        finally:
            self._end_all()
            world.phones.close()
            if world.sockets is not None:
                world.sockets.close()
            if outlet is not None:
                world.recorder.tidy()
                outlet.close()
            lost = None if keeper is None else keeper.finish()
            if lost is not None and sys.exc_info()[0] is None:
                raise DvaSimError(lost)

    def _run(self, world: ConsoleWorld) -> None:
        options = self._options
        with ending_when_asked(world.clock, supervised=False) as ending:
            web, pictures = self._start()
            serving = web.first_line()
            world.serve_cameras(str(serving["base"]))
            actions = Actions(world)
            world.tell = web.pipe.put
            world.dropped = lambda: web.pipe.outbox.dropped
            self._listen(world, web, actions)
            self._draw(world, pictures)
            world.begin()
            world.clock.pulse(FLUSH, self._flush)
            gc.freeze()  # what stays for the whole run is not looked through again and again
            self._say(f"Console: {serving['supervise']}")
            if options.token:
                for name, role in ROLES:
                    self._say(f"{name}: {serving[role]}")
            self._say_of_phones(serving)
            if world.sockets is not None:
                self._say(f"DVA: {world.sockets.dva}")
            self._open_browser(str(serving["supervise"]))
            if not ending.is_asked:
                world.clock.go()
                world.clock.run()
            self._leave(world, web)

    def _start(self) -> tuple[Child, Child]:
        options = self._options
        ours, self._to_web = socket.socketpair()
        words = ["--host", options.host, "--port", str(options.port)]
        words += ["--pictures-fd", str(ours.fileno())]
        words += [] if options.token else ["--no-token"]
        if options.phones:
            words += ["--phones-host", options.phones_host]
            words += ["--phones-port", str(options.phones_port)]
        web = Child("web process", WEB, words, [ours])
        self._children.append(web)
        ours.close()
        return web, self._start_pictures()

    def _start_pictures(self) -> Child:
        """Our copy of its end stays open, so that another one can take its place."""
        end = self._to_web
        assert end is not None
        pictures = Child("pictures process", PICTURES, ["--web-fd", str(end.fileno())], [end])
        self._children.append(pictures)
        return pictures

    def _listen(self, world: ConsoleWorld, web: Child, actions: Actions) -> None:
        def hear() -> None:
            for line in web.pipe.lines():
                actions.take(line)
            if not web.pipe.is_open:
                world.clock.unwatch(web.pipe.fileno())
                self._failed = web.why()
                world.clock.stop()

        world.clock.watch(web.pipe.fileno(), hear)

    def _draw(self, world: ConsoleWorld, pictures: Child) -> None:
        """Without pictures all else goes on, and another process draws from then on."""
        world.show = pictures.pipe.put

        def hear() -> None:
            pictures.pipe.lines()
            if pictures.pipe.is_open:
                return
            world.clock.unwatch(pictures.pipe.fileno())
            world.recorder.tell(world.clock.now, "console", pictures.why(), "link")
            self._children.remove(pictures)
            pictures.end()
            pictures.make_sure(0.0)
            if self._restarts < MOST_RESTARTS:
                self._restarts += 1
                self._draw(world, self._start_pictures())
                world.show_scene()

        world.clock.watch(pictures.pipe.fileno(), hear)

    def _flush(self) -> None:
        for child in self._children:
            child.pipe.flush()

    def _leave(self, world: ConsoleWorld, web: Child) -> None:
        """Everybody who drives is stopped, and a moment is left for the word of it."""
        for person in world.persons:
            person.release(lambda *_: None)
        world.clock.pace(paused=False)
        with suppress(DvaSimError):
            world.clock.run(world.clock.now + LAST_WORDS)
        web.pipe.put({"k": "bye", "t": world.feed.now_ms, "why": "the console was ended"})

    def _end_all(self) -> None:
        if self._to_web is not None:
            self._to_web.close()
        for child in self._children:
            child.end()
        deadline = time.monotonic() + END_WITHIN
        for child in self._children:
            child.make_sure(deadline)

    def _say_of_phones(self, serving: Mapping[str, Any]) -> None:
        """Their address, also for a camera; and what people should know of it."""
        for told in serving["told"]:
            self._say(told)
        if address := serving["phone"]:
            from dva_sim.console.qr_code import half_blocks  # late: start-up

            self._say(f"Phone: {address}")
            if (sys.stdout.encoding or "").lower().replace("-", "") == "utf8":
                self._say(half_blocks(address, sys.stdout.isatty()))
            trust = address.partition("?")[0].removesuffix("phone")
            self._say(f"A phone has to trust this machine once: {trust}trust says how.")

    def _open_browser(self, address: str) -> None:
        """Where there is one; never where nobody could see it."""
        hidden = any(os.environ.get(name) for name in BROWSERLESS)
        seen = sys.platform in ("darwin", "win32") or any(map(os.environ.get, NO_DISPLAY))
        if self._options.open and seen and not hidden:
            with suppress(webbrowser.Error):
                webbrowser.open(address)
