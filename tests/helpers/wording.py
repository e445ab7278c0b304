"""What a line says, however it is worded."""

from collections.abc import Mapping


def unnamed(line: object, *names: object) -> list[str]:
    """Of codes, names and numbers that a line should hold, those that it does not."""
    return [str(name) for name in names if str(name) not in str(line)]


def counted(counters: Mapping[str, int], *words: str) -> int:
    """How often something was counted whose name has all these words in it."""
    return sum(number for name, number in counters.items() if not unnamed(name, *words))
