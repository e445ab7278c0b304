"""Reply codes: `OK`, or why a request was refused."""

from __future__ import annotations

from typing import Final

OK: Final = 0
BAD_MESSAGE: Final = 1
NOT_REGISTERED: Final = 2
NOT_PERMITTED: Final = 3
BAD_SESSION: Final = 4
OUT_OF_ORDER: Final = 5
STALE: Final = 6
WRONG_MODE: Final = 7
BUSY: Final = 8
UNKNOWN_DEVICE: Final = 9
UNKNOWN_SENSOR: Final = 10
UNKNOWN_EVENT: Final = 11
NOT_SUPPORTED: Final = 12

CODE_NAMES: Final = {
    OK: "ok",
    BAD_MESSAGE: "bad message",
    NOT_REGISTERED: "not registered",
    NOT_PERMITTED: "not permitted",
    BAD_SESSION: "bad session",
    OUT_OF_ORDER: "out of order",
    STALE: "stale",
    WRONG_MODE: "wrong mode",
    BUSY: "busy",
    UNKNOWN_DEVICE: "unknown device",
    UNKNOWN_SENSOR: "unknown sensor",
    UNKNOWN_EVENT: "unknown event",
    NOT_SUPPORTED: "not supported",
}
"""Reply codes in words, for logs and for the text of a reply."""
OBEYS_NO_MORE: Final = (NOT_PERMITTED, BAD_SESSION, WRONG_MODE)  # the next fares no better
