"""A report says what is special about a link, and is silent about what goes without saying."""

from typing import Any

from dva_sim.experiments.analysis.conditions import conditions
from dva_sim.simulation import scenario as scenarios

SPECIAL = {
    "law of the delay",
    "recorded delays",
    "packets may overtake",
    "bursts of losses",
    "queue before the link, in packets",
    "outages",
    "partitions",
    "otherwise towards the robot",
    "otherwise from the robot",
}


def told(**link: Any) -> dict[str, list[str]]:
    changes = {f"link.{key}": value for key, value in link.items()}
    scenario = scenarios.build(scenarios.load("drive-to-event"), changes)
    rows = dict(conditions({"drive": scenario.model_dump(mode="json")}, []))
    return {name: value for name, value in rows.items() if name in SPECIAL}


def test_a_plain_link_has_nothing_special():
    assert told(delay_s=0.1, loss=0.01) == {}


def test_what_is_special_is_told():
    found = told(
        loss=0.02,
        bursts={"mean_s": 0.1},
        reorder=True,
        queue_packets=50,
        outages=[{"from_s": 3, "for_s": 2}],
        up={"loss": 0.2},
    )
    assert found == {
        "bursts of losses": ["mean_s 0.1, loss 1.0"],
        "packets may overtake": ["yes"],
        "queue before the link, in packets": ["50"],
        "outages": ["from_s 3.0, for_s 2.0, direction both"],
        "otherwise towards the robot": ["loss 0.2"],
    }
