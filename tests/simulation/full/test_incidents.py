"""Incidents: false reports, duplicate reports, and containment."""

import math
from typing import Any

import pytest
from helpers.wording import unnamed

from dva_sim.core.events import Event, State
from dva_sim.kernel.streams import Streams
from dva_sim.protocol import messages as m
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.hazards import HEARSAY_LATE, HEARSAY_WITHIN, draw_incidents
from dva_sim.simulation.full.physical_world import Field, is_dangerous
from dva_sim.simulation.full.recording import Recording, event_about
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import id_of
from dva_sim.simulation.scenario import EventConfig
from dva_sim.worlds.hazards import CLEAR
from dva_sim.worlds.site import load_site

LATE = 400.0  # by then the fire of these tests burns well [s]


def in_danger(field: Field, x: float, y: float, now: float) -> bool:
    """True if somebody there is exposed [m, s], as a run counts it."""
    near = field.is_near(field.dangers(now), x, y)
    return near or is_dangerous(field.surroundings.at(x, y, now))


def scenario(event: dict[str, Any], **changes: Any) -> scenarios.Scenario:
    """A fire in the chemistry lab, which is reported at once; two guards, or what is changed."""
    fire = {"kind": "fire", "room": "Chemistry lab", "reported": True} | event
    fire.setdefault("hazard", {"growth": "slow"})  # so that a guard can come near in time
    team = {"robot": {"count": 0}, "guard": {"count": 2}, "horizon_s": 600}
    return scenarios.build({"events": [fire]} | team, changes)


def run(event: dict[str, Any], seed: int = 1, **changes: Any) -> tuple[Run, Recording]:
    played = Run(scenario(event, **changes), seed)
    return played, played.run()


def around(played: Run) -> tuple[float, float]:
    """A place a metre from the fire."""
    x, y = played.field.incidents[0].hazard.position
    return x + 1.0, y


# --- a growing hazard ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "attended", "follows"),
    [
        ({}, False, False),
        ({}, True, True),
        ({"dva.severity": "followed"}, False, True),
        ({"dva.severity": "reported"}, True, False),
    ],
)
def test_severity_moves_at_a_console_or_where_a_scenario_says_so(changes, attended, follows):
    stage = Run(scenario({}, **changes), 1).stage
    stage.attended = attended
    assert stage.follows_severity == follows


def test_who_has_reported_a_hazard_reports_again_as_it_grows():
    changes = {"guard.count": 1, "guard.mobilisation_s": 500, "dva.severity": "followed"}
    played, _ = run({"hazard": {"growth": "fast"}}, **changes)
    told = [(fact.text, fact.cause) for fact in played.dva.facts if fact.action == "severity"]
    assert told == [
        ("medium", "caller reports it as graver"),
        ("high", "caller reports it as graver"),
        ("critical", "caller reports it as graver"),
    ]


# --- false alarms ----------------------------------------------------------------------


def test_a_false_alarm_is_where_and_when_the_real_one_would_be():
    real, alarm = (
        Run(scenario({"false_alarm": false, "latest_s": 60.0}), 7).field.incidents[0]
        for false in (False, True)
    )
    assert (real.hazard, real.start, real.detected) == (alarm.hazard, alarm.start, alarm.detected)
    assert (real.false_alarm, alarm.false_alarm) == (False, True)


def test_of_a_false_alarm_nothing_is_seen_felt_or_dangerous():
    for false_alarm in (False, True):
        field = Run(scenario({"false_alarm": false_alarm}), 1).field
        x, y = field.incidents[0].hazard.position
        assert in_danger(field, x, y, LATE) is not false_alarm
        assert bool(field.spots(LATE)) is not false_alarm
        assert (field.surroundings.at(x + 1.0, y, LATE).heat_flux > 0.0) is not false_alarm


def test_a_guard_refutes_a_false_alarm_and_nobody_was_in_danger():
    played, recording = run({"false_alarm": True})
    assert [event.state for event in recording.events] == [State.REFUTED]
    assert sum(played.recorder.exposure.values()) == 0.0
    assert not any("breaks out" in moment.what for moment in played.recorder.timeline)


def test_an_operator_refutes_a_false_alarm():
    team = {"robot.count": 1, "guard.count": 0}
    _, recording = run({"false_alarm": True}, **team)
    assert [event.state for event in recording.events] == [State.REFUTED]


# --- several reports -------------------------------------------------------------------


def test_others_report_the_same_some_seconds_later_and_some_metres_off():
    site = load_site("caparica")
    event = EventConfig(kind="fire", room="Canteen", reported=True, reports=5)
    for seed in range(20):
        [incident] = draw_incidents((event,), site, Streams(seed))
        assert len(incident.hearsay) == 4
        for heard in incident.hearsay:
            assert HEARSAY_LATE[0] <= heard.time - incident.detected <= HEARSAY_LATE[1] == 20.0
            assert math.dist(heard.position, incident.hazard.position) <= HEARSAY_WITHIN == 3.0
            assert site.room_at(*heard.position) == "Canteen"


def test_how_many_report_an_event_changes_nothing_else_of_it():
    one, five = (Run(scenario({"reports": n}), 3).field.incidents[0] for n in (1, 5))
    assert (one.hazard, one.start, one.detected) == (five.hazard, five.start, five.detected)


