"""Refusals, as an app handles them: pure, and the same for every pattern and driver.

A requested command gets a reply. A published one does not, but the robot publishes its holder and
the outcome of the holder's newest command.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from dva_sim.protocol import messages as m

ASK_AGAIN = (m.NOT_PERMITTED, m.BAD_SESSION)  # only the DVA knows whether the permission holds
PASSES = (m.STALE, m.OUT_OF_ORDER)  # codes of late commands; the next one may be in time
LATE_FOR = 10.0
"""Design: time with only refusals, at least `REFUSALS_IN_A_ROW`, before an alert [s]."""
SAYS_LATE_FOR = 40.0
"""Design: the same for published commands [s]. It is longer than `LATE_FOR`, since a robot that is
only slow ends the drive itself after 30 s without an obeyed command."""
REFUSALS_IN_A_ROW = 3  # design: consecutive refusals of other kinds, or sends without a reply
TAKEN = "somebody else holds the robot"


@dataclass
class Refusals:
    """Counts refusals, and reports when all further commands will be refused.

    Attributes:
        me: Id of the device that drives.
        codes: Number of replies other than OK to commands, by code.
        last: The code that ended it.
        late: True if all commands have arrived late for `LATE_FOR`.
    """

    me: str
    codes: Counter[int] = field(default_factory=Counter)
    last: int | None = None
    late: bool = False
    _in_vain: int = 0
    _late: int = 0
    _late_since: float = 0.0
    _sent: int = 0
    _confirmed: bool = False
    _doubtful: int = 0

    def answered(self, code: int | None, now: float) -> str:
        """Handle the reply to a command; return why all further ones will be refused, or "".

        Args:
            code: Code of the reply; None if it cannot be read, or belongs to something else.
            now: Time [s].
        """
        if code == m.OK:
            self._in_vain = self._late = 0
            return ""
        self.codes[m.BAD_MESSAGE if code is None else code] += 1
        if code in PASSES:
            return self._too_late(code, now, LATE_FOR)
        self._in_vain += 1
        if code not in m.OBEYS_NO_MORE and self._in_vain < REFUSALS_IN_A_ROW:
            return ""
        return self._over(code)

    def held(self, holder: str | None, code: int | None, now: float, sent: int) -> str:
        """Note the robot's holder; return why all further commands will be refused, or "".

        A report from before the drive may arrive late. So reports count once the robot has
        confirmed this driver, or when the same report is repeated.

        Args:
            holder: Id of the device that may act; None if there is none.
            code: Code that its newest command got, or would get; None: OK.
            now: Time [s].
            sent: Number of commands sent so far; without any, nothing new can be concluded.
        """
        code = m.OK if code is None else code
        ours = holder == self.me
        goes_on = sent > self._sent
        self._sent = sent
        if ours and (code == m.OK or code in PASSES):
            self._confirmed = True
            self._doubtful = 0
            if code == m.OK:
                self._late = 0
                self.late = False
            if code == m.OK or not goes_on:
                return ""
            why = self._too_late(code, now, SAYS_LATE_FOR)
            self.codes[code] += bool(why)
            return why
        self._doubtful += 1
        if not self._confirmed and self._doubtful < REFUSALS_IN_A_ROW:
            return ""
        self.codes[code if ours else m.NOT_PERMITTED] += 1
        return self._over(code) if ours else self._over(m.NOT_PERMITTED, TAKEN if holder else "")

    def _too_late(self, code: int, now: float, limit: float) -> str:
        """Return one more that came late, and none that did not since the first of them."""
        if self._late == 0:
            self._late_since = now
        self._late += 1
        since = now - self._late_since if self._late >= REFUSALS_IN_A_ROW else 0.0
        self.late = since >= LATE_FOR
        return self._over(code, f"{m.CODE_NAMES[code]} for {limit:g} s") if since >= limit else ""

    def _over(self, code: int | None, why: str = "") -> str:
        self.last = code
        name = "no answer that can be read" if code is None else m.CODE_NAMES.get(code, str(code))
        return f"the robot no longer obeys: {why or name}"
