"""The balance of a timed run: every event of the world in exactly one state, none lost.

What the world counted is held against what the DVA's book says, and the rules that hold
whatever a policy advises against what everybody is really at.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from dva_sim.core.events import State

if TYPE_CHECKING:
    from dva_sim.timed.shift import Shift

SLACK = 1e-3  # deadlines are looked at exactly, but for the clock's step [s]


def check(shift: Shift) -> None:
    """Count every rule that does not hold now."""
    for broken in (*_conservation(shift), *_limits(shift), *_team(shift)):
        shift.violations[broken] += 1


def _conservation(shift: Shift) -> Iterator[str]:
    """S6: the counts add up, here and in the book, and both know the same open events."""
    held = sum(len(incidents) for incidents in shift.events.values())
    if shift.total != len(shift.unnoticed) + held + sum(shift.settled.values()):
        yield "an event of the world is lost"
    book = shift.desk.book
    if sum(book.counts.values()) != book.total:
        yield "the book's counts do not add up"
    if book.open.keys() != shift.events.keys():
        yield "the book and the world know different open events"
    if len(book.waiting) != sum(level.now for level in shift.waiting):
        yield "the book and the world count different waiting events"


def _limits(shift: Shift) -> Iterator[str]:
    """Nothing waits beyond its deadline, and no more than may wait."""
    rules, now, book = shift.desk.orders.rules, shift.clock.now, shift.desk.book
    for event in book.waiting.values():
        if now - event.waiting_since > rules.escalate_after + SLACK:
            yield "an event waits beyond its deadline"
    if rules.most_waiting is not None and len(book.waiting) > rules.most_waiting:
        yield "more events wait than may"


def _team(shift: Shift) -> Iterator[str]:
    """One event per responder and one responder per event, as the DVA believes it to be."""
    engaged = shift.desk.orders.engaged
    for unit in shift.units:
        job, at = unit.job, [event.number for event in engaged.all(unit.device)]
        if ([] if job is None else [job.order.event_id]) != at:
            yield "a responder is at something else than the DVA believes"
    for event in shift.desk.book.in_state(State.ASSIGNED, State.ON_SCENE):
        if event.responder is None:
            yield "an event that somebody should be at has nobody"
    for event in shift.desk.book.open.values():
        if (
            event.responder is not None
            and event.responder == event.actor
            and event.state
            in (
                State.ASSIGNED,
                State.ON_SCENE,
            )
        ):
            yield "somebody is to do two things at once"
