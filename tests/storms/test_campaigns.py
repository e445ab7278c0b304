"""Campaigns: a journal that can be resumed, and the command."""

from types import SimpleNamespace

import pytest
from helpers.processes.command_line import ended
from helpers.studies.dask_cluster import DaskCluster
from helpers.wording import unnamed

from dva_sim.experiments.execution.executors import local
from dva_sim.kernel.recorder import Breach
from dva_sim.storms import campaign, shrinking, storm
from dva_sim.storms.campaign import Journal, StormTally, outcomes
from dva_sim.storms.outcome import StormOutcome


def outcome(seed: int, **of: object) -> StormOutcome:
    return StormOutcome(seed=seed, simulated_s=3600.0, digest="d", **of)


@pytest.fixture
def played(monkeypatch):
    """The seeds that are really played; storms cost nothing."""
    seeds = []
    monkeypatch.setattr(
        campaign, "play_seed", lambda seed, profile: seeds.append(seed) or outcome(seed)
    )
    return seeds


def play_all(file, seeds, profile="all"):
    return [o.seed for o, _ in outcomes(seeds, profile, Journal(file), local(1))]


def test_what_was_played_is_not_played_again(tmp_path, played):
    file = tmp_path / "storms.jsonl"
    assert play_all(file, range(3)) == [0, 1, 2]
    assert sorted(play_all(file, range(5))) == [0, 1, 2, 3, 4]
    assert played == [0, 1, 2, 3, 4]
    assert play_all(file, range(1), "nodes") == [0]
    assert played[-1] == 0


def test_what_another_version_has_played_is_played_again(tmp_path, played, monkeypatch):
    file = tmp_path / "storms.jsonl"
    play_all(file, range(2))
    monkeypatch.setattr(campaign, "fingerprint_of_storms", lambda: "another")
    assert play_all(file, range(2)) == [0, 1]
    assert played == [0, 1, 0, 1]
    assert play_all(file, range(2)) == [0, 1]
    assert played == [0, 1, 0, 1]


def test_a_journal_that_was_cut_short_loses_its_last_line_alone(tmp_path, played):
    file = tmp_path / "storms.jsonl"
    play_all(file, range(3))
    file.write_bytes(file.read_bytes()[:-20])
    assert sorted(key[1] for key in Journal(file).outcomes) == [0, 1]
    play_all(file, range(3))
    assert sorted(key[1] for key in Journal(file).outcomes) == [0, 1, 2]


def test_an_outcome_comes_back_from_the_journal(tmp_path):
    whole = outcome(7, breaches=[Breach("S1", "robot-1", 2.5, "moves", 3)])
    file = tmp_path / "storms.jsonl"
    Journal(file).keep("all", whole)
    assert Journal(file).outcomes["all", 7] == whole


def test_the_upper_limit_of_failures_is_that_of_poisson():
    tally = StormTally()
    for seed in range(100):
        tally.add(outcome(seed))
    assert tally.most_per_hour() == pytest.approx(0.02996, abs=1e-4)
    tally.add(outcome(100, breaches=[Breach("S1", "robot-1", 2.5, "moves")]))
    assert tally.failures == {100: ["S1"]}
    assert tally.most_per_hour() == pytest.approx(4.744 / 101, abs=1e-4)


def test_failures_are_reduced_at_the_end_and_once(tmp_path, monkeypatch):
    steps = []

    def failing(seed, profile):
        steps.append(f"played {seed}")
        breaches = [Breach("S1", "robot-1", 2.5, "moves")] if seed == 1 else []
        return outcome(seed, breaches=breaches)

    def shrunk(shrinker):
        steps.append(f"reduced {shrinker.plan.seed}")
        return shrinker.plan.with_faults(())

    def replayed(plan, before):
        before(SimpleNamespace(recorder=SimpleNamespace(timeline=[])))
        return failing(plan.seed, "none")

    monkeypatch.setattr(campaign, "play_seed", failing)
    monkeypatch.setattr(storm, "play", replayed)
    monkeypatch.setattr(shrinking.Shrinker, "shrink", shrunk)
    words = ("storm", "--seeds", "1:3", "--profile", "none", "-j", "1", "-o", tmp_path)
    assert ended(*words)[0] == 1
    assert steps == ["played 1", "played 2", "played 3", "reduced 1", "played 1"]
    found = tmp_path / "found"
    assert sorted(file.name for file in found.iterdir()) == ["none-1.txt", "none-1.yaml"]
    assert ended(*words)[0] == 1
    assert len(steps) == 5
    (found / "none-1.yaml").unlink()  # as if it had been killed while it reduced
    assert ended(*words)[0] == 1
    assert steps[5:] == ["reduced 1", "played 1"]


@pytest.mark.system
def test_storms_on_a_cluster_are_those_of_one_process(tmp_path):
    seeds = ["--seeds", "3:3", "--plays", "regions"]
    assert ended("storm", *seeds, "-j", "1", "-o", tmp_path / "here")[0] == 0
    with DaskCluster(tmp_path) as dask:
        dask.add_worker()
        assert ended("storm", *seeds, "--scheduler", dask.address, "-o", tmp_path / "there")[0] == 0
        code, _, told = ended("storm", *seeds, "--scheduler", dask.address, "-j", "2")
    assert (code, unnamed(told, "processes", "scheduler")) == (2, [])
    here, there = (Journal(tmp_path / name / "storms.jsonl") for name in ("here", "there"))
    digests = {key: outcome.digest for key, outcome in here.outcomes.items()}
    assert {key: outcome.digest for key, outcome in there.outcomes.items()} == digests
    assert len(digests) == 1
