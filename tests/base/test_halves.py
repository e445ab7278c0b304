"""Tests that two processes share: each runs once, and nothing that goes wrong is lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import patience
import pytest
from halves import Helper

TESTS = Path(__file__).parents[1]
ONE_MEETS_THE_OTHER = """
from pathlib import Path
import os, patience
def test_{own}():
    Path("{own}").write_text(str(os.getpid()))
    assert patience.becomes(Path("{other}").exists)
"""
BOTH = {own: ONE_MEETS_THE_OTHER.format(own=own, other=other) for own, other in ("az", "za")}


def pytest_on(folder: Path, files: dict[str, str], *words: str) -> list[str]:
    """The command that runs tests of these texts in two processes."""
    for name, text in files.items():
        (folder / f"test_{name}.py").write_text(text)
    (folder / "conftest.py").write_text("from halves import pytest_addoption, pytest_configure\n")
    (folder / "pytest.ini").write_text("[pytest]\naddopts = -p no:cacheprovider -rs\n")
    return [sys.executable, "-m", "pytest", "--halves", "--rootdir", str(folder), *words]


def ended(folder: Path, files: dict[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    command = pytest_on(folder, files, *words)
    return patience.run(command, cwd=folder, env=environment(), capture_output=True, text=True)


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(TESTS), "PYTHONDONTWRITEBYTECODE": "1"}


def test_two_processes_share_the_files_and_one_summary_tells_of_all(tmp_path: Path) -> None:
    skips = "import pytest\ndef test_skips():\n    pytest.skip('too dark')\n"
    done = ended(tmp_path, BOTH | {"m": skips})
    assert done.returncode == 0, done.stdout
    assert "2 passed, 1 skipped in" in done.stdout
    assert done.stdout.count("too dark") == 1
    assert (tmp_path / "a").read_text() != (tmp_path / "z").read_text()


def test_a_failure_in_the_second_process_is_told_and_is_the_exit_code(tmp_path: Path) -> None:
    done = ended(tmp_path, BOTH | {"z": BOTH["z"] + "    assert 1 == 2, 'arithmetic'\n"})
    assert done.returncode == 1
    assert "1 failed, 1 passed in" in done.stdout
    assert "AssertionError: arithmetic" in done.stdout


def test_a_second_process_that_dies_is_told_with_what_it_said(tmp_path: Path) -> None:
    done = ended(tmp_path, BOTH | {"z": BOTH["z"] + "    os.abort()\n"})
    assert done.returncode == 3
    assert f"the second process ended with {-signal.SIGABRT}" in done.stdout
    assert "test_z.py" in done.stdout


def test_tests_that_nobody_ran_are_told(tmp_path: Path) -> None:
    done = ended(tmp_path, BOTH | {"z": BOTH["z"] + "    os._exit(0)\n"})
    assert done.returncode == 3
    assert "nobody ran ['test_z.py::test_z']" in done.stdout


def test_where_there_is_no_test_that_is_no_success(tmp_path: Path) -> None:
    assert ended(tmp_path, BOTH, "-k", "nothing").returncode == pytest.ExitCode.NO_TESTS_COLLECTED


def test_a_test_that_hangs_ends_the_run_with_a_traceback(tmp_path: Path) -> None:
    hangs = "import time\ndef test_m():\n    time.sleep(1000)\n"
    limits = ("-o", "faulthandler_timeout=1", "-o", "faulthandler_exit_on_timeout=true")
    done = ended(tmp_path, {"m": hangs}, *limits)
    assert done.returncode not in (0, 5)
    assert "Timeout (0:00:01)!" in done.stdout + done.stderr
    assert "in test_m" in done.stdout + done.stderr


def test_ctrl_c_ends_both(tmp_path: Path) -> None:
    waits = "    patience.becomes(lambda: False)\n"
    command = pytest_on(tmp_path, {name: text + waits for name, text in BOTH.items()})
    with subprocess.Popen(
        command, cwd=tmp_path, env=environment(), stdout=subprocess.PIPE, text=True
    ) as leader:
        try:
            assert patience.becomes(lambda: (tmp_path / "a").exists() and (tmp_path / "z").exists())
            helper = int((tmp_path / "z").read_text())
            leader.send_signal(signal.SIGINT)
            said, _ = leader.communicate(timeout=patience.PATIENCE_S)
        finally:
            leader.kill()
    assert leader.returncode == pytest.ExitCode.INTERRUPTED
    assert "KeyboardInterrupt" in said
    with pytest.raises(ProcessLookupError):
        os.kill(helper, 0)


def test_a_helper_whose_leader_is_gone_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    helper = Helper(None, tmp_path)
    monkeypatch.setattr(os, "getppid", lambda: 1)
    with pytest.raises(pytest.exit.Exception, match="the other half is gone"):
        helper.pytest_runtest_protocol(None)
