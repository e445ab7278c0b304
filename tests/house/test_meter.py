"""Counters and output of `make bench`."""

import os
import platform
import signal
import subprocess
import sys

import pytest
from benchmarks import cases, counting, meter, runner, startup
from helpers.paths import TESTS
from typer.main import get_command

from dva_sim.cli import app


@pytest.mark.skipif(platform.system() != "Linux", reason="perf_event_open is Linux's")
def test_the_systems_counter_counts_what_happens_while_it_works():
    try:
        counter = counting.Perf(counting.SOFTWARE_TASK_CLOCK)  # there without a counting processor
    except counting.Unavailable as why:
        pytest.skip(str(why))
    done, little = counter.count(lambda: float(sum(range(100))))
    _, much = counter.count(lambda: float(sum(range(1_000_000))))
    assert done == 4950.0
    assert 0 < little < much


def test_a_counter_that_the_system_does_not_have_says_so():
    with pytest.raises(counting.Unavailable):
        counting.Perf((0, 1 << 40))


def test_callgrinds_account_is_read(tmp_path):
    (tmp_path / "7.2").write_text("fn=(3) main\ntotals: 1234\n")
    assert counting.Callgrind.total(tmp_path / "7.2") == 1234


def test_what_is_measured_depends_on_no_hash_seed_and_no_processor():
    assert counting.pinned()["PYTHONHASHSEED"] == "0"
    assert "AVX" in counting.pinned()["NPY_DISABLE_CPU_FEATURES"] or platform.machine() != "x86_64"


def test_a_row_tells_both_versions_and_the_change():
    ours = {"a task": {"instructions": 9e6, "cpu_s": 0.004}}
    theirs = {"a task": {"instructions": 1e7, "cpu_s": 0.005}}
    row = list(meter.lines(ours, theirs))[1]
    assert row.split() == ["a", "task", "run", "9.00", "M", "10.00", "M", "-10.0", "%", "4", "5"]


def test_a_case_that_the_other_version_lacks_is_told_and_does_not_count_as_a_crash():
    ours = {"a task": {"instructions": 9e6, "cpu_s": None}}
    rows = list(meter.lines(ours, {"a task": {"error": "ImportError: no such module"}}))
    assert rows[1].split() == ["a", "task", "run", "9.00", "M", "-", "-", "-"]
    assert rows[2].endswith("ImportError: no such module")


def test_the_start_of_every_command_is_measured():
    commands = {words.split()[0] for words in startup.COMMANDS.values()}
    assert set(get_command(app).list_commands(None)) <= commands


def test_the_start_of_the_version_in_a_folder_is_measured_wherever_one_stands(tmp_path):
    (tmp_path / "dva_sim").mkdir()
    (tmp_path / "dva_sim/__init__.py").touch()
    (tmp_path / "dva_sim/cli.py").write_text("raise SystemExit('this is another version')")
    environment = counting.pinned() | {"PYTHONPATH": str(tmp_path)}
    reported = startup.measured("--help", counting.Nothing.name, tmp_path, environment)
    assert reported["error"] == "this is another version"


def test_a_case_whose_process_dies_is_told_as_a_crash(tmp_path, monkeypatch):
    monkeypatch.setitem(cases.CASES, "dies", cases.Case("run", lambda: os._exit(7)))
    runner.in_a_copy("dies", counting.Nothing.name, 0, tmp_path / "results")
    assert list(runner.read(tmp_path / "results")) == [{"case": "dies", "error": "crashed (7)"}]


def test_a_ratio_is_told_where_both_its_cases_were_measured():
    above, below = next(iter(meter.RATIOS.values()))
    found = {
        above: {"instructions": 6e6, "cpu_s": 1.0},
        below: {"instructions": 2e6, "cpu_s": 1.0},
    }
    assert list(meter.ratios(found)) == [f"{next(iter(meter.RATIOS))}: 3.00"]
    assert list(meter.ratios({above: found[above]})) == []


ASKING = """
import subprocess, sys
from helpers.processes.other_version import end_with_signals, output, version

end_with_signals()
with version("HEAD") as folder:
    assert (folder / "Makefile").exists()
    output([sys.executable, "-c", "import sys, time; print(1, file=sys.stderr); time.sleep(600)"])
"""


STARTING = """
import subprocess
start = subprocess.Popen.__init__
def slowly(*args, **options):
    start(*args, **options)
    import time
    if options.get("start_new_session"):
        time.sleep(0.5)
subprocess.Popen.__init__ = slowly
"""


@pytest.mark.system
@pytest.mark.parametrize("before", ["", STARTING], ids=["runs", "starts"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_meter_that_is_stopped_leaves_no_folder_and_no_program_behind(tmp_path, number, before):
    environment = os.environ | {"TMPDIR": str(tmp_path), "PYTHONPATH": str(TESTS)}
    words = [sys.executable, "-c", before + ASKING]
    with subprocess.Popen(words, env=environment, stderr=subprocess.PIPE, text=True) as meter:
        assert meter.stderr is not None
        assert meter.stderr.readline() == "1\n"  # what it asked for runs
        assert len(list(tmp_path.iterdir())) == 1
        meter.send_signal(number)
        assert meter.stderr.read() == ""  # which ends when nobody holds the pipe any more
    assert meter.returncode == 128 + number
    assert not list(tmp_path.iterdir())
