"""S11: every message that is rejected is answered or counted, seen from outside."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from dva_sim.kernel.recorder import Recorder
from dva_sim.network.messaging import Request, Service
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.storms.interference import PassingMessage

ANSWERED_WITHIN = 60.0  # unless it still waits in a queue [s]
QUEUED_WITHIN = 300.0  # of a robot that takes 3 s for a message, and was driven meanwhile [s]


@dataclass(eq=False, slots=True)
class _Open:
    """A request that a node has not answered yet, and from when on that is expected of it."""

    node: str
    arrived: float
    since: float
    data: bytes


class AnswerWatch:
    """Sees what reaches the DVA, robots and people, and what they answer.

    Args:
        recorder: Recorder that counts refusals and notes broken rules.
        now: Function that returns the time [s].
        nodes: Ids of those who have to answer, with their labels.
        heard: Called with each answer: of whom, to whom, its bytes; whether it gets there or not.
        waits: Returns True for a request that is still in the queue of a node.
    """

    def __init__(
        self,
        recorder: Recorder,
        now: Callable[[], float],
        nodes: dict[str, str],
        heard: Callable[[str, str, bytes], object],
        waits: Callable[[str, bytes], bool] = lambda node, data: False,
    ) -> None:
        self._recorder, self._now, self._nodes, self._heard = recorder, now, nodes, heard
        self._waits = waits
        self._open: dict[_Open, None] = {}
        self._answers, self._excused = 0, set[str]()
        self._silently: dict[str, deque[float]] = {node: deque() for node in nodes}

    def excuse(self, node: str, excused: bool) -> None:
        """Expect nothing of a node that is down, nor of what it had not answered by then."""
        (self._excused.add if excused else self._excused.discard)(node)
        self._open = {each: None for each in self._open if each.node != node}

    def watch(self, passing: PassingMessage) -> None:
        """Let a message reach its receiver; one that is none has to be answered or counted.

        Of each one that is refused while this one is taken, and is not answered, the time is noted.
        """
        node = passing.to
        if node not in self._nodes:
            passing.take(passing.payload)
            return
        refused, answers = self._refused(), self._answers
        passing.take(passing.payload)
        refused, answers = self._refused() - refused, self._answers - answers
        self._silently[node].extend([self._now()] * (refused - answers))
        if node in self._excused or refused or answers:
            return
        if _is_for_somebody(passing.payload) and not is_message(passing.payload):
            self._breach(node, "neither answers nor counts what is no message")

    def tap(self, node: str) -> _Tap:
        """Return what sees the requests to a node."""
        return _Tap(self, node)

    def opened(self, node: str, request: Request) -> Request:
        """Note a request; return it with an answer that is seen."""
        each = _Open(node, self._now(), self._now(), request.data)
        if node not in self._excused:
            self._open[each] = None

        def answer(reply: bytes) -> object:
            self._answers += 1
            self._open.pop(each, None)
            self._heard(node, str(request.peer), reply)
            return request.answer(reply)

        return request._replace(answer=answer)

    def look(self) -> None:
        """Judge the requests that should have been answered by now.

        Messages without a reply have to be counted: each refusal without an answer counts for one
        of them, at the same node.
        """
        now = self._now()
        while self._open:
            each = next(iter(self._open))
            if now - each.since < ANSWERED_WITHIN:
                return
            del self._open[each]
            if now - each.arrived < QUEUED_WITHIN and self._waits(each.node, each.data):
                each.since = now
                self._open[each] = None
                continue
            # Those that waited are judged after younger ones, whose counts are not theirs.
            silently = self._silently[each.node]
            while silently and now - silently[0] > QUEUED_WITHIN + ANSWERED_WITHIN:
                silently.popleft()
            counted = next((when for when in silently if when >= each.arrived), None)
            if counted is not None:
                silently.remove(counted)
            else:
                self._breach(each.node, "has neither answered nor counted a request")

    def _refused(self) -> int:
        """Number of refusals, which the recorder counts under names of their own."""
        counters = self._recorder.counters
        return sum(count for name, count in counters.items() if name.startswith("refused"))

    def _breach(self, node: str, what: str) -> None:
        self._recorder.violated("S11", self._now(), self._nodes[node], what)


class _Tap:
    """Sees the requests to one node; see `RequestTap`."""

    def __init__(self, answers: AnswerWatch, node: str) -> None:
        self._answers, self._node = answers, node

    def serve(self, service: Service, request: Request) -> None:
        """Serve a request, and watch for its reply."""
        service(self._answers.opened(self._node, request))

    def heard(self, publisher: str, payload: Any) -> None:
        """Ignore publications."""


def _is_for_somebody(payload: Any) -> bool:
    """Return True unless it is a picture, or a reply: late ones are dropped with their request."""
    return isinstance(payload, bytes) and b"<reply>" not in payload


def is_message(data: bytes) -> bool:
    """Return True for a valid message."""
    try:
        decode(data)
    except ProtocolError:
        return False
    return True
