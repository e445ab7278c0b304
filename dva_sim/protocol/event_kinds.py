"""Kinds of events in messages, and words for their severity.

Any other event is reported as one of these kinds.
"""

from typing import Final, Literal, get_args

EventKind = Literal["fire", "gas_leak", "flood"]
EVENT_KINDS: Final[tuple[str, ...]] = get_args(EventKind)
SEVERITIES: Final = {"low": 0.15, "medium": 0.4, "high": 0.6, "critical": 0.9}
"""Design: severity of a report, by the word that a person chooses."""
SEVERITY_WORDS: Final = ((0.75, "critical"), (0.5, "high"), (0.25, "medium"), (0.0, "low"))


def severity_word(severity: float) -> str:
    """Return the word for a severity from 0 (harmless) to 1."""
    return next(word for least, word in SEVERITY_WORDS if severity >= least)
