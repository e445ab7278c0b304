"""What somebody meant by a name that there is not: the nearest one, or else what there is."""

from __future__ import annotations

import re
from collections.abc import Iterable

_ALIKE = 0.75  # of two names that differ by a slip; by chance two words reach 0.6
_LISTED = 12  # names in one line; more are counted


def guess(given: str, known: Iterable[str]) -> str | None:
    """The name that was meant; None if no guess is good."""
    from difflib import SequenceMatcher  # late: a mistake can wait for it

    wanted, best = _plain(given), (0.0, "")
    for name in known:
        plain = _plain(name)
        score = SequenceMatcher(None, wanted, plain).ratio()
        if len(wanted) > 2 and (plain.startswith(wanted) or wanted.startswith(plain)):
            score += 1 - _ALIKE  # the beginning of a name is more than letters in common
        best = max(best, (score, name), key=lambda pair: pair[0])
    return best[1] if wanted and best[0] >= _ALIKE else None


def hint(given: str, known: Iterable[str], there: str = "known") -> str:
    """`did you mean 'x'?`, or if no guess is good what there is, not too much of it."""
    names = list(known)
    near = guess(given, names)
    if near is not None:
        return f"did you mean {near!r}?"
    if not names:
        return f"{there}: none"
    more = f", ... ({len(names)} in all)" if len(names) > _LISTED else ""
    return f"{there}: {', '.join(names[:_LISTED])}{more}"


def unknown(what: str, given: object, known: Iterable[str]) -> str:
    """That there is nothing of a name, and which one was meant or what there is."""
    return f"{what} {given!r} is unknown; {hint(str(given), known)}"


def _plain(name: str) -> str:
    """A name without what people mix up: case, and the signs between words."""
    return re.sub(r"[\s_.-]+", "_", name.casefold())
