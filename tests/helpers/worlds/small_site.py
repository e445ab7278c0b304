"""A tiny drawn site, written into a folder feature by feature."""

import json

from dva_sim.worlds.geo import GeoFrame

FRAME = GeoFrame(38.6612, -9.2058)


def feature(kind, shape, points, **properties):
    """A GeoJSON feature from points in metres."""
    coordinates = [list(reversed(FRAME.to_latlon(x, y))) for x, y in points]
    nested = {"Point": coordinates[0], "LineString": coordinates, "Polygon": [coordinates]}
    geometry = {"type": shape, "coordinates": nested[shape]}
    return {"type": "Feature", "properties": {"kind": kind, **properties}, "geometry": geometry}


def square(x, y, size):
    return [(x, y), (x + size, y), (x + size, y + size), (x, y + size), (x, y)]


TWO_ROOMS = [
    feature("room", "Polygon", square(0, 0, 4), name="west"),
    feature("room", "Polygon", square(4, 0, 4), name="east"),
    feature("wall", "LineString", square(0, 0, 4)),
    feature("wall", "LineString", square(4, 0, 4)),
    feature("door", "LineString", [(4, 1.5), (4, 2.5)]),
]


def write_site(folder, features, **changes):
    keys = {
        "name": "tiny",
        "origin": "{latitude: 38.6612, longitude: -9.2058}",
        "plan": "tiny.geojson",
        **changes,
    }
    (folder / "tiny.yaml").write_text("".join(f"{k}: {v}\n" for k, v in keys.items()))
    plan = {"type": "FeatureCollection", "features": features}
    (folder / "tiny.geojson").write_text(json.dumps(plan, indent=1))
    return folder / "tiny.yaml"
