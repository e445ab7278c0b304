"""Performance goals. A miss is reported, not a failure: the machine may be the cause."""

import math


def goal(what: str, found: float, least: float = -math.inf, most: float = math.inf) -> None:
    """Tell whether a figure lies where it should."""
    bound = f"at least {least:g}" if least > -math.inf else f"at most {most:g}"
    word = "met" if least <= found <= most else "MISSED"
    print(f"\n  goal: {what} {bound}; it is {found:.3g}: {word}", end="")
