"""What a line says, however it is worded."""


def unnamed(line: object, *names: object) -> list[str]:
    """Of codes, names and numbers that a line should hold, those that it does not."""
    return [str(name) for name in names if str(name) not in str(line)]
