"""Each action is done once and answered once, however often a page says it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final, Unpack

from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.wire.kinds import BadMessage
from dva_sim.console.wire.seats import REFUSAL, Answered, DoneLine
from dva_sim.kernel.errors import DvaSimError

SAME_STOP_S: Final = 1.0  # two requests for an emergency stop within this time count as one [s]

FAREWELL_PREFIX: Final = (
    "bye-"  # ids of what is asked for in the name of a page that is gone for good begin so
)


class Answers:
    """Answers to actions, by the ids that pages give them; the oldest are forgotten.

    Attributes:
        given: The answers, as lines; None while one is still to come.
    """

    MOST = 1000

    def __init__(self) -> None:
        self.given: dict[str, DoneLine | None] = {}
        self._at: dict[str, float] = {}  # when, real time [s]

    def once(
        self,
        number: str,
        do: Callable[[OnResult], object],
        tell: Callable[[DoneLine], object],
        *,
        repeats: bool = False,
    ) -> None:
        """Do an action that is new; one that was said before is answered as it was then.

        Args:
            number: Its id.
            do: Does it, and tells what came of it, now or later; what it raises is a refusal.
            tell: Callback for the answer.
            repeats: Do it again if it was answered a while ago: an emergency stop has to stop,
                though its id was used before.
        """
        if number in self.given:
            entry = self.given[number]
            if entry is None:
                return
            if not repeats or time.monotonic() - self._at[number] < SAME_STOP_S:
                tell(entry)
                return
        self.given[number] = None
        if len(self.given) > self.MOST:
            oldest = next(iter(self.given))
            del self.given[oldest]
            self._at.pop(oldest, None)

        def answer_with(ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
            answer: DoneLine = {"k": "done", "id": number, "ok": ok, "text": text, **more}
            self.given[number], self._at[number] = answer, time.monotonic()
            tell(answer)

        answering(do, answer_with)


def answering(do: Callable[[OnResult], object], on_result: OnResult) -> None:
    """Do something of which somebody waits to hear; if it is refused, that is the answer."""
    try:
        do(on_result)
    except (Refused, BadMessage, DvaSimError) as error:
        on_result(False, str(error), outcome=REFUSAL)
