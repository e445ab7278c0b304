"""Tests that two processes share: each runs once, and nothing that goes wrong is lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from halves import Helper
from helpers.paths import TESTS
from helpers.processes import patience
from skips import MOST_SKIPPED

CONFTEST = """
from halves import pytest_addoption, pytest_configure
from skips import pytest_sessionfinish
"""
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
    (folder / "conftest.py").write_text(CONFTEST)
    (folder / "pytest.ini").write_text("[pytest]\naddopts = -p no:cacheprovider -rs\n")
    return [sys.executable, "-m", "pytest", "--halves", "--rootdir", str(folder), *words]


def ended(folder: Path, files: dict[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    command = pytest_on(folder, files, *words)
    return patience.run(
        command, cwd=folder, env=environment(folder), capture_output=True, text=True
    )


def environment(folder: Path) -> dict[str, str]:
    ours = {"PYTHONPATH": str(TESTS), "PYTHONDONTWRITEBYTECODE": "1", "TMPDIR": str(folder)}
    return {**os.environ, **ours}


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


def test_after_the_first_failure_nothing_more_is_run_if_that_is_asked_for(tmp_path: Path) -> None:
    done = ended(tmp_path, BOTH | {"z": BOTH["z"] + "    assert 1 == 2\n"}, "-x")
    assert done.returncode == 1
    assert "1 failed" in done.stdout


def test_a_file_that_cannot_be_collected_is_told(tmp_path: Path) -> None:
    done = ended(tmp_path, BOTH | {"m": "1 / 0\n"})
    assert done.returncode == pytest.ExitCode.INTERRUPTED
    assert "ZeroDivisionError" in done.stdout


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


@pytest.mark.parametrize(("skipped", "code"), [(MOST_SKIPPED, 0), (MOST_SKIPPED + 1, 1)])
def test_a_run_in_which_too_many_tests_are_skipped_has_failed(
    tmp_path: Path, skipped: int, code: int
) -> None:
    skips = f"""
import pytest
@pytest.mark.parametrize("n", range({skipped}))
def test_m(n):
    pytest.skip("too dark")
"""
    done = ended(tmp_path, {"m": skips})
    assert done.returncode == code
    assert (f"{skipped} tests were skipped; at most {MOST_SKIPPED} may be." in done.stdout) == code


def test_a_test_that_hangs_ends_the_run_with_a_traceback(tmp_path: Path) -> None:
    hangs = "import time\ndef test_m():\n    time.sleep(1000)\n"
    limits = ("-o", "faulthandler_timeout=1", "-o", "faulthandler_exit_on_timeout=true")
    done = ended(tmp_path, {"m": hangs}, *limits)
    assert done.returncode not in (0, 5)
    assert "Timeout (0:00:01)!" in done.stdout + done.stderr
    assert "in test_m" in done.stdout + done.stderr


WAITS = """
from pathlib import Path
from helpers.processes import patience
def test_{own}():
    try:
        Path("{own}").touch()
        patience.becomes(lambda: False)
    finally:
        Path("{own} over").touch()
"""


def interrupted(folder: Path, how: signal.Signals) -> tuple[int, str]:
    """What the leader ends with, and says, if it is sent a signal while both are at work."""
    files = {name: WAITS.format(own=name) for name in BOTH}
    with subprocess.Popen(
        pytest_on(folder, files),
        cwd=folder,
        env=environment(folder),
        stdout=subprocess.PIPE,
        text=True,
    ) as leader:
        try:
            assert patience.becomes(lambda: all((folder / name).exists() for name in BOTH))
            leader.send_signal(how)
            said, _ = leader.communicate(timeout=patience.PATIENCE_S)
        finally:
            leader.kill()
    return leader.returncode, said


def test_ctrl_c_ends_both(tmp_path: Path) -> None:
    code, said = interrupted(tmp_path, signal.SIGINT)
    assert code == pytest.ExitCode.INTERRUPTED
    assert "KeyboardInterrupt" in said
    assert (tmp_path / "a over").exists()
    assert (tmp_path / "z over").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere it ends after the test it is at")
def test_the_second_process_ends_when_the_first_is_killed(tmp_path: Path) -> None:
    code, _ = interrupted(tmp_path, signal.SIGKILL)
    assert code == -signal.SIGKILL
    assert patience.becomes((tmp_path / "z over").exists)


def test_a_helper_whose_leader_is_gone_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    helper = Helper(None, tmp_path)
    monkeypatch.setattr(os, "getppid", lambda: 1)
    with pytest.raises(pytest.exit.Exception, match="the other half is gone"):
        helper.pytest_runtest_protocol(None)
