"""Contacts, jams and how they end: the rules, and what counts them.

There is no reverse, so whoever has driven into something has to turn away from it, or waits
for help. The rules:

- **A contact** begins when a robot touches a wall, another robot or a person, having touched
  nothing for `SAME_CONTACT`. A scrape along a ragged wall is one contact, however many segments
  it has, and so is a push during which both sides part for a moment. Contacts with people are
  counted among all, and once more by themselves.
- **Jammed** is a robot that touches something, has been asked to drive or turn for `JAM_TIME`
  altogether, and in all that time moved less than `JAM_WAY` and turned less than `JAM_TURN`
  from where it was. Time in which nothing is asked of it does not count, and resets nothing.
  A robot without power is asked for nothing: it fails, but it is not jammed.
- **It recovers** by turning on the spot, where its drive can, until the way ahead is free, and
  then driving on; or by being pushed. As soon as it has moved `JAM_WAY` or turned `JAM_TURN` it
  is no longer jammed. A car cannot turn without moving ahead: one whose nose touches a wall
  stays jammed.
- **Who may free it**: only somebody beside it. In a run nobody does: a jam of a car ends what
  it was sent to do, and is counted as the cause.
"""

from __future__ import annotations

import math
from typing import Final

SAME_CONTACT: Final = 0.5  # touching again within this time is the same contact [s]
JAM_TIME: Final = 5.0  # asked to move for so long, in contact [s]; assumed
JAM_WAY: Final = 0.05  # [m]; assumed
JAM_TURN: Final = 0.1  # [rad]; assumed


class Contacts:
    """Contacts of one kind that a body has had.

    Attributes:
        count: Contacts begun so far.
        touching: Shapes that it touches now.
        last: When it last ceased to touch one [s].
    """

    def __init__(self) -> None:
        self.count, self.touching, self.last = 0, 0, -math.inf

    def begin(self, now: float) -> None:
        """It touches one more shape."""
        if not self.touching and now - self.last > SAME_CONTACT:
            self.count += 1
        self.touching += 1

    def end(self, now: float) -> None:
        """It touches one shape less."""
        self.touching -= 1
        self.last = now


class Jam:
    """Whether a robot is jammed: it is told of every tick in which it strains against something.

    Attributes:
        count: How often it became so.
    """

    def __init__(self) -> None:
        self.count = 0
        self._since = 0.0
        self._x = self._y = self._heading = math.inf

    def strain(self, x: float, y: float, heading: float, dt: float) -> None:
        """For a tick it was asked to move while it touched something, there [m, rad]."""
        if not self._near(x, y, heading):
            self._x, self._y, self._heading, self._since = x, y, heading, 0.0
        if self._since < JAM_TIME <= self._since + dt:
            self.count += 1
        self._since += dt

    def holds(self, x: float, y: float, heading: float) -> bool:
        """Whether it is jammed, being there [m, rad]."""
        return self._since >= JAM_TIME and self._near(x, y, heading)

    def _near(self, x: float, y: float, heading: float) -> bool:
        way = math.hypot(x - self._x, y - self._y)
        return way < JAM_WAY and abs(heading - self._heading) < JAM_TURN
