"""The transition table of `protocol/models/event.pml`, taken from the DVA's own orders.

An event in each state meets everything that can happen to it, early and late, at the first attempt
and at the last; what the DVA makes of it is a row.
`PYTHONPATH=tests .venv/bin/python tests/helpers/dva/event_table.py` writes the file.
"""

import itertools
from collections.abc import Iterator
from pathlib import Path

from helpers.dva.dispatch_office import GUARD, HERE, Office

from dva_sim.core.assignments import Rules
from dva_sim.core.dva import Dva
from dva_sim.core.events import Cause, Event
from dva_sim.protocol import messages as m

TABLE = Path(__file__).parents[3] / "protocol" / "models" / "event_table.pml"
BEGAN, WAITS, LIMIT, MOST = 10.0, 60.0, 100.0, 3
NOW = {False: 40.0, True: 75.0}  # times before the deadline and after it [s]

STATES = {
    "PENDING": (),
    "ORDERED": ("SEND",),
    "TAKEN_UP": ("SEND", "TAKE_UP"),
    "UNDER_WAY": ("SEND", "TAKE_UP", "DEPART"),
    "ON_SCENE": ("SEND", "TAKE_UP", "DEPART", "ARRIVE"),
    "CONFIRMED": ("SEND", "TAKE_UP", "DEPART", "ARRIVE", "CONFIRM", "END"),
    "ACTOR_ORDERED": ("SEND", "TAKE_UP", "DEPART", "ARRIVE", "CONFIRM", "END", "SEND"),
    "ACTOR_TAKEN_UP": ("SEND", "TAKE_UP", "DEPART", "ARRIVE", "CONFIRM", "END", "SEND", "TAKE_UP"),
    "CLOSED": ("ESCALATE",),
}
"""Steps that bring an event into each state."""
TO_CONFIRM = frozenset({"TAKEN_UP", "UNDER_WAY", "ON_SCENE"})
"""States in which the attempt that is going on has been counted."""
HAPPENINGS = (
    *("SEND", "TAKE_UP", "DECLINE", "DEPART", "ARRIVE", "CONFIRM", "REFUTE", "CONTAIN", "END"),
    *("FAIL", "VANISH", "CALL_AWAY", "REPORT", "DEADLINE", "ORDER_LIMIT"),
)


class Case:
    """One event that nobody but a guard can be sent to, and that has to be dealt with, too."""

    def __init__(self) -> None:
        rules = Rules(escalate_after=WAITS, containment=True, max_attempts=MOST, order_limit=LIMIT)
        self.core: Dva = Office(rules=rules).core
        self.event: Event = self.core.events.add("fire", HERE, 0.5, BEGAN, contain=True)

    def into(self, state: str) -> None:
        """Bring the event into a state, at its beginning."""
        for happening in STATES[state]:
            self.happens(happening, BEGAN)

    def happens(self, what: str, now: float) -> None:
        """Apply an occurrence, if it is possible."""
        orders, event, state = self.core.orders, self.event, self.state
        is_order = state in ("ORDERED", "ACTOR_ORDERED")
        match what:
            case "SEND" if state == "PENDING":
                orders.confirm(event, GUARD, None, now)
            case "SEND" if state == "CONFIRMED":
                orders.act(event, GUARD, now)
            case "TAKE_UP" if is_order:
                orders.taken_up(self._order())
            case "DECLINE" if is_order:
                orders.not_taken_up(self._order(), now)
            case "DEPART" if orders.has_order(event, GUARD):
                orders.departed(event, GUARD, now)
            case "ARRIVE" if orders.has_order(event, GUARD):
                orders.arrived(event, GUARD, now)
            case "CONFIRM" | "REFUTE" | "CONTAIN" if orders.has_order(event, GUARD):
                orders.found(event, GUARD, _FINDINGS[what], now)
            case "END" | "FAIL" if orders.has_order(event, GUARD):
                orders.ends(event, GUARD, "done" if what == "END" else "failed", now)
            case "VANISH":
                orders.abandon(GUARD, now)
            case "CALL_AWAY" if orders.may_preempt(event, now):
                orders.redirect(event, now)
            case "REPORT" if event.open:
                self.core.events.merge(event, 0.9)
            case "DEADLINE":
                orders.give_up(now)
            case "ORDER_LIMIT" if event.open:
                orders.take_back(event.times.get("act_assigned", BEGAN) + LIMIT + 1.0)
            case "ESCALATE":
                orders.transition(event, Cause.WAITED, now)

    def _order(self) -> m.Order:
        orders, event = self.core.orders, self.event
        return next(send for send in orders.again() if send.body.event_id == event.number)

    @property
    def state(self) -> str:
        """The state in the words of the model."""
        event = self.event
        if not event.open:
            return "CLOSED"
        if event.state.value == "confirmed":
            acts = "ACTOR_TAKEN_UP" if event.act_taken_up else "ACTOR_ORDERED"
            return "CONFIRMED" if event.actor is None else acts
        if event.state.value == "assigned":
            under_way = "UNDER_WAY" if "departed" in event.times else "TAKEN_UP"
            return under_way if event.taken_up else "ORDERED"
        return {"pending": "PENDING", "on scene": "ON_SCENE"}[event.state.value]


_FINDINGS = {"CONFIRM": "confirmed", "REFUTE": "refuted", "CONTAIN": "contained"}


def outcome(state: str, what: str, late: bool, last: bool) -> tuple[str, ...]:
    """Transition of an event, in the words of the model; empty if nothing changes."""
    case = Case()
    case.into(state)
    assert case.state == state, (case.state, state)
    event, now = case.event, NOW[late]
    event.waiting_since = BEGAN
    event.attempts = before = (MOST if last else 1) - (state not in TO_CONFIRM)
    case.happens(what, now)
    done = {
        f"into({case.state})": case.state != state,
        "attempt()": event.attempts > before,
        "no_attempt()": event.attempts < before,
        "wait_again()": event.waiting_since > BEGAN and event.open,
    }
    return tuple(name for name, is_so in done.items() if is_so)


def rows(state: str, what: str) -> Iterator[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Rows of a state and a happening, by those circumstances alone that matter there."""
    both = (True, False)
    found = {pair: outcome(state, what, *pair) for pair in itertools.product(both, both)}
    by_late = any(found[True, last] != found[False, last] for last in both)
    by_last = any(found[late, True] != found[late, False] for late in both)
    for late, last in itertools.product(both if by_late else (True,), both if by_last else (True,)):
        named = [_named("late", late)] * by_late + [_named("last", last)] * by_last
        if found[late, last]:
            yield tuple(named), found[late, last]


def _named(fact: str, is_so: bool) -> str:
    return fact if is_so else f"!{fact}"


def table() -> str:
    """The file's text."""
    lines = [
        "/* What becomes of an event: written by tests/helpers/dva/event_table.py from",
        "   dva_sim/core/orders.py. Change that, not this. What no row names changes nothing. */",
        "inline decide() {",
        "  if",
    ]
    for state, what in itertools.product(STATES, HAPPENINGS):
        for facts, done in rows(state, what):
            guard = " && ".join([f"state == {state}", f"what == {what}", *facts])
            lines.append(f"  :: {guard} -> {'; '.join(done)}")
    return "\n".join([*lines, "  :: else", "  fi", "}", ""])


if __name__ == "__main__":
    TABLE.write_text(table())
