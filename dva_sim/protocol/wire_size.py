"""Sizes that fit into a message: lists are cut, and times are bounded."""

LIST_BYTES = 7000  # maximum size of a list, without the rest of the message [B]
LONGEST = 1e6  # longest time in a message [s]


def sent_time(seconds: float) -> float:
    """Return a time as a message can hold it [s]."""
    return max(0.0, min(seconds, LONGEST))


def xml_size(text: str) -> int:
    """Return the maximum size of a text in XML, where three characters are escaped [B]."""
    return len(text.encode()) + 4 * sum(text.count(sign) for sign in "&<>")
