"""Measures of control rooms: how long people took, and what the policy would have done.

Only runs in which somebody takes part at a control room have these columns.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from dva_sim.core.events import Event
from dva_sim.kernel.measure import Measure, text
from dva_sim.protocol.facts import Fact
from dva_sim.protocol.messages import BUSY, OK, OUT_OF_ORDER
from dva_sim.simulation.full.recording import Recording
from dva_sim.simulation.measures.commands import NAN, Row, mean, restricted_mean

RUN_COLUMNS = (
    Measure(
        "acknowledge_mean_s",
        "first report to acknowledgement, mean over events; the horizon where never",
        title="restricted mean time to acknowledge",
        awaits="acknowledgement",
    ),
    Measure(
        "assign_mean_s",
        "first report to the first order given, mean over events; the horizon where never",
        title="restricted mean time to the first order",
        awaits="order",
    ),
    Measure("person_orders", "orders that people gave, as proposed or not"),
    Measure("overrides", "orders of people that differ from what the policy would have done"),
    Measure(
        "override_delay_mean_s",
        "expected arrival of whom people sent, less that of whom the policy would have, mean",
        title="what overrides cost in expected arrival",
        low=-math.inf,
    ),
    Measure("unanswered", "orders that the policy gave as nobody had decided in time"),
    Measure("dismissed", "events that people called false alarms or escalated"),
    Measure("decided_too_late", "decisions of people that were refused, as another was first"),
)
EVENT_COLUMNS = (
    Measure("t_acknowledged_s", "when somebody at a control room acknowledged it"),
    Measure("acknowledge_s", "detection until it is acknowledged", title="time to acknowledge"),
    Measure("assign_s", "detection until the first order", title="time to the first order"),
    text("decided_by", "who gave the last order for it: person, policy or none"),
    text("policy_would_send", "whom the policy would have sent then; empty: nobody"),
    Measure("overridden", "whether people sent somebody else there", low=0, high=1),
)


def run_measures(recording: Recording) -> Row:
    """Return the measures of the whole run."""
    facts = recording.facts
    horizon = recording.scenario.horizon_s
    overrides = [fact for fact in facts if fact.overrides]
    orders = [fact for fact in facts if _is_order(fact) and fact.role is not None]
    costs = [cost for fact in overrides if (cost := _cost(fact)) is not None]
    return {
        "acknowledge_mean_s": restricted_mean(map(_acknowledged, recording.events), horizon),
        "assign_mean_s": restricted_mean([_assigned(e, facts) for e in recording.events], horizon),
        "person_orders": len(orders),
        "overrides": len(overrides),
        "override_delay_mean_s": mean(costs),
        "unanswered": sum(_is_order(f) and f.role is None and bool(f.cause) for f in facts),
        "dismissed": sum(
            f.action in ("false_alarm", "escalate") and f.role is not None and f.code == OK
            for f in facts
        ),
        "decided_too_late": sum(f.role is not None and f.code in _TOO_LATE for f in facts),
    }


def event_measures(event: Event | None, recording: Recording) -> Row:
    """Return the measures of one event; only its names if the DVA never knew of it."""
    orders = [f for f in recording.facts if event and f.event == event.number and _is_order(f)]
    last = orders[-1] if orders else None
    advised = last.advised if last else None
    acknowledged = event.handling.acknowledged if event else None
    return {
        "t_acknowledged_s": acknowledged.time if acknowledged else NAN,
        "acknowledge_s": _acknowledged(event) if event else NAN,
        "assign_s": _assigned(event, recording.facts) if event else NAN,
        "decided_by": "none" if last is None else "policy" if last.role is None else "person",
        "policy_would_send": recording.labels.get(advised or "", ""),
        "overridden": any(order.overrides for order in orders),
    }


_TOO_LATE = frozenset({OUT_OF_ORDER, BUSY})


def _is_order(fact: Fact) -> bool:
    return fact.action == "assign" and fact.code == OK


def _cost(fact: Fact) -> float | None:
    """Return how much later the device sent is expected than the one the policy would send [s]."""
    if fact.arrival_in is None or fact.advised_in is None:
        return None
    return fact.arrival_in - fact.advised_in


def _acknowledged(event: Event) -> float:
    acknowledgement = event.handling.acknowledged
    return NAN if acknowledgement is None else acknowledgement.time - event.times["detected"]


def _assigned(event: Event, facts: Iterable[Fact]) -> float:
    times = (f.time for f in facts if f.event == event.number and _is_order(f))
    return next(times, NAN) - event.times["detected"]
