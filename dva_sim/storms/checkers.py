"""Rules that only storms check, from outside the agents.

S5: a driver whose commands are refused stops driving. S10: queues, registry, caches and memory are
bounded; their elements are counted. S11: every rejected message is answered or counted.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Iterable, Iterator
from dataclasses import dataclass
from types import FunctionType, MethodType, ModuleType
from typing import Any, Final

from dva_sim.agents.robot.command_queue import MAX_OF_OTHERS, CommandQueue
from dva_sim.agents.robot.controller import MAX_OBSERVERS
from dva_sim.agents.robot.inquiry import MAX_READERS
from dva_sim.agents.robot.sensors import MAX_SUBSCRIPTIONS
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.messaging import Request, Service
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode_if_valid
from dva_sim.storms.interference import PassingMessage

# --- S5 ----------------------------------------------------------------------------------

STOPS_WITHIN = 20.0  # time from the first refusal, which may arrive late like any message [s]
REFUSALS_IN_A_ROW = 3  # refusals that count; the first may be of a former drive
_BEGINS = b"<StartTeleOp"
_COMMANDS = b"<SetTeleOp"
_TELLS = b"<reply>", b"<RobotHolder>"


@dataclass
class _Refused:
    """Refusals in a row of one driver by one robot."""

    first: float
    count: int = 0


class RefusedDrivers:
    """Checker of drivers that continue although robots refuse their commands.

    Args:
        recorder: Recorder of drivers who continue.
        labels: Names by id.
        drivers: Ids of the drivers that have to stop.
    """

    def __init__(self, recorder: Recorder, labels: dict[str, str], drivers: Container[str]) -> None:
        self._recorder = recorder
        self._labels = labels
        self._drivers = drivers
        self._refused: dict[tuple[str, str], _Refused] = {}

    def arrives(self, now: float, passing: PassingMessage) -> None:
        """Note the replies that a driver receives."""
        data = passing.payload
        to = passing.to
        if to not in self._drivers or not isinstance(data, bytes):
            return
        if not any(kind in data for kind in _TELLS):
            return
        key = (to, passing.source)
        is_refused = _refuses(data, to)
        if is_refused:
            self._refused.setdefault(key, _Refused(now)).count += 1
        elif is_refused is False:
            self._refused.pop(key, None)

    def sent(self, now: float, source: str, to: str, payload: Any) -> None:
        """Judge a command by a refused driver, unless that driver has restarted."""
        refused = self._refused.get((source, to))
        if refused is None or not isinstance(payload, bytes):
            return
        if _BEGINS in payload:
            del self._refused[source, to]
        elif _COMMANDS in payload and refused.count >= REFUSALS_IN_A_ROW:
            since = now - refused.first
            if since > STOPS_WITHIN:
                what = f"commands {self._labels[to]} on, which has refused it for {since:.0f} s"
                self._recorder.violated("S5", now, self._labels[source], what)


def _refuses(data: bytes, to: str) -> bool | None:
    """Return True if a robot refuses a driver, False if it obeys, None if neither is said."""
    message = decode_if_valid(data)
    body = None if message is None else message.body
    if isinstance(body, m.RobotHolder):
        return body.holder != to or body.code in m.OBEYS_NO_MORE
    if isinstance(body, m.Reply) and body.content is None:
        return body.code in m.OBEYS_NO_MORE if body.code != m.OK else False
    return None


# --- S10 ---------------------------------------------------------------------------------

MAX_BREACHES: Final = 200
"""Maximum elements of a container without a bound of its own, on top of one for each event ever
reported: a team of fifteen devices needs at most 72."""
BOUNDS: Final[dict[str, int]] = {
    "Registry.entries": 20_000,
    "EventTable.open": 10_000,
    "EventTable.closed": 10_000,
    "EventTable.waiting": 10_000,
    "Confirmations._waiting": MAX_OF_OTHERS,
    "Inquiry._readers": MAX_READERS,
    "RobotController.observers": MAX_OBSERVERS,
    "SensorSubscriptions._subscribed": MAX_SUBSCRIPTIONS,
    "Requester.round_trips": 100_000,
    "DvaAgent._last_reported": 20_000,
    "ReplyCache._replies": 64 * 1024,
    "_Kept.keys": 64,
    "FairQueue._queues[]": 1_000,
    "Trail._facts": 10_000,
    "Store._events": 10_000,
}
"""Bounds on containers of agents, by class and attribute."""
KEPT_FOR_MEASURES: Final = frozenset({"DvaAgent.events", "DvaAgent.facts"})
"""Records that a run keeps for its measures; a lasting DVA keeps none of them."""
_ATOMS: Final = (str, bytes, int, float, complex, bool, type(None), type, ModuleType, FunctionType)
_NOT_THEIRS: Final = (Recorder, Clock)
_SHARED: Final = tuple(
    f"dva_sim.{room}." for room in ("storms", "worlds", "kernel", "simulation.scenario")
)
"""Modules of objects that no agent fills: checkers, the world, the scenario."""


def count_waiting(inbox: CommandQueue, peer: str) -> int:
    """Return how many messages of one connection wait in a robot's queue."""
    queues = inbox._waiting._queues.items()
    return sum(len(queue) for (whose, _), queue in queues if whose == peer)


def is_waiting(inbox: CommandQueue, data: bytes) -> bool:
    """Return True for a message that is in a robot's queue."""
    queues = inbox._waiting._queues.values()
    return any(letter.data == data for queue in queues for letter in queue)


