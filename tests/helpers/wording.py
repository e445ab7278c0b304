"""Checks of a line's content that ignore its wording."""

from collections.abc import Mapping


def unnamed(line: object, *names: object) -> list[str]:
    """Codes, names and numbers that a line should hold but does not."""
    return [str(name) for name in names if str(name) not in str(line)]


def counted(counters: Mapping[str, int], *words: str) -> int:
    """Total of the counters whose name has all these words in it."""
    return sum(number for name, number in counters.items() if not unnamed(name, *words))