def test_three_reports_of_one_fire_are_one_event_to_the_dva():
    _, recording = run({"reports": 3})
    assert [(e.state, e.reports) for e in recording.events] == [(State.CONFIRMED, 3)]
    callers = [moment.who for moment in recording.recorder.timeline if "reports" in moment.what]
    assert callers == ["caller", *sorted(callers[1:])]
    assert len(set(callers)) == 3
    assert unnamed(callers[1:], "2 of event 1", "3 of event 1") == []


def test_all_who_report_have_ids_of_their_own():
    fires = [{"kind": "fire", "room": "Canteen", "reported": True, "reports": 3}] * 2
    played = Run(scenarios.build({"events": fires, "guard": {"count": 1}}), 1)
    detectors = [tag for tag in played.stage.labels if tag.startswith("02:00:00:04")]
    assert detectors == [id_of("detector", number) for number in (1, 3, 4, 2, 5, 6)]


# --- containment -----------------------------------------------------------------------


def test_what_a_guard_has_contained_is_not_there_any_more():
    played = Run(scenario({}), 1)
    field, (x, y) = played.field, Run(scenario({}), 1).field.incidents[0].hazard.position
    played.clock.run(LATE)
    field.contained.clear()
    assert field.is_there("fire", x, y)
    field.contain("gas_leak", x, y)
    field.contain("fire", x + 10.0, y)
    assert field.is_there("fire", x, y)
    flames = field.surroundings.at(x + 1.0, y, LATE).heat_flux
    field.contain("fire", x + 1.0, y)
    assert not field.is_there("fire", x, y)
    assert not field.is_near(field.dangers(LATE), x, y)
    # The hot smoke under the ceiling still radiates.
    assert field.surroundings.at(x + 1.0, y, LATE + 0.1).heat_flux < 0.1 * flames
    assert field.contained == {0: LATE}


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_where_the_dva_wants_it_a_fire_is_confirmed_and_contained(seed):
    played, recording = run({"room": "Canteen"}, seed, **{"dispatch.containment": True})
    [event] = recording.events
    assert event.state is State.CONTAINED
    when = played.field.contained[0]
    assert event.times["confirmed"] < when <= event.times["contained"] + 0.01
    x, y = around(played)
    assert in_danger(played.field, x, y, when - 0.1)
    assert not in_danger(played.field, x, y, when)
    assert not played.recorder.violations


def test_without_a_word_on_containment_nobody_contains():
    played, recording = run({})
    assert [event.state for event in recording.events] == [State.CONFIRMED]
    assert played.field.contained == {}


def test_a_robot_looks_and_a_guard_contains():
    team = {"robot.count": 1, "guard.count": 1, "dispatch.containment": True}
    played, recording = run({"room": "Canteen"}, **team)
    assert [event.state for event in recording.events] == [State.CONTAINED]
    assert list(played.field.contained) == [0]


# --- danger ----------------------------------------------------------------------------


def test_a_wall_keeps_one_out_of_danger_that_is_near_but_not_of_air_that_comes_through():
    field = Run(scenario({"room": "North office", "hazard": {"growth": "ultrafast"}}), 1).field
    x, y = field.incidents[0].hazard.position
    far = 0.9 * field.incidents[0].hazard.danger_radius(75.0)
    sees = field.stage.planner.line_of_sight
    around = [(x + far * math.cos(a / 2), y + far * math.sin(a / 2)) for a in range(13)]
    hidden = [p for p in around if not sees((x, y), p)]
    assert 0 < len(hidden) < len(around)
    for place in around:
        assert in_danger(field, *place, 75.0) is (place not in hidden)
    field.surroundings.at = lambda *_: CLEAR._replace(explosive=0.3)  # type: ignore[method-assign]
    assert in_danger(field, *hidden[0], 75.0)


def test_an_event_that_only_a_robot_felt_is_about_what_is_farther_off():
    run = Run(scenarios.build(scenarios.load("drive-to-event"), {}), 1)
    incident, site = run.field.incidents[0], run.stage.site
    x, y = incident.hazard.position
    place = m.Position(*site.frame.to_latlon(x + 15.0, y))
    robot = id_of("robot", 1)
    felt = Event(1, incident.kind, place, 0.5, sources={robot: 0.6})
    seen = Event(2, incident.kind, place, 0.5, sources={id_of("detector", 1): 0.9})
    assert event_about(incident, [felt], site, {robot}) is felt
    assert event_about(incident, [seen], site, {robot}) is None


@pytest.mark.system
@pytest.mark.parametrize("heeded", [(), ("gas",)])
def test_a_leak_that_no_detector_notices_is_smelt_by_a_robot_on_its_round(heeded):
    changes: dict[str, Any] = {
        "events": [{"kind": "gas_leak", "room": "Canteen", "at_s": 20}],
        "patrols": [{"robot": "robot-1", "places": ["Canteen", "Main corridor"]}],
        "dva.sensors": heeded,
    }
    run = Run(scenarios.build(scenarios.load("drive-to-event"), changes), 1)
    run.clock.run(140.0)
    events = list(run.dva.events.values())
    assert [e.kind for e in events] == ["gas_leak"] * len(heeded)
    assert [set(e.sources) for e in events] == [{id_of("robot", 1)}] * len(heeded)
    assert run.recorder.violations == {}
