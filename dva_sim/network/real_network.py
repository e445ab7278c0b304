"""Nodes that talk over real connections, whatever carries the bytes, in real time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Hashable
from typing import Any, Final

from dva_sim.kernel.errors import DvaSimError
from dva_sim.network.messaging import (
    Answer,
    OnReply,
    RequestTap,
    Service,
    Subscription,
    Wire,
    make_request,
)
from dva_sim.network.realtime import LiveClock

DRAIN: Final = 64  # maximum messages read from one source before others have their turn
LARGEST: Final = 65_536  # maximum size of a request or a reply [B]
MAX_PICTURE: Final = 2_000_000  # maximum size of a publication [B]


class NetworkError(DvaSimError):
    """Port that cannot be opened, or broker that cannot be started."""


class RealNetwork(ABC):
    """Nodes of this process on a real network; see `Transport`.

    Args:
        clock: Clock that waits for arrivals.
        tell: Callback for one line about each connection that could not be made.

    Attributes:
        counters: Messages refused or not sent, counted by reason.
        watcher: Callback for each message: a node here, the content, and True if that node sends
            it.
        taps: See `Transport`.
    """

    def __init__(self, clock: LiveClock, tell: Callable[[str], object]) -> None:
        self.clock = clock
        self._tell = tell
        self.counters: Counter[str] = Counter()
        self.watcher: Callable[[str, Any, bool], object] | None = None
        self.taps: dict[str, RequestTap] = {}
        self._addresses: dict[str, str] = {}
        self._services: dict[str, Service] = {}

    def introduce(self, node: str, address: str) -> None:
        """Implement `Transport`."""
        self._addresses[node] = address

    def forget(self, node: str) -> None:
        """Forget a node's address. Close all connections to it first."""
        self._addresses.pop(node, None)

    def address(self, node: str) -> str | None:
        """Return the address of a node, if it is known."""
        return self._addresses.get(node)

    @abstractmethod
    def is_here(self, node: str) -> bool:
        """Return True if a node belongs to this process."""

    @abstractmethod
    def join(self, node: str, host: str = "127.0.0.1", port: int = 0) -> str:
        """Let a node take requests and publish.

        Args:
            node: The node.
            host: Address to listen on.
            port: Port for requests; 0 for any free one.

        Returns:
            Its address, as for a registration.

        Raises:
            NetworkError: it cannot listen there.
        """

    @abstractmethod
    def leave(self, node: str) -> None:
        """End what `join` has begun; later replies of the node are dropped."""

    @abstractmethod
    def close(self) -> None:
        """Close everything; what was sent last has a moment to leave."""

    def serve(self, node: str, service: Service) -> None:
        """Set the handler of a node's requests; the node must have joined."""
        self._services[node] = service

    @abstractmethod
    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> Wire:
        """Return a connection for requests from a node to a peer."""

    @abstractmethod
    def publish(self, node: str, topic: str, payload: Any, size: int) -> None:
        """Publish to all subscribers of a topic; a payload other than bytes packs itself."""

    @abstractmethod
    def ready(self, node: str, topic: str, size: int) -> bool:
        """Return True if a topic has a subscriber, and a payload of this size need not wait."""

    @abstractmethod
    def subscribe(
        self, node: str, publisher: str, topic: str, handler: Callable[[Any], object]
    ) -> Subscription:
        """Subscribe a node to a topic of a publisher."""

    def note(self, node: str, payload: Any, sent: bool = True) -> None:
        """Pass a message to the watcher, if there is one."""
        if self.watcher is not None:
            self.watcher(node, payload, sent)

    def _serve_request(
        self,
        node: str,
        data: bytes,
        send: Answer,
        sender: str | None,
        peer: Hashable,
        origin: str,
    ) -> None:
        """Hand a request to the service of a node; `send` takes the bytes of the reply."""
        self.note(node, data, sent=False)

        def answer(reply: bytes) -> None:
            self.note(node, reply)
            send(reply)

        request = make_request(data, answer, sender, peer, origin)
        service = self._services[node]
        tap = self.taps.get(node)
        if tap is None:
            service(request)
        else:
            tap.serve(service, request)

    def hand_over(
        self, node: str, publisher: str, data: bytes, handler: Callable[[Any], object]
    ) -> None:
        """Hand what a publisher has published to the handler of a node."""
        self.note(node, data, sent=False)
        if (tap := self.taps.get(node)) is not None:
            tap.heard(publisher, data)
        handler(data)

    def _tell_once(self, problem: str) -> None:
        self.counters[problem] += 1
        if self.counters[problem] == 1:
            self._tell(problem)
