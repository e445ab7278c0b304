"""The models of a drive and of an event hold, each mechanism matters, and they are the code."""

import shutil
import subprocess
from pathlib import Path

import pytest
from helpers.dva import event_table, teleop_table
from helpers.paths import ROOT

from dva_sim.agents.robot.controller import RobotController
from dva_sim.core.orders import Orders

MODELS = ROOT / "protocol" / "models"
MISSING = [name for name in ("spin", "cc") if shutil.which(name) is None]
needs_spin = pytest.mark.skipif(
    bool(MISSING), reason=f"{' and '.join(MISSING)} missing: make tools"
)

ORDER = "SESSIONS=1", "LETTERS=2"
OWNERS = "SESSIONS=2", "LETTERS=1"
DRIVER, EMERGENCY = (("SESSIONS=1", "LETTERS=1", f"LIVE={n}") for n in (1, 2))


def errors(folder: Path, *defined: str, rule: str = "", model: str = "teleop") -> int:
    """Number of errors that the checker finds in a model with these definitions.

    Args:
        folder: Working folder.
        defined: Bounds, and mechanisms that are left out.
        rule: A liveness rule; left out: all assertions.
        model: The name of its file.
    """

    def run(*command: str) -> str:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
        return done.stdout

    # An error is found early: then it is compiling that takes the time.
    level = "-O0" if any("=" not in name for name in defined) else "-O2"
    run("spin", "-a", *(f"-D{name}" for name in defined), str(MODELS / f"{model}.pml"))
    options = ["-DNFAIR=4"] if rule else ["-DSAFETY"]
    run("cc", level, "-w", "-DNOREDUCE", "-DMEMLIM=500", *options, "-o", "pan", "pan.c")
    found = run("./pan", "-m400000", *(["-a", "-f", "-N", rule] if rule else []))
    assert "error: max search depth" not in found
    assert "Search not completed" not in found or "errors: 1" in found, found
    return int(found.split("errors:")[1].split()[0])


@needs_spin
@pytest.mark.system
@pytest.mark.invariant("S1", "S2", "S3", "S5")
@pytest.mark.parametrize("bound", [ORDER, OWNERS], ids=" ".join)
def test_no_order_of_events_breaks_a_rule_of_safety(tmp_path, bound):
    assert errors(tmp_path, *bound) == 0


LIVE = [("drive_ends", DRIVER), ("emergency_stops", EMERGENCY)]


@needs_spin
@pytest.mark.system
@pytest.mark.invariant("S2", "S3")
@pytest.mark.parametrize(("rule", "bound"), LIVE)
def test_a_drive_whose_time_is_over_ends(tmp_path, rule, bound):
    assert errors(tmp_path, *bound, rule=rule) == 0


@needs_spin
@pytest.mark.system
@pytest.mark.parametrize(
    ("without", "bound", "rule"),
    [
        ("NO_CONFIRMATION", OWNERS, ""),
        ("STALE_ANSWERS", OWNERS, ""),
        ("NO_SESSION", OWNERS, ""),
        ("HAND_OVER_MOVING", OWNERS, ""),
        ("NO_STANDSTILL", OWNERS, ""),
        ("NO_WATCHDOG", OWNERS, ""),
        ("NO_AGE_LIMIT", OWNERS, ""),
        ("EMERGENCY_RESUMES", OWNERS, ""),
        ("NO_ORDER", ORDER, ""),
        ("QUEUE_SURVIVES", ORDER, ""),
        ("NO_LATCH", ORDER, ""),
        ("NO_LEASE", DRIVER, "drive_ends"),
        ("NO_REMINDER", DRIVER, "drive_ends"),
        ("EMERGENCY_QUEUES", EMERGENCY, "emergency_stops"),
    ],
)
def test_without_any_one_mechanism_a_rule_breaks(tmp_path, without, bound, rule):
    assert errors(tmp_path, *bound, without, rule=rule) == 1


@needs_spin
@pytest.mark.system
@pytest.mark.invariant("S6")
def test_an_event_ends_whatever_people_do(tmp_path):
    assert errors(tmp_path, rule="event_ends", model="event") == 0


@needs_spin
@pytest.mark.system
@pytest.mark.parametrize(
    "changed",
    [
        *("NO_DEADLINE", "NO_ORDER_LIMIT", "NO_LAST_ATTEMPT"),
        *("WAIT_AGAIN_AFTER_DECLINE", "REPORTS_RESET"),
    ],
)
def test_without_a_deadline_or_a_last_attempt_an_event_need_not_end(tmp_path, changed):
    assert errors(tmp_path, changed, rule="event_ends", model="event") == 1


def test_the_table_of_the_event_is_that_of_the_orders():
    command = "PYTHONPATH=tests .venv/bin/python tests/helpers/dva/event_table.py"
    assert event_table.TABLE.read_text() == event_table.table(), f"write it again: {command}"


def test_orders_that_forget_attempts_have_another_table(monkeypatch):
    monkeypatch.setattr(Orders, "_goes_on", lambda *_: True)
    assert event_table.TABLE.read_text() != event_table.table()


def test_the_table_of_the_model_is_that_of_the_controller():
    command = ".venv/bin/python tests/helpers/dva/teleop_table.py"
    assert teleop_table.TABLE.read_text() == teleop_table.table(), f"write it again: {command}"


def test_a_controller_that_obeys_any_session_has_another_table(monkeypatch):
    monkeypatch.setattr(RobotController, "_refusal", lambda *_: None)
    assert teleop_table.TABLE.read_text() != teleop_table.table()
