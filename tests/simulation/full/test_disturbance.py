"""A drive that is disturbed at a stated moment, and when its operator knows."""

from typing import Any

import pytest

import dva_sim
from dva_sim.agents.robot.controller import LEASE_S
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.measures.episodes import measures_of, run_row
from dva_sim.simulation.measures.workload import operator_rows

KINDS = ("revoke", "take_over", "refuse")
PATTERNS = ("req-rep", "latest-wins")


def disturbed(pattern: str, kind: str, heeds: bool = True, **changes: Any) -> Run:
    """A run until a little after the robot has been told."""
    of_it = {"disturbance.kind": kind, "disturbance.holder_told": False, "command.heeds": heeds}
    base = {"pattern": pattern, "link.delay_s": 0.1, "horizon_s": 40} | of_it | changes
    return Run(scenarios.build(scenarios.load("drive-to-event"), base), 1)


@pytest.mark.invariant("S2", "S5")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_who_heeds_refusals_knows_within_two_seconds(pattern, kind):
    recording = disturbed(pattern, kind).run()
    row = run_row(recording)
    assert row["driven_on_s"] < 2.0
    assert row["commands_in_vain"] <= 20
    assert (row["alerted"], row["drive_outcome"], row["violations"]) == (True, "refused", 0)
    (of_operator,) = operator_rows(recording)
    assert of_operator["refused_drives"] >= 1
    assert "not permitted" in of_operator["refusals"]


@pytest.mark.parametrize("pattern", PATTERNS)
def test_as_the_document_has_it_nobody_knows_for_long(pattern):
    row = run_row(disturbed(pattern, "revoke", heeds=False).run())
    assert row["driven_on_s"] > 10.0
    assert not row["alerted"]


PATIENT = {"operator.person": 4, "link.delay_s": 0.05, "horizon_s": 75, "disturbance.after_s": 10}
PATIENT_SEED = 8925906438681307792  # with which that person drives on for longer than the lease


@pytest.mark.invariant("S2")
def test_commands_that_are_refused_hold_no_robot():
    of_it = {"disturbance.kind": "refuse", "disturbance.holder_told": False, "command.heeds": False}
    changes = PATIENT | of_it | {"pattern": "pipelined"}
    row = dva_sim.episode("drive-to-event", seed=PATIENT_SEED, set=changes).measures
    assert row["commands_in_vain"] > 10 * (LEASE_S - 10.0)
    assert row["violations"] == 0


def test_what_is_told_by_the_dva_is_known_at_once_by_every_pattern():
    row = run_row(disturbed("pub-sub", "revoke", **{"disturbance.holder_told": True}).run())
    assert row["driven_on_s"] < 0.1
    assert row["drive_outcome"] == "gave up"


def test_of_a_run_without_disturbance_nothing_is_measured_of_one():
    scenario = scenarios.load("drive-to-event")
    assert "driven_on_s" not in measures_of(scenarios.build(scenario, {}))
    assert "disturbance" not in scenarios.build(scenario, {}).model_dump()
    assert "driven_on_s" in measures_of(scenarios.build(scenario, {"disturbance.kind": "revoke"}))


def until(run: Run, condition: Any, limit: float) -> None:
    end = run.clock.now + limit
    while not condition():
        assert run.clock.now < end
        run.clock.run(run.clock.now + 0.5)


# --- who says OK and does nothing -----------------------------------------------------------


@pytest.mark.invariant("S6")
def test_a_guard_that_says_ok_and_only_lives_on_holds_no_event():
    base = {"robot.count": 0, "guard.count": 2, "guard.mobilisation_s": 5, "horizon_s": 200}
    changes = base | {"operator.count": 0, "dispatch.depart_within_s": 60}
    run = Run(scenarios.build(scenarios.load("drive-to-event"), changes), 1)
    liars = list(run.field.guards)
    for guard in liars:
        guard._take_up = lambda errand: None  # type: ignore[method-assign]
    run.clock.run(30.0)
    (event,) = run.dva.events.values()
    first = event.responder
    until(run, lambda: event.responder not in (None, first), 100.0)
    assert 60.0 < run.clock.now < 75.0
    assert run.dva.core.counters["did not set out"] == 1
    assert run.recorder.violations == {}
