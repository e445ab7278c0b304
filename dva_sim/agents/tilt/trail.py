"""How old the pictures are that a command rests on, carried along with the tilt itself."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.agents.tilt.filters import Filter


class Trail:
    """Takes the time at which a picture was captured the way that the tilt takes.

    The hand averages what it is asked to do, and the filter averages what the hand does. The
    same hand and the same filter, given capture times in place of tilts, answer when the
    pictures behind a command were captured, on average: as old as a signal that rises steadily
    comes out of both. It is for the recorder alone, and touches no command.

    Args:
        make_filter: Makes another filter like the phone's.
    """

    def __init__(self, make_filter: Callable[[], Filter]) -> None:
        self._make_filter = make_filter
        self.begin(0.0)

    def begin(self, now: float) -> None:
        """A drive begins; what is behind the tilt until a picture is followed counts from now."""
        self._filter = self._make_filter()
        # Since the beginning, as empty slots of a filter hold a zero.
        self._begun, self._asked, self._hand = now, 0.0, 0.0

    def follow(self, captured: float) -> None:
        """From now on the hand follows what a picture captured at that time [s] led to."""
        self._asked = captured - self._begun

    def sample(self, count: int, decay: float) -> None:
        """So many samples; from each to the next the hand keeps the share `decay`."""
        asked, hand, add = self._asked, self._hand, self._filter.add
        for _ in range(count):
            hand = asked + (hand - asked) * decay
            add((hand, hand))
        self._hand = hand

    def captured(self) -> float:
        """When the pictures behind the filter's value were captured, on average [s]."""
        return self._begun + self._filter.value()[0]

    @property
    def age(self) -> float:
        """Mean age of what the filter's value is made of, in samples: of the value taken last."""
        return self._filter.age

    @property
    def asked(self) -> float:
        """When the picture was captured that is followed now [s]."""
        return self._begun + self._asked
