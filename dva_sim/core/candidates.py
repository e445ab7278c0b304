"""Candidates for an event: when each would arrive, and why it may not be sent."""

from __future__ import annotations

import math
from collections.abc import Iterator

from dva_sim.core.dispatcher import Advised, Dispatcher
from dva_sim.core.events import Event, State
from dva_sim.core.registry import DeviceEntry
from dva_sim.core.situation_builder import KINDS
from dva_sim.core.travel_times import Start
from dva_sim.protocol import messages as m
from dva_sim.protocol.control_room import FREE
from dva_sim.protocol.devices import GUARD, ROBOT
from dva_sim.protocol.wire_size import LIST_BYTES, xml_size

MAX_NAMED = 32  # maximum candidates in a proposal
NO_WAY = "there is no way"
CANDIDATE_BYTES = 200  # size of a candidate without its texts for people [B]


def proposal(dispatcher: Dispatcher, event: Event, now: float) -> m.Proposal:
    """Return the policy's proposal for an event, with its reasons."""
    advised = dispatcher.advised(event, now)
    everybody = sorted(_everybody(dispatcher, event, now), key=_earliest_first)
    question = dispatcher.questions.of(event.number)
    within = None if question is None else max(0.0, question.until - now)
    reason = _reason(event, advised, everybody)
    named, arrival = (advised.device, advised.arrival_in) if advised else (None, None)
    task = advised.task if advised else event.waits_for if event.open else None
    return m.Proposal(
        event_id=event.number,
        policy=dispatcher.name,
        reason=reason,
        task=task,
        device=named,
        arrival_in=arrival,
        decide_within=within,
        candidates=_as_many_as_fit(everybody),
    )


def _earliest_first(candidate: m.Candidate) -> tuple[bool, float, str]:
    return (
        candidate.reason != FREE,
        math.inf if candidate.arrival_in is None else candidate.arrival_in,
        candidate.device,
    )


def _reason(event: Event, advised: Advised | None, everybody: list[m.Candidate]) -> str:
    """Explain the advice, as far as advice alone can tell."""
    if not event.open:
        return f"it is over: {event.state}"
    free = [c for c in everybody if c.reason == FREE and c.arrival_in is not None]
    if advised is None:
        if event.waits_for is None:
            return "nobody is missing there"
        if everybody and all(c.reason == NO_WAY for c in everybody):
            return "no way leads there: nobody can go"
        return "the policy lets it wait" if free else "nobody can go"
    if advised.device in (event.responder, event.actor):
        return "was sent there by the policy"
    # Texts show whole seconds, so a smaller difference would read as none.
    sooner = [c for c in free if (c.arrival_in or 0.0) < advised.arrival_in - 0.5]
    if not sooner:
        return f"the first there among {len(free)} who could go"
    best = sooner[0]
    gap = advised.arrival_in - (best.arrival_in or 0.0)
    return f"chosen by the policy; {best.label} would be there {gap:.0f} s earlier"[:256]


def _everybody(dispatcher: Dispatcher, event: Event, now: float) -> Iterator[m.Candidate]:
    """Yield all guards and robots."""
    registry = dispatcher.orders.registry
    entries = [
        entry for entry in registry.entries.values() if entry.device.device_type in (GUARD, ROBOT)
    ]
    for entry, eta in zip(entries, _ways(dispatcher, entries, event), strict=True):
        why = _why_not(dispatcher, entry, event, eta, now) or FREE
        arrival = eta if math.isfinite(eta) else None
        yield m.Candidate(entry.device.id_tag, entry.device.label, why[:256], arrival)


def _ways(dispatcher: Dispatcher, entries: list[DeviceEntry], event: Event) -> list[float]:
    """Return when each device would arrive [s from now]; infinite where unknown, or never."""
    engaged = dispatcher.orders.engaged
    positions = {
        e.device.id_tag: Start(
            e.device.id_tag, KINDS[e.device.device_type], e.position, e.device.id_tag in engaged
        )
        for e in entries
        if e.position is not None
    }
    if not positions:
        return [math.inf] * len(entries)
    eta = dispatcher.situations.travel(list(positions.values()), [event.position])[1][0]
    etas = dict(zip(positions, map(float, eta), strict=True))
    return [etas.get(entry.device.id_tag, math.inf) for entry in entries]


def _why_not(
    dispatcher: Dispatcher, entry: DeviceEntry, event: Event, eta: float, now: float
) -> str:
    """Return the first reason why somebody cannot be sent there now; empty: it can."""
    orders = dispatcher.orders
    device = entry.device
    if entry.silent:
        return f"not heard of for {now - entry.last_heard:.0f} s"
    if at := orders.engaged.all(device.id_tag):
        return "is sent there already" if event in at else f"is at event {at[0].number}"
    if device.id_tag in event.handling.taken_off:
        return "was taken off this event"
    if entry.free_from > now:
        return f"declined an order; is asked again in {entry.free_from - now:.0f} s"
    if entry.position is None:
        return "nobody knows where it is"
    if not math.isfinite(eta):
        return NO_WAY
    if device.device_type == ROBOT:
        return _why_not_a_robot(dispatcher, device.id_tag, event, now)
    return ""


def _why_not_a_robot(dispatcher: Dispatcher, robot: str, event: Event, now: float) -> str:
    orders = dispatcher.orders
    if orders.emergencies.holds(robot):
        return "stopped by an emergency: release it first"
    if event.state is State.CONFIRMED:
        return "a robot cannot deal with it"
    if orders.sessions.is_held(robot):
        grant = orders.sessions.permissions.grants.get(robot)
        return f"is held by {orders.label_of(grant.holder)}" if grant else "is being handed over"
    return "" if dispatcher.situations.operators(now) else "no operator is free"


def _as_many_as_fit(everybody: list[m.Candidate]) -> tuple[m.Candidate, ...]:
    named: list[m.Candidate] = []
    room = LIST_BYTES
    for candidate in everybody[:MAX_NAMED]:
        room -= CANDIDATE_BYTES + xml_size(candidate.label) + xml_size(candidate.reason)
        if room < 0:
            break
        named.append(candidate)
    return tuple(named)
