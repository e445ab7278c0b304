"""Office blocks of any size from a seed: the same seed and size give the same house to the bit.

First a rectangle is cut up into corridors, cross corridors, a lobby and cells along them; then the
cells get a use, a name, and what stands in rooms of that use.
"""

from __future__ import annotations

import itertools
import string
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field
from shapely import LineString, Point, Polygon

from dva_sim.kernel.config import Config
from dva_sim.kernel.streams import Streams
from dva_sim.worlds.geojson import Feature

STOREY = 14.5  # wanted depth of a corridor with the rooms on both its sides [m]
CORRIDOR = (2.0, 2.6)  # range of widths of corridors [m]
LOBBY = (6.0, 8.0)  # range of widths of lobbies [m]
CROSSING_EVERY = 40.0  # distance between crossings along the corridors [m]
MIN_CELL = 2.8  # width of the narrowest room [m]
WISHES = ((3.0, 3.9), (4.8, 6.5), (7.0, 9.5))  # ranges of preferred widths of rooms [m]
ODDS = (0.55, 0.30, 0.15)  # probability of each range


class FloorCell(NamedTuple):
    """A rectangle [m] that becomes a room.

    Attributes:
        x1: West [m].
        y1: South [m].
        x2: East [m].
        y2: North [m].
        wing: Number of its corridor, from 0 in the south.
        door_north: The corridor lies north of it, else south.
        facade: The wall opposite to the door is an outer wall.
    """

    x1: float
    y1: float
    x2: float
    y2: float
    wing: int
    door_north: bool
    facade: bool

    @property
    def width(self) -> float:
        """Along the corridor [m]."""
        return self.x2 - self.x1

    @property
    def depth(self) -> float:
        """Away from the corridor [m]."""
        return self.y2 - self.y1

    @property
    def area(self) -> float:
        """Floor area [m^2]."""
        return self.width * self.depth

    @property
    def door_y(self) -> float:
        """Position of the wall at the corridor [m]."""
        return self.y2 if self.door_north else self.y1

    @property
    def back_y(self) -> float:
        """Position of the wall opposite the corridor [m]."""
        return self.y1 if self.door_north else self.y2

    @property
    def outwards(self) -> float:
        """Direction of its door: 1 for north, -1 for south."""
        return 1.0 if self.door_north else -1.0

    def box(self, left: float, right: float, near: float, far: float) -> Box:
        """Return a rectangle in it, by its gaps [m] to the sides, to the corridor and opposite."""
        south, north = (far, near) if self.door_north else (near, far)
        ends = self.x1 + left, self.y1 + south, self.x2 - right, self.y2 - north
        return tenths(ends[0]), tenths(ends[1]), tenths(ends[2]), tenths(ends[3])


Box = tuple[float, float, float, float]  # x1, y1, x2, y2 [m]


@dataclass(frozen=True)
class Layout:
    """An office block before its rooms have names.

    Attributes:
        width: West to east [m].
        depth: South to north [m].
        corridors: From facade to facade, one for each wing.
        crossings: Pieces of cross corridors between two wings, south to north in each.
        lobby: Between the southern facade and the first corridor.
        cells: All other rooms.
    """

    width: float
    depth: float
    corridors: tuple[Box, ...]
    crossings: tuple[tuple[Box, ...], ...]
    lobby: Box
    cells: tuple[FloorCell, ...]


def tenths(value: float) -> float:
    """Return a length rounded to 0.1 m, the lattice on which walls lie."""
    return round(float(value), 1)


def lay_out(width: float, depth: float, rng: np.random.Generator) -> Layout:
    """Cut up a rectangle.

    Args:
        width: West to east [m], at least 24.
        depth: South to north [m], at least 12.
        rng: Random generator.
    """
    width = tenths(width)
    depth = tenths(depth)
    wings = max(1, int(depth / STOREY + 0.65))
    edges = [tenths(depth * wing / wings) for wing in range(wings + 1)]
    corridors = []
    for south, north in itertools.pairwise(edges):
        wide = tenths(rng.uniform(*CORRIDOR))
        low = tenths((south + north - wide) / 2)
        corridors.append((0.0, low, width, tenths(low + wide)))
    crossings = _crossings(corridors, width, rng) if wings > 1 else ()
    lobby = _lobby(corridors[0], width, rng)
    cells = tuple(_cells(edges, corridors, crossings, lobby, rng))
    return Layout(width, depth, tuple(corridors), crossings, lobby, cells)


