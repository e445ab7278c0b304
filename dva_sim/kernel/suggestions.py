"""Suggestions for unknown names: the closest known name, or a list of the known ones."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

from dva_sim.kernel.retired import use_now
from dva_sim.kernel.wording import listing

_LETTERS: Final = 3  # minimum letters of an abbreviation or a word with letters exchanged
_A_SLIP: Final = 4  # letters per likely typing error
_LISTED: Final = 12  # maximum names listed in one line


def guess(given: str, known: Iterable[str]) -> str | None:
    """Return the known name that was probably meant; None without a good guess.

    A good guess differs by few typing errors; or one of both begins with the other, and they have
    similar lengths or there is no other such name.
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


def _is_half(first: str, second: str) -> bool:
    return 2 * min(len(first), len(second)) >= max(len(first), len(second))


def _begins(first: str, second: str) -> bool:
    short, long = sorted((first, second), key=len)
    return len(short) >= _LETTERS and long.startswith(short)


def _slips(first: str, second: str) -> int:
    """Return the number of letters left out, inserted, changed, or exchanged with the next.

    Names that differ only in their number count as entirely different.
    """
    if abs(len(first) - len(second)) > len(first) // _A_SLIP + 1 or _is_numbered(first, second):
        return len(first) + len(second)
    before = list[int]()
    row = list(range(len(second) + 1))
    for i, a in enumerate(first, 1):
        above = before
        before = row
        row = [i]
        for j, b in enumerate(second, 1):
            least = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (a != b))
            if i > 1 and j > 1 and (a, first[i - 2]) == (second[j - 2], b):
                least = min(least, above[j - 2] + 1)
            row.append(least)
    return row[-1]


def _is_numbered(first: str, second: str) -> bool:
    """Return True if two names differ only in their number, as robot-1 and robot-9."""
    digits = re.compile(r"[0-9]+")
    return first != second and digits.sub("0", first) == digits.sub("0", second)


def hint(given: str, known: Iterable[str], heading: str = "known") -> str:
    """Return `did you mean 'x'?`, or a list of known names without a good guess."""
    names = list(known)
    near = guess(given, names)
    return f"did you mean {near!r}?" if near is not None else f"{heading}: {listed(names)}"


def unknown(what: str, given: object, known: Iterable[str], heading: str = "known") -> str:
    """Return a message that a name is unknown, with the closest known name or a list.

    For a retired name, it names the replacement.
    """
    instead = use_now(what, str(given))
    return instead or f"{what} {given!r} is unknown; {hint(str(given), known, heading)}"


def listed(names: Iterable[object], most: int = _LISTED) -> str:
    """Return names in a line; beyond `most`, the first ones and the total number."""
    every = [str(name) for name in names]
    more = f", ... ({len(every)} in all)" if len(every) > most else ""
    return (", ".join(every[:most]) or "none") + more


def either(names: Iterable[object]) -> str:
    """Return `a, b or c`."""
    return listing([str(name) for name in names], "or")


def plain_name(name: str) -> str:
    """Return a name in lower case without separators, which people confuse."""
    return re.sub(r"[\s_.-]+", "_", name.casefold())
