"""What rooms of an office block are for, and what stands in them."""

from __future__ import annotations

import itertools
import string
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

from dva_sim.worlds.office_plan import Box, Cell, Layout, tenths

STAIRS_EVERY = 40.0  # along a facade [m]
BASE_GAP, BASE_WALL = 1.2, 0.7  # between robot bases, and to the walls [m]
APPROACH = 1.6  # free floor behind the door of a robot bay [m]


class Use(NamedTuple):
    """What a room is for.

    Attributes:
        name: As people call it.
        door: Width of its door [m].
        detectors: Kinds of those in it.
        furniture: Rectangles that stand in a cell.
    """

    name: str
    door: float
    detectors: tuple[str, ...]
    furniture: Callable[[Cell], Iterator[Box]]


def _nothing(_: Cell) -> Iterator[Box]:
    yield from ()


def _desk(cell: Cell) -> Iterator[Box]:
    """One desk or two at the window."""
    side = tenths((cell.width - min(cell.width - 1.2, 3.2)) / 2)
    yield cell.box(side, side, cell.depth - 0.8, 0.0)


def _table(cell: Cell) -> Iterator[Box]:
    """Something large in the middle that one can walk around."""
    if cell.width >= 3.4 and cell.depth >= 3.4:
        yield cell.box(1.2, 1.2, 1.2, 1.2)


def _counter(cell: Cell) -> Iterator[Box]:
    yield cell.box(0.0, 0.0, cell.depth - 0.7, 0.0)


def _cubicles(cell: Cell) -> Iterator[Box]:
    yield cell.box(0.0, 0.0, cell.depth - 1.5, 0.0)


def _flight(cell: Cell) -> Iterator[Box]:
    """A flight of stairs along one side; past it lies the way out."""
    yield cell.box(0.0, cell.width - 1.3, 1.6, 0.9)


def _rows(size: float, aisle: float) -> Callable[[Cell], Iterator[Box]]:
    """Rows away from the door: benches, racks, shelves, islands of desks."""

    def rows(cell: Cell) -> Iterator[Box]:
        count = int((cell.width - aisle) / (size + aisle))
        if cell.depth < 3.6 or count < 1:
            yield from _desk(cell)
            return
        gap = (cell.width - count * size) / (count + 1)
        for number in range(count):
            left = tenths(gap + number * (size + gap))
            yield cell.box(left, cell.width - left - size, 1.4, 1.0)

    return rows


ROBOT_BAY = Use("Robot bay", 1.4, ("smoke",), _nothing)
CONTROL = Use("Control room", 1.1, ("smoke",), _nothing)
STAIRS = Use("Stairs", 1.2, ("smoke",), _flight)
SINGLE = (  # one of each in every block, if it has the rooms; the first are the most needed
    Use("Server room", 1.1, ("smoke", "water"), _rows(1.0, 1.2)),
    Use("Toilets", 1.0, ("water",), _cubicles),
    Use("Plant room", 1.4, ("smoke", "gas", "co", "water"), _table),
    Use("Kitchen", 1.1, ("heat", "gas", "water"), _counter),
    Use("Archive", 1.1, ("smoke",), _rows(0.6, 1.1)),
    Use("Workshop", 1.4, ("smoke", "co"), _table),
)
SMALL = (Use("Office", 1.0, ("smoke",), _desk), Use("Copy room", 1.0, ("smoke",), _counter))
MEDIUM = (
    Use("Team office", 1.1, ("smoke",), _rows(1.6, 1.1)),
    Use("Meeting room", 1.1, ("smoke",), _table),
)
LARGE = (
    Use("Laboratory", 1.4, ("smoke", "gas", "water"), _rows(0.9, 1.3)),
    Use("Open office", 1.2, ("smoke",), _rows(1.6, 1.2)),
    Use("Seminar room", 1.2, ("smoke",), _rows(0.6, 1.0)),
)
COPY_ROOM_EVERY = 9
MOST_BAYS = 4
MEDIUM_FROM, LARGE_FROM = 20.0, 36.0  # [m^2]


