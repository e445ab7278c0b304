"""Several DVAs in one run: passed on, lent, copied, taken over, and back; no rule is broken."""

import pytest

from dva_sim.agents.device import AgentDevice
from dva_sim.core.regions.leases import Leases
from dva_sim.protocol import messages as m
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.regional_agent import NOT_COPIED
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import id_of

HALL = {
    "site": {"name": "hall"},
    "robot": {"count": 1},
    "operator": {"count": 1},
    "guard": {"count": 2},
    "control": "supervisory",
    "events": [{"kind": "fire", "position": [50, 20], "at_s": 5, "reported": True}],
    "dva": {
        "regions": {
            "west": {"polygon": [[0, 0], [30, 0], [30, 40], [0, 40]]},
            "east": {"rest": True},
        }
    },
    "horizon_s": 200,
}
WEST, EAST = id_of("dva", 1), id_of("dva", 2)
GUARD = id_of("guard", 2)


def hall(**changes) -> Run:
    run = Run(scenarios.build(HALL, {k.replace("__", "."): v for k, v in changes.items()}), 1)
    run.stage.recorder.keeps = True
    return run


def caller(run, x, y, dva) -> AgentDevice:
    """A device that is registered with a DVA."""
    device = run.stage.device("detector", 90, (x, y))
    device.dva = dva
    device.register()
    return device


def report(run, device, x, y, answers) -> None:
    place = m.Position(*run.stage.site.frame.to_latlon(x, y))
    body = m.EventReport(None, "flood", place, 0.5, 0.9, "detected")
    device.ask(device.dva, body, answers.append, lambda: answers.append(None))


def counts(run):
    return run.recorder.counters


def open_events(run, dva):
    return [e.number for e in run.dvas[dva].core.events.open.values()]


def test_devices_register_with_the_dva_of_their_place():
    run = hall()
    run.clock.run(3.0)
    west, east = (run.dvas[dva].core.registry.entries for dva in (WEST, EAST))
    assert {id_of("robot", 1), id_of("operator", 1), EAST} <= west.keys()
    assert {id_of("guard", 1), id_of("guard", 2), WEST} <= east.keys()
    assert not west.keys() & east.keys()


def test_a_report_about_another_region_is_booked_there_once_and_answered():
    run = hall()
    device, answers = caller(run, 5, 5, WEST), []
    run.clock.run(2.0)
    report(run, device, 40, 5, answers)
    run.clock.run(3.0)
    assert [reply.code for reply in answers] == [m.OK]
    assert open_events(run, WEST) == []
    assert open_events(run, EAST) == [1_000_001]
    assert counts(run)["reports passed on"] == 1


def test_a_report_that_the_other_dva_does_not_take_within_three_seconds_is_kept_here():
    run = hall()
    device, answers = caller(run, 5, 5, WEST), []
    run.clock.run(2.0)
    run.end_dva(2)
    report(run, device, 40, 5, answers)
    run.clock.run(4.9)
    assert answers == []
    run.clock.run(5.5)
    assert [(reply.code, reply.text) for reply in answers] == [(m.OK, "unreplicated")]
    assert open_events(run, WEST) == [1]


def test_a_report_is_answered_once_the_deputy_has_its_copy():
    run = hall()
    device, answers = caller(run, 5, 5, WEST), []
    run.clock.run(2.0)
    report(run, device, 10, 5, answers)
    run.clock.run(2.2)
    assert [(reply.code, reply.text) for reply in answers] == [(m.OK, "")]
    assert list(run.dvas[EAST].core.deputy.copies["west"]) == [1]


def test_a_report_without_a_copy_is_answered_as_unreplicated_after_300_ms_and_counted():
    run = hall()
    device, answers = caller(run, 5, 5, WEST), []
    run.clock.run(2.0)
    run.end_dva(2)
    report(run, device, 10, 5, answers)
    run.clock.run(2.25)
    assert answers == []
    run.clock.run(2.4)
    assert [(reply.code, reply.text) for reply in answers] == [(m.OK, "unreplicated")]
    assert counts(run)[NOT_COPIED] == 1


def test_a_dva_without_robots_in_hand_lends_a_guard_and_gets_him_back():
    run = hall(robot__count=0, events__0__position=[10, 20])
    recording = run.run()
    assert [(e.number, e.state, e.responder) for e in recording.events] == [(1, "confirmed", EAST)]
    assert not run.dvas[EAST].core.help.copies
    assert not run.dvas[EAST].core.orders.engaged
    assert not recording.recorder.broken


DEATH = [{"region": "east", "at_s": 20.0}]


