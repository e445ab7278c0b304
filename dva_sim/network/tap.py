"""Observer of the requests to a node, of its replies, and of publications that it receives.

A tap is given to a transport for one node, virtual or on sockets, and taken away again at any
time; without one nothing is done and nothing is kept:

    tap = Tap(transport.clock, heard.append)
    transport.taps["02:00:00:01:00:01"] = tap
    ...
    del transport.taps["02:00:00:01:00:01"]

It changes neither what is said nor when. `on_exchange` is called within the handling of the
message: it should put the exchange somewhere and return, and must not wait for anybody. A tap
keeps nothing itself; of a request that is never answered nothing stays.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

from dva_sim.kernel.clock import Clock
from dva_sim.network.messaging import Request, Service


@dataclass(slots=True)
class Exchange:
    """Request that has arrived with its reply, or publication that was heard.

    Attributes:
        number: Number in the order of arrival, from 1.
        arrived: Arrival time by the run's clock [s].
        data: Content of the message.
        peer: Identity of the connection; for a publication, the id of its publisher.
        published: True for a publication, which has no reply.
        reply: Reply; None until there is one.
        service_s: Time from arrival to answer [s]: by the run's clock or, where the answer came
            within the handling of the request, the real time which that took; None without an
            answer.
    """

    number: int
    arrived: float
    data: bytes
    peer: Hashable
    published: bool = False
    reply: bytes | None = None
    service_s: float | None = None


class Tap:
    """Observer of the requests to one node, its replies, and the publications that it hears.

    Args:
        clock: The run's clock.
        on_exchange: Callback for each exchange once the message has been handled, and a request
            that is answered later a second time, with its reply: the same object, by the same
            number.
        publications: True to include publications.
    """

    def __init__(
        self,
        clock: Clock,
        on_exchange: Callable[[Exchange], object],
        publications: bool = True,
    ) -> None:
        self._clock = clock
        self._on_exchange = on_exchange
        self.publications = publications
        self._count = 0

    def serve(self, service: Service, request: Request) -> None:
        """Let a service take a request, and see its answer, whenever that comes."""
        exchange = self._new(request.data, request.peer)
        begun = time.perf_counter()
        is_handled = False

        def answer(reply: bytes) -> None:
            exchange.reply = reply
            later = self._clock.now - exchange.arrived
            exchange.service_s = later if is_handled else time.perf_counter() - begun
            request.answer(reply)
            if is_handled:
                self._on_exchange(exchange)

        service(request._replace(answer=answer))
        is_handled = True
        self._on_exchange(exchange)

    def heard(self, publisher: str, payload: Any) -> None:
        """Take a publication that has reached the node; pictures are none."""
        if self.publications and isinstance(payload, bytes):
            exchange = self._new(payload, publisher)
            exchange.published = True
            self._on_exchange(exchange)

    def _new(self, data: bytes, peer: Hashable) -> Exchange:
        self._count += 1
        return Exchange(self._count, self._clock.now, data, peer)
