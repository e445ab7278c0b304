"""What every robot's motors promise: kept by all that are shipped, missed by the bad ones here."""

import math

import pytest
from helpers.paths import ROOT

from dva_sim.cli import checks
from dva_sim.kernel.errors import ConfigError
from dva_sim.testing.promises import tried
from dva_sim.testing.robots import check_robot
from dva_sim.worlds.drives import Differential

NAMES = sorted(path.stem for path in (ROOT / "agents/robots").glob("*.yaml"))


@pytest.mark.parametrize("name", NAMES)
def test_every_robot_that_is_shipped_keeps_its_promises(name):
    outcome = tried(check_robot, name, slow=60.0)
    assert (outcome.broken, outcome.warnings) == ((), ())
    assert outcome.tries > 100


class Reckless(Differential):
    def set_point(self, speed, turn_rate):
        return 2 * speed, turn_rate


class Spinner(Differential):
    def set_point(self, speed, turn_rate):
        return speed, 2 * turn_rate


class Numberless(Differential):
    def set_point(self, speed, turn_rate):
        return speed / speed if speed else math.nan, turn_rate


class Dizzy(Differential):
    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        return (math.inf, 0.0) if now_speed < 0 else super().accelerations(
            speed, turn_rate, now_speed, now_turn_rate, dt)  # fmt: skip


class Forgetless(Differential):
    asked = 0

    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        type(self).asked += 1  # shared by all of the class
        return 0.001 * self.asked, 0.0


class Overshooting(Differential):
    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        return 0.5 if speed > 0 else -now_speed, (turn_rate - now_turn_rate) * 2


class Whirling(Differential):
    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        along, _ = super().accelerations(speed, turn_rate, now_speed, now_turn_rate, dt)
        return along, 1.0


class Backwards(Differential):
    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        _, turn = super().accelerations(speed, turn_rate, now_speed, now_turn_rate, dt)
        return (-0.5 if now_speed > -0.2 else 0.0), turn


class Rolling(Differential):
    """Hardly brakes."""

    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        along, turn = super().accelerations(speed, turn_rate, now_speed, now_turn_rate, dt)
        return max(along, -0.1), turn


class Endless(Differential):
    """Does not brake at all."""

    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        along, turn = super().accelerations(speed, turn_rate, now_speed, now_turn_rate, dt)
        return max(along, 0.0), turn


class Failing(Differential):
    def accelerations(self, speed, turn_rate, now_speed, now_turn_rate, dt):
        return 1 / 0, 0.0


@pytest.mark.parametrize(
    ("drive", "said"),
    [
        (Reckless, "aims at a speed beyond the limits: ("),
        (Spinner, "aims at a turn rate beyond the limit: ("),
        (Numberless, "aims at what is no number: (nan, "),
        (Dizzy, "answers what is no number: "),
        (Forgetless, "remembers: a new copy answers differently: "),
        (Overshooting, "drives faster than its limit: "),
        (Whirling, "turns faster than its limit: "),
        (Backwards, "drives backwards: "),
        (Rolling, "stops too late: 1.25"),
        (Endless, "does not stop within a minute: 0.5 m/s"),
        (Failing, "raises: ZeroDivisionError: division by zero (test_robots.py:"),
    ],
)
def test_a_broken_promise_is_told_in_a_plain_line(drive, said):
    outcome = tried(check_robot, drive)
    assert any(line.startswith(said) for line in outcome.broken), outcome.broken


def test_robots_are_checked_by_profile_and_by_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    bad = "from dva_sim.worlds.drives import Drive\nclass Bad(Drive):\n"
    (tmp_path / "bad.py").write_text(bad + "    def accelerations(self, *a): return 1 / 0\n")
    assert checks.check(["robot", "servrobot", "tracked.py:Tracked"]) == 0
    lines = capsys.readouterr().out.splitlines()
    said = "servrobot: robot: valid; 154 drives, "
    assert any(line.startswith(said) for line in lines)  # a busy machine has warnings, too
    assert lines[-1] == "2 robots: 2 valid"
    assert checks.check(["robot", "bad.py:Bad"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "bad.py:Bad: raises: ZeroDivisionError: division by zero (bad.py:3)"
    assert lines[1].startswith("bad.py:Bad: robot: invalid, breaks 1 of its promises; ")


@pytest.mark.parametrize(
    ("names", "options", "said"),
    [
        (["robot", "servrobut"], [], "did you mean 'servrobot'?"),
        (["robot", "tracked"], ["scrub=2"], "drive '"),
        (["robot", "tracked"], ["scrub=2"], "option 'scrub' is 2; should be from 0 to 1"),
        (["robot", "tracked"], ["speed=2"], "has no option 'speed'; known: scrub"),
        (["robot", "pibot"], ["steering_deg=90"], "is 90; should be in (0, 80)"),
    ],
)
def test_a_mistake_is_one_line(names, options, said, capsys):
    assert checks.check(names, options) == 1
    out = capsys.readouterr().out
    assert said in out
    assert len(out.splitlines()) == 2


def test_a_robot_has_to_be_named():
    with pytest.raises(ConfigError, match=r"which one\? mine.py:Mine, or one of pibot, servrobot"):
        checks.check(["robot"])
