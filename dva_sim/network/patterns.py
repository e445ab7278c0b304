"""Messaging patterns: how the commands of a drive travel from the phone's app to a robot.

A pattern is an object. Its attributes state what others have to know of it: its name, whether the
robot subscribes, which of the waiting commands the robot obeys. Its methods define what the app
does with each command. Patterns are listed and looked up here.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Final, Protocol

from typing_extensions import override

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.plugins import Plugins
from dva_sim.network.request_window import MAX_UNANSWERED, RequestWindow


class Command(Protocol):
    """Command as the app made it from the tilt; only the line can encode it."""

    @property
    def time(self) -> float:
        """Time at which it was made [s]."""


class Line(Protocol):
    """View of a drive for a pattern: a path to the robot, and an app that counts and alerts.

    Attributes:
        clock: The run's.
        rate_hz: Wanted commands per second.
        timeout: Time to wait for a reply [s].
        attempts: Number of times a request is sent before it fails.
        window: Maximum number of unanswered requests, where a pattern allows more than one.
    """

    clock: Clock
    rate_hz: float
    timeout: float
    attempts: int
    window: int

    def open_requests(
        self, window: int = 1, *, timeout: float | None = None, attempts: int | None = None
    ) -> None:
        """Connect to the robot's service: a REQ socket, or a DEALER for a window above 1.

        Args:
            window: Maximum number of unanswered requests.
            timeout: Time-out of a request [s]; None: as configured.
            attempts: Number of attempts per request; None: as configured.
        """

    @property
    def busy(self) -> bool:
        """True if a further request would have to wait."""

    def request(
        self,
        command: Command,
        then: Callable[[bytes], object],
        failed: Callable[[], object],
    ) -> None:
        """Send a command; `then` gets the reply, `failed` is called if none arrives."""

    def publish(self, command: Command) -> None:
        """Publish a command on the robot's topic, without knowing whether it arrives."""

    def newest(self, command: Command) -> Command:
        """Return the phone's present command, if the app keeps sending; else the command itself."""

    def supersede(self, command: Command) -> None:
        """Count a command that is not sent, since a newer one took its place."""

    def code_of(self, reply: bytes) -> int | None:
        """Return the code in a reply, see `dva_sim.protocol.messages`; None if unreadable."""

    def lost(self, why: str = "") -> None:
        """Alert that no robot obeys any more, and end the drive."""


class Pattern(ABC):
    """Base class of messaging patterns. Derive your own from it; each drive has its own copy.

    An emergency and all other requests never pass through here.

    Attributes:
        title: Name in reports; the pattern's own name if empty.
        label: Short name, for narrow places.
        colour: Colour of its lines in figures, by its name in `report/figures/palette.py`.
        sockets: Sockets that carry the commands, the app's first. In virtual time the same
            connections are modelled.
        when_slow: Fate of commands when the robot or the link cannot keep up.
        answered: True if the app learns that nobody obeys: it alerts when the time-outs of all
            attempts have passed, and the time in which it asks for a reply.
        in_step: True if a command waits for the reply to the one before.
        published: True if commands are published, so that the robot subscribes to them when a drive
            begins. It takes requests in any case.
        newest_wins: True if the robot obeys only the newest published command in its queue.
    """

    title: str = ""
    label: str = ""
    colour: str = ""
    sockets: str = ""
    when_slow: str = ""
    answered: bool = False
    in_step: bool = False
    published: bool = False
    newest_wins: bool = False
    line: Line

    def begin(self, line: Line) -> None:
        """Begin a drive: open what is needed."""
        self.line = line

    @abstractmethod
    def offer(self, command: Command) -> None:
        """Send a command that the app has made, keep it for later, or supersede it."""

    def end(self) -> None:  # noqa: B027 (most patterns send nothing by themselves)
        """Stop sending: the drive is over."""