def _crossings(
    corridors: list[Box], width: float, rng: np.random.Generator
) -> tuple[tuple[Box, ...], ...]:
    """Cross corridors at even distances along the corridors, each moved by a few metres."""
    count = max(1, round(width / CROSSING_EVERY))
    crossings = []
    for number in range(count):
        wide = tenths(rng.uniform(*CORRIDOR))
        middle = width * (number + 0.5) / count + rng.uniform(-0.1, 0.1) * width / count
        x1 = tenths(middle - wide / 2)
        crossings.append(
            tuple(
                (x1, south[3], tenths(x1 + wide), north[1])
                for south, north in itertools.pairwise(corridors)
            )
        )
    return tuple(crossings)


def _lobby(corridor: Box, width: float, rng: np.random.Generator) -> Box:
    wide = tenths(rng.uniform(*LOBBY))
    x1 = tenths(rng.uniform(0.4, 0.6) * width - wide / 2)
    return x1, 0.0, tenths(x1 + wide), corridor[1]


def _cells(
    edges: list[float],
    corridors: list[Box],
    crossings: tuple[tuple[Box, ...], ...],
    lobby: Box,
    rng: np.random.Generator,
) -> Iterator[FloorCell]:
    """Yield rooms south and north of each corridor, from west to east."""
    last = len(corridors) - 1
    across = [(pieces[0][0], pieces[0][2]) for pieces in crossings]
    for wing, (_, low, width, high) in enumerate(corridors):
        for y1, y2, door_north in ((edges[wing], low, True), (high, edges[wing + 1], False)):
            facade = wing == (0 if door_north else last)
            gaps = across if not facade else [(lobby[0], lobby[2])] if door_north else []
            bounds = [0.0, *(x for gap in gaps for x in gap), width]
            for start, end in zip(bounds[::2], bounds[1::2], strict=True):
                cuts = _cuts(start, end, rng)
                for x1, x2 in itertools.pairwise(cuts):
                    yield FloorCell(
                        x1=x1, y1=y1, x2=x2, y2=y2, wing=wing, door_north=door_north, facade=facade
                    )


def _cuts(start: float, end: float, rng: np.random.Generator) -> list[float]:
    """Return where partitions stand: room widths drawn from `WISHES`, scaled to fit."""
    length = end - start
    wishes = list[float]()
    while sum(wishes) < length:
        wishes.append(rng.uniform(*WISHES[rng.choice(len(WISHES), p=ODDS)]))
    if sum(wishes) - length > wishes[-1] / 2 or len(wishes) * (MIN_CELL + 0.1) > length:
        wishes = wishes[:-1] or wishes
    spare = np.array(wishes) - MIN_CELL
    widths = MIN_CELL + 0.1 + (length - (MIN_CELL + 0.1) * len(spare)) * spare / spare.sum()
    return [tenths(start + reach) for reach in (0.0, *np.cumsum(widths))]


STAIRS_EVERY = 40.0  # distance between stairs along a facade [m]
BASE_GAP = 1.2  # distance between robot bases [m]
BASE_WALL = 0.7  # distance of a robot base from the walls [m]
APPROACH = 1.6  # free floor behind the door of a robot bay [m]


class Use(NamedTuple):
    """Use of a room.

    Attributes:
        name: Name for people.
        door: Width of its door [m].
        detectors: Kinds of those in it.
        furniture: Rectangles that stand in a cell.
    """

    name: str
    door: float
    detectors: tuple[str, ...]
    furniture: Callable[[FloorCell], Iterator[Box]]


def _nothing(_: FloorCell) -> Iterator[Box]:
    yield from ()


def _desk(cell: FloorCell) -> Iterator[Box]:
    """Yield one desk or two desks at the window."""
    side = tenths((cell.width - min(cell.width - 1.2, 3.2)) / 2)
    yield cell.box(side, side, cell.depth - 0.8, 0.0)


def _table(cell: FloorCell) -> Iterator[Box]:
    """Yield a large piece of furniture in the middle that people can walk around."""
    if cell.width >= 3.4 and cell.depth >= 3.4:
        yield cell.box(1.2, 1.2, 1.2, 1.2)


