"""Mistakes in sites, plans, maps, hazards and drives, and places where no body fits."""

import math
from pathlib import Path

import numpy as np
from helpers.mistakes import check_mistake, each_mistake, mistakes, of_file
from helpers.paths import TESTS
from helpers.worlds.small_map import write_map
from helpers.worlds.small_site import TWO_ROOMS, feature, square, write_site

from dva_sim.cli import site
from dva_sim.worlds.compartments import of_floor
from dva_sim.worlds.drives import DriveSpec, load_drive
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.hazards import make_hazard
from dva_sim.worlds.maps import FREE, OCCUPIED, OccupancyGrid, load_ros_map
from dva_sim.worlds.physics import World, hall
from dva_sim.worlds.site import load_site, map_site
from dva_sim.worlds.site_export import write_site as export

HALL = str(TESTS / "data/hall.yaml")
KNOT = [(0, 0), (2, 2), (2, 0), (0, 2), (0, 0)]
ROOM = feature("room", "Polygon", square(0, 0, 4), name="hall")
STOREYS = [
    feature("room", "Polygon", square(0, 0, 4), name="ground", level="0"),
    feature("room", "Polygon", square(0, 0, 4), name="first", level=1),
]
NO_STOREYS = [feature("yard", "Polygon", square(8, 0, 4), name="yard")]


def hazard(kind, settings):
    make_hazard(kind, (0.0, 0.0), 0.0, **settings)


def plan(features, changes):
    load_site(write_site(Path(), features, **changes))


def feature_6(wrong):
    plan([*TWO_ROOMS, wrong], {})


def room_6(member, value):
    feature_6(ROOM | {member: value})


def two_rooms(changes):
    plan(TWO_ROOMS, changes)


def plan_text(text):
    path = write_site(Path(), TWO_ROOMS)
    Path("tiny.geojson").write_text(text)
    load_site(path)


def ros_map(changes):
    load_ros_map(write_map(Path(), [[254]], **changes))


def large_map(rows, columns):
    load_ros_map(write_map(Path(), np.full((rows, columns), 254, np.uint8), resolution=3))


def speckled(side):
    """A floor on which no two cells touch."""
    cells = np.indices((side, side)).sum(axis=0) % 2 * OCCUPIED
    of_floor(OccupancyGrid(1.0, Pose(0, 0, 0), cells), cells == FREE)


def map_of(path):
    map_site(path, 1, 1, 1)


def narrow_map(pixels):
    map_of(write_map(Path(), pixels, resolution=0.1))


def drive(name, options):
    load_drive(name, options)(DriveSpec())


def bodies(*added):
    """Bodies in the corridor: robots and people by name, each at its x and y."""
    world = World(load_site("caparica"), 0.04)
    for name, x, y in added:
        pose = Pose(x, y, 0.0)
        if name.startswith("robot"):
            world.add_robot(name, DriveSpec(), pose)
        else:
            world.add_person(name, pose)


def walk(speed):
    World(hall(9, 9), 0.04).add_person("guard-1", Pose(4, 4, 0)).walk(speed, 0.0)


def fast_robot(speed):
    World(hall(9, 9), 0.04).add_robot("robot-1", DriveSpec(max_speed=speed), Pose(4, 4, 0))


def shown(name, out, options):
    site.show(name, out, options, coverage=False, width=400)


def exported(name):
    export(load_site("caparica"), Path(name))


def clearance(radius):
    load_site("caparica").sample_free(np.random.default_rng(2), radius)


