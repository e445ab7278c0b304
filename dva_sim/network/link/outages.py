"""Outages of a link, and partitions between nodes of a network."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Literal

from pydantic import model_validator

from dva_sim.kernel.config import Config
from dva_sim.network.link.losses import Fate, PositiveSeconds, Seconds


class Gap(Config):
    """A time without a link, once or again and again.

    Attributes:
        from_s: Start of the gap.
        for_s: Length of the gap.
        every_s: Time from one start to the next; by default it occurs once.
    """

    from_s: Seconds
    for_s: PositiveSeconds
    every_s: PositiveSeconds | None = None

    @model_validator(mode="after")
    def _ends(self) -> Gap:
        if self.every_s is not None and self.for_s >= self.every_s:
            raise ValueError(f"for_s {self.for_s:g} should be below every_s {self.every_s:g}")
        return self

    def covers(self, time: float) -> bool:
        """Return True if nothing gets through at a time [s]."""
        since = time - self.from_s
        if self.every_s is not None and since >= 0:
            since %= self.every_s
        return 0 <= since < self.for_s


class Outage(Gap):
    """A time at which what would cross the link is lost.

    Attributes:
        direction: Direction that is lost; `up` is towards the robot.
    """

    direction: Literal["up", "down", "both"] = "both"


class Partition(Gap):
    """A time at which nothing gets from some nodes to others; the way back is not concerned.

    Attributes:
        source: Nodes that are not heard, such as `operator-1`, `robot-*` or `*`.
        destination: Nodes that do not hear them.
    """

    source: str = "*"
    destination: str = "*"

    def parts(self, source: str, destination: str) -> bool:
        """Return True if it separates one node from another."""
        return fnmatchcase(source, self.source) and fnmatchcase(destination, self.destination)


def lose_in_gaps(gaps: Sequence[Gap]) -> Fate:
    """Return a fate that loses everything during gaps."""
    return lambda now, left_at: any(gap.covers(left_at) for gap in gaps)
