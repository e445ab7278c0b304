"""Questions of a robot to the DVA about its permissions: which is next, and when.

Without keys anybody can claim to be the DVA. What is claimed in its name is therefore only a reason
to ask: the answer comes over a connection that the robot itself has opened, and it alone counts.
However much is claimed, one question is under way at a time and a few are asked in a second; each
answer states what holds by then, so that no claim has to wait for those before it. Pure.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, field

from dva_sim.protocol import messages as m

BURST = 4.0  # maximum questions in immediate succession
RATE = 4.0  # sustained rate limit [1/s]
MAX_READERS = 64  # maximum devices about which a question is pending
MAX_OVER = 1000  # maximum sessions noted as over while one question is under way
CLOCK_TOLERANCE_S = 1e-5  # tolerance of a query for clocks that round to microseconds [s]


@dataclass
class Inquiry:
    """The open questions of a robot to the DVA.

    Attributes:
        asked: Open query to the DVA.
        asked_at: Time of the question [s].
    """

    asked: m.GetGrant | None = None
    asked_at: float = -math.inf
    _holder: bool = False  # whether the question about the holder is pending
    _claimed: str | None = None  # latest device that was claimed to be the holder
    _by_name: bool = False  # True for an older DVA, which is asked about a device by id
    _readers: OrderedDict[str, None] = field(default_factory=OrderedDict)
    _readers_next: bool = False
    _over: set[int] = field(default_factory=set)
    _left: float = BURST
    _counted_at: float = 0.0

    @property
    def is_open(self) -> bool:
        """True while the question who holds the robot is open or under way."""
        return self._holder or (self.asked is not None and self.asked.level is None)

    def restart(self, now: float) -> None:
        """Forget every question, and open the one who holds the robot, as that is forgotten, too.

        Args:
            now: Start of the period in which nobody may take the robot, as after a query [s].
        """
        fresh = Inquiry(asked_at=now, _holder=True)
        for name in vars(self):
            setattr(self, name, getattr(fresh, name))

    def about_holder(self, claimed: str | None) -> None:
        """Make the question about the robot's holder pending.

        Args:
            claimed: Id of the device that is said to be the holder, or acts as if it were.
        """
        self._holder = True
        self._claimed = claimed or self._claimed

    def about_reader(self, device: str) -> None:
        """Make the question pending which sensors a device may read."""
        if len(self._readers) < MAX_READERS:
            self._readers[device] = None

    def is_over(self, session: int) -> None:
        """Note a claim that a session is over; an answer in transit may be older."""
        if self.asked is not None and len(self._over) <= MAX_OVER:
            self._over.add(session)

    def due(self, now: float) -> float:
        """Return when the next question may be asked; infinite while none can be."""
        if self.asked is not None or not (self._holder or self._readers):
            return math.inf
        lacking = 1.0 - self._allowed(now)
        return now if lacking <= CLOCK_TOLERANCE_S else now + lacking / RATE

    def next(self, now: float) -> m.GetGrant | None:
        """Return the next question, which is then under way, if one may be asked now."""
        if self.due(now) > now:
            return None
        self._left = self._allowed(now) - 1.0
        self._counted_at = now
        if self._readers and (self._readers_next or not self._holder):
            self.asked = m.GetGrant(self._readers.popitem(last=False)[0], "sensors")
        else:
            self.asked = m.GetGrant(self._claimed if self._by_name else None)
            self._holder = False
        # Readers and the holder take turns: neither can keep the other waiting.
        self._readers_next = not self._readers_next
        self.asked_at = now
        self._over.clear()
        return self.asked

    def answered(self, reply: m.Reply) -> m.GetGrant | None:
        """Handle the answer to the open query; return the query if it is settled.

        The DVA must be asked again if it does not know the robot yet, if it understands only
        questions about one device (before 1.6), or if its answer may be older than the end of a
        session.
        """
        question = self.asked
        self.asked = None
        by_name = self._by_name
        self._by_name = False
        if question is None:
            return None
        if reply.code in (m.BAD_MESSAGE, m.NOT_SUPPORTED):
            self._by_name = not by_name and question.level is None and self._claimed is not None
            if self._by_name:
                self._holder = True
                return None
        permission = reply.content
        overtaken = isinstance(permission, m.Permission) and self._was_over(permission.session)
        if overtaken or reply.code == m.NOT_REGISTERED:
            self._again(question)
            return None
        if not self._holder:
            self._claimed = None
        return question

    def unanswered(self) -> None:
        """Open the question under way again, since the DVA has not answered."""
        question = self.asked
        self.asked = None
        if question is not None:
            self._again(question)

    def _was_over(self, session: int) -> bool:
        # With more ends than were kept, any session may be over.
        return session in self._over or len(self._over) > MAX_OVER

    def _again(self, question: m.GetGrant) -> None:
        if question.level is None:
            self._holder = True
        else:
            self.about_reader(question.holder or "")

    def _allowed(self, now: float) -> float:
        return min(BURST, self._left + RATE * (now - self._counted_at))
