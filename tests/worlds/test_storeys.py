"""Storeys of plans, and properties of other programs that mean geometry."""

import json

import pytest
from helpers.wording import unnamed
from helpers.worlds.small_site import feature, square, write_site

from dva_sim.testing.files import check_file
from dva_sim.worlds.site import load_site
from dva_sim.worlds.storeys import label_of, parse_storeys


@pytest.mark.parametrize(
    ("properties", "storeys"),
    [
        ({"level": 0}, {"0"}),
        ({"level": 1.0}, {"1"}),
        ({"level": "0;1"}, {"0", "1"}),
        ({"level": "-1-1"}, {"-1", "0", "1"}),
        ({"level": "0.5"}, {"0.5"}),
        ({"level": "EG"}, {"EG"}),
        ({"level": 0, "repeat_on": "2-3"}, {"0", "2", "3"}),
        ({"level": None}, set()),
        ({}, set()),
    ],
)
def test_a_level_names_one_storey_or_several(properties, storeys):
    assert parse_storeys(properties) == storeys
    assert label_of(0.0) == label_of("0") == "0"


HOUSE = [
    feature("room", "Polygon", square(0, 0, 4), name="ground", level="0"),
    feature("room", "Polygon", square(4, 0, 4), name="stairs", level="0;1"),
    feature("room", "Polygon", square(0, 0, 4), name="first", level=1),
    feature("yard", "Polygon", square(8, 0, 4), name="yard"),
]


@pytest.mark.parametrize(
    ("level", "rooms"),
    [("0", ["ground", "stairs", "yard"]), ('"1"', ["stairs", "first", "yard"])],
)
def test_a_site_reads_one_storey_of_its_plan(tmp_path, level, rooms):
    path = write_site(tmp_path, HOUSE, level=level)
    assert sorted(room.name for room in load_site(path).rooms) == sorted(rooms)
    assert check_file(path).problems == check_file(tmp_path / "tiny.geojson").problems == []


def test_features_that_share_a_storey_need_no_choice(tmp_path):
    assert len(load_site(write_site(tmp_path, HOUSE[:2])).rooms) == 2


def test_properties_that_mean_geometry_elsewhere_and_heights_are_named(tmp_path):
    room = feature("room", "Polygon", square(0, 0, 4), name="a", height=3, storey="2", colour="red")
    for position in room["geometry"]["coordinates"][0]:
        position.append(12.5)
    site = write_site(tmp_path, [room])
    for file in (site, tmp_path / "tiny.geojson"):
        doubts = check_file(file).doubts
        assert len(doubts) == 3
        assert unnamed(" ".join(doubts), "'height' of 1", "'storey'", "positions") == []
    plan = json.loads((tmp_path / "tiny.geojson").read_text())
    assert plan["features"][0]["properties"]["height"] == 3
