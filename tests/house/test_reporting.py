"""Failure of a test run, and the choice of faults to plant."""

import os
import sys

import pytest
from helpers.mutation import scores
from helpers.mutation.faults import Sites, shares
from helpers.mutation.scores import Verdicts, score
from helpers.paths import PYTHON_PATH, ROOT
from helpers.processes.patience import run
from helpers.reporting.left_out import MOST_SKIPPED


@pytest.mark.system
@pytest.mark.parametrize(("skipped", "code"), [(MOST_SKIPPED, 0), (MOST_SKIPPED + 1, 1)])
def test_a_run_in_which_too_many_tests_are_skipped_has_failed(tmp_path, skipped, code):
    (tmp_path / "test_m.py").write_text(
        f"import pytest\n@pytest.mark.parametrize('n', range({skipped}))\n"
        "def test_m(n): pytest.skip('too dark')\n"
    )
    words = ["-n", "1", "-p", "no:cacheprovider", "-p", "helpers.reporting.left_out"]
    done = run(
        [sys.executable, "-m", "pytest", *words, "--rootdir", str(tmp_path)],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": PYTHON_PATH},
        capture_output=True,
        text=True,
    )
    assert done.returncode == code, done.stdout
    assert ("may be" in done.stdout) == bool(code)


SOURCE = b'''
def f(x: int = 2) -> bool:
    """1 < 2."""
    log(x)
    x.n = x.n
    x += x
    if log:
        raise E
    return not x < 10 and True, f"{x + 1}"
'''


def test_faults_fit_where_a_program_could_be_wrong_and_nowhere_else():
    found = Sites("dva_sim/room/f.py", SOURCE).found
    assert [(one.old, one.new) for one in found][1:] == [
        ("log(x)", "pass"),
        ("x.n = x.n", "pass"),
        ("x += x", "pass"),
        ("raise E", "pass"),
        ('return not x < 10 and True, f"{x + 1}"', "return None"),
        ("and", "or"),
        ("not ", ""),
        ("<", "<="),
        ("10", "11"),
        ("True", "False"),
    ]
    assert (found[0].old, found[0].new, found[0].line, found[0].room) == ("2", "3", 2, "room")
    assert b"x <= 10" in next(one for one in found if one.old == "<").in_place(SOURCE)


def test_every_room_gives_a_fault_and_large_ones_more():
    assert shares({"small": 1, "middle": 30, "large": 69}, 13) == {
        "small": 1,
        "middle": 4,
        "large": 8,
    }


def test_a_score_is_the_share_of_noticed_faults_among_those_that_change_something(
    tmp_path, monkeypatch
):
    first, second, third = names = ["a", "b", "c"]
    monkeypatch.setattr(scores, "equivalents", lambda: {third: "no more than a note"})
    Verdicts(tmp_path / "v.csv").note(first, "")
    verdicts = Verdicts(tmp_path / "v.csv")  # the search is resumed
    for fault, test in [(first, "test_f"), (second, ""), (third, "")]:
        verdicts.note(fault, test)
    found = score("room", "1", names, Verdicts(tmp_path / "v.csv"))
    assert (found.mutants, found.noticed, found.equivalent, found.share) == (3, 1, 1, 0.5)


def test_every_fault_that_changes_nothing_is_one_and_has_a_reason():
    listed = scores.equivalents()
    files = {name.partition("::")[0] for name in listed}
    sites = [Sites(file, (ROOT / file).read_bytes()) for file in files]
    assert listed.keys() <= {fault.name for site in sites for fault in site.found}
    assert all(len(reason) > 10 for reason in listed.values())
