"""Teams on the ground: who goes, how far, and what everybody does on the way and there."""

import functools
import math
from typing import Any

import numpy as np
import pytest
from helpers.processes.second_process import run_here_and_elsewhere

from dva_sim.core.dispatch import known_policies
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.timed import TimedRecording, build, simulate_timed
from dva_sim.simulation.timed.travel import Rooms
from dva_sim.worlds.hazards import make_hazard
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import FOOTPRINT, load_site

AREA = {"width_m": 100.0, "height_m": 60.0}
TIMES = ("detected", "assigned", "departed", "arrived", "confirmed", "closed")
MIXED: dict[str, Any] = {
    "model": "timed",
    "area": AREA,
    "responders": [
        {
            "name": "guard",
            "count": 4,
            "base": "random",
            "speed_mps": 1.3,
            "mobilisation": {"law": "lognormal", "median_s": 45, "spread": 0.45},
            "look": 5,
            "act": 60,
            "after": "recall",
        },
        {
            "name": "robot",
            "kind": "robot",
            "count": 3,
            "speed_mps": 0.35,
            "mobilisation": 4,
            "look": 3,
            "after": "return",
        },
    ],
    "operators": {"count": 2},
    "demand": [
        {
            "between": {"law": "exponential", "mean_s": 100},
            "false_share": 0.3,
            "patience": {"law": "exponential", "mean_s": 400},
            "repeats": {"share": 0.3, "after": {"law": "exponential", "mean_s": 60}},
            "severity": {"low": 0.1, "high": 1.0},
        },
        {"kind": "gas_leak", "between": {"law": "exponential", "mean_s": 240}},
    ],
    "dispatch": {
        "containment": True,
        "escalate_after_s": 300,
        "merge_distance_m": 8,
        "stations": [{"name": "west", "at": [10, 10]}, {"name": "east", "at": [90, 50]}],
    },
    "horizon_s": 5000,
    "drain": True,
}


@functools.cache
def mixed() -> TimedRecording:
    """The usual policy's."""
    return play(MIXED)


def play(scenario: dict[str, Any], seed: int = 1, **changes: Any) -> TimedRecording:
    dotted = {key.replace("__", "."): value for key, value in changes.items()}
    recording = simulate_timed(build(scenario, dotted), seed)
    assert not recording.violations
    return recording


def at(x: float, y: float) -> list[float]:
    """A zone that is a point."""
    return [x, y, x, y]


def lone_guard(**given: Any) -> dict[str, Any]:
    """A guard in a corner, and one fire 50 m away."""
    guard = {"name": "guard", "base": [0, 0], "speed_mps": 2.0, "mobilisation": 10, "look": 5}
    return {
        "model": "timed",
        "area": AREA,
        "zones": {"there": at(30, 40), "near": at(3, 4)},
        "responders": [guard | given.pop("guard", {})],
        "demand": [{"batch": {"count": 1}, "zones": {"there": 1}}],
        "horizon_s": 1000,
        "drain": True,
    } | given


# --- ways ------------------------------------------------------------------------------


def test_fifty_metres_at_2_mps_after_10_s_of_getting_ready_take_35_s():
    columns = play(lone_guard()).columns
    assert [columns[name][0] for name in TIMES] == [0.0, 0.0, 10.0, 35.0, 40.0, 40.0]


def test_one_who_returns_is_busy_until_back_at_base():
    demand = [{"batch": {"count": 2}, "zones": {"there": 1}}]
    recording = play(lone_guard(guard={"after": "return"}, demand=demand))
    # There after 35 s, sure after 40 s, back after 65 s; then the same again.
    assert recording.columns["assigned"].tolist() == [0.0, 65.0]
    assert recording.columns["arrived"].tolist() == [35.0, 100.0]
    assert recording.units[0].distance == pytest.approx(200.0, abs=1e-3)
    assert recording.units[0].spent["return"] == pytest.approx(50.0, abs=1e-3)


def test_one_who_stays_sets_out_from_where_the_last_event_was():
    demand = [
        {"name": "first", "batch": {"count": 1}, "zones": {"there": 1}},
        {"name": "second", "batch": {"count": 1, "at_s": 50}, "zones": {"there": 1}},
    ]
    recording = play(lone_guard(demand=demand))
    assert recording.columns["departed"].tolist() == [10.0, 60.0]
    assert recording.columns["arrived"].tolist() == [35.0, 60.0]


