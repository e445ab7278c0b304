from collections.abc import Callable

import pytest
from helpers.wording import unnamed

from dva_sim.network.emulator.needs import EmulatorError
from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network.real_side import measuring
from dva_sim.validation.network.real_side.cell import EmulatedJob, EmulatedOutcome
from dva_sim.validation.network.real_side.measuring import (
    COLUMNS,
    Progress,
    Row,
    describe_machine,
    make_job,
    measure_all,
)

SLOW, FAST = Condition("pub", 10), Condition("pub", 50)
Play = Callable[[Condition, int], None]


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Conditions measured, on a fake machine that answers at once."""
    return pretend(monkeypatch, lambda condition, seed: None)


def pretend(monkeypatch: pytest.MonkeyPatch, play: Play) -> list[tuple[str, int]]:
    calls: list[tuple[str, int]] = []

    def measure(condition: Condition, seed: int, link: str) -> Row:
        play(condition, seed)
        calls.append((condition.label, seed))
        return dict.fromkeys(COLUMNS, "1") | condition.to_row()

    def run_job(job: EmulatedJob) -> EmulatedOutcome:
        return EmulatedOutcome(way="root")

    monkeypatch.setattr(measuring, "measure", measure)
    monkeypatch.setattr(measuring, "run_job", run_job)
    return calls


def test_every_condition_comes_once_before_any_comes_twice(tmp_path, played):
    assert measure_all([SLOW, FAST], [1, 2], tmp_path / "own.csv") == []
    labels = [SLOW.label, FAST.label]
    assert played == [(label, seed) for seed in (1, 2) for label in labels]


def test_a_row_says_what_it_is_of(tmp_path, played):
    measure_all([SLOW], [7], tmp_path / "own.csv", group="blind")
    header, row = (tmp_path / "own.csv").read_text().splitlines()
    assert header.startswith("cell,group,seed,cond_id,pattern,hz,")
    assert row.startswith(f"blind_pub10_d0_j0_l0_r0_p5_s7,blind,7,{SLOW.hash},pub,10,")


def test_what_is_there_is_not_measured_again(tmp_path, played):
    measure_all([SLOW], [1, 2], tmp_path / "own.csv")
    reports: list[Progress] = []
    measure_all([SLOW, FAST], [1, 2], tmp_path / "own.csv", reports.append)
    assert played[2:] == [(FAST.label, 1), (FAST.label, 2)]
    assert [(progress.done, progress.total) for progress in reports] == [(2, 4), (3, 4), (4, 4)]
    assert reports[0].left_s > reports[1].left_s > reports[2].left_s == 0


def test_a_campaign_that_is_stopped_goes_on_where_it_was(tmp_path, monkeypatch):
    def stop_at_the_second(condition: Condition, seed: int) -> None:
        if seed == 2:
            raise KeyboardInterrupt

    pretend(monkeypatch, stop_at_the_second)
    with pytest.raises(KeyboardInterrupt):
        measure_all([SLOW], [1, 2, 3], tmp_path / "own.csv")
    again = pretend(monkeypatch, lambda condition, seed: None)
    measure_all([SLOW], [1, 2, 3], tmp_path / "own.csv")
    assert again == [(SLOW.label, 2), (SLOW.label, 3)]
    assert len((tmp_path / "own.csv").read_text().splitlines()) == 4


def test_a_run_that_fails_is_told_and_the_others_go_on(tmp_path, monkeypatch):
    def fail_once(condition: Condition, seed: int) -> None:
        if seed == 1:
            raise EmulatorError("there was no handshake within 60 s")

    pretend(monkeypatch, fail_once)
    reports: list[Progress] = []
    failures = measure_all([SLOW], [1, 2], tmp_path / "own.csv", reports.append)
    (failure,) = failures
    assert not unnamed(failure, f"own_{SLOW.label}_s1: ", "60 s")
    assert (reports[-1].done, reports[-1].total) == (1, 2)


def test_a_campaign_stops_when_nothing_works(tmp_path, monkeypatch):
    def fail(condition: Condition, seed: int) -> None:
        raise EmulatorError("the robot failed")

    pretend(monkeypatch, fail)
    reports: list[Progress] = []
    with pytest.raises(EmulatorError, match="the robot failed"):
        measure_all([SLOW], range(100), tmp_path / "own.csv", reports.append)
    assert len(reports) == 3


def test_two_conditions_with_one_seed_do_not_share_their_random_numbers():
    assert make_job(SLOW, 1).seed != make_job(FAST, 1).seed != make_job(FAST, 2).seed


def test_the_description_of_a_machine_names_nobody(played):
    machine = describe_machine("packets")
    text = " ".join(str(value) for value in machine.values())
    assert "/" not in text
    assert machine["libzmq"]
    assert machine["cores"]
