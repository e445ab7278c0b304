"""Rules of several DVAs: each checker sees its fault, and sees none in honest runs."""

import pytest

from dva_sim.agents.people.guard_protocol import GuardProtocol
from dva_sim.core.regions.division import Claim, Division
from dva_sim.core.regions.help import MutualHelp
from dva_sim.core.regions.strays import Strays
from dva_sim.core.regions.takeover import Deputy
from dva_sim.core.sessions import DvaAnswer
from dva_sim.protocol import messages as m
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.observations import terms_of
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import id_of
from dva_sim.simulation.full.verdicts import judged

HALL = {
    "site": {"name": "hall"},
    "robot": {"count": 0},
    "operator": {"count": 0},
    "guard": {"count": 2},
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


def hall(keep_traffic=False, **changes) -> Run:
    changed = {key.replace("__", "."): value for key, value in changes.items()}
    return Run(scenarios.build(HALL, changed), 1, keep_traffic)


def parted(at_s, for_s, *pairs):
    """Partitions that cut both ways between pairs of nodes."""
    both = [*pairs, *((b, a) for a, b in pairs)]
    gap = {"from_s": at_s, "for_s": for_s}
    return [{"source": a, "destination": b, **gap} for a, b in both]


ALONE = [("dva-east", "dva-west"), ("dva-east", "guard-*")]
"""The eastern DVA reaches its detectors and nobody else."""


def broken(run):
    return {rule for rule, _ in run.recorder.broken}


# --- honest runs -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "changes",
    [
        {"dva__deaths": [{"region": "east", "at_s": 20.0, "back_after_s": 40.0}]},
        {"dva__deaths": [{"region": "west", "at_s": 20.0}]},
        {"link__partitions": parted(3.0, 60.0, *ALONE)},
        {"link__partitions": parted(20.0, 60.0, *ALONE)},
        {"link__partitions": parted(20.0, 60.0, ("dva-east", "dva-west"))},
        {"events__0__position": [10, 20]},
        {"events__0__position": [10, 20], "dva__deaths": [{"region": "west", "at_s": 20.0}]},
        {"events__0__position": [10, 20], "dva__deaths": [{"region": "east", "at_s": 20.0}]},
    ],
)
def test_honest_dvas_break_no_rule_whoever_dies_or_is_parted(changes):
    run = hall(keep_traffic=True, **changes)
    run.clock.run(200.0)
    assert broken(run) == set()
    verdicts = judged(run.recorder.facts, terms_of(run.scenario))
    assert [v.rule for v in verdicts if v.is_broken] == []
    assert {"S12", "S13", "S14", "S15"} <= {v.rule for v in verdicts}


def test_an_incident_is_looked_at_once_after_a_partition():
    run = hall(link__partitions=parted(3.0, 60.0, *ALONE))
    run.clock.run(200.0)
    looked = [e for e in run.recording().events if e.state == "confirmed"]
    assert len(looked) == 1
    assert run.dvas[EAST].core.counters["event passed on"] == 1


def test_a_run_of_one_dva_is_judged_by_seven_rules():
    run = Run(scenarios.build({k: v for k, v in HALL.items() if k != "dva"}), 1, True)
    run.clock.run(10.0)
    verdicts = judged(run.recorder.facts, terms_of(run.scenario))
    assert [v.rule for v in verdicts] == [f"S{n}" for n in range(1, 8)]


# --- planted faults ----------------------------------------------------------------------------


@pytest.mark.invariant("S12")
def test_a_guard_that_obeys_two_dvas_breaks_s12(monkeypatch):
    honest = GuardProtocol.handle

    def handle(self, message, now):
        self.dva = message.source
        return honest(self, message, now)

    monkeypatch.setattr(GuardProtocol, "handle", handle)
    run = hall(events__0__at_s=100)
    run.clock.run(3.0)
    place = m.Position(*run.stage.site.frame.to_latlon(50, 20))
    run.dvas[WEST].device.ask(id_of("guard", 1), m.Order(7, "fire", place, None))
    run.clock.run(5.0)
    assert "S12" in broken(run)


@pytest.mark.invariant("S12")
def test_a_dva_that_orders_by_an_older_epoch_breaks_s12(monkeypatch):
    monkeypatch.setattr(Division, "learn", lambda self, region, claim: False)
    run = hall(events__0__at_s=40)
    run.dvas[WEST].core.division.claims["east"] = Claim(2, WEST)
    run.clock.run(60.0)
    assert "S12" in broken(run)


@pytest.mark.invariant("S13")
def test_a_deputy_that_confirms_copies_and_keeps_none_breaks_s13(monkeypatch):
    monkeypatch.setattr(Deputy, "keep", lambda *_: DvaAnswer())
    run = hall(dva__deaths=[{"region": "east", "at_s": 20.0}])
    run.clock.run(60.0)
    assert broken(run) == {"S13"}


@pytest.mark.invariant("S13")
def test_a_dva_that_lets_a_stray_go_untold_breaks_s13(monkeypatch):
    def pass_on(self, now):
        sends = honest(self, now)
        return [send for s in sends for send in self.taken(s, now)]

    honest = Strays.pass_on
    monkeypatch.setattr(Strays, "pass_on", pass_on)
    run = hall(link__partitions=parted(3.0, 60.0, *ALONE))
    run.clock.run(100.0)
    assert "S13" in broken(run)


@pytest.mark.invariant("S14")
def test_two_dvas_that_serve_one_region_after_a_partition_break_s14(monkeypatch):
    def learn(self, region, claim):
        return self.own == WEST and honest(self, region, claim)

    honest = Division.learn
    monkeypatch.setattr(Division, "learn", learn)
    run = hall(link__partitions=parted(3.0, 60.0, *ALONE))
    run.clock.run(120.0)
    assert "S14" in broken(run)


@pytest.mark.invariant("S14")
def test_dvas_that_look_at_one_event_twice_after_a_partition_break_s14(monkeypatch):
    monkeypatch.setattr(Strays, "pass_on", lambda *_: [])
    two = [
        {"kind": "fire", "position": [50, 20], "at_s": 10, "reported": True, "reports": 2},
    ]
    run = hall(events=two, link__partitions=parted(3.0, 60.0, *ALONE), guard__mobilisation_s=400)
    run.clock.run(30.0)
    place = m.Position(*run.stage.site.frame.to_latlon(50, 20))
    report = m.EventReport(None, "fire", place, 0.5, 0.9, "detected")
    guard = run.field.guards[0].device
    guard.ask(guard.dva, report)
    run.clock.run(120.0)
    assert "S14" in broken(run)


@pytest.mark.invariant("S15")
def test_a_helper_that_goes_on_when_it_is_told_to_stop_breaks_s15(monkeypatch):
    monkeypatch.setattr(MutualHelp, "end", lambda *_: [])
    run = hall(events__0__position=[10, 20], guard__mobilisation_s=300)
    run.dvas[WEST].core.roles.appoint(id_of("detector", 1), "dispatch")
    run.clock.run(20.0)
    detector = next(d for d in run.stage.devices if d.id_tag == id_of("detector", 1))
    detector.ask(WEST, m.FalseAlarm(1, "toast", None))
    run.clock.run(100.0)
    assert broken(run) == {"S15"}


@pytest.mark.invariant("S15")
def test_a_dva_that_promises_help_and_books_nothing_breaks_s15(monkeypatch):
    monkeypatch.setattr(MutualHelp, "give", lambda *_: DvaAnswer())
    run = hall(events__0__position=[10, 20])
    run.clock.run(20.0)
    assert broken(run) == {"S15"}
