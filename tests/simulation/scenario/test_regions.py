"""Regions of a scenario: who serves which place, and what is refused."""

import pytest

from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation import scenario as scenarios

HALL = {"site": {"name": "hall"}, "robot": {"count": 1}, "events": [{"kind": "fire"}]}
WEST = {"polygon": [[0, 0], [30, 0], [30, 40], [0, 40]]}
EAST = {"polygon": [[30, 0], [60, 0], [60, 40], [30, 40]]}
REST = {"rest": True}


def built(**regions):
    return scenarios.build(HALL | {"dva": {"regions": regions}})


def plan(**regions):
    scenario = built(**regions)
    return scenarios.plan_of(scenario.dva.regions, scenarios.site_of(scenario, 0))


def test_a_place_belongs_to_the_region_around_it_and_to_the_nearest_outside_all():
    divided = plan(west=WEST, east=EAST)
    assert [divided.region_at(x, 20.0) for x in (1, 29, 31, 59, 65)] == [
        *["west"] * 2,
        *["east"] * 3,
    ]
    assert divided.outside("west", 33.0, 20.0) == pytest.approx(3.0)
    assert divided.outside("west", 29.0, 20.0) == 0.0


def test_the_rest_is_whatever_no_other_region_has():
    divided = plan(west=WEST, others=REST)
    assert divided.region_at(45.0, 5.0) == "others"
    assert divided.areas["others"].area == pytest.approx(1200.0, abs=1.0)


def test_the_deputy_is_the_next_region_or_the_one_that_is_named():
    third = {"polygon": [[50, 0], [60, 0], [60, 40], [50, 40]]}
    divided = plan(west=WEST, middle=REST, east=third | {"deputy": "middle"})
    assert divided.deputies == {"west": "middle", "middle": "east", "east": "middle"}
    assert divided.serving_order("east") == ("east", "middle", "west")


@pytest.mark.parametrize(
    ("regions", "problem"),
    [
        ({"west": WEST}, "one region is no division; name two, or leave it out"),
        ({"west": WEST, "east": WEST}, "dva.regions.east: 'west' and 'east' overlap by 1200.0 m2"),
        ({"west": WEST, "east": {"rooms": ["Hal"]}}, "room 'Hal' is unknown; did you mean 'Hall'?"),
        ({"west": WEST, "east": {"rooms": []}}, "a region needs rooms, a polygon, or rest: true"),
        ({"a": REST, "b": REST}, "only one region can have the rest"),
        ({"west": WEST, "east": EAST | {"deputy": "east"}}, "a region is not its own deputy"),
        ({"west": WEST, "east": EAST | {"deputy": "north"}}, "region 'north' is unknown"),
        ({"west": WEST, "east": {"polygon": [[40, 0], [60, 0], [60, 40]]}}, "is in no region"),
        ({"west": {"polygon": [[0, 0], [1, 1]]}, "b": REST}, "at least three corners"),
        ({"a": {"polygon": [[0, 0], [9, 9], [9, 0], [0, 9]]}, "b": REST}, "crosses itself"),
    ],
)
def test_what_is_no_division_of_the_site_is_refused_in_a_line(regions, problem):
    with pytest.raises(ConfigError, match="dva") as refused:
        built(**regions)
    assert problem in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_death_of_an_unknown_region_is_refused():
    deaths = [{"region": "north", "at_s": 5}]
    with pytest.raises(ConfigError, match="region 'north' is unknown"):
        scenarios.build(HALL | {"dva": {"regions": {"west": WEST, "east": EAST}, "deaths": deaths}})


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"deaths": [{"at_s": 9, "latest_s": 5}]}, "latest_s 5 is before at_s 9"),
        ({"backbone": {"partitions": [{"from_s": 1, "for_s": 2}]}}, "link.partitions part DVAs"),
        ({"backbone": {"jitter_s": 0.2, "delay_s": 0.1}}, "jitter_s 0.2 is above delay_s 0.1"),
    ],
)
def test_what_no_backbone_and_no_death_can_be_is_refused(changes, problem):
    with pytest.raises(ConfigError) as refused:
        scenarios.build(HALL | {"dva": {"regions": {"west": WEST, "east": EAST}, **changes}})
    assert problem in str(refused.value)


def test_a_request_waits_for_the_slower_of_link_and_backbone():
    far = scenarios.build(HALL | {"dva": {"backbone": {"delay_s": 2}}, "link": {"delay_s": 1}})
    assert scenarios.request_timeout_s(far) == pytest.approx(1.25 * 16.0)


def test_a_scenario_of_one_dva_is_written_as_before():
    written = scenarios.build(HALL | {"dva": {"sensors": ["smoke"]}}).model_dump()["dva"]
    assert not {"regions", "deaths", "backbone"} & written.keys()