def test_one_who_is_called_on_the_way_back_turns_around_at_once():
    demand = [
        {"name": "first", "batch": {"count": 1}, "zones": {"there": 1}},
        {"name": "second", "batch": {"count": 1, "at_s": 50}, "zones": {"there": 1}},
    ]
    recording = play(lone_guard(guard={"after": "recall"}, demand=demand))
    # Sure at 40 s; 10 s and 20 m on the way back, and the same again.
    assert recording.columns["departed"][1] == 50.0
    assert recording.columns["arrived"][1] == pytest.approx(60.0, abs=1e-3)


def test_each_room_of_the_site_is_reached_by_the_planner_s_way():
    scenario = {
        "model": "timed",
        "site": {"name": "caparica", "spots": 1},
        "responders": [{"name": "guard", "base": "post-2", "after": "return"}],
        "demand": [{"batch": {"count": 4}}],
        "dispatch": {"merge_distance_m": 0},
        "drain": True,
    }
    recording, site = play(scenario), load_site("caparica")
    planner, post, columns = Planner(site, FOOTPRINT), site.guard_posts[1], recording.columns
    for k in range(4):
        way = planner.distance((post.x, post.y), (columns["x"][k], columns["y"][k]))
        assert columns["arrived"][k] - columns["departed"][k] == pytest.approx(way, rel=0.02)
        assert site.rooms[columns["zone"][k]].contains(columns["x"][k], columns["y"][k])


def test_from_half_way_nine_ways_in_ten_are_as_long_as_the_planner_finds_within_a_tenth():
    rooms, planner = Rooms("caparica", 1, "path"), Planner(load_site("caparica"), FOOTPRINT)
    start, goal, rng = rooms.spots(3)[0], rooms.spots(12)[0], np.random.default_rng(1)
    errors = []
    for gone in rng.uniform(0, rooms.length(start, goal), 12):
        here = rooms.along(start, goal, gone)
        for zone in (5, 9, 14):
            there = rooms.spots(zone)[0]
            planned = planner.distance(here.point, there.point)
            errors.append(rooms.length(here, there) / planned - 1)
    assert np.median(np.abs(errors)) < 0.03
    assert np.quantile(np.abs(errors), 0.9) < 0.10
    assert np.abs(errors).max() < 0.20


def test_turning_the_whole_area_by_a_quarter_changes_no_time():
    guards = [(5.0, 5.0), (80.0, 20.0), (40.0, 50.0)]
    events = [(10.0, 40.0), (70.0, 55.0), (90.0, 5.0), (33.0, 12.0)]

    def run(turn: bool, order: list[int]) -> Any:
        def place(x: float, y: float) -> tuple[float, float]:
            return (100.0 - y, x) if turn else (x, y)

        scenario = {
            "model": "timed",
            "area": {"width_m": 100, "height_m": 100},
            "zones": {f"z{k}": at(*place(*xy)) for k, xy in enumerate(events)},
            "responders": [
                {"name": f"guard {k}", "base": place(*guards[k]), "look": 20} for k in order
            ],
            "demand": [
                {"name": f"s{k}", "between": 150 + 7 * k, "zones": {f"z{k}": 1}} for k in range(4)
            ],
            "horizon_s": 3000,
            "drain": True,
        }
        recording = play(scenario, dispatch__policy="nearest_idle")
        return recording.columns["arrived"], np.array(recording.responders)[
            recording.columns["responder"]
        ]

    plain, who = run(False, [0, 1, 2])
    turned, same = run(True, [0, 1, 2])
    relabelled, still = run(False, [2, 0, 1])
    assert turned == pytest.approx(plain, abs=1e-4)
    assert relabelled == pytest.approx(plain, abs=1e-4)
    assert who.tolist() == same.tolist() == still.tolist()


# --- what is done there ------------------------------------------------------------------


def test_who_has_found_a_fire_deals_with_it_without_getting_ready_again():
    scenario = lone_guard(guard={"act": 60}, dispatch={"containment": True})
    recording = play(scenario)
    columns = recording.columns
    assert columns["confirmed"][0] == 40.0
    assert columns["contained"][0] == 100.0
    assert recording.responders[columns["actor"][0]] == "guard"
    assert recording.count("contained") == 1


