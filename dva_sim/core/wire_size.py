"""Sizes of messages: lists are cut before they exceed one message."""

LIST_BYTES = 7000  # of a list, the rest of the message apart [B]


def xml_size(text: str) -> int:
    """Room for a text in XML, where a few signs take four bytes more [B]."""
    return len(text.encode()) + 4 * sum(text.count(sign) for sign in "&<>")
