"""Matching cells of two results folders, as far as both vary the same factors."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.addresses import REFERENCE, Address
from dva_sim.experiments.study.parts import REPEATS, Level

Levels = tuple[tuple[str, Level], ...]


_NOT = object()


_Cell = Mapping[str, Any]  # as in the manifest: part, cell, config, levels


@dataclass(frozen=True)
class Pair:
    """A cell of each folder that are compared with each other.

    Attributes:
        part: Name of the part.
        levels: Levels that both cells have in common.
        first: Number of the cell in the first folder.
        second: Number of the cell in the second.
        is_same: True if both ran exactly the same configuration.
    """

    part: str
    levels: Levels
    first: int
    second: int
    is_same: bool


@dataclass(frozen=True)
class Matched:
    """Correspondence between the cells of two folders.

    Attributes:
        pairs: Cells that were found in both.
        only_first: Cells of the first folder without a counterpart, as part and levels.
        only_second: Cells of the second without one.
        differing: Factors whose levels have nothing in common, or that one folder alone has,
            with the levels of each; they tell no cells apart.
    """

    pairs: tuple[Pair, ...]
    only_first: tuple[tuple[str, Levels], ...]
    only_second: tuple[tuple[str, Levels], ...]
    differing: dict[str, tuple[tuple[Level, ...], tuple[Level, ...]]]


def match(first: Results, second: Results) -> Matched:
    """Match cells by the levels of the factors that both folders vary.

    The rest is matched by configuration, so that a folder of one cell finds its like in
    a grid. Reference runs and repeats take no part.
    """
    a = _cells(first)
    b = _cells(second)
    differing = _differing(a, b)
    by_levels = _matched(a, b, lambda cell: (cell["part"], _key(cell, differing)))
    rest_a = _without(a, (x for x, _ in by_levels))
    rest_b = _without(b, (y for _, y in by_levels))
    by_config = _matched(rest_a, rest_b, lambda cell: (cell["part"], cell["config"]))
    pairs = sorted((*by_levels, *by_config), key=lambda pair: a.index(pair[0]))
    return Matched(
        tuple(_pair(x, y) for x, y in pairs),
        tuple(_name(cell) for cell in _without(rest_a, (x for x, _ in by_config))),
        tuple(_name(cell) for cell in _without(rest_b, (y for _, y in by_config))),
        differing,
    )


def _cells(results: Results) -> list[_Cell]:
    cells = results.manifest.get("cells", [])
    return [c for c in cells if c["part"] != REPEATS and c["cell"] != REFERENCE]


def _differing(
    a: Sequence[_Cell], b: Sequence[_Cell]
) -> dict[str, tuple[tuple[Level, ...], tuple[Level, ...]]]:
    """Factors that cannot tell cells apart in both, with their levels here and there."""
    found = {}
    for factor in dict.fromkeys(name for cell in (*a, *b) for name in cell["levels"]):
        here = _levels(a, factor)
        there = _levels(b, factor)
        if not set(here) & set(there):
            found[factor] = here, there
    return found


def _levels(cells: Iterable[_Cell], factor: str) -> tuple[Level, ...]:
    return tuple(dict.fromkeys(c["levels"][factor] for c in cells if factor in c["levels"]))


def _matched(
    a: Iterable[_Cell], b: Iterable[_Cell], key: Callable[[_Cell], Hashable]
) -> list[tuple[_Cell, _Cell]]:
    """Pairs of cells whose key is the same, and nobody else's."""
    once_a = _once(a, key)
    once_b = _once(b, key)
    return [(cell, once_b[name]) for name, cell in once_a.items() if name in once_b]


def _once(cells: Iterable[_Cell], key: Callable[[_Cell], Hashable]) -> dict[Hashable, _Cell]:
    cells = list(cells)
    counts = Counter(map(key, cells))
    return {key(cell): cell for cell in cells if counts[key(cell)] == 1}


def _without(cells: Iterable[_Cell], taken: Iterable[_Cell]) -> list[_Cell]:
    addresses = set(map(Address.of, taken))
    return [cell for cell in cells if Address.of(cell) not in addresses]


def _key(cell: _Cell, but: Iterable[str]) -> Levels:
    return tuple(sorted((k, v) for k, v in cell["levels"].items() if k not in set(but)))


def _name(cell: _Cell) -> tuple[str, Levels]:
    return cell["part"], tuple(cell["levels"].items())


def _pair(a: _Cell, b: _Cell) -> Pair:
    """The levels are those that both have, in the order of the first."""
    common = tuple((k, v) for k, v in a["levels"].items() if b["levels"].get(k, _NOT) == v)
    return Pair(a["part"], common, a["cell"], b["cell"], a["config"] == b["config"])