def test_a_robot_looks_while_a_guard_stands_by_outside_and_enters_when_it_is_sure():
    scenario = lone_guard(
        responders=[
            {"name": "guard", "base": [0, 0], "speed_mps": 2.0, "act": 60},
            {"name": "robot", "kind": "robot", "base": [30, 30], "speed_mps": 0.2, "look": 5},
        ],
        operators={"count": 1},
        dispatch={"containment": True, "policy": "hazard_team"},
    )
    recording = play(scenario)
    columns, guard = recording.columns, recording.units[0]
    assert recording.responders[columns["responder"][0]] == "robot"
    assert columns["confirmed"][0] == pytest.approx(55.0)
    assert columns["act_arrived"][0] < 25.0  # it waits at the edge
    radius = make_hazard("fire", (30, 40), 0.0).danger_radius(55.0)
    assert columns["contained"][0] == pytest.approx(55.0 + radius / 2.0 + 60.0, abs=1e-3)
    assert guard.spent["stand by"] > 25.0
    assert guard.exposure["act"] == pytest.approx(60.0)
    assert guard.exposure["approach"] == pytest.approx(radius / 2.0, abs=0.1)
    assert recording.operators == [pytest.approx(columns["confirmed"][0])]


def test_who_stands_by_at_a_false_alarm_is_sent_home():
    scenario = lone_guard(
        responders=[
            {"name": "guard", "base": [0, 0], "speed_mps": 2.0, "after": "recall"},
            {"name": "robot", "kind": "robot", "base": [30, 30], "speed_mps": 0.2},
        ],
        operators={"count": 1},
        dispatch={"containment": True, "policy": "hazard_team"},
    )
    scenario["demand"][0]["false_share"] = 1.0
    recording = play(scenario)
    assert recording.count("refuted") == 1
    assert recording.exposure == 0.0


def test_a_guard_is_exposed_from_the_danger_radius_on_and_until_out_of_it():
    recording = play(lone_guard())
    hazard = make_hazard("fire", (30.0, 40.0), 0.0)
    exposure = recording.units[0].exposure
    approach = exposure["approach"]
    # So long before arrival the way left was the radius at that time.
    assert 2.0 * approach == pytest.approx(hazard.danger_radius(35.0 - approach), abs=1e-3)
    assert exposure["look"] == pytest.approx(5.0)
    assert exposure["leave"] == pytest.approx(hazard.danger_radius(40.0) / 2.0)


def test_a_robot_is_never_exposed():
    robot = {"kind": "robot", "name": "robot"}
    recording = play(lone_guard(guard=robot, operators={"count": 1}))
    assert recording.count("confirmed") == 1
    assert recording.exposure == 0.0


def test_one_on_the_way_to_a_small_fire_is_sent_to_a_large_one_near_by():
    demand = [
        {"name": "small", "batch": {"count": 1}, "zones": {"there": 1}, "severity": 0.1},
        {"name": "large", "batch": {"count": 1, "at_s": 15}, "zones": {"near": 1}, "severity": 1.0},
    ]
    recording = play(lone_guard(demand=demand, dispatch={"policy": "preemptive"}))
    assert recording.columns["preemptions"].tolist() == [1, 0]
    # 10 m out at 15 s, 5 m past the near one; back there at 2 m/s, without getting ready.
    assert recording.columns["arrived"][1] == pytest.approx(17.5, abs=1e-3)
    assert recording.counters["preempted"] == 1


def test_bids_are_kept_where_nothing_disturbs_the_way():
    recording = play(lone_guard(dispatch={"policy": "auction"}))
    assert recording.counters["auctions"] == 1
    assert recording.columns["arrived"].tolist() == [35.0]


def test_an_idle_guard_is_moved_to_where_events_are_expected():
    stations = [{"name": "far", "at": "there"}, {"name": "near", "at": "near"}]
    scenario = lone_guard(
        guard={"speed_mps": 1.0},
        demand=[{"between": 400, "zones": {"there": 1}}],
        dispatch={"policy": "coverage", "stations": stations},
    )
    recording = play(scenario)
    assert recording.counters["relocated"] >= 1
    assert recording.columns["arrived"][0] == pytest.approx(410.0)  # it waits there already