SITES = [
    *mistakes(
        feature_6,
        (feature("robot_base", "Point", [(0.1, 1)]), "tiny.geojson: feature 6 robot_base 0.3 m"),
        (feature("window", "LineString", [(0, 0), (1, 1)]), "feature 6 kind 'window' wall room"),
        (feature("room", "Polygon", square(0, 4, 2), name="west"), "feature 6 room name 'west'"),
        (feature("wall", "Point", [(1, 1)]), "feature 6 wall LineString MultiLineString Polygon"),
        (feature("room", "Polygon", KNOT, name="knot"), "feature 6 room self-intersection"),
        ({"type": "Feature"}, "feature 6 'kind'"),
        (feature("zone", "Polygon", square(1, 1, 1), use="secret"), "use: restricted charging"),
        (feature("wifi", "Polygon", square(1, 1, 1)), "quality good fair poor none numbers"),
        (feature("wifi", "Polygon", square(1, 1, 1), loss=3), "feature 6 loss: 1"),
        (feature("room", "Polygon", square(0, 4, 2), name="a", ceiling_m=0.4), "ceiling_m: 1.5"),
        (
            feature("camera", "Point", [(1, 1)], field_of_view_deg=400),
            "feature 6 field_of_view_deg: 360",
        ),
        (feature("exit", "LineString", [(8, 1), (8, 1.2)]), "feature 6 exit 0.5 m wide"),
        (feature("path", "Polygon", square(8, 0, 2), name="west"), "feature 6 path name 'west'"),
    ),
    *mistakes(
        room_6,
        ("properties", None, "feature 6 'kind' room wall"),
        ("properties", {"name": "helper"}, "feature 6 'kind'"),
        ("properties", {"kind": None}, "feature 6 'kind'"),
        ("properties", 3, "feature 6 'properties'"),
        ("geometry", None, "feature 6 room geometry"),
        ("geometry", {"type": "Polygon"}, "feature 6 Polygon"),
        ("geometry", {"type": "Polygon", "coordinates": [[["a", 1], [2, 3]]]}, "6 Polygon"),
        ("geometry", {"type": "Polygon", "coordinates": []}, "feature 6 coordinates"),
        ("geometry", {"type": "GeometryCollection", "geometries": []}, "6 GeometryCollection"),
    ),
    *mistakes(
        two_rooms,
        ({"plan": "gone.geojson"}, "tiny.yaml:3:1: plan 'gone.geojson'"),
        ({"plam": "x"}, "'plam'; 'plan'?"),
        ({"origin": "{latitude: 138, longitude: 0}"}, "tiny.yaml:2:10: origin.latitude"),
        ({"generate": "{kind: office_block}"}, "plan generate"),
        ({"plan": "null"}, "plan generate"),
    ),
    *mistakes(
        plan,
        (STOREYS, {}, "tiny.geojson 2 storeys 0, 1 'level: 0'"),
        (STOREYS, {"level": 2}, "tiny.geojson storey 2 0, 1"),
        (NO_STOREYS, {"level": 0}, "tiny.geojson storey 0 'level'"),
        ([feature("room", "Polygon", square(0, 0, 6000), name="x")], {}, "6,000 0.05 tiny.yaml"),
    ),
    *mistakes(
        plan_text,
        ('{"type": "FeatureCollection",\n "features": [}', "tiny.geojson:2:15:"),
    ),
    *mistakes(
        load_site,
        ("caparica", {"seed": 1}, "'caparica' no options"),
        ("atlantis", "'atlantis' caparica"),
        ("office-block", {"wdith_m": 80}, "'wdith_m'; 'width_m'?"),
        ("office-block", {"width_m": 9}, "'office-block': width_m: least 24"),
        ("office-block", {"seed": "x"}, "'office-block': seed: whole 'x'"),
    ),
    *mistakes(load_site("caparica").room, ("Archives", "'Archives' 'Archive'")),
    *mistakes(clearance, (9.0, "9 m radius")),
    *mistakes(shown, (HALL, None, ["seed=1"], "no options")),
    *mistakes(shown, ("caparica", Path("a.hologram"), [], "a.hologram cannot written")),
    *mistakes(of_file(exported, "file"), ("", "file cannot written")),
    *mistakes(
        ros_map,
        ({"resolution": None}, "missing 'resolution'"),
        ({"resolution": -1}, "map.yaml:2:1: resolution"),
        ({"resolution": 1e19}, "map.yaml:2:1: resolution: 5"),
        ({"origin": "[1.0e308, 0, 0]"}, "map.yaml:3:10: origin.0:"),
        ({"image": "gone.pgm"}, "map.yaml:1:1: 'gone.pgm'"),
        ({"image": "map.yaml"}, "image 'map.yaml'"),
        ({"free_thresh": 0.9}, "free_thresh 0.9 occupied_thresh 0.65"),
    ),
    *mistakes(
        large_map,
        (1, 2000, "map.yaml:2:1: 6,000 5,000"),
        (6500, 6500, "map.yaml:1:1: 'map.pgm' 6500 40 million"),
    ),
    *mistakes(speckled, (90, "floor 4,000 pieces")),
    *mistakes(narrow_map, ([[0, 254, 0]], "floor robot")),
    *mistakes(map_of, ("nowhere/gone.yaml", "nowhere/gone.yaml not found")),
]

BODIES = [
    *mistakes(
        drive,
        ("four_way", {}, "drive 'four_way' differential, three_way"),
        ("mine.py", {}, "drive 'mine.py' class mine.py:Mine"),
        ("mine.py:Mine", {}, "drive 'mine.py:Mine': 'mine.py' not found"),
        ("tracked.py:Yours", {}, "drive 'tracked.py:Yours': class 'Yours'"),
        ("tracked.py:DriveSpec", {}, "drive; class dva_sim.worlds"),
        ("three_way", {"scrub": 1}, "'scrub'; wheelbase_m, steering_deg, servo_s"),
        ("three_way", {"wheelbase_m": 0}, "'wheelbase_m' 0"),
        ("three_way", {"steering_deg": 90}, "'steering_deg' 90"),
        ("three_way", {"servo_s": -1}, "'servo_s' -1"),
        ("differential", {"gain": 1}, "drive 'differential' 'gain'"),
    ),
    *mistakes(
        bodies,
        (("robot-1", 4, 12), ("guard-1", 4.4, 12), "'guard-1' robot"),
        (("guard-1", 6, 12), ("guard-2", 6.1, 12), "'guard-2' another person"),
        (("guard-1", 6, 12), ("robot-2", 6.4, 12), "'robot-2' person"),
        (("robot-1", 4, 12), ("robot-2", 4.3, 12), "'robot-2' another robot"),
        (("robot-3", 8.1, 5), "'robot-3' wall"),
    ),
    *mistakes(walk, (math.nan, "guard-1 nan"), (math.inf, "guard-1 inf"), error=ValueError),
    *mistakes(fast_robot, (3.8, "'robot-1' 3.75")),
    *mistakes(
        hazard,
        ("quake", {}, "hazard 'quake' fire, flood, gas_leak;"),
        ("fire", {"rate": 1.0}, "hazard 'fire' 'rate' growth, peak"),
        ("fire", {"growth": "quick"}, "growth: slow, medium, fast ultrafast"),
        ("gas_leak", {"gas": "helium"}, "gas: methane, propane carbon_monoxide"),
        ("flood", {"inflow": -1.0}, "hazard 'flood': inflow: above 0, -1.0"),
        ("flood", {"inflow": 10.1}, "inflow: most 10, 10.1"),
        ("fire", {"peak": 100_001.0}, "peak: most 100000, 100001"),
        ("fire", {"peak": math.inf}, "peak: finite inf"),
        ("gas_leak", {"rate": 1e9}, "rate: most 10, 1000000000"),
        ("gas_leak", {"wind": 51.0}, "wind: most 50, 51"),
    ),
]


@each_mistake([*SITES, *BODIES])
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
