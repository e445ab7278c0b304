"""Severity that moves by what the DVA learns, where its rules let it; each step has a reason."""

import pytest
from helpers.dva.dispatch_office import (
    DETECTOR,
    DVA,
    GUARD,
    OTHER_DETECTOR,
    ROBOT,
    Office,
    east,
)
from helpers.wording import unnamed

from dva_sim.core.assignments import Rules
from dva_sim.core.sensing import VALUES_IN_A_ROW, Sensing, SensorAlarm
from dva_sim.protocol import messages as m

THIRD_DETECTOR = "02:00:00:04:00:03"
ALARM = 0.3  # of smoke [1/m]


def office_of(moves: bool = True) -> Office:
    """Three detectors, and a DVA that heeds smoke."""
    rules = Rules(escalate_after=1000.0, severity_moves=moves)
    office = Office(rules=rules, sensing=Sensing({"smoke": SensorAlarm("fire", ALARM)}))
    office.core.sessions.permissions.own = DVA
    for detector in (OTHER_DETECTOR, THIRD_DETECTOR):
        office.register(detector, "Sensor")
    return office


def report(office: Office, severity: float, source: str = DETECTOR, now: float = 1.0) -> None:
    body = m.EventReport(None, "fire", east(12), severity, 0.5, "detected")
    assert office.say(source, body, now)[0].code == m.OK


def steps(office: Office) -> list[tuple[str | None, str]]:
    """Severity and reason of each step since the last call."""
    facts = office.core.trail.take()
    return [(fact.text, fact.cause) for fact in facts if fact.action == "severity"]


def test_a_graver_report_raises_the_severity_and_the_reason_names_who_reports():
    office = office_of()
    report(office, 0.2)
    report(office, 0.6, OTHER_DETECTOR)
    assert office.event(1).severity == 0.6
    label = office.core.orders.label_of(OTHER_DETECTOR)
    [(severity, reason)] = steps(office)
    assert (severity, label in reason) == ("high", True)


def test_a_step_within_a_word_has_no_reason_and_a_lower_report_changes_nothing():
    office = office_of()
    report(office, 0.1)
    report(office, 0.2, OTHER_DETECTOR)
    report(office, 0.15)
    assert office.event(1).severity == 0.2
    assert steps(office) == []


def test_three_devices_that_report_it_make_it_high():
    office = office_of()
    for source in (DETECTOR, OTHER_DETECTOR, OTHER_DETECTOR):
        report(office, 0.2, source)
    assert office.event(1).severity == 0.2
    report(office, 0.2, THIRD_DETECTOR)
    assert office.event(1).severity == 0.5
    assert steps(office) == [("high", "3 devices report it")]


def test_a_robots_sensor_counts_once_it_has_stood_above_its_alarm_level_for_some_values():
    office = office_of()
    report(office, 0.1)
    for number in range(VALUES_IN_A_ROW):
        assert office.event(1).severity == 0.1
        office.shows(ROBOT, "smoke", 3.2 * ALARM, now=2.0 + number)
    assert office.event(1).severity == pytest.approx(0.8)
    [(severity, reason)] = steps(office)
    assert (severity, unnamed(reason, "smoke", "robot", "3.2")) == ("critical", [])


def test_one_value_far_above_the_others_is_no_reason():
    office = office_of()
    report(office, 0.1)
    for number, times in enumerate((1.1, 9.0, 1.2)):
        office.shows(ROBOT, "smoke", times * ALARM, now=2.0 + number)
    assert office.event(1).severity == pytest.approx(0.275)


def test_a_finding_counts_as_grave_as_it_says():
    office = office_of()
    report(office, 0.1)
    office.finds(office.event(1).holder, "confirmed", 9.0)
    assert office.event(1).severity == 0.5
    (step,) = steps(office)
    assert step[0] == "high"
    assert step[1].endswith("confirms it")


def test_a_detector_that_goes_on_reporting_what_was_found_raises_no_second_event():
    office = office_of()
    report(office, 0.2)
    office.finds(office.event(1).holder, "confirmed", 9.0)
    report(office, 0.9, now=20.0)
    assert office.core.events.total == 1
    assert office.event(1).severity == 0.9


def test_a_detector_that_goes_on_reporting_what_was_refuted_is_heard():
    office = office_of()
    report(office, 0.2)
    office.finds(office.event(1).holder, "refuted", 9.0)
    report(office, 0.9, now=20.0)
    assert office.core.events.total == 2


def test_severity_is_the_highest_reported_where_it_does_not_move():
    office = office_of(moves=False)
    report(office, 0.1)
    report(office, 0.2, OTHER_DETECTOR)
    report(office, 0.15, THIRD_DETECTOR)
    for number in range(VALUES_IN_A_ROW):
        office.shows(ROBOT, "smoke", 5 * ALARM, now=2.0 + number)
    office.finds(office.event(1).holder or GUARD, "confirmed", 9.0)
    assert office.event(1).severity == 0.2
    assert steps(office) == []
