"""Alarms: their states, one list by priority, shelves with an end, floods that fold."""

from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from dva_sim.console.events.alarms import (
    MAX_ALARMS,
    MAX_SHELF,
    PRIORITIES,
    AlarmCondition,
    Alarms,
    AlarmState,
)

CORRIDOR = "Corridor 2"


def fire(number: int = 1, priority: str = "high", **more: Any) -> AlarmCondition:
    room = more.pop("place", CORRIDOR)
    return AlarmCondition(
        f"event {number}", "fire", priority, room, f"fire {number}, {room}", **more
    )


def states(alarms: Alarms) -> dict[str, str]:
    return {key: str(alarm.state) for key, alarm in alarms.known.items()}


def texts(alarms: Alarms, now: float = 100.0) -> list[str]:
    return [row["text"] for row in alarms.rows(now)]


@pytest.fixture
def burning() -> Alarms:
    """One fire, reported at 0 s."""
    alarms = Alarms()
    alarms.update([fire()], 0.0)
    return alarms


def test_a_condition_is_unacknowledged_until_somebody_has_seen_it(burning):
    assert states(burning) == {"event 1": "unacknowledged"}

    burning.acknowledge("event 1", "ana")
    burning.update([fire()], 1.0)
    assert states(burning) == {"event 1": "acknowledged"}
    assert burning.rows(1.0)[0]["seen_by"] == "ana"


def test_what_is_over_and_seen_is_no_alarm_any_more(burning):
    burning.acknowledge("event 1", "ana")
    burning.update([], 1.0)

    assert states(burning) == {}


def test_what_is_over_before_anybody_saw_it_stays_as_returned_until_somebody_does(burning):
    burning.update([], 1.0)
    assert states(burning) == {"event 1": "returned"}

    burning.acknowledge("event 1", "ana")
    assert states(burning) == {}


def test_what_comes_back_is_new_again(burning):
    burning.update([], 10.0)
    burning.update([fire()], 20.0)

    assert states(burning) == {"event 1": "unacknowledged"}
    assert burning.rows(21.0)[0]["is_new"]


def test_an_alarm_that_becomes_graver_has_to_be_seen_again():
    alarms = Alarms()
    alarms.update([fire(priority="medium")], 0.0)
    alarms.acknowledge("event 1", "ana")
    alarms.update([fire(priority="critical")], 10.0)
    assert states(alarms) == {"event 1": "unacknowledged"}

    alarms.acknowledge("event 1", "ana")
    alarms.update([fire(priority="low")], 20.0)
    assert states(alarms) == {"event 1": "acknowledged"}


def test_what_was_seen_by_a_message_to_the_dva_is_seen_here(burning):
    burning.update([fire(seen_by="ben")], 1.0)

    assert states(burning) == {"event 1": "acknowledged"}
    assert burning.rows(1.0)[0]["seen_by"] == "ben"


def test_only_a_new_alarm_stands_out_and_only_for_5_seconds():
    alarms = Alarms()
    alarms.update([fire(1), fire(2)], 0.0)
    alarms.acknowledge("event 2", "ana")

    assert [row["is_new"] for row in alarms.rows(4.9)] == [True, False]
    assert [row["is_new"] for row in alarms.rows(5.0)] == [False, False]


def test_the_list_has_the_gravest_first_then_what_nobody_saw_then_the_newest():
    alarms = Alarms()
    alarms.update([fire(1, "low"), fire(2, "critical"), fire(3, "critical")], 0.0)
    alarms.acknowledge("event 2", "ana")
    both = [fire(1, "low"), fire(2, "critical"), fire(3, "critical"), fire(4, "critical")]
    alarms.update(both, 9.0)

    assert [row["key"] for row in alarms.rows(9.0)] == ["event 4", "event 3", "event 2", "event 1"]


def test_a_shelved_alarm_is_out_of_the_list_until_its_end_and_then_new(burning):
    burning.shelve("event 1", 60.0, "ana", 0.0, "a drill")
    burning.update([fire()], 59.0)
    assert texts(burning) == []
    (row,) = burning.shelved(59.0)
    assert (row["left_s"], row["shelved_by"], row["shelved_why"]) == (1, "ana", "a drill")

    burning.update([fire()], 60.0)
    assert burning.shelved(60.0) == []
    assert burning.rows(60.0)[0]["is_new"]


def test_no_shelf_lasts_longer_than_a_shift(burning):
    burning.shelve("event 1", 1e9, "ana", 0.0)

    assert burning.known["event 1"].shelved_until == MAX_SHELF


def test_a_shelved_alarm_that_gets_graver_is_in_the_list_again():
    alarms = Alarms()
    alarms.update([fire(1, "low")], 0.0)
    alarms.acknowledge("event 1", "ana")
    alarms.shelve("event 1", 600.0, "ana", 1.0, "a drill")
    alarms.update([fire(1, "critical")], 2.0)
    assert alarms.shelved(2.0) == []
    assert states(alarms) == {"event 1": "unacknowledged"}


