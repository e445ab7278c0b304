"""Strategies by name, and those that users bring."""

import math
from pathlib import Path

import pytest
from helpers.wording import counted, unnamed
from helpers.worlds.delayed_loops import CURSOR, ROBOT, drive, person, way

from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.strategies import (
    GuardedStrategy,
    Oracle,
    PointView,
    Predictor,
    Pursuit,
    Sighting,
    Strategy,
    Truth,
    known_strategies,
    load_strategy,
)
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import simulate
from dva_sim.simulation.measures import episodes

HEAD = "from dva_sim.agents.operator.strategies import Intent, Strategy\n\n"


def written(folder: Path, body: str) -> str:
    """A file with one class, `Mine`, and the name that means it."""
    path = folder / "mine.py"
    path.write_text(f"{HEAD}class Mine(Strategy):\n{body}")
    return f"{path}:Mine"


def test_all_ways_of_steering_have_names():
    names = {"adaptive", "move_and_wait", "oracle", "predictor", "pursuit", "two_point"}
    assert names <= set(known_strategies())
    for name in names - {"oracle"}:
        assert isinstance(load_strategy(name)(person(), ROBOT), Strategy)


def test_only_the_oracle_is_told_the_truth_and_it_is_no_strategy_that_sees():
    oracle = load_strategy("oracle")(person(), ROBOT)
    assert isinstance(oracle, Oracle)
    assert not isinstance(oracle, Strategy)
    state = Observation(0, 0.0, 0.0, 0.0, 0.0, 0.0, ())
    assert oracle.drive(way((0, 0), (9, 0)), Truth(state), 0.5).speed == pytest.approx(0.475)
    with pytest.raises(AttributeError):
        Pursuit(person(), ROBOT).drive(way((0, 0), (9, 0)), Truth(state), 0.5)  # type: ignore[arg-type]


POSING = """
from dva_sim.agents.operator.strategies import Oracle, Pursuit
class Mine(Pursuit):
    __class__ = Oracle
"""


def test_one_that_poses_as_the_oracle_is_not_taken_for_it(tmp_path):
    (tmp_path / "mine.py").write_text(POSING)
    made = load_strategy("mine.py:Mine", base=tmp_path)(person(), ROBOT)
    assert not isinstance(made, Oracle)


def test_the_strategy_of_a_user_steers(tmp_path):
    name = written(
        tmp_path,
        "    def drive(self, route, view, stop_before):\n"
        "        ahead = route.ahead(view.seen.x, view.seen.y, view.seen.heading, 1.0)\n"
        "        if ahead.remaining < stop_before:\n"
        "            return Intent(0.0, 0.0)\n"
        "        return Intent(self.person.caution, ahead.bearing)\n",
    )
    mine = load_strategy(name)(person(), ROBOT)
    assert isinstance(mine, GuardedStrategy)
    track = drive(mine, way((0, 0), (5, 0), (5, 5)), 0.2, 60.0)
    assert math.dist((track[-1].x, track[-1].y), (5.0, 5.0)) < 0.5
    predicted = Predictor(person(), ROBOT, inner=load_strategy(name)(person(), ROBOT))
    assert drive(predicted, way((0, 0), (5, 0)), 2.0, 30.0)[-1].x == pytest.approx(4.7, abs=0.1)


USING = """
    uses = "helper"

    def __init__(self, person, reach, helper=None):
        super().__init__(person, reach)
        self.helper = helper

    def drive(self, route, view, stop_before):
        speed, turn_rate = self.helper.drive(route, view, stop_before)
        return Intent(0.5 * speed, turn_rate)
"""


def test_a_strategy_of_a_user_may_use_another_one_that_a_configuration_names(tmp_path):
    name = written(tmp_path, USING)
    mine = load_strategy(name, {"helper": "pursuit"})(person(), ROBOT)
    plain = drive(Pursuit(person(), ROBOT), way((0, 0), (5, 0)), 0.0, 0.1)
    half = drive(mine, way((0, 0), (5, 0)), 0.0, 0.1)
    assert half[0].wanted.speed == pytest.approx(0.5 * plain[0].wanted.speed)
    with pytest.raises(ConfigError, match="option 'helper' is 'oracle'"):
        load_strategy(name, {"helper": "oracle"})(person(), ROBOT)


@pytest.mark.parametrize(
    ("answer", "problem"),
    [
        ("Intent(float('nan'), 0.0)", "answers nan, 0.0"),
        ("Intent(0.1, float('inf'))", "answers 0.1, inf"),
        ("None", "TypeError: cannot unpack non-iterable NoneType object"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("exit(3)", "SystemExit: 3"),
        ("('fast', 'left')", "TypeError: must be real number, not str"),
    ],
)
def test_one_that_answers_nonsense_lets_the_robot_stand(tmp_path, answer, problem):
    name = written(tmp_path, f"    def drive(self, route, view, stop_before): return {answer}\n")
    mine = load_strategy(name)(person(), ROBOT)
    track = drive(mine, way((0, 0), (5, 0)), 0.0, 2.0)
    assert {tuple(at.wanted) for at in track} == {(0.0, 0.0)}
    assert mine.failures == 20
    assert mine.first_failure == problem


def test_one_that_wants_too_much_gets_what_the_robot_can_do(tmp_path):
    body = "    def drive(self, route, view, stop_before): return 1e9, -1e9\n"
    body += "    def point(self, view): return 3e9, 4e9\n"
    mine = load_strategy(written(tmp_path, body))(person(), CURSOR)
    assert drive(mine, way((0, 0), (5, 0)), 0.0, 0.1)[0].wanted == (0.5, -1.0)
    seen = Sighting(0, *[0.0] * 8, tolerance=0.01)
    assert mine.point(PointView(0.0, seen, 0.3)) == pytest.approx((0.3, 0.4))


def test_in_a_run_failures_are_counted_and_told_once_a_drive(tmp_path):
    name = written(tmp_path, "    def drive(self, route, view, stop_before): return 1 / 0\n")
    run = simulate(
        scenarios.build(
            scenarios.load("drive-to-event"), {"operator.strategy": name, "horizon_s": 60}
        ),
        1,
    )
    story = [moment.what for moment in run.recorder.timeline if "strategy fails" in moment.what]
    assert len(story) == len(run.recorder.drives) > 0
    assert unnamed(story[0], "ZeroDivisionError: division by zero") == []
    assert counted(run.recorder.counters, "failed", "operator") > 100


@pytest.mark.parametrize(
    ("strategy", "least", "most", "share"),
    [("pursuit", 0, 0, 0.0), ("move_and_wait", 5, 15, 1.0), ("adaptive", 5, 60, 0.85)],
)
def test_a_run_tells_how_often_its_operator_waited_and_how_long_it_steered_so(
    strategy, least, most, share
):
    """At a link delay of a second each way, adaptive persons come to move and wait."""
    changes = {"operator.strategy": strategy, "link.delay_s": 1.0}
    run = simulate(scenarios.build(scenarios.load("drive-to-event"), changes), 1)
    row = episodes.run_row(run)
    assert least <= row["move_waits"] <= most
    assert row["move_and_wait_share"] == pytest.approx(share, abs=0.1)