def oversized(
    roots: Iterable[object], events: int = 0, left_out: Iterable[object] = ()
) -> Iterator[tuple[str, int, int]]:
    """Yield each container that holds more than its bound, of all reachable from some objects.

    Args:
        roots: Agents; what they share with the whole run is left out.
        events: Number of events that the DVA has ever had.
        left_out: Objects to skip, together with what only they hold.

    Yields:
        Class and attribute, number of elements, bound.
    """
    seen = {id(each) for each in left_out}
    todo = [("", root) for root in roots]
    while todo:
        name, each = todo.pop()
        if isinstance(each, (*_ATOMS, *_NOT_THEIRS)) or id(each) in seen:
            continue
        seen.add(id(each))
        if isinstance(each, (dict, list, tuple, set, frozenset, deque)):
            if name in KEPT_FOR_MEASURES:
                continue
            bound = BOUNDS.get(name, MAX_BREACHES + events)
            if len(each) > bound:
                yield name, len(each), bound
            inner = each.values() if isinstance(each, dict) else each
            todo += [(f"{name}[]", value) for value in inner if not isinstance(value, _ATOMS)]
        elif isinstance(each, MethodType):
            continue
        elif _is_theirs(each):
            todo += [(f"{type(each).__name__}.{key}", v) for key, v in _attributes(each)]


def _attributes(each: object) -> Iterator[tuple[str, Any]]:
    yield from getattr(each, "__dict__", {}).items()
    for kind in type(each).__mro__:
        for slot in getattr(kind, "__slots__", ()):
            if hasattr(each, slot):
                yield slot, getattr(each, slot)


def _is_theirs(each: object) -> bool:
    module = type(each).__module__
    return module.startswith("dva_sim.") and not module.startswith(_SHARED)


# --- S11 ---------------------------------------------------------------------------------

ANSWERED_WITHIN = 60.0  # time to answer a request, unless it still waits in a queue [s]
QUEUED_WITHIN = 300.0  # longest wait in a queue: a driven robot may take 3 s per message [s]


@dataclass(eq=False, slots=True)
class _Open:
    """Request that a node has not answered yet; an answer is expected from `since` on."""

    node: str
    arrived: float
    since: float
    data: bytes


class AnswerWatch:
    """Checker of the messages that reach the DVA, robots and people, and of their answers.

    Args:
        recorder: Recorder that counts refusals and notes broken rules.
        now: Function that returns the time [s].
        nodes: Labels of the nodes that have to answer, by id.
        heard: Callback for each answer, delivered or not: its sender, receiver and bytes.
        waits: Predicate: True for a request that is still in the queue of a node.
    """

    def __init__(
        self,
        recorder: Recorder,
        now: Callable[[], float],
        nodes: dict[str, str],
        heard: Callable[[str, str, bytes], object],
        waits: Callable[[str, bytes], bool] = lambda node, data: False,
    ) -> None:
        self._recorder = recorder
        self._now = now
        self._nodes = nodes
        self._heard = heard
        self._waits = waits
        self._open: dict[_Open, None] = {}
        self._answers = 0
        self._excused = set[str]()
        self._silently: dict[str, deque[float]] = {node: deque() for node in nodes}

    def excuse(self, node: str, excused: bool) -> None:
        """Expect no answers from a node that is down, not even to earlier requests."""
        (self._excused.add if excused else self._excused.discard)(node)
        self._open = {each: None for each in self._open if each.node != node}

    def watch(self, passing: PassingMessage) -> None:
        """Let a message reach its receiver; an invalid one has to be answered or counted.

        The time of each refusal without an answer is noted.
        """
        node = passing.to
        if node not in self._nodes:
            passing.take(passing.payload)
            return
        refused = self._refused()
        answers = self._answers
        passing.take(passing.payload)
        refused = self._refused() - refused
        answers = self._answers - answers
        self._silently[node].extend([self._now()] * (refused - answers))
        if node in self._excused or refused or answers:
            return
        # Late replies are dropped like their requests, and a picture is not a message.
        is_for_somebody = isinstance(passing.payload, bytes) and b"<reply>" not in passing.payload
        if is_for_somebody and not is_message(passing.payload):
            self._breach(node, "neither answers nor counts an invalid message")

    def tap(self, node: str) -> _Tap:
        """Return a tap on the requests to a node."""
        return _Tap(self, node)

    def opened(self, node: str, request: Request) -> Request:
        """Note a request; return it with a callback that notes its answer."""
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
            # Requests that waited are judged after younger ones, and must not use up their counts.
            silently = self._silently[each.node]
            while silently and now - silently[0] > QUEUED_WITHIN + ANSWERED_WITHIN:
                silently.popleft()
            counted = next((when for when in silently if when >= each.arrived), None)
            if counted is not None:
                silently.remove(counted)
            else:
                self._breach(each.node, "has neither answered nor counted a request")

    def _refused(self) -> int:
        """Return the number of refusals, which the recorder counts under names of their own."""
        counters = self._recorder.counters
        return sum(count for name, count in counters.items() if name.startswith("refused"))

    def _breach(self, node: str, what: str) -> None:
        self._recorder.violated("S11", self._now(), self._nodes[node], what)


class _Tap:
    """Tap on the requests to one node; see `RequestTap`."""

    def __init__(self, answers: AnswerWatch, node: str) -> None:
        self._answers = answers
        self._node = node

    def serve(self, service: Service, request: Request) -> None:
        """Serve a request, and watch for its reply."""
        service(self._answers.opened(self._node, request))

    def heard(self, publisher: str, payload: Any) -> None:
        """Ignore publications."""


def is_message(data: bytes) -> bool:
    """Return True for a valid message."""
    return decode_if_valid(data) is not None
