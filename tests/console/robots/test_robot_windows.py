"""A robot's windows in a run: their messages, manual control from a page, faults on demand."""

import pytest
from helpers.console.simulated_console import Page
from helpers.processes.patience import PATIENCE_S
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.robots.latencies import KEPT_TIMES, Latencies


@pytest.fixture
def page(monkeypatch):
    return opened(Page(monkeypatch, guard__count=0, bystander__count=0))


def opened(page):
    page.actions.take({"client": "c1", "do": "watch", "robots": [0]})
    page.let(1.0)
    return page


def window(page):
    page.let(0.2)
    return [line for line in page.lines_of("robot") if line["i"] == 0][-1]


def by_hand(page, speed=0.0, turn=0.0, held=True, seconds=1.0, client="c1"):
    """Send the input of a held page at its usual rate."""
    for n in range(round(seconds / 0.05)):
        line = {"client": client, "do": "manual", "n": n, "speed": speed, "turn": turn}
        page.actions.take({**line, "held": held})
        page.let(0.05)


def story(page):
    return [line["what"] for line in page.lines_of("story") if line["who"] == "robot-1"]


def test_only_robots_that_somebody_looks_at_are_told(page):
    page.let(1.0)
    assert {line["i"] for line in page.lines_of("robot")} == {0}


def test_a_robot_that_stands_says_so_once_and_shows_its_sensors_with_units(page):
    shown = window(page)
    assert (shown["mode"], shown["hand"], shown["speed_mps"]) == ("Idle", None, 0.0)
    assert shown["station"]["state"] == "listening"
    units = {sensor["name"]: sensor["unit"] for sensor in shown["sensors"]}
    assert units["temperature"] == "degC"
    assert all("values" in sensor or "least" in sensor for sensor in shown["sensors"])


def test_a_hand_moves_the_robot_within_its_limits_and_no_rule_is_broken(page):
    assert page.do("manual_take", robot=0) == (True, "manual control is yours")
    by_hand(page, 1.0, -0.5, seconds=3.0)
    shown = window(page)
    assert (shown["mode"], shown["hand"]) == ("Manual", 1)
    assert shown["speed_mps"] == pytest.approx(0.5)
    assert shown["turn_rate_radps"] == pytest.approx(-0.2618, abs=1e-3)
    assert page.robot().body.speed == pytest.approx(0.5, abs=0.02)
    assert page.do("manual_release")[0]
    page.let(2.0)
    assert window(page)["hand"] is None
    assert page.robot().body.speed == pytest.approx(0.0, abs=1e-3)
    assert not page.world.recorder.violations


@pytest.mark.parametrize(
    "end",
    [
        lambda page: page.actions.take({"client": "c1", "do": "gone"}),
        lambda page: page.let(0.5),  # nothing is said any more
        lambda page: by_hand(page, 1.0, held=False, seconds=0.1),
        lambda page: page.do("pace", paused=True),
        lambda page: page.world.clock.on_late(0.3),
    ],
)
def test_whoever_lets_go_or_falls_silent_or_leaves_stops_the_robot_at_once(page, end):
    page.do("manual_take", robot=0)
    by_hand(page, 1.0, seconds=2.0)
    assert page.robot().body.speed > 0.4
    end(page)
    page.let(1.0)
    assert page.robot().body.speed == pytest.approx(0.0, abs=0.02)
    assert window(page)["mode"] == "Manual"


def test_a_hand_of_which_nothing_comes_for_long_is_let_go_and_the_page_says_why(page):
    page.do("manual_take", robot=0)
    page.let(35.0)
    shown = window(page)
    assert (shown["mode"], shown["hand"]) == ("Idle", None)
    assert unnamed(shown["notice"], "manual control", "heard") == []
    assert shown["notice"] in story(page)


def test_who_asks_for_a_robot_in_a_hand_is_told_that_it_is_busy(page):
    page.do("manual_take", robot=0)
    assert page.do("take", robots=[0], client="c2")[0]
    done, text = page.do("start", client="c2")
    assert (done, unnamed(text, "robot-1", "by hand")) == (False, [])
    page.let(5.0)
    assert page.robot().controller.mode is Mode.IDLE
    by_hand(page, 0.5, seconds=1.0)
    assert page.robot().body.speed > 0.2
    page.do("manual_release")
    page.let(2.0)
    assert page.do("start", client="c2")[0]
    page.let(2.0)
    assert page.robot().controller.mode is Mode.TELEOPERATION
    assert not page.world.recorder.violations


def test_a_robot_that_somebody_holds_goes_into_no_hand_and_says_whose_it_is(page):
    assert page.do("take", robots=[0], client="c2")[0]
    assert page.do("manual_take", robot=0) == (False, "busy: held by console-1")


