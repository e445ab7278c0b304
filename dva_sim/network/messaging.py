"""Requests and publications behind one interface, whatever carries the bytes.

A `Transport` connects nodes by request/reply and publish/subscribe.
`dva_sim.network.virtual_network` implements it in virtual time, `dva_sim.network.sockets` over
ZeroMQ sockets; agents use only the interface defined here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.makers import maker

QUEUE_LIMIT = 1000  # maximum requests waiting at one requester
ROUND_TRIPS_KEPT = 100_000  # latest round trips that are kept for statistics
MAX_ANSWERED = 64  # maximum deadlines kept of requests that were answered meanwhile

Answer = Callable[[bytes], object]


class Request(NamedTuple):
    """A request that has arrived.

    Attributes:
        data: Its bytes.
        answer: Callback for the bytes of the reply; once, now or later.
        sender: Id of the device whose key opened the connection; None without keys.
        peer: Local identity of the connection that it came by; meaningless elsewhere.
        origin: Network address and key that it came from; None where no sockets carry it.
    """

    data: bytes
    answer: Answer
    sender: str | None = None
    peer: Hashable = None
    origin: str | None = None


make_request = maker(Request)

Service = Callable[[Request], object]


class Subscription(Protocol):
    """Subscription of one node to a topic of another."""

    def close(self) -> None:
        """Leave; nothing more is delivered."""

    def pause(self) -> None:
        """Take nothing more for now: what comes waits on the way, at last at the publisher."""

    def resume(self) -> None:
        """Take what has waited, and what comes."""


class Wire(Protocol):
    """A connection to the service of a peer, replaced by closing it and opening another."""

    def send(self, tag: int, data: bytes) -> None:
        """Send a request as soon as the connection is open; its reply comes with the tag."""

    def close(self) -> None:
        """Forget what is under way: no reply is delivered any more."""


OnReply = Callable[[int, bytes], object]


class RequestTap(Protocol):
    """Observer of what reaches a node; see `dva_sim.network.tap`."""

    def serve(self, service: Service, request: Request) -> None:
        """Let the service take the request, and see its answer."""

    def heard(self, publisher: str, payload: Any) -> None:
        """Take a publication that has reached the node."""


class RequestTransport(Protocol):
    """Transport of requests from one node to another."""

    @property
    def clock(self) -> Clock:
        """The clock that all who use this transport share."""

    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> Wire:
        """Open a connection from `node` to the service of `peer`."""


class CommandSockets(RequestTransport, Protocol):
    """Transport of commands under any pattern."""

    def publish(self, node: str, topic: str, payload: Any, size: int) -> None:
        """Send a payload, which counts as `size` bytes [B], to the subscribers of a topic."""


class Transport(CommandSockets, Protocol):
    """Transport of messages between nodes; a node is named by the id of its device.

    Attributes:
        taps: Taps on the requests that reach a node, by the id of the node.
    """

    taps: dict[str, RequestTap]

    def introduce(self, node: str, address: str) -> None:
        """Set the address of a node, as in its registration."""

    def forget(self, node: str) -> None:
        """Forget a node to which nobody is connected, or will be."""

    def serve(self, node: str, service: Service) -> None:
        """Let `service` take the requests to `node`."""

    def ready(self, node: str, topic: str, size: int) -> bool:
        """Return True if a topic has a subscriber, and `size` more bytes [B] need not wait."""

    def subscribe(
        self, node: str, publisher: str, topic: str, handler: Callable[[Any], object]
    ) -> Subscription:
        """Hand what `publisher` publishes to `handler`: topics that begin with `topic`.

        Topics end in `|`, so that none begins another.
        """


@dataclass(slots=True)
class _Asked:
    """Request that waits or is under way."""

    tag: int
    data: bytes
    on_reply: Callable[[bytes], object]
    on_failure: Callable[[], object]
    attempts: int = 0
    sent_at: float = 0.0


class Requester:
    """Requester of one peer; each request is answered, or fails after a number of attempts.

    With a window of 1 it is a REQ socket: the next request goes when the last one is
    answered, and after a time-out the connection is closed and reopened. A wider window
    is a DEALER: several requests may be under way at once, over one connection.
    The same bytes are sent again after a time-out, so a receiver can recognise a repetition.

    Args:
        transport: Transport of the messages.
        node: Node that sends the requests.
        peer: Node that replies.
        timeout: Time to wait for a reply [s].
        attempts: Number of times a request is sent before it fails.
        window: Maximum number of unanswered requests.

    Attributes:
        on_timeout: Callback for each attempt that was not answered in time.
    """

    def __init__(
        self,
        transport: RequestTransport,
        node: str,
        peer: str,
        timeout: float,
        attempts: int = 3,
        window: int = 1,
    ) -> None:
        self._transport = transport
        self._clock = transport.clock
        self.node = node
        self.peer = peer
        self.timeout = timeout
        self._attempts = attempts
        self._window = window
        self._queue: deque[_Asked] = deque()
        self._open: dict[int, _Asked] = {}
        self._deadlines: deque[tuple[float, int, int]] = deque()  # when [s], tag, attempt
        self._wire: Wire | None = None
        self._last_tag = 0
        self._tag_at_rest = -1
        self.on_timeout: Callable[[], object] = lambda: None
        self.timeouts = self.failures = self.overflows = 0
        self.round_trips: deque[float] = deque(maxlen=ROUND_TRIPS_KEPT)

    @property
    def busy(self) -> bool:
        """True if a further request would have to wait."""
        return len(self._open) >= self._window

    def open(self) -> None:
        """Connect now, as a socket does, so that the first request need not wait for it."""
        if self._wire is None:
            self._wire = self._transport.connect(
                self.node, self.peer, self._on_reply, pipelined=self._window > 1
            )

    def request(
        self,
        data: bytes,
        on_reply: Callable[[bytes], object],
        on_failure: Callable[[], object] = lambda: None,
    ) -> None:
        """Send `data` as soon as the window allows."""
        if len(self._queue) >= QUEUE_LIMIT:
            self.overflows += 1
            on_failure()
            return
        self._last_tag += 1
        self._queue.append(_Asked(self._last_tag, data, on_reply, on_failure))
        self._fill()

    def renew(self) -> None:
        """Renew the connection to a peer elsewhere: what is under way is sent again."""
        self._disconnect()
        for request in list(self._open.values()):
            self._attempt(request)

    def rest(self) -> None:
        """Disconnect, until the next request, if there was none since the last call."""
        if self._last_tag == self._tag_at_rest and not self._open:
            self._disconnect()
        self._tag_at_rest = self._last_tag

    def give_up(self) -> None:
        """Give up a peer that has gone for good; all pending requests fail."""
        waiting = [*self._open.values(), *self._queue]
        self.close()
        for request in waiting:
            request.on_failure()

    def close(self) -> None:
        """Forget all requests without calling back."""
        self._queue.clear()
        self._open.clear()
        self._disconnect()

    def _fill(self) -> None:
        while self._queue and len(self._open) < self._window:
            request = self._queue.popleft()
            request.sent_at = self._clock.now
            self._open[request.tag] = request
            self._attempt(request)

    def _attempt(self, request: _Asked) -> None:
        """Send a request, over a new connection if there is none."""
        request.attempts += 1
        if len(self._deadlines) > MAX_ANSWERED + 2 * len(self._open):
            # The first stays, since its event is already scheduled.
            first, *later = self._deadlines
            self._deadlines = deque([first, *(each for each in later if each[1] in self._open)])
        self._deadlines.append((self._clock.now + self.timeout, request.tag, request.attempts))
        if len(self._deadlines) == 1:
            self._clock.call_at(self._deadlines[0][0], self._look_at_deadlines)
        self.open()
        assert self._wire is not None
        self._wire.send(request.tag, request.data)

    def _disconnect(self) -> None:
        if self._wire is not None:
            self._wire.close()
        self._wire = None

    def _on_reply(self, tag: int, reply: bytes) -> None:
        request = self._open.pop(tag, None)
        if request is None:
            return  # a repeated reply, or one to a request that was given up
        self.round_trips.append(self._clock.now - request.sent_at)
        request.on_reply(reply)
        self._fill()

    def _look_at_deadlines(self) -> None:
        """Look at the deadlines once the first is reached; answered ones need no event.

        One event for all: a timer for each request costs more than the request.
        """
        _, tag, attempt = self._deadlines[0]
        self._expire(tag, attempt)
        self._deadlines.popleft()
        while self._deadlines and self._deadlines[0][1] not in self._open:
            self._deadlines.popleft()
        if self._deadlines:
            self._clock.call_at(self._deadlines[0][0], self._look_at_deadlines)

    def _expire(self, tag: int, attempt: int) -> None:
        request = self._open.get(tag)
        if request is None or request.attempts != attempt:
            return
        self.timeouts += 1
        self.on_timeout()
        if self._window == 1:
            # A REQ socket cannot send again before it has received: only a new one can.
            self._disconnect()
        if attempt < self._attempts:
            self._attempt(request)
            return
        self.failures += 1
        del self._open[tag]
        request.on_failure()
        self._fill()
