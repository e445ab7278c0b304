"""Kinds of events in messages; any other event is reported as one of these."""

from typing import Final, Literal, get_args

EventKind = Literal["fire", "gas_leak", "flood"]
EVENT_KINDS: Final[tuple[str, ...]] = get_args(EventKind)
