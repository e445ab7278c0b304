"""S11: every message that is rejected is answered or counted, seen from outside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from dva_sim.kernel.recorder import Recorder
from dva_sim.network.messaging import Request, Service
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.storms.interference import PassingMessage

ANSWERED_WITHIN = 60.0  # a full queue of a robot that takes 3 s for a message is cut by then [s]


@dataclass(eq=False, slots=True)
class _Open:
    """A request that a node has not answered yet."""

    node: str
    arrived: float
    refused: int


class AnswerWatch:
    """Sees what reaches the DVA and the robots, and what they answer.

    Args:
        recorder: Counts what is refused, and is told what breaks the rule.
        now: Gives the time [s].
        nodes: Ids of the DVA and the robots, with their labels.
        heard: Called with each answer: of whom, to whom, its bytes; whether it gets there or not.
    """

    def __init__(
        self,
        recorder: Recorder,
        now: Callable[[], float],
        nodes: dict[str, str],
        heard: Callable[[str, str, bytes], object],
    ) -> None:
        self._recorder, self._now, self._nodes, self._heard = recorder, now, nodes, heard
        self._open: dict[_Open, None] = {}
        self._answers, self._excused = 0, set[str]()
        self._counted_for = 0

    def excuse(self, node: str, excused: bool) -> None:
        """Expect nothing of a node that is down, nor of what it had not answered by then."""
        (self._excused.add if excused else self._excused.discard)(node)
        self._open = {each: None for each in self._open if each.node != node}

    def watch(self, passing: PassingMessage) -> None:
        """Let a message reach its receiver; one that is none has to be answered or counted."""
        is_judged = passing.to in self._nodes and passing.to not in self._excused
        if not is_judged or not isinstance(passing.payload, bytes) or is_message(passing.payload):
            passing.take(passing.payload)
            return
        before = self._refused(), self._answers
        passing.take(passing.payload)
        if before == (self._refused(), self._answers) and passing.to not in self._excused:
            self._breach(passing.to, "neither answers nor counts what is no message")

    def tap(self, node: str) -> _Tap:
        """Return what sees the requests to a node."""
        return _Tap(self, node)

    def opened(self, node: str, request: Request) -> Request:
        """Note a request; return it with an answer that is seen."""
        each = _Open(node, self._now(), self._refused())
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

        What nobody answers has to be counted: each refusal counts for one of them.
        """
        now, refused = self._now(), self._refused()
        while self._open:
            each = next(iter(self._open))
            if now - each.arrived < ANSWERED_WITHIN:
                return
            del self._open[each]
            if refused - max(each.refused, self._counted_for) > 0:
                self._counted_for = max(each.refused, self._counted_for) + 1
            else:
                self._breach(each.node, "has neither answered nor counted a request")

    def _refused(self) -> int:
        counters = self._recorder.counters
        return sum(count for name, count in counters.items() if "refused" in name)

    def _breach(self, node: str, what: str) -> None:
        self._recorder.violated("S11", self._now(), self._nodes[node], what)


class _Tap:
    """Sees the requests to one node; see `RequestTap`."""

    def __init__(self, answers: AnswerWatch, node: str) -> None:
        self._answers, self._node = answers, node

    def serve(self, service: Service, request: Request) -> None:
        """See `RequestTap`."""
        service(self._answers.opened(self._node, request))

    def heard(self, publisher: str, payload: Any) -> None:
        """See `RequestTap`."""


def is_message(data: bytes) -> bool:
    """Return True for a valid message."""
    try:
        decode(data)
    except ProtocolError:
        return False
    return True
