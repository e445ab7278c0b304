"""Budgets of cost: the file, the check, and a slowdown that it catches."""

import shutil
import subprocess

import pytest
from benchmarks import budget, counting, meter, startup
from benchmarks.budget import Budget
from benchmarks.cases import CASES, LOOP
from helpers.paths import ROOT

HEAD = "case,unit,budget,reason\n"
BUDGETS = {
    LOOP: Budget(LOOP, "instructions", 1e7, "the unit"),
    "a drive": Budget("a drive", "loops", 0.5, "as measured"),
    "a study": Budget("a study", "MB", 200.0, "as measured"),
}


def test_every_budget_has_a_reason_and_something_that_measures_it():
    for name, row in budget.read(ROOT / budget.FILE).items():
        assert row.reason != "unset"
        command = name.removeprefix(startup.PREFIX)
        assert name in CASES or command in startup.COMMANDS or name == budget.STUDY


@pytest.mark.parametrize(
    ("row", "problem"),
    [
        ("a drive,loops,0.5,", "no reason"),
        ("a drive,loops,0.5,  ", "no reason"),
        ("a drive,loops,0,fast", "must be above 0"),
        ("a drive,loops,nan,fast", "must be above 0"),
        ("a drive,hours,1,fast", "unit 'hours'; write loops"),
        ("a drive,loops,1,fast\na drive,loops,2,slow", "has a budget already"),
    ],
)
def test_a_row_that_says_too_little_is_refused_with_its_line(tmp_path, row, problem):
    file = tmp_path / "budgets.csv"
    file.write_text(f"{HEAD}{row}\n")
    with pytest.raises(ValueError, match=rf"budgets\.csv:\d: .*{problem}"):
        budget.read(file)


def test_a_file_that_is_written_is_read_again(tmp_path):
    budget.write(tmp_path / "budgets.csv", BUDGETS)
    assert budget.read(tmp_path / "budgets.csv") == BUDGETS


@pytest.mark.parametrize("name", ["a drive", "a study"])
@pytest.mark.parametrize(
    ("share", "is_missed"), [(1.05, True), (1.01, False), (1.0, False), (0.99, False), (0.95, True)]
)
def test_a_change_beyond_three_per_cent_is_told_with_both_numbers(name, share, is_missed):
    costs = {row.case: row.budget for row in BUDGETS.values()}
    costs[name] *= share
    assert list(budget.missed(BUDGETS, costs)) == [name] * is_missed
    told = [line for line in budget.lines(BUDGETS, costs) if line.startswith(f"{name}:")]
    assert len(told) == is_missed
    for line in told:
        assert f"{costs[name]:.4g}" in line
        assert f"{BUDGETS[name].budget:.4g}" in line


def test_what_is_missed_is_rewritten_with_the_reason_and_nothing_else_is():
    costs = {LOOP: 1e7, "a drive": 0.6, "a study": 201.0}
    changed = budget.rewritten(BUDGETS, BUDGETS, costs, reason="a second camera")
    assert changed["a drive"] == Budget("a drive", "loops", 0.6, "a second camera")
    assert changed["a study"] == BUDGETS["a study"]


def test_under_another_build_of_python_a_budget_moves_with_what_the_version_before_costs():
    before = {LOOP: 9e6, "a drive": 0.4, "a study": 210.0}
    here = budget.moved(BUDGETS, BUDGETS, before)
    assert not list(budget.missed(here, before))
    assert list(budget.missed(here, before | {"a drive": 0.42})) == ["a drive"]
    raised = BUDGETS | {"a drive": Budget("a drive", "loops", 0.525, "a second camera")}
    here = budget.moved(raised, BUDGETS, before)
    assert not list(budget.missed(here, before | {"a drive": 0.42}))
    changed = budget.rewritten(BUDGETS, BUDGETS | here, before | {"a drive": 0.84}, reason="two")
    assert changed["a drive"].budget == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("steps", "landed"),
    [
        (["checkout -q -b mine", "commit -q --allow-empty -m more"], "second"),
        ([], "first"),
        (["rm -q file"], "second"),
    ],
    ids=["on a branch", "on main", "changed on main"],
)
def test_the_version_that_landed_last_is_the_one_before_this(tmp_path, monkeypatch, steps, landed):
    git = ["git", "-C", str(tmp_path), "-c", "user.name=A", "-c", "user.email=a@example.org"]
    (tmp_path / "file").touch()
    begin = [
        "init -q -b main",
        "add file",
        "commit -q -m first",
        "commit -q --allow-empty -m second",
    ]
    for step in (*begin, *steps):
        subprocess.run([*git, *step.split()], check=True)
    monkeypatch.setattr(meter, "GIT", git)
    commit = budget.landed()
    told = subprocess.check_output([*git, "log", "-1", "--format=%s", commit], text=True)
    assert told == f"{landed}\n"


def test_without_a_version_before_this_there_is_nothing_to_compare_with(tmp_path, monkeypatch):
    monkeypatch.setattr(meter, "GIT", ["git", "-C", str(tmp_path)])
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    with pytest.raises(LookupError, match="no version before"):
        budget.landed()


@pytest.mark.system
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind counts, and is missing")
def test_five_per_cent_more_work_is_caught_when_counted_and_one_per_cent_passes(tmp_path):
    package = tmp_path / "dva_sim"
    package.mkdir()
    (package / "__init__.py").touch()
    name = f"{startup.PREFIX}--help"

    def cost(rounds):
        (package / "cli.py").write_text(f"for _ in range({rounds}):\n    sorted(range(100))\n")
        found = meter.started(tmp_path, ["--help"], counting.Callgrind.name, repeats=1)
        return found[name]["instructions"]

    small, usual = cost(300), cost(3_000)
    of_a_round = (usual - small) / 2_700
    rows = {name: Budget(name, "instructions", usual, "as measured")}
    for share, is_missed in ((0.05, True), (0.01, False), (-0.05, True)):
        planted = cost(3_000 + round(share * usual / of_a_round))
        assert planted / usual - 1 == pytest.approx(share, abs=0.002)
        assert list(budget.missed(rows, {name: planted})) == [name] * is_missed