def _counter(cell: FloorCell) -> Iterator[Box]:
    yield cell.box(0.0, 0.0, cell.depth - 0.7, 0.0)


def _cubicles(cell: FloorCell) -> Iterator[Box]:
    yield cell.box(0.0, 0.0, cell.depth - 1.5, 0.0)


def _flight(cell: FloorCell) -> Iterator[Box]:
    """Yield a flight of stairs along one side; past it lies the way out."""
    yield cell.box(0.0, cell.width - 1.3, 1.6, 0.9)


def _rows(size: float, aisle: float) -> Callable[[FloorCell], Iterator[Box]]:
    """Return rows away from the door: benches, racks, shelves, islands of desks."""

    def rows(cell: FloorCell) -> Iterator[Box]:
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
MAX_BAYS = 4
MEDIUM_FROM = 20.0  # area from which a room counts as medium [m^2]
LARGE_FROM = 36.0  # area from which a room counts as large [m^2]


def assign(layout: Layout, bases: int) -> list[tuple[FloorCell, Use, str]]:
    """Return a use and a name for every cell, in the order of the cells.

    Stairs stand at the facades, as they lead out; robots get the largest rooms near the
    lobby; one of each of `SINGLE` is spread over the house; all others go by their size.
    """
    left = list(layout.cells)
    uses = dict[FloorCell, tuple[Use, str]]()
    for use, name, wish in _needs(layout):
        bays = [bay for bay in uses if uses[bay][0] is ROBOT_BAY]
        if use is not ROBOT_BAY or sum(len(base_positions(bay)) for bay in bays) < bases:
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


def _needs(layout: Layout) -> Iterator[tuple[Use, str, Callable[[FloorCell], float]]]:
    """Yield the needs of a house: a use, a name, and a measure of how unfit a cell is."""
    for number in range(1, MAX_BAYS + 1):
        name = ROBOT_BAY.name if number == 1 else f"{ROBOT_BAY.name} {number}"
        yield ROBOT_BAY, name, lambda cell: cell.wing - cell.area / 1000
    yield CONTROL, CONTROL.name, lambda cell: cell.wing + abs(cell.area - 30) / 1000
    for letter, stairwell in zip(string.ascii_uppercase, _stairwells(layout), strict=False):
        yield STAIRS, f"{STAIRS.name} {letter}", partial(_unfit_for_stairs, *stairwell)
    for number, use in enumerate(SINGLE):
        x = layout.width * (0.15 + 0.7 * (number * 0.618 % 1))
        yield use, use.name, partial(_unfit_for_one, x)


def _unfit_for_stairs(north: bool, x: float, cell: FloorCell) -> float:
    elsewhere = not cell.facade or cell.door_north == north
    return 1000 * elsewhere + abs((cell.x1 + cell.x2) / 2 - x) + 3 * cell.width


def _unfit_for_one(x: float, cell: FloorCell) -> float:
    return abs((cell.x1 + cell.x2) / 2 - x) + abs(cell.area - 22) / 2


def _stairwells(layout: Layout) -> Iterator[tuple[bool, float]]:
    """Yield facades and places along them [m]; the lobby is the southern one of small houses."""
    count = max(1, round(layout.width / STAIRS_EVERY))
    for number in range(count):
        yield True, layout.width * (number + 0.5) / count
    for number in range(count - 1):
        yield False, layout.width * (number + 1) / count


def _by_size(cell: FloorCell, numbers: Iterator[int]) -> tuple[Use, str]:
    """Return any other room; its number tells the corridor."""
    number = next(numbers)
    if cell.area >= LARGE_FROM:
        use = LARGE[number % len(LARGE)]
    elif cell.area >= MEDIUM_FROM:
        use = MEDIUM[number % len(MEDIUM)]
    else:
        use = SMALL[number % COPY_ROOM_EVERY == 0]
    return use, f"{use.name} {number}"


def base_positions(bay: FloorCell) -> list[tuple[float, float]]:
    """Return the positions of robots in a bay [m]: rows from the wall opposite its door."""
    columns = 1 + int((bay.width - 2 * BASE_WALL) / BASE_GAP + 1e-6)
    rows = 1 + int((bay.depth - BASE_WALL - APPROACH) / BASE_GAP + 1e-6)
    first = (bay.x1 + bay.x2 - (columns - 1) * BASE_GAP) / 2
    ys = [bay.back_y + bay.outwards * (BASE_WALL + row * BASE_GAP) for row in range(rows)]
    xs = [first + column * BASE_GAP for column in range(columns)]
    return [(tenths(x), tenths(y)) for y in ys for x in xs]