def test_a_second_page_gets_no_hand_on_it(page):
    page.do("manual_take", robot=0)
    done, text = page.do("manual_take", robot=0, client="c2")
    assert (done, unnamed(text, "busy", "by hand")) == (False, [])
    by_hand(page, 1.0, client="c2")
    assert page.robot().body.speed == pytest.approx(0.0, abs=1e-3)


def test_an_emergency_wins_over_the_hand_and_is_told_with_who_pressed_it(page):
    page.do("manual_take", robot=0)
    by_hand(page, 1.0, seconds=2.0)
    assert page.do("emergency", robots="all", client="c2")[0]
    by_hand(page, 1.0, seconds=2.0)
    shown = window(page)
    assert (shown["mode"], shown["hand"]) == ("Emergency", None)
    assert page.lines_of("rows")[-1]["robots"][0]["emergency"]["by"] == "page c2"
    assert unnamed(shown["notice"], "manual control", "emergency") == []
    assert page.robot().body.speed == pytest.approx(0.0, abs=1e-3)
    assert page.do("release_emergency", robots="all", role="supervise")[0]
    page.let(1.0)
    assert page.do("manual_take", robot=0)[0]
    by_hand(page, 1.0, seconds=2.0)
    assert window(page)["mode"] == "Manual"
    assert not page.world.recorder.violations


def test_latency_is_that_of_the_link_one_way_and_the_pictures_there_and_back(monkeypatch):
    page = opened(Page(monkeypatch, link__delay_s=0.1, guard__count=0, bystander__count=0))
    page.sets_out(0.3, then=5.0)
    shown = window(page)
    assert shown["one_way"]["median_ms"] == pytest.approx(100, abs=5)
    assert shown["one_way"]["last_ms"] <= shown["one_way"]["largest_ms"]
    assert shown["loop"]["median_ms"] > 200
    assert shown["replies"]["median_ms"] < 50


def test_figures_are_of_the_newest_times_alone():
    times = Latencies()
    assert times.line() is None
    for n in range(KEPT_TIMES + 100):
        times.add(9.0 if n < 100 else (n - 100) / 1000)
    line = times.line()
    assert line == {
        "last_ms": 999.0,
        "median_ms": 499.5,
        "p95_ms": 949.0,
        "largest_ms": 999.0,
        "count": KEPT_TIMES + 100,
    }


@pytest.mark.parametrize(
    ("what", "more", "key", "on"),
    [
        ("processing", {"seconds": 2.5}, "processing_s", 2.5),
        ("replies", {}, "replies", True),
        ("freeze", {}, "freeze", True),
        ("camera", {}, "camera", True),
    ],
)
def test_a_fault_is_shown_and_undone_and_is_in_the_story_both_times(page, what, more, key, on):
    before = window(page)["faults"]
    count = len(story(page))
    assert page.do("fault", robot=0, what=what, on=True, **more)[0]
    assert window(page)["faults"][key] == on
    assert page.do("fault", robot=0, what=what, on=False)[0]
    assert window(page)["faults"] == before
    assert len(story(page)) >= count + 2


def test_a_sensor_that_is_stuck_is_marked_and_one_that_is_not_there_is_refused(page):
    assert page.do("fault", robot=0, what="sensor", sensor="smoke", on=True)[0]
    page.let(1.5)
    stuck = {sensor["name"]: sensor["stuck"] for sensor in window(page)["sensors"]}
    assert stuck["smoke"]
    assert not stuck["temperature"]
    done, why = page.do("fault", robot=0, what="sensor", sensor="nose", on=True)
    assert not done
    assert "'nose'" in why


def test_replies_that_are_dropped_end_in_time_outs_and_break_no_rule(page):
    assert page.do("take", robots=[0])[0]
    page.do("fault", robot=0, what="replies", on=True)
    assert not page.do("start", within=60.0)[0]
    page.do("fault", robot=0, what="replies", on=False)
    page.let(5.0)
    assert page.do("start", within=PATIENCE_S)[0]
    assert not page.world.recorder.violations


def test_a_robot_that_freezes_in_a_drive_is_stopped_by_its_watchdog(page):
    page.sets_out(0.5, then=2.0)
    page.do("fault", robot=0, what="freeze", on=True)
    page.let(1.0)
    assert page.robot().body.speed > 0.2
    page.let(5.0)
    assert page.robot().body.speed == pytest.approx(0.0, abs=1e-3)
    page.let_go()
    page.do("fault", robot=0, what="freeze", on=False)
    page.let(5.0)
    assert page.robot().controller.mode is Mode.IDLE
    assert not page.world.recorder.violations


def test_the_slider_of_the_link_counts_again_once_the_knob_is_off(page):
    page.do("fault", robot=0, what="processing", on=True, seconds=1.0)
    page.do("link", processing_s=0.2)
    assert page.robot().inbox.service() == 1.0
    page.do("fault", robot=0, what="processing", on=False)
    assert page.robot().inbox.service() == 0.2
