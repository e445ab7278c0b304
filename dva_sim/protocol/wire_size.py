"""Limits of what fits into a message: lists are cut, and times are bounded."""

LIST_BYTES = 7000  # of a list, the rest of the message apart [B]
LONGEST = 1e6  # longest time in a message [s]


def sent_time(seconds: float) -> float:
    """Return a time as a message can hold it [s]."""
    return max(0.0, min(seconds, LONGEST))


def xml_size(text: str) -> int:
    """Return the room for a text in XML, where a few signs take four bytes more [B]."""
    return len(text.encode()) + 4 * sum(text.count(sign) for sign in "&<>")
