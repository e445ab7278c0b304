"""S10: queues, registry, caches and memory are bounded, by counting what is really there."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from types import FunctionType, MethodType, ModuleType
from typing import Any, Final

from dva_sim.agents.robot.command_queue import OTHERS, CommandQueue
from dva_sim.agents.robot.controller import MOST_OBSERVERS
from dva_sim.agents.robot.inquiry import MOST_READERS
from dva_sim.agents.robot.sensors import MOST as MOST_SUBSCRIBED
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import Recorder

MOST: Final = 200
"""Elements of a container without a bound of its own, beside one for each event there ever was: a
team of fifteen devices needs 72 at most."""
BOUNDS: Final[dict[str, int]] = {
    "Registry.entries": 20_000,
    "EventTable.open": 10_000,
    "EventTable.closed": 10_000,
    "EventTable.waiting": 10_000,
    "Confirmations._waiting": OTHERS,
    "Inquiry._readers": MOST_READERS,
    "RobotController.observers": MOST_OBSERVERS,
    "SensorSubscriptions._subscribed": MOST_SUBSCRIBED,
    "Requester.round_trips": 100_000,
    "DvaAgent._last_reported": 20_000,
    "ReplyCache._replies": 64 * 1024,
    "_Kept.keys": 64,
    "FairQueue._lines[]": 1_000,
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
"""Modules of what no agent fills: checkers, the world, the scenario."""


def waiting_of(inbox: CommandQueue, peer: str) -> int:
    """Return how many messages of one connection wait in a robot's queue."""
    lines = inbox._waiting._lines.items()
    return sum(len(line) for (whose, _), line in lines if whose == peer)


def is_waiting(inbox: CommandQueue, data: bytes) -> bool:
    """Return True for a message that is in a robot's queue."""
    lines = inbox._waiting._lines.values()
    return any(letter.data == data for line in lines for letter in line)


def oversized(
    roots: Iterable[object], events: int = 0, left_out: Iterable[object] = ()
) -> Iterator[tuple[str, int, int]]:
    """Yield each container that holds more than it may, of all that can be reached from objects.

    Args:
        roots: Agents; what they share with the whole run is left out.
        events: Number of events that the DVA has ever had.
        left_out: Other objects that are not looked at, nor what only they hold.

    Yields:
        Class and attribute, number of elements, bound.
    """
    seen, todo = {id(each) for each in left_out}, [("", root) for root in roots]
    while todo:
        name, each = todo.pop()
        if isinstance(each, (*_ATOMS, *_NOT_THEIRS)) or id(each) in seen:
            continue
        seen.add(id(each))
        if isinstance(each, (dict, list, tuple, set, frozenset, deque)):
            if name in KEPT_FOR_MEASURES:
                continue
            bound = BOUNDS.get(name, MOST + events)
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
