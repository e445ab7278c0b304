"""Lost links and giving up, with every messaging pattern."""

import pytest
from helpers.dva.scripted_dva import EAST, ROBOT, PretendedDva, driving

from dva_sim.agents.operator.drive import ATTEMPTS
from dva_sim.kernel.recorder import DriveLog

ASKED = ("req-rep", "pipelined")
BY_PLACES = """
import math
from dva_sim.agents.operator.strategies import Intent, Strategy

class Mine(Strategy):
    along = 0.0

    def drive(self, route, view, stop_before):
        seen = view.seen
        ways = [min(self.along + 0.05 * n, route.length) for n in range(40)]
        self.along = min(ways, key=lambda s: math.dist(route.point_at(s), (seen.x, seen.y)))
        x, y = route.point_at(self.along + 0.8)
        bearing = math.remainder(math.atan2(y - seen.y, x - seen.x) - seen.heading, math.tau)
        most = self.reach.turn_rate
        turn = min(max(0.6 * bearing, -most), most)
        return Intent(0.0 if abs(bearing) > 0.5 else 0.25, turn)
"""
PATTERNS = ("req-rep", "latest-wins")
STRATEGIES = ("pursuit", "move_and_wait")


def lost_after(dva: PretendedDva, log: DriveLog) -> tuple[str, float]:
    """Outcome of the drive, and the time until then [s]."""
    now = dva.now
    dva.run_until(lambda: log.ended is not None, limit=120.0)
    assert log.ended is not None
    dva.run_for(1.0)
    assert "failed" in dva.progress(1)
    return log.outcome, log.ended - now


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_robot_that_says_nothing_any_more_is_lost_after_20_s_without_a_picture(pattern):
    dva, log = driving(pattern)
    dva.field.robots[ROBOT].device.silent = True
    outcome, took = lost_after(dva, log)
    assert outcome == "lost link"
    assert took == pytest.approx(20.5, abs=0.8)


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_commands_that_do_not_arrive_are_a_lost_link_after_three_attempts(pattern, strategy):
    """The picture goes on; nobody moves any more, whatever is tried."""
    dva, log = driving(pattern, **{"operator.strategy": strategy})
    dva.field.robots[ROBOT].inbox._put = lambda *_: None  # type: ignore[method-assign]
    outcome, took = lost_after(dva, log)
    assert (outcome, ATTEMPTS) == ("lost link", 3)
    assert 12.0 < took < 45.0
    tried = dva.stage.recorder.counters["replans"]
    assert tried <= 3 if pattern in ASKED else tried == 3


def test_the_story_says_what_an_operator_believes_of_the_link_and_not_that_it_is_so():
    dva, log = driving("latest-wins")
    dva.field.robots[ROBOT].inbox._put = lambda *_: None  # type: ignore[method-assign]
    lost_after(dva, log)
    story = [moment.what for moment in dva.stage.recorder.timeline]
    assert any("does not move" in what for what in story)
    assert not any("lost link" in what for what in story)


@pytest.mark.parametrize("pattern", ASKED)
def test_the_app_alerts_after_three_sends_of_2_s_without_an_answer(pattern):
    dva, log = driving(pattern, **{"command.timeout_s": 2.0})
    dva.field.robots[ROBOT].inbox._put = lambda *_: None  # type: ignore[method-assign]
    outcome, took = lost_after(dva, log)
    assert outcome == "lost link"
    assert took == pytest.approx(6.0, abs=0.5)
    assert log.alerts >= 1


def test_who_gets_no_nearer_gives_up_when_its_patience_ends():
    """A robot that turns and never drives: patience is of the person."""
    dva, log = driving("latest-wins", **{"operator.traits": {"patience_s": 30.0}})
    body = dva.field.robots[ROBOT].body
    drive = body.drive
    body.drive = lambda speed, turn, until: drive(0.0, 0.3, until)  # type: ignore[method-assign]
    outcome, took = lost_after(dva, log)
    assert outcome == "gave up"
    assert 15.0 < took < 60.0


def test_a_robot_gets_nearer_whatever_its_strategy_asks_of_the_way(tmp_path):
    """A strategy that steers by positions alone never asks the route where it is."""
    path = tmp_path / "mine.py"
    path.write_text(BY_PLACES)
    changes = {"operator.strategy": f"{path}:Mine", "operator.traits": {"patience_s": 20.0}}
    dva = PretendedDva(robots=1, pattern="latest-wins", **changes)
    dva.operator()
    dva.order(1, EAST, robot=ROBOT)
    dva.run_until(lambda: "departed" in dva.progress(1))
    (log,) = dva.stage.recorder.drives
    dva.run_until(lambda: "arrived" in dva.progress(1) or log.ended is not None, limit=300.0)
    assert "arrived" in dva.progress(1)
    assert dva.now - log.started > 40.0
