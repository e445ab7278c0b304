"""Levels at which a finding holds, in words: `without delay`, `from 250 ms on`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Finding
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import listing
from dva_sim.simulation.labels import absent_at_zero, factor_name, level_name, named, setting

_MOST_SPACES = 2  # in a name that reads well before `of 250 ms`


def place_of(finding: Finding, stop: int) -> str:
    """Describe one stop of a finding: `with profile default, at a one-way delay of 1 s`."""
    return ", ".join(filter(None, (condition(finding), at(finding, [stop]))))


def condition(f: Finding) -> str:
    """`with profile default`: the levels of the other factors; nothing without any."""
    return f"with {setting(f.within)}" if f.within else ""


def at(f: Finding, where: Sequence[int]) -> str:
    """`at a one-way delay of 1 s`, or where a contrast holds that runs over nothing."""
    if not f.over:
        return f.everywhere
    if spoken := _spoken(f, where):
        return spoken
    names = listing([level_name(f.over, f.levels[i]) for i in where])
    name = factor_name(f.over)
    if name.count(" ") > _MOST_SPACES:
        return f"where the {name} is {names}"
    vowel = name[0] in "aeiou" and not name.startswith("one")
    article = "" if len(where) > 1 else "an " if vowel else "a "
    of = "of " if unit_of(f.over) or is_ordered(f) else ""
    return f"at {article}{name} {of}{names}"


def places(f: Finding, where: NDArray[np.intp]) -> str:
    """`from 250 ms on`, `up to 100 ms`, `at every delay`, or the levels one by one."""
    if not f.over:
        return f.everywhere
    names = [level_name(f.over, f.levels[int(i)]) for i in where]
    solid = len(where) > 1 and bool((np.diff(where) == 1).all()) and is_ordered(f)
    if len(where) == len(f.levels) > 1:
        if counted := _counted(f, f.levels):
            return f"with every number of {counted} tried"
        return f"at every {factor_name(f.over)} tried"
    if solid and where[-1] == len(f.levels) - 1:
        return f"from {names[0]} on"
    if solid and where[0] == 0:
        return f"up to {names[-1]}"
    return _spoken(f, where) or f"at {listing(names)}"


def _spoken(f: Finding, where: Iterable[int]) -> str:
    """Phrase levels that are not plain numbers: `without delay`, `with 8 robots`."""
    levels = [f.levels[int(i)] for i in where]
    if levels == [0] and (absent := absent_at_zero(f.over)):
        return f"without {absent}"
    names = listing([level_name(f.over, level) for level in levels])
    if counted := _counted(f, levels):
        return f"with {names} {counted}" if names != "0" else f"with no {counted}"
    if all(isinstance(level, int | float) and not isinstance(level, bool) for level in levels):
        return ""
    if f.over == "link":
        return f"on the {names} link{'s' if len(levels) > 1 else ''}"
    if len(levels) == 1:
        return f"with {named(f.over, levels[0])}"
    return f"with {factor_name(f.over)} {names}"


def _counted(f: Finding, levels: Sequence[Level]) -> str:
    """Name of what the levels count, as in `8 robots` or `1 robot`; empty unless they count."""
    # A bare number is a quantity; counts of a treatment are names.
    are_numerals = all(isinstance(level, str) and level.isdigit() for level in levels)
    if not are_numerals and not str(f.over).endswith(".count"):
        return ""
    name = factor_name(str(f.over))
    return re.sub(r"s\b", "", name, count=1) if [str(i) for i in levels] == ["1"] else name


def is_ordered(f: Finding) -> bool:
    """True if the levels are ascending quantities."""
    values = [v for v in f.levels if isinstance(v, int | float)]
    return len(values) == len(f.levels) and values == sorted(values)