POST_ROOM = 0.5  # distance of a guard post from the walls [m]
DETECTOR_EVERY = 8.0  # distance between detectors along corridors [m]
CAMERA_RANGE = 20.0  # range of a camera [m]
MASTS_EVERY = 25.0  # distance between Wi-Fi base stations along corridors [m]
RESTRICTED = ("Server room", "Plant room")


class OfficeBlock(Config):
    """An office block: which one, how large, and for how many.

    Attributes:
        seed: Same seed and size, same house.
        width_m: Outside, west to east.
        depth_m: Outside, south to north.
        robot_bases: In robot bays.
        guard_posts: In the lobby and at the ends of corridors.
        operator_desks: In the control room.
    """

    kind: Literal["office_block"] = "office_block"
    seed: Annotated[int, Field(ge=0)] = 1
    width_m: Annotated[float, Field(ge=24, le=300)] = 60.0
    depth_m: Annotated[float, Field(ge=12, le=200)] = 40.0
    robot_bases: Annotated[int, Field(ge=1, le=12)] = 4
    guard_posts: Annotated[int, Field(ge=1, le=12)] = 3
    operator_desks: Annotated[int, Field(ge=1, le=3)] = 2


def office_block(block: OfficeBlock) -> tuple[Feature, ...]:
    """Return the features of a house, in metres; its south-western corner is the origin."""
    streams = Streams(block.seed)
    layout = lay_out(block.width_m, block.depth_m, streams.fresh("office-block/layout"))
    rooms = assign(layout, block.robot_bases)
    return (
        *_ways(layout),
        *_exits(layout, rooms),
        *_rooms(rooms, streams.fresh("office-block/doors")),
        *_people_and_robots(block, layout, rooms),
        *_equipment(layout),
    )


def _feature(kind: str, shape: Any, **properties: Any) -> Feature:
    return Feature(kind, shape, properties)


def _box(box: Sequence[float]) -> Any:
    """Return corners counter-clockwise from the south-west."""
    x1, y1, x2, y2 = box
    return Polygon([(x1, y1), (x2, y1), (x2, y2), (x1, y2)])


def _point(x: float, y: float) -> Any:
    return Point(tenths(x), tenths(y))


# --- corridors, walls and ways out -----------------------------------------------------
def _ways(layout: Layout) -> Iterator[Feature]:
    """Outer walls, corridors, cross corridors and the lobby; rooms bring their own walls."""
    yield _feature("wall", _box((0.0, 0.0, layout.width, layout.depth)).exterior)
    for number, corridor in enumerate(layout.corridors, 1):
        name = f"Corridor {number}" if len(layout.corridors) > 1 else "Corridor"
        yield _feature("room", _box(corridor), name=name)
    for letter, pieces in zip("ABCDEFGHIJ", layout.crossings, strict=False):
        for number, piece in enumerate(pieces, 1):
            yield _feature("room", _box(piece), name=f"Cross corridor {letter}{number}")
    yield _feature("room", _box(layout.lobby), name="Lobby")


def _exits(layout: Layout, rooms: Iterable[tuple[FloorCell, Use, str]]) -> Iterator[Feature]:
    """Yield exits at both ends of every corridor, in the lobby, and past every flight of stairs."""
    for number, (_, low, width, high) in enumerate(layout.corridors, 1):
        for x, side in ((0.0, "West"), (width, "East")):
            ends = LineString([(x, tenths(low + 0.4)), (x, tenths(high - 0.4))])
            yield _feature("exit", ends, name=f"{side} exit {number}")
    x1, _, x2, _ = layout.lobby
    middle = tenths((x1 + x2) / 2)
    doors = LineString([(middle - 1.0, 0.0), (middle + 1.0, 0.0)])
    yield _feature("exit", doors, name="Main entrance")
    for cell, use, name in rooms:
        if use is STAIRS and cell.facade:
            y = cell.back_y
            ends = LineString([(tenths(cell.x2 - 1.3), y), (tenths(cell.x2 - 0.3), y)])
            yield _feature("exit", ends, name=f"{name} exit")


