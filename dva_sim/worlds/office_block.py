"""Office blocks of any size from a seed: the same seed and size give the same house to the bit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from dva_sim.config import Config
from dva_sim.streams import Streams
from dva_sim.worlds.drawing import Feature
from dva_sim.worlds.office_plan import Box, Cell, Layout, lay_out, tenths
from dva_sim.worlds.office_rooms import CONTROL, STAIRS, Use, assign, stands

POST_ROOM = 0.5  # of a guard post from the walls [m]
DETECTOR_EVERY = 8.0  # along corridors [m]
CAMERA_RANGE = 20.0  # [m]
MASTS_EVERY = 25.0  # Wi-Fi base stations along corridors [m]
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
    """The features of a house, in metres; its south-western corner is the origin."""
    luck = Streams(block.seed)
    layout = lay_out(block.width_m, block.depth_m, luck.fresh("office-block/layout"))
    rooms = assign(layout, block.robot_bases)
    return (
        *_ways(layout),
        *_exits(layout, rooms),
        *_rooms(rooms, luck.fresh("office-block/doors")),
        *_people_and_robots(block, layout, rooms),
        *_equipment(layout),
    )


def _feature(kind: str, shape: Any, **properties: Any) -> Feature:
    return Feature(kind, shape, properties)


def _line(*points: tuple[float, float]) -> Any:
    from shapely import LineString

    return LineString(points)


def _box(box: Box) -> Any:
    """Corners counter-clockwise from the south-west."""
    from shapely import Polygon

    x1, y1, x2, y2 = box
    return Polygon([(x1, y1), (x2, y1), (x2, y2), (x1, y2)])


def _point(x: float, y: float) -> Any:
    from shapely import Point

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


def _exits(layout: Layout, rooms: Iterable[tuple[Cell, Use, str]]) -> Iterator[Feature]:
    """At both ends of every corridor, in the lobby, and past every flight of stairs."""
    for number, (_, low, width, high) in enumerate(layout.corridors, 1):
        for x, side in ((0.0, "West"), (width, "East")):
            ends = _line((x, tenths(low + 0.4)), (x, tenths(high - 0.4)))
            yield _feature("exit", ends, name=f"{side} exit {number}")
    x1, _, x2, _ = layout.lobby
    middle = tenths((x1 + x2) / 2)
    yield _feature("exit", _line((middle - 1.0, 0.0), (middle + 1.0, 0.0)), name="Main entrance")
    for cell, use, name in rooms:
        if use is STAIRS and cell.facade:
            y = cell.y1 if cell.door_north else cell.y2
            ends = _line((tenths(cell.x2 - 1.3), y), (tenths(cell.x2 - 0.3), y))
            yield _feature("exit", ends, name=f"{name} exit")


# --- rooms -----------------------------------------------------------------------------


def _rooms(rooms: Iterable[tuple[Cell, Use, str]], rng: np.random.Generator) -> Iterator[Feature]:
    for cell, use, name in rooms:
        outline = _box((cell.x1, cell.y1, cell.x2, cell.y2))
        yield _feature("room", outline, name=name)
        yield _feature("wall", outline.exterior)
        yield _door(cell, use, rng)
        for piece in use.furniture(cell):
            yield _feature("wall", _box(piece))
        for number, kind in enumerate(use.detectors):
            x = cell.x1 + cell.width * (number + 1) / (len(use.detectors) + 1)
            yield _feature(f"{kind}_detector", _point(x, _clear_of_the_door(cell)))
        if use.name in RESTRICTED:
            yield _feature("zone", outline, name=name, use="restricted")


def _door(cell: Cell, use: Use, rng: np.random.Generator) -> Feature:
    width = min(use.door, tenths(cell.width - 0.8))
    x = tenths(rng.uniform(cell.x1 + 0.4, cell.x2 - 0.4 - width))
    ends = _line((x, cell.door_y), (tenths(x + width), cell.door_y))
    return _feature("door", ends)


def _clear_of_the_door(cell: Cell) -> float:
    """Where no furniture stands: a metre from the corridor [m]."""
    return cell.y2 - 1.0 if cell.door_north else cell.y1 + 1.0


# --- who and what is in the house ------------------------------------------------------


def _people_and_robots(
    block: OfficeBlock, layout: Layout, rooms: list[tuple[Cell, Use, str]]
) -> Iterator[Feature]:
    bays = [cell for cell, _, name in rooms if name.startswith("Robot bay")]
    spots = [(bay, spot) for bay in bays for spot in stands(bay)]
    for bay, spot in spots[: block.robot_bases]:
        heading = 90.0 if bay.door_north else -90.0
        yield _feature("robot_base", _point(*spot), heading_deg=heading)
    for bay in bays:
        area = _box((bay.x1, bay.y1, bay.x2, bay.y2))
        yield _feature("zone", area, name="Charging", use="charging")
    for x, y, heading in _posts(layout)[: block.guard_posts]:
        yield _feature("guard_post", _point(x, y), heading_deg=heading)
    control = next(cell for cell, use, _ in rooms if use is CONTROL)
    for number in range(block.operator_desks):
        x = control.x1 + control.width * (number + 0.5) / block.operator_desks
        y = (control.y1 + control.y2) / 2
        heading = -90.0 if control.door_north else 90.0
        yield _feature("operator_desk", _point(x, y), heading_deg=heading)


def _posts(layout: Layout) -> list[tuple[float, float, float]]:
    """The lobby first, then the ends of the corridors: x, y [m], heading [deg]."""
    x1, y1, x2, _ = layout.lobby
    posts = [(x1 + POST_ROOM, y1 + 1.5, 0.0), (x2 - POST_ROOM, y1 + 1.5, 180.0)]
    for _, low, width, high in layout.corridors:
        y = (low + high) / 2
        posts += [(width - 2.0, y, 180.0), (2.0, y, 0.0)]
    row = [(x1 + (x2 - x1) * number / 5, y1 + 2.5, -90.0) for number in range(1, 5)]
    return [*posts, *row, *((x, y + 1.0, heading) for x, y, heading in row)]


def _equipment(layout: Layout) -> Iterator[Feature]:
    """Smoke detectors, cameras and base stations along the corridors and in the lobby."""
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
    """Places evenly along a corridor [m]."""
    count = max(1, round(length / every))
    return [length * (number + 0.5) / count for number in range(count)]