def assign(layout: Layout, bases: int) -> list[tuple[Cell, Use, str]]:
    """A use and a name for every cell, in the order of the cells.

    Stairs stand at the facades, as they lead out; robots get the largest rooms near the
    lobby; one of each of `SINGLE` is spread over the house; all others go by their size.
    """
    left, uses = list(layout.cells), dict[Cell, tuple[Use, str]]()
    for use, name, wish in _needs(layout):
        if use is not ROBOT_BAY or sum(_capacity(c, *uses[c]) for c in uses) < bases:
            cell = min(left, key=wish, default=None)
            if cell is not None:
                left.remove(cell)
                uses[cell] = use, name
    most = max(Counter(cell.wing for cell in left).values(), default=0)
    hundred = 100 if most < 100 else 1000  # no corridor's numbers run into the next one's
    numbers = [itertools.count(hundred * (wing + 1) + 1) for wing in range(len(layout.corridors))]
    return [
        (cell, *(uses.get(cell) or _by_size(cell, numbers[cell.wing]))) for cell in layout.cells
    ]


def _needs(layout: Layout) -> Iterator[tuple[Use, str, Callable[[Cell], float]]]:
    """What a house needs: a use, a name, and what makes a cell unfit for it."""
    for number in range(1, MOST_BAYS + 1):
        name = ROBOT_BAY.name if number == 1 else f"{ROBOT_BAY.name} {number}"
        yield ROBOT_BAY, name, lambda cell: cell.wing - cell.area / 1000
    yield CONTROL, CONTROL.name, lambda cell: cell.wing + abs(cell.area - 30) / 1000
    for letter, stairwell in zip(string.ascii_uppercase, _stairwells(layout), strict=False):
        yield STAIRS, f"{STAIRS.name} {letter}", partial(_unfit_for_stairs, *stairwell)
    for number, use in enumerate(SINGLE):
        x = layout.width * (0.15 + 0.7 * (number * 0.618 % 1))
        yield use, use.name, partial(_unfit_for_one, x)


def _capacity(cell: Cell, use: Use, _: str) -> int:
    return len(stands(cell)) if use is ROBOT_BAY else 0


def _unfit_for_stairs(north: bool, x: float, cell: Cell) -> float:
    elsewhere = not cell.facade or cell.door_north == north
    return 1000 * elsewhere + abs((cell.x1 + cell.x2) / 2 - x) + 3 * cell.width


def _unfit_for_one(x: float, cell: Cell) -> float:
    return abs((cell.x1 + cell.x2) / 2 - x) + abs(cell.area - 22) / 2


def _stairwells(layout: Layout) -> Iterator[tuple[bool, float]]:
    """At which facade, and where along it [m]; the lobby is the southern one of small houses."""
    count = max(1, round(layout.width / STAIRS_EVERY))
    for number in range(count):
        yield True, layout.width * (number + 0.5) / count
    for number in range(count - 1):
        yield False, layout.width * (number + 1) / count


def _by_size(cell: Cell, numbers: Iterator[int]) -> tuple[Use, str]:
    """Any other room; its number tells the corridor."""
    number = next(numbers)
    if cell.area >= LARGE_FROM:
        use = LARGE[number % len(LARGE)]
    elif cell.area >= MEDIUM_FROM:
        use = MEDIUM[number % len(MEDIUM)]
    else:
        use = SMALL[number % COPY_ROOM_EVERY == 0]
    return use, f"{use.name} {number}"


def stands(bay: Cell) -> list[tuple[float, float]]:
    """Where robots stand in a bay [m]: rows from the wall opposite to its door."""
    columns = 1 + int((bay.width - 2 * BASE_WALL) / BASE_GAP + 1e-6)
    rows = 1 + int((bay.depth - BASE_WALL - APPROACH) / BASE_GAP + 1e-6)
    inwards = 1.0 if bay.door_north else -1.0
    back = bay.y1 if bay.door_north else bay.y2
    first = (bay.x1 + bay.x2 - (columns - 1) * BASE_GAP) / 2
    return [
        (tenths(first + column * BASE_GAP), tenths(back + inwards * (BASE_WALL + row * BASE_GAP)))
        for row in range(rows)
        for column in range(columns)
    ]
