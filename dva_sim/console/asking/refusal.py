"""Outcome of an action: an answer, or a refusal with its reason."""

from __future__ import annotations

from typing import Final, Protocol, Unpack

from dva_sim.console.wire.seats import Answered

UNKNOWN: Final = "unknown"  # outcome of what may have been done or not: nobody has answered
NO_ANSWER: Final = "the DVA does not answer"


class OnResult(Protocol):
    """Callback for the answer to an action."""

    def __call__(self, ok: bool, text: str, /, **more: Unpack[Answered]) -> object:
        """Told whether it was done, what there is to say of it, and what was asked for."""


def unanswered(on_result: OnResult, text: str = NO_ANSWER) -> None:
    """Tell that nobody has answered, so that one cannot know whether it was done."""
    on_result(False, text, outcome=UNKNOWN)


class Refused(Exception):
    """An action that cannot be done, and why, in a line."""
