"""Suggestions for unknown names: the closest known name, or a list of the known ones."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

from dva_sim.kernel.retired import use_now
from dva_sim.kernel.wording import listing

_LETTERS: Final = 3  # minimum letters of a beginning that identifies a name
_A_SLIP: Final = 4  # letters per likely typing error
_LISTED: Final = 12  # maximum names listed in one line


def guess(given: str, known: Iterable[str]) -> str | None:
    """Return the name that was meant; None if no guess is good.

    A good guess differs by few slips, has the name as half of it or more, or is the only one that
    begins with it.
    """
    plain_given = plain_name(given)
    names = list(known)
    if not plain_given:
        return None
    slips = {name: _slips(plain_given, plain_name(name)) for name in names}
    near = min(slips, key=lambda name: slips[name], default=None)
    if near is not None and slips[near] <= (len(plain_given) + 1) // _A_SLIP:
        exchanged = sorted(plain_given) == sorted(plain_name(near))
        if len(plain_given) > _LETTERS or (len(plain_given) == _LETTERS and exchanged):
            return near
    begun = {name: plain_name(name) for name in names if _begins(plain_given, plain_name(name))}
    halves = [name for name, plain in begun.items() if _is_half(plain_given, plain)]
    return halves[0] if halves else next(iter(begun)) if len(begun) == 1 else None


def _is_half(one: str, other: str) -> bool:
    return 2 * min(len(one), len(other)) >= max(len(one), len(other))


def _begins(one: str, other: str) -> bool:
    short, long = sorted((one, other), key=len)
    return len(short) >= _LETTERS and long.startswith(short)


def _slips(one: str, other: str) -> int:
    """Return letters left out, put in, changed, or exchanged with the next.

    Many for another number.
    """
    if abs(len(one) - len(other)) > len(one) // _A_SLIP + 1 or _is_numbered(one, other):
        return len(one) + len(other)
    before = list[int]()
    row = list(range(len(other) + 1))
    for i, a in enumerate(one, 1):
        above = before
        before = row
        row = [i]
        for j, b in enumerate(other, 1):
            least = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (a != b))
            if i > 1 and j > 1 and (a, one[i - 2]) == (other[j - 2], b):
                least = min(least, above[j - 2] + 1)
            row.append(least)
    return row[-1]


def _is_numbered(one: str, other: str) -> bool:
    """Return True if two names differ only in their number: robot-9 is no misspelt robot-1."""
    digits = re.compile(r"[0-9]+")
    return one != other and digits.sub("0", one) == digits.sub("0", other)


def hint(given: str, known: Iterable[str], heading: str = "known") -> str:
    """Return `did you mean 'x'?`; if no guess is good what there is, but not too much of it."""
    names = list(known)
    near = guess(given, names)
    return f"did you mean {near!r}?" if near is not None else f"{heading}: {listed(names)}"


def unknown(what: str, given: object, known: Iterable[str], heading: str = "known") -> str:
    """Say that a name is unknown, and suggest the closest one or list the known ones.

    Of a retired name, say what to use instead.
    """
    instead = use_now(what, str(given))
    return instead or f"{what} {given!r} is unknown; {hint(str(given), known, heading)}"


def listed(names: Iterable[object], most: int = _LISTED) -> str:
    """Return names in a line; of many the first, and how many there are."""
    every = [str(name) for name in names]
    more = f", ... ({len(every)} in all)" if len(every) > most else ""
    return (", ".join(every[:most]) or "none") + more


def either(names: Iterable[object]) -> str:
    """Return `a, b or c`."""
    return listing([str(name) for name in names], "or")


def plain_name(name: str) -> str:
    """Return a name without capitals and separators, which people mix up."""
    return re.sub(r"[\s_.-]+", "_", name.casefold())
