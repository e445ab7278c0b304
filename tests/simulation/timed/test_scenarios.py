"""Mistakes in a timed scenario are reported at their place, with the correct form."""

from typing import Any

import pytest
from helpers.wording import unnamed

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.timed import build, rehearse_timed

GOOD: dict[str, Any] = {
    "model": "timed",
    "responders": [{"name": "guard"}],
    "demand": [{"between": 10}],
}
AREA = {"area": {"width_m": 10, "height_m": 10}}
SITE = {"site": {"name": "caparica"}}
ROBOT = {"name": "robot", "kind": "robot"}
DRIVEN = {"responders": [ROBOT], "operators": {"count": 1}}
REPEATED = {"demand": [{"between": 1, "repeats": {"share": 0.5}}]}


@pytest.mark.parametrize(
    ("wrong", "names"),
    [
        ({"demand": [{}]}, "between, sources batch"),
        ({"demand": [{"between": 0}]}, "between 0 s"),
        ({"demand": [{"between": 1, "batch": {"count": 1}}]}, "between, sources batch"),
        ({"demand": [{"between": 1, "zones": {"hall": 1}}]}, "zone 'hall' here"),
        ({"demand": [{"between": 1}, {"between": 2}]}, "streams 'fire'"),
        ({"demand": [{"between": 1, "notice": "detectors"}]}, "'detectors' site"),
        ({"demand": [{"between": {"law": "exponential"}}]}, "missing mean_s"),
        ({"responders": [ROBOT]}, "robots operator"),
        (DRIVEN | {"responders": [ROBOT | {"after": "recall"}]}, "driven operator"),
        ({"responders": [{"name": "a"}, {"name": "a"}]}, "responders 'a'"),
        ({"responders": [{"name": "a", "base": "hall"}]}, "place 'hall'"),
        ({"responders": [{"name": "a", "base": "post"}]}, "place 'post'"),
        (AREA | SITE, "site area"),
        ({"zones": {"a": [0, 0, 1, 1]}}, "zones area"),
        (AREA | {"zones": {"a": [2, 0, 1, 1]}}, "xmin, ymin, xmax, ymax"),
        (AREA | {"travel": "path"}, "travel 'path' site"),
        ({"travel": "straight"}, "travel site area"),
        ({"warm_up_s": 9, "horizon_s": 8}, "warm_up_s 9 horizon_s 8"),
        ({"dispatch": {"policy": "min_etta"}}, "policy 'min_etta' 'min_eta'?"),
        ({"dispatch": {"policy": "min_eta", "options": {"a": 1}}}, "'min_eta' 'a'"),
        ({"dispatch": {"preferences": {"here": ["guide"]}}}, "responder 'guide'"),
        ({"dispatch": {"contaiment": True}}, "contaiment' 'containment'"),
        (REPEATED | {"dispatch": {"merge_distance_m": 0}}, "repeats dispatch.merge_distance_m"),
        (DRIVEN | {"dispatch": {"containment": True}}, "containment guards"),
    ],
)
def test_a_mistake_is_told_in_one_line(wrong, names):
    with pytest.raises(ConfigError) as problem:
        build(GOOD | wrong)
    assert unnamed(problem.value, *names.split()) == []
    assert "\n" not in str(problem.value)


@pytest.mark.parametrize(
    ("lines", "place", "names"),
    [
        ("demand:\n  - between: {law: exponential, mean_s: -3}\n", (4, 33), "above 0"),
        ("demand: [{between: 3}]\ndispatch:\n  policy: fastest\n", (5, 3), "'fastest'"),
    ],
)
def test_a_mistake_in_a_file_has_its_line_and_column(tmp_path, lines, place, names):
    file = tmp_path / "shift.yaml"
    file.write_text(f"model: timed\nresponders: [{{name: guard}}]\n{lines}")
    with pytest.raises(ConfigError) as problem:
        build(load_yaml(file))
    assert (problem.value.line, problem.value.column) == place
    assert names in str(problem.value)


def test_changes_reach_into_lists_by_number():
    scenario = build(GOOD, {"responders.0.count": 3, "demand.0.between": 7, "horizon_s": 60})
    assert scenario.names == ["guard-1", "guard-2", "guard-3"]
    assert scenario.demand[0].between.mean == 7


@pytest.mark.parametrize("key", ["responders.4.count", "responders.x.count", "demand.0.kind.x"])
def test_a_change_of_what_is_not_there_is_refused(key):
    with pytest.raises(ConfigError):
        build(GOOD, {key: 1})


def test_a_site_with_too_few_posts_is_told_before_anything_runs():
    scenario = build(GOOD | SITE | {"responders": [{"name": "guard", "base": "post-9"}]})
    with pytest.raises(ConfigError, match="post-9"):
        rehearse_timed(scenario, 1)


@pytest.mark.parametrize("never", [None, float("inf")])
def test_an_event_may_wait_forever(never):
    scenario = build(GOOD | {"dispatch": {"escalate_after_s": never}})
    assert scenario.dispatch.escalate_after_s == never


def test_the_oracle_refuses_what_no_plan_of_tours_describes():
    scenario = build(GOOD | {"dispatch": {"policy": "oracle"}})
    with pytest.raises(ConfigError, match="after: return"):
        rehearse_timed(scenario, 1)
