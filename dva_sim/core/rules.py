"""The rules that hold whatever a policy advises."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Rules:
    """What the DVA insists on.

    Attributes:
        escalate_after: An event that has waited so long for somebody is escalated [s]. 0: at
            once if nobody is free; infinite: never.
        containment: Whether a confirmed event also needs a person who deals with it.
        most_waiting: More events than that do not wait: the newest is escalated at once.
        merge_distance: Reports of one kind nearer than this are one event [m]; 0: never.
        max_attempts: Orders given for one event before it is escalated.
        order_limit: Who has not settled an event so long after the order gives it back [s].
        bid_within: How long bids are taken [s].
        operator_span: How many robots one operator may have in hand at once.
        declined_pause: Who declines an order, or is not reached, is not asked again for [s].
    """

    escalate_after: float = 120.0
    containment: bool = False
    most_waiting: int | None = None
    merge_distance: float = 8.0
    max_attempts: int = 4
    order_limit: float = 900.0
    bid_within: float = 2.0
    operator_span: int = 1
    declined_pause: float = 10.0