def test_a_deputy_goes_on_where_a_dva_was_killed_while_a_guard_was_under_way():
    run = hall(dva__deaths=DEATH)
    recording = run.run()
    (event,) = recording.events
    assert (event.number, event.state) == (1_000_001, "confirmed")
    assert event.times["assigned"] < 20.0
    assert run.dvas[WEST].core.division.claims["east"] == (2, WEST)
    assert {guard.device.dva for guard in run.field.guards} == {WEST}
    assert not recording.recorder.broken


@pytest.mark.parametrize("at_s", [67.0, 69.0])  # before the guard arrives, and before he has looked
def test_what_a_guard_finds_while_his_dva_dies_is_reported_to_the_deputy(at_s):
    run = hall(dva__deaths=[{"region": "east", "at_s": at_s}], horizon_s=100.0)
    recording = run.run()
    (event,) = recording.events
    assert (event.number, event.state, event.responder) == (1_000_001, "confirmed", GUARD)
    assert at_s < event.times["confirmed"] < at_s + 25.0
    assert not run.dvas[WEST].core.orders.engaged
    assert not recording.recorder.broken


@pytest.mark.parametrize("at_s", [22.0, 60.0])
def test_the_next_event_of_a_dead_dvas_region_is_assigned_in_time(at_s):
    events = [{"kind": "fire", "position": [50, 20], "at_s": at_s, "reported": True}]
    run = hall(dva__deaths=DEATH, events=events)
    run.clock.run(max(20.0 + 25.0, at_s + 10.0))
    (event,) = run.dvas[WEST].core.events.open.values()
    assert event.state == "assigned"
    assert not run.recorder.broken


def test_a_dva_that_is_back_serves_no_region_and_is_the_deputy():
    run = hall(dva__deaths=[{"region": "east", "at_s": 20.0, "back_after_s": 40.0}])
    device, answers = caller(run, 5, 5, WEST), []
    run.clock.run(70.0)
    assert dict(run.dvas[EAST].core.division.served()) == {}
    assert dict(run.dvas[WEST].core.division.served()) == {"west": 1, "east": 2}
    report(run, device, 50, 5, answers)
    run.clock.run(71.0)
    assert [(reply.code, reply.text) for reply in answers] == [(m.OK, "")]
    assert run.dvas[EAST].core.deputy.copies["east"]
    assert not run.recorder.broken


def test_a_device_obeys_the_last_dva_until_the_other_has_confirmed():
    run = hall()
    run.clock.run(3.0)
    guard = run.field.guards[0].device
    run.network.leave(WEST)
    hand_over = m.HandOver(WEST)
    answers = []
    run.dvas[EAST].device.ask(guard.id_tag, hand_over, answers.append)
    run.clock.run(8.0)
    assert [reply.code for reply in answers] == [m.OK]
    assert guard.dva == EAST
    run.network.come_back(WEST)
    run.clock.run(14.0)
    assert guard.dva == WEST


@pytest.mark.parametrize(
    ("source", "dva", "code"),
    [(WEST, WEST, m.NOT_PERMITTED), (EAST, "02:00:00:00:00:09", m.UNKNOWN_DEVICE)],
)
def test_a_device_takes_a_hand_over_only_from_its_dva_and_to_one_that_it_knows(source, dva, code):
    run = hall()
    run.clock.run(3.0)
    guard, answers = run.field.guards[0].device, []
    run.dvas[source].device.ask(guard.id_tag, m.HandOver(dva), answers.append)
    run.clock.run(5.0)
    assert [reply.code for reply in answers] == [code]
    assert guard.dva == EAST


def test_the_same_seed_gives_the_same_run_of_several_dvas():
    one, other = (hall(dva__deaths=DEATH).run() for _ in range(2))
    assert one.recorder.timeline == other.recorder.timeline


# --- the backbone ----------------------------------------------------------------------------


def reported(**changes):
    """The answer to a report of the west, and the time that it took [s]."""
    run = hall(**changes)
    device, answers = caller(run, 10, 5, WEST), []
    run.clock.run(4.0)
    report(run, device, 10, 5, answers)
    while not answers:
        run.clock.run(run.clock.now + 0.01)
    return answers[0].text, run.clock.now - 4.0


def test_a_report_waits_for_its_copy_to_cross_the_backbone_and_back():
    text, took = reported(dva__backbone={"delay_s": 0.1})
    assert text == ""
    assert 0.2 <= took < 0.25
    assert reported()[1] < 0.05