class Requested(Pattern):
    """Requests: the next command goes when one of those under way has been answered.

    Commands of the phone in the meantime are superseded by its latest one. After the last attempt
    without an answer the app alerts: the link is lost.
    """

    answered = True
    waiting: Command | None = None

    @override
    def begin(self, line: Line) -> None:
        super().begin(line)
        line.open_requests()

    @override
    def offer(self, command: Command) -> None:
        if not self.line.busy:
            self.line.request(command, self._answered, self.line.lost)
            return
        if self.waiting is not None:
            self.line.supersede(self.waiting)
        self.waiting = command

    def _answered(self, _: bytes) -> None:
        """Send a command that waited: the newest value if the app keeps sending anyway."""
        waiting = self.waiting
        self.waiting = None
        if waiting is not None:
            self.offer(self.line.newest(waiting))


class ReqRep(Requested):
    """Request and reply: the app sends its next command only when the last one was answered."""

    title = "REQ/REP"
    label = "REQ/REP"
    colour = "vermilion"
    sockets = "REQ to ROUTER"
    when_slow = "commands become rarer"
    in_step = True


class Pipelined(Requested):
    """Requests of which several may be unanswered at a time.

    How many is `command.window` of the scenario.
    """

    title = "pipelined requests"
    label = "pipelined requests"
    colour = "purple"
    sockets = "DEALER to ROUTER"
    when_slow = "commands become older, by a window at most"

    @override
    def begin(self, line: Line) -> None:
        self.line = line
        line.open_requests(line.window)


class Paced(Requested):
    """Requests, as many unanswered at a time as neither the link nor the robot lets queue.

    How many follows from the times of the answers, see `RequestWindow`.
    """

    title = "paced requests"
    label = "paced"
    colour = "brown"
    sockets = "DEALER to ROUTER"
    when_slow = "commands become rarer"

    @override
    def begin(self, line: Line) -> None:
        self.line = line
        self._window = RequestWindow(line.rate_hz)
        line.open_requests(MAX_UNANSWERED)

    @override
    def offer(self, command: Command) -> None:
        if self._window.is_open and not self.line.busy:
            self._ask(command)
            return
        if self.waiting is not None:
            self.line.supersede(self.waiting)
        self.waiting = command

    def _ask(self, command: Command) -> None:
        number = self._window.sent()
        sent_at = self.line.clock.now

        def answered(reply: bytes) -> None:
            now = self.line.clock.now
            self._window.answered(number, now - sent_at, now)
            self._answered(reply)

        self.line.request(command, answered, self.line.lost)


class PubSub(Pattern):
    """Publish and subscribe: the app sends without waiting, and the robot applies every command."""

    title = "plain PUB/SUB"
    label = "plain PUB/SUB"
    colour = "blue"
    sockets = "XPUB to SUB"
    when_slow = "commands queue without bound"
    published = True

    @override
    def offer(self, command: Command) -> None:
        # Send and forget.
        self.line.publish(command)


class LatestWins(PubSub):
    """Publish and subscribe, but the robot applies only the newest command that it has."""

    title = "latest-wins PUB/SUB"
    label = "latest-wins"
    colour = "green"
    when_slow = "commands are skipped"
    newest_wins = True


PATTERNS: Final[dict[str, type[Pattern]]] = {
    "req-rep": ReqRep,
    "pipelined": Pipelined,
    "paced": Paced,
    "pub-sub": PubSub,
    "latest-wins": LatestWins,
}
"""The shipped ones, by the names that a scenario uses."""

PLUGINS: Final = Plugins(
    "pattern",
    Pattern,  # type: ignore[type-abstract]
    PATTERNS,
    folder="protocol/patterns",
    group="dva_sim.patterns",
    key="pattern",
    needs="offer(command)",
    public="dva_sim.network.patterns.Pattern",
)


def meaning_of(kind: type[Pattern]) -> str:
    """Describe a pattern: the first sentence of its docstring, without its full stop."""
    first = " ".join((inspect.getdoc(kind) or "").partition("\n\n")[0].split())
    return first[:1].lower() + first[1:].removesuffix(".")


known_patterns = PLUGINS.known
load_pattern = PLUGINS.load
"""Factory of the pattern of a name, one for each drive; see `Plugins.load`."""
