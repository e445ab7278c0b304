"""How the DVA decides: who goes, and who may ask for what."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from dva_sim.config import Config
from dva_sim.core.access import LEVELS
from dva_sim.core.rules import Rules
from dva_sim.scenario.parts import NonNegative, Positive


class DispatchConfig(Config):
    """How the DVA chooses who goes, and the rules that hold whatever is chosen.

    Attributes:
        policy: By name, or as `my_policy.py:Mine`.
        options: Of that policy.
        escalate_after_s: An event that has waited so long for somebody is escalated; 0: at
            once if nobody is free; null: never.
        containment: Whether a confirmed event also needs a guard who deals with it.
        most_waiting: More events than that do not wait: the newest is escalated at once.
        merge_distance_m: Reports of one kind nearer than this are one event; 0: never.
        order_limit_s: Who has not settled an event so long after the order gives it back.
        bid_within_s: How long an auction takes bids.
    """

    policy: str = "min_eta"
    options: dict[str, Any] = Field(default_factory=dict)
    escalate_after_s: NonNegative | None = 120.0
    containment: bool = False
    most_waiting: Annotated[int, Field(ge=0)] | None = None
    merge_distance_m: NonNegative = 8.0
    max_attempts: Annotated[int, Field(ge=1)] = 4
    order_limit_s: Positive = 900.0
    bid_within_s: Positive = 2.0

    def rules(self) -> Rules:
        """As the core wants them."""
        never = math.inf
        return Rules(
            never if self.escalate_after_s is None else self.escalate_after_s,
            self.containment,
            self.most_waiting,
            self.merge_distance_m,
            self.max_attempts,
            self.order_limit_s,
            self.bid_within_s,
        )


class AccessConfig(Config):
    """What some devices may ask for, for a time; what no rule allows is refused.

    Attributes:
        holders: Labels such as `operator-1`; left out: all.
        robots: Labels such as `robot-1`; left out: all.
        levels: `teleoperation`, `missions`, `both`, `sensors`.
        sensors: Names of the sensors that may be read; left out: all.
        from_s: From when on.
        until_s: Up to when; what is in use then is revoked. Left out: for good.
    """

    holders: tuple[str, ...] = ()
    robots: tuple[str, ...] = ()
    levels: tuple[Literal["teleoperation", "missions", "both", "sensors"], ...] = LEVELS
    sensors: tuple[str, ...] | None = None
    from_s: NonNegative = 0.0
    until_s: Positive | None = None


class PatrolConfig(Config):
    """A round that the DVA sends a robot while nothing happens.

    Attributes:
        robot: Its label, such as `robot-1`.
        places: Names of rooms, or places as `[x, y]` in metres on the site's plane, in order.
    """

    robot: str
    places: Annotated[tuple[str | tuple[float, float], ...], Field(min_length=1, max_length=64)]