def test_over_a_backbone_of_300_ms_a_report_is_answered_before_its_copy():
    text, took = reported(dva__backbone={"delay_s": 0.3})
    assert text == "unreplicated"
    assert took == pytest.approx(0.3, abs=0.05)


def test_an_outage_of_the_backbone_parts_dvas_and_nobody_else():
    run = hall(dva__backbone={"outages": [{"from_s": 10, "for_s": 60}]})
    run.clock.run(40.0)
    assert run.dvas[WEST].core.registry.entries[EAST].silent
    assert not run.dvas[EAST].core.registry.entries[id_of("guard", 1)].silent
    assert run.dvas[WEST].core.division.claims["east"] == (1, EAST)
    run.clock.run(90.0)
    assert not run.dvas[WEST].core.registry.entries[EAST].silent
    assert not run.recorder.broken


def test_a_deputy_hears_of_the_end_of_an_event_after_an_outage():
    run = hall(dva__backbone={"outages": [{"from_s": 65.0, "for_s": 20.0}]})
    run.clock.run(84.0)
    (event,) = run.dvas[EAST].core.events.closed.values()
    assert 65.0 < event.times["closed"] < 84.0
    assert [*run.dvas[WEST].core.deputy.copies["east"]] == [event.number]
    run.clock.run(100.0)
    assert not run.dvas[WEST].core.deputy.copies["east"]


def test_the_same_seed_gives_the_same_run_over_a_backbone_with_losses():
    lossy = {"delay_s": 0.05, "jitter_s": 0.02, "loss": 0.2}
    one, other = (hall(dva__backbone=lossy).run() for _ in range(2))
    assert one.recorder.timeline == other.recorder.timeline
    assert not one.recorder.broken


# --- deaths ----------------------------------------------------------------------------------


def test_a_death_without_a_region_strikes_a_dva_and_a_moment_of_the_seed():
    found = set()
    for seed in range(1, 9):
        run = Run(scenarios.build(HALL, {"dva.deaths": [{"at_s": 5, "latest_s": 15}]}), seed)
        run.clock.run(5.0)
        assert not any(dva.is_gone for dva in run.dvas.values())
        run.clock.run(15.0)
        found |= {dva.device.id_tag for dva in run.dvas.values() if dva.is_gone}
    assert found == {WEST, EAST}


def test_after_the_death_of_the_only_dva_nobody_is_sent():
    one = {key: value for key, value in HALL.items() if key != "dva"}
    run = Run(scenarios.build(one, {"dva.deaths": [{"at_s": 2}], "horizon_s": 60}), 1)
    recording = run.run()
    assert recording.events == []
    assert recording.duration == 60.0


def driven_while_its_dva_dies():
    """A run in which the western robot is driven to a fire when its DVA dies, 25 s later."""
    run = hall(
        control="direct",
        guard__count=0,
        events__0__position=[25, 35],
        dva__deaths=[{"region": "west", "at_s": 12.0}],
    )
    run.clock.run(11.0)
    robot = next(iter(run.field.robots.values()))
    session = robot.controller.grant.session
    assert run.dvas[WEST].core.sessions.permissions.grants[id_of("robot", 1)].session == session
    run.clock.run(37.0)
    assert robot.device.dva == EAST
    return run, session


def test_a_permission_holds_at_the_deputy_while_its_drive_goes_on():
    run, session = driven_while_its_dva_dies()
    grant = run.dvas[EAST].core.sessions.permissions.grants[id_of("robot", 1)]
    assert (grant.holder, grant.session) == (id_of("operator", 1), session)
    run.clock.run(200.0)
    assert [drive.outcome for drive in run.recorder.drives] == ["confirmed"]
    assert not run.dvas[EAST].core.sessions.permissions.grants
    assert not run.recorder.broken


def test_a_robot_tells_its_dva_who_drives_it_if_that_one_was_started_again():
    again = {"region": "west", "at_s": 12.0, "back_after_s": 3.0}
    run = hall(control="direct", events__0__position=[10, 20], dva__deaths=[again])
    run.clock.run(11.0)
    robot = next(iter(run.field.robots.values()))
    session = robot.controller.grant.session
    run.clock.run(20.0)
    assert robot.device.dva == WEST
    grants = run.dvas[WEST].core.sessions.permissions.grants
    assert grants[id_of("robot", 1)].session == session
    assert not run.recorder.broken


def test_a_deputy_that_believes_no_robot_knows_no_holder(monkeypatch):
    monkeypatch.setattr(Leases, "bring", lambda *_: None)
    run, _ = driven_while_its_dva_dies()
    assert not run.dvas[EAST].core.sessions.permissions.grants
