"""The processes beside what a console shows: one serves pages, one draws pictures.

Whatever is shown - a world, a recording - runs in the command's own process, tells its lines to
both, and does what the pages ask for.
"""

from __future__ import annotations

import gc
import os
import socket
import sys
import webbrowser
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from dva_sim.cameras.children import END_SOON, PAINTED, PipedChild
from dva_sim.cameras.lines import Show
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.lines import KINDS, Tell
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.realtime import PacedClock
from dva_sim.options.runs import PageOptions
from dva_sim.serving.listening import listen
from dva_sim.serving.processes import end_all

WEB = "dva_sim.console.web"
PICTURES = "dva_sim.console.pages.pictures"
# What else is printed: an address for each of those who may do less than everything.
ROLES = ("Dispatch only", "dispatch"), ("Drive only", "drive"), ("Look only", "look")
BROWSERLESS = ("CI", "PYTEST_CURRENT_TEST", "DVA_SIM_NO_BROWSER")  # where none is opened
FLUSH = 0.05  # from one look at what waits to be written to the next, real time [s]
MAX_RESTARTS = 5  # of the process that draws
NO_DISPLAY = ("DISPLAY", "WAYLAND_DISPLAY")

Say = Callable[[str], object]


class ConsoleSubject(Protocol):
    """Interface of what a console shows.

    Attributes:
        clock: Its time, at its pace.
        tell: Callback for lines to pages, with a key where only the newest counts.
        show: Callback for lines to the renderer, with a key likewise.
        dropped: Number of lines for pages dropped so far.
    """

    clock: PacedClock
    tell: Tell
    show: Show
    dropped: Callable[[], int]

    def serve_cameras(self, base: str) -> None:
        """Serve the robots' pictures below this URL from now on."""

    def begin(self) -> None:
        """Tell the scene, and from then on what changes."""

    def show_scene(self) -> None:
        """Send the whole scene to the renderer."""

    def note(self, text: str) -> None:
        """Tell people of a failure of the console itself."""


class ConsoleProcesses:
    """The web process and the one that draws, and the lines to and from them.

    Args:
        options: Addresses and access rules of the pages.
        say: Prints a line.
        phones: Host and port for phones; None: none are served.

    Attributes:
        serving: First message of the web process: its addresses.
        failed: Reason why the web process has ended by itself; empty if it has not.
    """

    def __init__(
        self, options: PageOptions, say: Say, phones: tuple[str, int] | None = None
    ) -> None:
        self._options = options
        self._say = say
        self._phones = phones
        self._children: list[PipedChild] = []
        self._to_web: socket.socket | None = None
        self.serving: Mapping[str, Any] = {}
        self.failed = ""
        self._restarts = 0

    def start(
        self,
        subject: ConsoleSubject,
        take: Callable[[Asked], object],
        report: Path | None = None,
        audit: Path | None = None,
    ) -> None:
        """Start both, connect them with what is shown, say where it is, and begin.

        Args:
            subject: Subject to show.
            take: Does what a line of a page asks for.
            audit: File of the audit log that pages show, if there is one.
            report: A study's report that pages may show.

        Raises:
            ConfigError: a port is taken, or the host is not this machine.
            ChildFailed: the web process could not begin.
        """
        web = self._start_web(report, audit)
        pictures = self._start_pictures()
        self.serving = web.ready(lambda: next(iter(web.pipe.lines()), None))
        subject.serve_cameras(str(self.serving["base"]))
        subject.tell = web.pipe.put
        subject.dropped = lambda: web.pipe.outbox.dropped
        self._listen(subject, web, take)
        self._draw(subject, pictures)
        subject.begin()
        subject.clock.pulse(FLUSH, self._flush)
        gc.freeze()  # what stays for the whole run is not looked through again and again
        self._say(f"Console: {self.serving['supervise']}")
        if not self._options.no_token:
            for name, role in ROLES:
                self._say(f"{name}: {self.serving[role]}")
        self._say_of_phones()
        self._open_browser(str(self.serving["supervise"]))

    def end(self) -> None:
        """End both, as soon as they have written what they have."""
        if self._to_web is not None:
            self._to_web.close()
        end_all(self._children, END_SOON)

    def _start_web(self, report: Path | None, audit: Path | None) -> PipedChild:
        options = self._options
        if options.users is not None and options.no_token:
            raise ConfigError("--users and --no-token exclude each other: nobody need log in")
        listen(options.host, options.port).close()  # else the web process alone would say so
        if self._phones is not None:
            listen(*self._phones, "--phones-port").close()
        ours, self._to_web = socket.socketpair()
        words = ["--host", options.host, "--port", str(options.port)]
        words += ["--pictures-fd", str(ours.fileno())]
        words += ["--no-token"] if options.no_token else []
        words += [] if options.users is None else ["--users", str(options.users)]
        words += [] if audit is None else ["--audit", str(audit)]
        words += [] if report is None else ["--report", str(report)]
        if self._phones is not None:
            host, port = self._phones
            words += ["--phones-host", host, "--phones-port", str(port)]
        web = PipedChild("the web process", WEB, words, [ours], KINDS)
        self._children.append(web)
        ours.close()
        return web

    def _start_pictures(self) -> PipedChild:
        """Return the our copy of its end stays open, so that another one can take its place."""
        end = self._to_web
        assert end is not None
        words = ["--web-fd", str(end.fileno())]
        pictures = PipedChild("the pictures process", PICTURES, words, [end], PAINTED)
        self._children.append(pictures)
        return pictures

    def _listen(
        self, subject: ConsoleSubject, web: PipedChild, take: Callable[[Asked], object]
    ) -> None:
        def hear() -> None:
            for line in web.pipe.lines():
                take(line)
            if not web.pipe.is_open:
                subject.clock.unwatch(web.pipe.fileno())
                self.failed = web.why()
                subject.clock.stop()

        subject.clock.watch(web.pipe.fileno(), hear)

    def _draw(self, subject: ConsoleSubject, pictures: PipedChild) -> None:
        """Draw in another process from then on; without pictures all else goes on."""
        subject.show = pictures.pipe.put

        def hear() -> None:
            pictures.pipe.lines()
            if pictures.pipe.is_open:
                return
            subject.clock.unwatch(pictures.pipe.fileno())
            subject.note(pictures.why())
            self._children.remove(pictures)
            end_all([pictures], 0.0)
            if self._restarts < MAX_RESTARTS:
                self._restarts += 1
                self._draw(subject, self._start_pictures())
                subject.show_scene()

        subject.clock.watch(pictures.pipe.fileno(), hear)

    def _flush(self) -> None:
        for child in self._children:
            child.pipe.flush()

    def _say_of_phones(self) -> None:
        """Say the phones' address, also for a camera, and what people should know of it."""
        for entry in self.serving["notices"]:
            self._say(entry)
        if address := self.serving["phone"]:
            from dva_sim.console.pages.qr_code import half_blocks  # late: start-up

            self._say(f"Phone: {address}")
            if (sys.stdout.encoding or "").lower().replace("-", "") == "utf8":
                self._say(half_blocks(address, sys.stdout.isatty()))
            trust = address.partition("?")[0].removesuffix("phone")
            self._say(f"Each phone must trust this computer once: {trust}trust says how.")

    def _open_browser(self, address: str) -> None:
        """Open the browser, where there is one that somebody could see."""
        hidden = any(os.environ.get(name) for name in BROWSERLESS)
        seen = sys.platform in ("darwin", "win32") or any(map(os.environ.get, NO_DISPLAY))
        if not self._options.no_open and seen and not hidden:
            with suppress(webbrowser.Error):
                webbrowser.open(address)
