"""`pytest --halves`: two processes share the tests, and one tells what came of all of them.

Both collect everything. The one that was started, the leader, takes file after file from the
front, its helper from the back, until they meet; so nobody has to know what a file costs. A file
is taken by creating an empty file of its name. The helper's reports go through a file too, so
that it never waits for the leader, who reads them between its own tests.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

FIRST = ("live", "system")
"""Folders whose files are dear: the halves had better not meet there."""

PR_SET_PDEATHSIG = 1  # prctl(2)
LOOK_S = 0.05
PATIENCE_S = 60.0  # with a helper that was told to stop
GOOD = (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.NO_TESTS_COLLECTED)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--halves", action="store_true", help="Share the tests with a second process.")
    parser.addoption("--half-of", type=Path, help="This is the second process, and they meet here.")


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    if config.option.half_of:
        config.workerinput = {}  # as pytest calls it: who leads writes what is kept of a run
        config.pluginmanager.register(Helper(config, config.option.half_of))
    elif config.option.halves and not config.option.collectonly:
        config.pluginmanager.register(Leader(config))


class Half:
    """Takes files, and leaves alone what the other half has taken."""

    def __init__(self, folder: Path, backwards: bool) -> None:
        self._folder, self._backwards = folder, backwards
        self._taken: dict[Path, bool] = {}

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        files = {item.path: None for item in items}
        order = sorted(files, key=lambda path: not set(FIRST).intersection(path.parts))
        place = {path: n for n, path in enumerate(reversed(order) if self._backwards else order)}
        items.sort(key=lambda item: place[item.path])

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> bool | None:
        if item.path not in self._taken:
            self._taken[item.path] = self._take(item.nodeid.partition("::")[0])
        return None if self._taken[item.path] else True

    def _take(self, name: str) -> bool:
        try:
            (self._folder / f"{name.replace('/', '+')}.taken").touch(exist_ok=False)
        except FileExistsError:
            return False
        return True


class Helper(Half):
    """The half that nobody watches: it writes its reports down, and ends with its leader."""

    def __init__(self, config: pytest.Config, folder: Path) -> None:
        super().__init__(folder, backwards=True)
        self._config, self._reports, self._leader = config, folder / "reports", os.getppid()
        if sys.platform == "linux":
            ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGINT)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> bool | None:
        if os.getppid() != self._leader:
            pytest.exit("the other half is gone")
        return super().pytest_runtest_protocol(item)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        data = self._config.hook.pytest_report_to_serializable(config=self._config, report=report)
        with self._reports.open("a", encoding="utf-8") as reports:
            reports.write(json.dumps(data, default=str) + "\n")


class Leader(Half):
    """The half that tells: starts the helper, reads its reports, and ends it."""

    def __init__(self, config: pytest.Config) -> None:
        self._kept = tempfile.TemporaryDirectory(prefix="dva-sim-halves-")
        super().__init__(Path(self._kept.name), backwards=False)
        self._config = config
        self._reports = self._folder / "reports"
        self._reports.touch()
        self._read = 0
        self._missing: set[str] = set()
        self._helper: subprocess.Popen[bytes]

    def pytest_sessionstart(self) -> None:
        with (self._folder / "said").open("wb") as said:
            self._helper = subprocess.Popen(
                [sys.executable, "-m", "pytest", *self._words()],
                cwd=self._config.invocation_params.dir,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C reaches it through its leader, once
            )

    @pytest.hookimpl(wrapper=True, trylast=True)
    def pytest_runtestloop(self, session: pytest.Session) -> Iterator[None]:
        self._missing = {item.nodeid for item in session.items}
        done = yield
        while self._is_at_work():
            time.sleep(LOOK_S)
        if self._missing and not (session.shouldfail or session.shouldstop):
            pytest.exit(f"nobody ran {sorted(self._missing)}\n{self._said()}", returncode=3)
        return done

    def pytest_sessionfinish(self) -> None:
        _end(self._helper)

    def _words(self) -> list[str]:
        """Of the command that started this process, for the helper."""
        words = [str(w) for w in self._config.invocation_params.args if w != "--halves"]
        return [*words, f"--half-of={self._folder}", "--color=no"]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "teardown":
            self._missing.discard(report.nodeid)

    def pytest_runtest_logfinish(self) -> None:
        self._is_at_work()

    def _is_at_work(self) -> bool:
        """Whether the helper is; tells what it reported so far, and ends all if it broke down."""
        code = self._helper.poll()
        if self._read < self._reports.stat().st_size:
            self._tell_its_reports()
        if code is not None and code not in GOOD:
            pytest.exit(f"the second process ended with {code}:\n{self._said()}", returncode=3)
        return code is None

    def _said(self) -> str:
        """What the helper printed; of a test that hung, where."""
        return (self._folder / "said").read_text(encoding="utf-8", errors="replace")

    def _tell_its_reports(self) -> None:
        hook = self._config.hook
        for data in self._news():
            report = hook.pytest_report_from_serializable(config=self._config, data=data)
            if isinstance(report.longrepr, list):
                report.longrepr = tuple(report.longrepr)  # of a skip: where, line, reason
            hook.pytest_runtest_logreport(report=report)

    def _news(self) -> list[dict[str, Any]]:
        """Whole lines that have been written since the last time."""
        with self._reports.open("rb") as reports:
            reports.seek(self._read)
            whole = reports.read().rpartition(b"\n")[0]
        self._read += len(whole) + bool(whole)
        return [json.loads(line) for line in whole.splitlines()]


def _end(helper: subprocess.Popen[bytes]) -> None:
    """Leave no process behind."""
    if helper.poll() is None:
        helper.send_signal(signal.SIGINT)
        try:
            helper.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            helper.kill()
            helper.wait()