@pytest.mark.parametrize(
    ("priority", "acknowledged", "must"),
    [("critical", False, True), ("critical", True, False), ("high", False, False)],
)
def test_a_critical_alarm_must_be_seen_before_anything_else(priority, acknowledged, must):
    alarms = Alarms()
    alarms.update([fire(1, priority)], 0.0)
    if acknowledged:
        alarms.acknowledge("event 1", "ana")
    assert alarms.must_be_seen("event 1") == must


def test_what_returns_on_the_shelf_stays_shelved_when_it_comes_back(burning):
    burning.shelve("event 1", 60.0, "ana", 0.0)
    burning.update([], 10.0)
    burning.update([fire()], 20.0)

    assert texts(burning) == []
    assert len(burning.shelved(20.0)) == 1


def test_ten_alarms_in_ten_minutes_are_a_flood_and_alike_ones_fold():
    alarms = Alarms()
    nine = [fire(number) for number in range(7)]
    nine += [fire(number, place="Hall") for number in (7, 8)]
    alarms.update(nine, 0.0)
    assert len(texts(alarms)) == 9

    alarms.update([*nine, fire(9, "critical", place="Lab 318")], 1.0)
    assert texts(alarms) == ["fire 9, Lab 318", f"7 x fire, {CORRIDOR}", "2 x fire, Hall"]
    assert alarms.is_flood


def test_robots_that_are_folded_in_a_flood_are_named():
    alarms = Alarms()
    lost = [
        AlarmCondition(f"lost {name}", "robot lost", "high", place="", text=f"{name} is lost")
        for name in ("robot-1", "robot-2")
    ]
    alarms.update([*lost, *map(fire, range(10))], 0.0)
    assert "2 x robot lost, robot-1, robot-2" in texts(alarms)


def test_a_folded_row_stands_for_all_its_alarms_and_is_as_grave_as_the_gravest():
    alarms = Alarms()
    many = [fire(number, "low") for number in range(9)]
    alarms.update([*many, fire(9, "critical")], 0.0)
    (row,) = alarms.rows(0.0)
    assert (row["priority"], row["count"]) == ("critical", 10)

    for key in alarms.members(row["key"]):
        alarms.acknowledge(key, "ana")
    assert set(states(alarms).values()) == {"acknowledged"}


def test_a_flood_ends_with_fewer_than_five_alarms_in_ten_minutes():
    alarms = Alarms()
    first = [fire(number) for number in range(6)]
    alarms.update(first, 0.0)
    rest = [fire(number) for number in range(10)]
    alarms.update(rest, 300.0)
    assert alarms.is_flood

    alarms.update(rest, 601.0)  # four are left in the window
    assert not alarms.is_flood
    assert len(texts(alarms)) == 10


def test_of_more_alarms_than_there_may_be_the_gravest_are_kept():
    alarms = Alarms()
    many = [fire(number, "low") for number in range(MAX_ALARMS)]
    alarms.update([*many, fire(9999, "critical")], 0.0)

    assert len(alarms.known) == MAX_ALARMS
    assert "event 9999" in alarms.known
    assert alarms.left_out == 1


def test_alarms_that_came_and_went_unseen_do_not_fill_the_memory():
    alarms = Alarms()
    for number in range(3 * MAX_ALARMS):
        alarms.update([fire(number)], float(number))

    assert len(alarms.known) <= 2 * MAX_ALARMS
    assert f"event {3 * MAX_ALARMS - 1}" in alarms.known


KEYS = st.integers(0, 3)


class AlarmLife(RuleBasedStateMachine):
    """Whatever happens, what is wrong is in sight or on a shelf with an end."""

    def __init__(self) -> None:
        super().__init__()
        self.alarms, self.now, self.on = Alarms(), 0.0, dict[int, str]()

    @rule(number=KEYS, priority=st.sampled_from(PRIORITIES), wait=st.floats(0, 400))
    def begins(self, number: int, priority: str, wait: float) -> None:
        self.on[number] = priority
        self.passes(wait)

    @rule(number=KEYS)
    def ends(self, number: int) -> None:
        self.on.pop(number, None)
        self.passes(0.0)

    @rule(wait=st.floats(0, 400))
    def passes(self, wait: float) -> None:
        self.now += wait
        self.alarms.update([fire(n, p) for n, p in self.on.items()], self.now)

    @rule(number=KEYS)
    def is_seen(self, number: int) -> None:
        self.alarms.acknowledge(f"event {number}", "ana")

    @rule(number=KEYS, seconds=st.floats(1, 300))
    def is_shelved(self, number: int, seconds: float) -> None:
        if f"event {number}" in self.alarms.known:
            self.alarms.shelve(f"event {number}", seconds, "ana", self.now)

    @invariant()
    def all_that_is_wrong_is_listed_or_shelved(self) -> None:
        shown = [*self.alarms.rows(self.now), *self.alarms.shelved(self.now)]
        count = sum(row["count"] for row in shown)
        assert count == len(self.alarms.known)
        assert {f"event {number}" for number in self.on} <= self.alarms.known.keys()

    @invariant()
    def what_is_over_is_returned_and_nothing_else(self) -> None:
        for alarm in self.alarms.known.values():
            is_returned = alarm.state is AlarmState.RETURNED
            assert is_returned == (not alarm.is_on)


TestAlarmLife = AlarmLife.TestCase
TestAlarmLife.settings = settings(max_examples=30, stateful_step_count=20, deadline=None)
