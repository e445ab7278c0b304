"""Each action is done once and answered once, however often a page says it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from dva_sim.console.refusal import Refused, Said
from dva_sim.kernel.errors import DvaSimError

Line = dict[str, Any]

BYE: Final = "bye-"  # ids of what is asked for in the name of a page that is gone for good begin so


class Answers:
    """What was answered to actions, by the ids that pages give them; the oldest are forgotten.

    Attributes:
        given: The answers, as lines; None while one is still to come.
    """

    MOST = 1000

    def __init__(self) -> None:
        self.given: dict[str, Line | None] = {}

    def once(
        self, number: str, do: Callable[[Said], object], tell: Callable[[Line], object]
    ) -> None:
        """Do an action that is new; one that was said before is answered as it was then.

        Args:
            number: Its id.
            do: Does it, and tells what came of it, now or later; what it raises is a refusal.
            tell: Takes the answer.
        """
        if number in self.given:
            if (known := self.given[number]) is not None:
                tell(known)
            return
        self.given[number] = None
        if len(self.given) > self.MOST:
            del self.given[next(iter(self.given))]

        def said(ok: bool, text: str, /, **more: Any) -> None:
            answer = {"k": "done", "id": number, "ok": ok, "text": text, **more}
            self.given[number] = answer
            tell(answer)

        answering(do, said)


def answering(do: Callable[[Said], object], said: Said) -> None:
    """Do something of which somebody waits to hear; if it is refused, that is the answer."""
    try:
        do(said)
    except (Refused, DvaSimError) as error:
        said(False, str(error))