# --- rooms -----------------------------------------------------------------------------
def _rooms(
    rooms: Iterable[tuple[FloorCell, Use, str]], rng: np.random.Generator
) -> Iterator[Feature]:
    for cell, use, name in rooms:
        outline = _box(cell[:4])
        yield _feature("room", outline, name=name)
        yield _feature("wall", outline.exterior)
        yield _door(cell, use, rng)
        for piece in use.furniture(cell):
            yield _feature("wall", _box(piece))
        for number, kind in enumerate(use.detectors):
            x = cell.x1 + cell.width * (number + 1) / (len(use.detectors) + 1)
            # Where no furniture stands: a metre from the corridor.
            yield _feature(f"{kind}_detector", _point(x, cell.door_y - cell.outwards))
        if use.name in RESTRICTED:
            yield _feature("zone", outline, name=name, use="restricted")


def _door(cell: FloorCell, use: Use, rng: np.random.Generator) -> Feature:
    width = min(use.door, tenths(cell.width - 0.8))
    x = tenths(rng.uniform(cell.x1 + 0.4, cell.x2 - 0.4 - width))
    return _feature("door", LineString([(x, cell.door_y), (tenths(x + width), cell.door_y)]))


# --- who and what is in the house ------------------------------------------------------
def _people_and_robots(
    block: OfficeBlock, layout: Layout, rooms: list[tuple[FloorCell, Use, str]]
) -> Iterator[Feature]:
    bays = [cell for cell, _, name in rooms if name.startswith("Robot bay")]
    spots = [(bay, spot) for bay in bays for spot in base_positions(bay)]
    for bay, spot in spots[: block.robot_bases]:
        yield _feature("robot_base", _point(*spot), heading_deg=90.0 * bay.outwards)
    for bay in bays:
        yield _feature("zone", _box(bay[:4]), name="Charging", use="charging")
    for x, y, heading in _posts(layout)[: block.guard_posts]:
        yield _feature("guard_post", _point(x, y), heading_deg=heading)
    control = next(cell for cell, use, _ in rooms if use is CONTROL)
    for number in range(block.operator_desks):
        x = control.x1 + control.width * (number + 0.5) / block.operator_desks
        y = (control.y1 + control.y2) / 2
        yield _feature("operator_desk", _point(x, y), heading_deg=-90.0 * control.outwards)


def _posts(layout: Layout) -> list[tuple[float, float, float]]:
    """Return the lobby first, then the ends of the corridors: x, y [m], heading [deg]."""
    x1, y1, x2, _ = layout.lobby
    posts = [(x1 + POST_ROOM, y1 + 1.5, 0.0), (x2 - POST_ROOM, y1 + 1.5, 180.0)]
    for _, low, width, high in layout.corridors:
        y = (low + high) / 2
        posts += [(width - 2.0, y, 180.0), (2.0, y, 0.0)]
    row = [(x1 + (x2 - x1) * number / 5, y1 + 2.5, -90.0) for number in range(1, 5)]
    return [*posts, *row, *((x, y + 1.0, heading) for x, y, heading in row)]


def _equipment(layout: Layout) -> Iterator[Feature]:
    """Yield the smoke detectors, cameras and base stations along the corridors and in the lobby."""
    for _, low, width, high in layout.corridors:
        y = (low + high) / 2
        for x in _along(width, DETECTOR_EVERY):
            yield _feature("smoke_detector", _point(x, y))
        for x in _along(width, MASTS_EVERY):
            yield _feature("base_station", _point(x, y), radio="wifi")
        for x, heading in ((0.3, 0.0), (width - 0.3, 180.0)):
            view = {"heading_deg": heading, "field_of_view_deg": 60.0, "range_m": CAMERA_RANGE}
            yield _feature("camera", _point(x, y), **view)
    x1, y1, x2, y2 = layout.lobby
    yield _feature("smoke_detector", _point((x1 + x2) / 2, (y1 + y2) / 2))
    view = {"heading_deg": -90.0, "field_of_view_deg": 100.0, "range_m": 10.0}
    yield _feature("camera", _point((x1 + x2) / 2, y2 - 0.3), name="entrance", **view)


def _along(length: float, every: float) -> list[float]:
    """Return places evenly along a corridor [m]."""
    count = max(1, round(length / every))
    return [length * (number + 0.5) / count for number in range(count)]
