"""Draws campus.geojson: five houses around a promenade, with lawns, gates and Wi-Fi.

Run it here after a change: `python draw_campus.py`. All lengths in metres; x east, y north.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from shapely import LineString, Point, Polygon, box, difference, get_parts, union_all

from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.geojson import Feature, write_features

HERE = Path(__file__).parent
WIDTH, DEPTH = 120.0, 90.0

# Paths: x1, y1, x2, y2.
PATHS = {
    "Promenade": (0, 41, 120, 47),
    "South avenue": (56, 0, 62, 41),
    "North avenue": (56, 47, 62, 90),
    "Engineering path": (35, 47, 39, 54),
    "Library path": (84, 47, 88, 54),
    "Workshop path": (25, 32, 29, 41),
    "Security path": (81, 40, 86, 41),
    "Engineering east path": (50, 64.7, 56, 67.7),
    "Engineering west path": (4.5, 47, 6.5, 67.7),
    "Engineering west door": (6.5, 64.7, 8, 67.7),
    "Library west path": (62, 64.7, 70, 67.7),
    "Energy path": (101, 47, 104, 67.7),
    "Library east door": (100, 64.7, 101, 67.7),
    "Workshop east path": (44, 18.8, 56, 21.8),
    "Workshop west path": (4.5, 18.8, 6.5, 41),
    "Workshop west door": (6.5, 18.8, 8, 21.8),
    "Security west path": (62, 30.8, 72, 33.8),
    "Security east path": (96, 30.8, 105, 33.8),
    "Canteen path": (105, 24, 108, 41),
}

# Houses along a corridor: south-western corner, depths of the south side, the corridor and the
# north side, its name; rooms with their widths from west to east.
HOUSES = (
    (
        (8, 54, 11, 2.4, 12.6, "Engineering corridor"),
        (
            ("Robotics lab", 14),
            ("Electronics lab", 12),
            ("Engineering hall", 6),
            ("Office A1", 5),
            ("Office A2", 5),
        ),
        (
            ("Lecture hall", 16),
            ("Seminar room", 8),
            ("Toilets A", 4),
            ("Print room", 4),
            ("Office A3", 5),
            ("Office A4", 5),
        ),
    ),
    (
        (70, 54, 11, 2.4, 12.6, "Library corridor"),
        (("Reading room", 13), ("Library hall", 6), ("Group room 1", 5.5), ("Group room 2", 5.5)),
        (("Stacks", 18), ("Archive", 7), ("Toilets B", 5)),
    ),
    (
        (8, 10, 9, 2.6, 10.4, "Workshop corridor"),
        (("Welding shop", 12), ("Chemistry lab", 12), ("Solvent store", 5), ("Toilets C", 7)),
        (("Machine hall", 16), ("Workshop hall", 6), ("Tool store", 7), ("Office C1", 7)),
    ),
    (
        (72, 24, 7.2, 2.2, 6.6, "Security corridor"),
        (("Robot bay", 14), ("Server room", 6), ("Meeting room", 4)),
        (("Control room", 9), ("Security hall", 5), ("Guard room", 10)),
    ),
)
FREE_ROOMS = {  # of houses without a corridor
    "Dining hall": (100, 12, 116, 24),
    "Kitchen": (100, 6, 110, 12),
    "Cold store": (110, 6, 116, 12),
    "Plant room": (104, 60, 114, 70),
    "Transformer": (104, 55, 114, 60),
}
HIGH = {"Machine hall": 6.0, "Lecture hall": 4.5, "Dining hall": 4.0, "Plant room": 4.5}
DOORS = (  # between rooms of houses without a corridor: x1, y1, x2, y2
    (103, 12, 104.4, 12),
    (110, 8, 110, 9.2),
    (108, 60, 109.4, 60),
)
EXITS = {
    "Engineering entrance": (36, 54, 38, 54),
    "Library entrance": (85, 54, 87, 54),
    "Workshop entrance": (26, 32, 28, 32),
    "Security entrance": (82.5, 40, 84.5, 40),
    "Engineering east exit": (50, 65.5, 50, 66.9),
    "Engineering west exit": (8, 65.5, 8, 66.9),
    "Library west exit": (70, 65.5, 70, 66.9),
    "Library east exit": (100, 65.5, 100, 66.9),
    "Workshop east exit": (44, 19.6, 44, 21),
    "Workshop west exit": (8, 19.6, 8, 21),
    "Security west exit": (72, 31.6, 72, 33),
    "Security east exit": (96, 31.6, 96, 33),
    "Canteen entrance": (105.5, 24, 107.5, 24),
    "Energy exit": (104, 65.3, 104, 66.7),
    "West gate": (0, 42, 0, 46),
    "East gate": (120, 42, 120, 46),
    "North gate": (57, 90, 61, 90),
    "South gate": (57, 0, 61, 0),
}
SOLIDS = (  # benches, shelves, tables, machines, trees
    *((x, 57, x + 1.2, 61) for x in (10.5, 14.5, 18.5)),
    *((x, 57, x + 0.9, 61) for x in (24, 27, 30)),
    *((x, 71, x + 0.5, 77) for x in (12, 14.5, 17, 19.5)),
    *((x, 57, x + 1.6, 60) for x in (72.5, 76.5, 80)),
    *((x, 70, x + 0.6, 77.5) for x in (72, 74.2, 76.4, 78.6, 80.8, 83, 85.2)),
    *((x, 70, x + 0.6, 76) for x in (90, 92.2)),
    (26, 71, 30, 73),
    (11, 24, 13, 28),
    (16, 24.5, 18.5, 27.5),
    (11, 12.5, 13, 15.5),
    (16, 12, 17.5, 14),
    (22, 12.5, 29, 13.7),
    (33.5, 10, 36.5, 11),
    (32, 27, 36, 28),
    (87.8, 26, 88.8, 29),
    (90, 26, 91, 29),
    (89, 36.5, 92, 38),
    *((x, 14.5, x + 1.2, 20) for x in (102, 105.5, 109, 112.5)),
    (101.5, 6, 108, 6.8),
    (107, 63.5, 111.5, 67),
    (107, 56.5, 111, 58.5),
    *((x, y, x + 0.8, y + 0.8) for x in (54, 63.2) for y in (6, 14, 36, 52, 60, 72, 82)),
    *((x, 49, x + 0.8, 49.8) for x in (12, 20, 28, 68, 76, 94, 110)),
)
BASES = (  # x, y, heading
    *((x, 25.0, 90) for x in (74, 76, 78, 80)),
    (20.5, 63.5, -90),
    (21.5, 30.5, -90),
)
POSTS = (
    (83.5, 37.5, 90),
    (88, 35, 180),
    (37, 57, -90),
    (86, 57, -90),
    (27, 29, 90),
    (106, 22.5, 90),
    (59, 44, 180),
    (4, 44, 0),
)
DESKS = ((74, 36.5, 90), (76.5, 36.5, 90), (79, 36.5, 90))
CAMERAS = {  # x, y, heading, field of view, range
    "Promenade west": (0.6, 46.4, -8, 70, 45),
    "Promenade east": (119.4, 41.6, 172, 70, 45),
    "North avenue": (56.6, 89.4, -82, 60, 40),
    "South avenue": (61.4, 0.6, 98, 60, 40),
    "Security hall": (81.3, 33.7, 50, 100, 8),
    "Engineering corridor": (8.4, 66.2, 0, 60, 25),
    "Library corridor": (70.4, 66.2, 0, 60, 25),
    "Workshop corridor": (43.6, 20.3, 180, 60, 25),
    "Server room": (91.6, 24.4, 120, 100, 8),
}
STATIONS = {
    "Engineering": (29, 66.2, "wifi"),
    "Library": (85, 66.2, "wifi"),
    "Workshop": (26, 20.3, "wifi"),
    "Security": (84, 32.3, "wifi"),
    "Promenade": (59, 48, "wifi"),
    "Mast": (116, 86, "lte"),
}
WIFI = (  # the later over the earlier
    ("Outdoors", "fair", (0, 0, 120, 90)),
    ("Engineering", "good", (8, 54, 50, 80)),
    ("Library", "good", (70, 54, 100, 80)),
    ("Workshop", "good", (8, 10, 44, 32)),
    ("Security", "good", (72, 24, 96, 40)),
    ("Promenade", "good", (42, 40, 78, 50)),
    ("South avenue", "poor", (46, 4, 70, 28)),
    ("Canteen", "poor", (98, 4, 118, 26)),
    ("North-west lawn", "poor", (0, 68, 8, 90)),
    ("Behind the library", "poor", (62, 80, 120, 90)),
    ("Stacks", "poor", (72, 69, 88, 80)),
    ("Energy centre", "none", (104, 55, 114, 70)),
)
ZONES = (
    ("Server room", "restricted", (86, 24, 92, 31.2)),
    ("Solvent store", "restricted", (32, 10, 37, 19)),
    ("Energy centre", "restricted", (104, 55, 114, 70)),
    ("Robot bay", "charging", (72.5, 24.3, 81.5, 26)),
    ("Assembly north", "assembly", (40, 83, 52, 89)),
    ("Assembly south", "assembly", (66, 6, 78, 14)),
)
SENSORS = {  # besides smoke in every room
    "gas": ("Chemistry lab", "Welding shop", "Solvent store", "Kitchen", "Plant room"),
    "co": ("Machine hall", "Welding shop", "Plant room", "Kitchen"),
    "heat": ("Kitchen", "Welding shop", "Transformer"),
    "water": (
        "Toilets A",
        "Toilets B",
        "Toilets C",
        "Server room",
        "Kitchen",
        "Plant room",
        "Archive",
    ),
}
HALLS = ("Engineering hall", "Library hall", "Workshop hall", "Security hall")  # open to corridors
DOOR = {"Machine hall": 2.0, "Robot bay": 1.6, "Welding shop": 1.6, "Lecture hall": 1.6}


def area(bounds: tuple[float, ...]) -> Any:
    """A rectangle from x1, y1, x2, y2."""
    x1, y1, x2, y2 = bounds
    return Polygon([(x1, y1), (x2, y1), (x2, y2), (x1, y2)])


def line(ends: tuple[float, ...]) -> Any:
    """A line from x1, y1 to x2, y2."""
    return LineString([ends[:2], ends[2:]])


def house(corner: tuple[Any, ...], south: Any, north: Any) -> Iterator[Feature]:
    """A corridor with rooms on both sides, each with a door to it; halls are open."""
    x, y, below, wide, above, name = corner
    low, high = y + below, y + below + wide
    yield from room(name, (x, low, x + sum(width for _, width in south), high), False)
    for rooms, y1, y2, at in ((south, y, low, low), (north, high, high + above, high)):
        x1 = x
        for called, width in rooms:
            yield from room(called, (x1, y1, x1 + width, y2), False)
            yield Feature("wall", LineString([(x1, y1), (x1, y2)]))
            yield Feature("wall", LineString([(x1 + width, y1), (x1 + width, y2)]))
            outer = y1 if at == y2 else y2
            yield Feature("wall", LineString([(x1, outer), (x1 + width, outer)]))
            if called not in HALLS:
                yield Feature("wall", LineString([(x1, at), (x1 + width, at)]))
                gap = DOOR.get(called, 1.1)
                start = x1 + round(0.35 * (width - gap), 1)
                yield Feature("door", line((start, at, start + gap, at)))
            x1 += width
    for end in (x, x1):
        yield Feature("wall", LineString([(end, low), (end, high)]))


def room(name: str, bounds: tuple[float, ...], walled: bool = True) -> Iterator[Feature]:
    """A room with smoke detectors no more than 10 m apart, and what else it needs."""
    x1, y1, x2, y2 = bounds
    height = {"ceiling_m": HIGH[name]} if name in HIGH else {}
    yield Feature("room", area(bounds), {"name": name, **height})
    if walled:
        yield Feature("wall", area(bounds).exterior)
    across, up = (max(1, round((b - a) / 10)) for a, b in ((x1, x2), (y1, y2)))
    for column in range(across):
        for row in range(up):
            x, y = x1 + (x2 - x1) * (column + 0.5) / across, y1 + (y2 - y1) * (row + 0.5) / up
            yield Feature("smoke_detector", Point(round(x, 2), round(y, 2)))
    for number, kind in enumerate(SENSORS, 1):
        if name in SENSORS[kind]:
            yield Feature(f"{kind}_detector", Point(x1 + number * (x2 - x1) / 5, y1 + 0.5))


def grounds(houses: Any) -> Iterator[Feature]:
    """Paths, and lawns on all that is left."""
    paths = {name: area(bounds) for name, bounds in PATHS.items()}
    for name, shape in paths.items():
        yield Feature("path", shape, {"name": name})
    left = difference(box(0, 0, WIDTH, DEPTH), union_all([*paths.values(), houses]))
    lawns = sorted(get_parts(left), key=lambda lawn: (lawn.centroid.y, lawn.centroid.x))
    for number, lawn in enumerate(lawns, 1):
        yield Feature("yard", Polygon(lawn.exterior), {"name": f"Lawn {number}"})


def campus() -> Iterator[Feature]:
    """Everything."""
    inside = [feature for plan in HOUSES for feature in house(*plan)]
    for name, bounds in FREE_ROOMS.items():
        inside += room(name, bounds)
    yield from inside
    yield from grounds(union_all([f.shape for f in inside if f.kind == "room"]))
    yield Feature("wall", area((0, 0, WIDTH, DEPTH)).exterior)
    yield from (Feature("wall", area(bounds)) for bounds in SOLIDS)
    yield from (Feature("door", line(ends)) for ends in DOORS)
    yield from (Feature("exit", line(ends), {"name": name}) for name, ends in EXITS.items())
    places = (("robot_base", BASES), ("guard_post", POSTS), ("operator_desk", DESKS))
    for kind, poses in places:
        yield from (Feature(kind, Point(x, y), {"heading_deg": turn}) for x, y, turn in poses)
    for name, (x, y, turn, view, reach) in CAMERAS.items():
        look = {"heading_deg": turn, "field_of_view_deg": view, "range_m": reach}
        yield Feature("camera", Point(x, y), {"name": name, **look})
    for name, (x, y, radio) in STATIONS.items():
        yield Feature("base_station", Point(x, y), {"name": name, "radio": radio})
    for name, quality, bounds in WIFI:
        yield Feature("wifi", area(bounds), {"name": name, "quality": quality})
    for name, use, bounds in ZONES:
        yield Feature("zone", area(bounds), {"name": name, "use": use})


if __name__ == "__main__":
    origin = load_yaml(HERE / "campus.yaml").data["origin"]
    frame = GeoFrame(origin["latitude"], origin["longitude"])
    write_features(HERE / "campus.geojson", campus(), frame)