def test_lists_of_preference_decide_by_zone():
    guards = [{"name": "guard", "count": 2, "base": [0, 0], "look": 5}]
    lists = {"there": ["guard-2", "guard-1"], "near": ["guard-1", "guard-2"]}
    demand = [
        {"name": zone, "between": 200 + k, "zones": {zone: 1}} for k, zone in enumerate(lists)
    ]
    scenario = lone_guard(
        responders=guards, demand=demand, dispatch={"policy": "preference", "preferences": lists}
    )
    recording = play(scenario)
    who = [recording.responders[k] for k in recording.columns["responder"]]
    streams = [recording.streams[k] for k in recording.columns["stream"]]
    assert set(zip(streams, who, strict=True)) == {("there", "guard-2"), ("near", "guard-1")}


# --- random numbers ------------------------------------------------------------------------


@pytest.mark.parametrize("policy", known_policies())
def test_every_policy_meets_the_same_events_and_breaks_no_rule(policy):
    recording = play(MIXED, dispatch__policy=policy)
    same = mixed()
    assert recording.events > 45
    for name in ("occurred", "detected", "x", "y", "true", "severity", "stream", "index"):
        assert recording.columns[name].tolist() == same.columns[name].tolist()
    assert not recording.counters["policy failed"]
    assert sum(recording.count(o) for o in ("contained", "refuted", "escalated", "expired")) == (
        int(recording.measured.sum())
    )


def test_a_look_takes_as_long_whoever_looks_and_whenever():
    look = {"law": "exponential", "mean_s": 30}
    one = play(MIXED, responders__0__look=look, responders__1__look=look)
    other = play(
        MIXED, responders__0__look=look, responders__1__look=look, dispatch__policy="random"
    )
    looks = [r.columns["confirmed"] - r.columns["arrived"] for r in (one, other)]
    alone = [r.columns["shared"] == 0 for r in (one, other)]
    both = ~np.isnan(looks[0]) & ~np.isnan(looks[1]) & alone[0] & alone[1]
    assert both.sum() > 15
    assert looks[0][both] == pytest.approx(looks[1][both], abs=1e-5)
    assert (one.columns["responder"] != other.columns["responder"])[both].any()


PROGRAM = """
from dva_sim.simulation.timed import build, simulate_timed
recording = simulate_timed(build({scenario!r}), 7)
print([c.tobytes() for c in recording.columns.values()])
print(recording.counters, [dict(u.spent) for u in recording.units])
"""


@pytest.mark.system
def test_the_same_seed_gives_the_same_bytes_in_two_processes():
    scenario = MIXED | {"dispatch": {"policy": "random"}}
    here, elsewhere = run_here_and_elsewhere(PROGRAM.format(scenario=scenario))
    assert here == elsewhere
    assert len(here) > 10_000


def test_a_further_guard_changes_no_other_guard_s_random_numbers():
    alone, together = (
        play(lone_guard(guard={"base": "random", "speed_sd_mps": 0.3, "name": "guard-1"})),
        play(
            lone_guard(
                responders=[
                    {
                        "name": name,
                        "base": "random",
                        "speed_mps": 2.0,
                        "speed_sd_mps": 0.3,
                        "mobilisation": 10,
                        "look": 5,
                        "from_s": begin,
                    }
                    for name, begin in (("guard-1", 0), ("guard-2", 500))
                ]
            )
        ),
    )
    assert alone.columns["arrived"].tolist() == together.columns["arrived"].tolist()


# --- a reference that knows the future -------------------------------------------------------


def test_who_knows_the_future_needs_no_more_time_in_sum_than_who_does_not():
    scenario = {
        "model": "timed",
        "area": AREA,
        "responders": [{"name": "guard", "count": 2, "base": "random", "after": "return"}],
        "demand": [{"between": {"law": "exponential", "mean_s": 40}}],
        "max_events": 6,
        "horizon_s": 5000,
        "drain": True,
    }
    gains = []
    for seed in range(1, 6):
        best = play(scenario, seed, dispatch__policy="oracle").mean("response")
        greedy = play(scenario, seed).mean("response")
        gains.append(greedy - best)
    assert min(gains) > -1e-5
    assert max(gains) > 1.0


# --- the shipped shift -----------------------------------------------------------------------


@pytest.mark.system
def test_the_shipped_shift_loses_no_event_and_breaks_no_rule():
    document = load_yaml("experiments/scenarios/patrol-shift.yaml")
    recording = simulate_timed(build(document, {"horizon_s": 3600}), 1)
    assert not recording.violations
    assert recording.events > 5
    assert recording.count("contained") > 0
    assert all(math.isfinite(t) for t in recording.columns["detected"])
