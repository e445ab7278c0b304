"""`pytest --cpu-by-room`: what the tests of each room cost, beside the last commit that was tested.

CPU seconds of the tests and of the programs they start, in all processes that share them. The
cache of pytest keeps the figures of each commit that was tested here, apart for each choice of
tests; before there is one, those of `cpu_by_room.json` are shown, which `--write-cpu-by-room`
writes.
"""

import hashlib
import json
import os
import subprocess
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from helpers.paths import ROOT, TESTS

RECORD = Path(__file__).with_suffix(".json")
REST = "collecting, and pytest"
MOST_KEPT = 50
Figures = dict[str, float]


def pytest_addoption(parser: pytest.Parser) -> None:
    shown = "Show the CPU seconds of each room beside those of the commit before."
    written = f"Write them to {RECORD.name}, which is shown where no commit was tested before."
    parser.addoption("--cpu-by-room", action="store_true", help=shown)
    parser.addoption("--write-cpu-by-room", action="store_true", help=written)


def pytest_configure(config: pytest.Config) -> None:
    if config.option.cpu_by_room or config.option.write_cpu_by_room:
        worker = hasattr(config, "workerinput")
        config.pluginmanager.register(Meter(config) if worker else Table(config))


def spent() -> float:
    """CPU time of this process, and of those that it started and that have ended [s]."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


class Meter:
    """Notes in each report what its test has cost."""

    def __init__(self, config: pytest.Config) -> None:
        self._config, self._before = config, spent()

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self) -> None:
        self._before = spent()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self) -> Any:
        report = yield
        now = spent()
        report.cpu_s, self._before = now - self._before, now
        return report

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        session.config.workeroutput["cpu_s"] = spent()


class Table(Meter):
    """Sums up what all processes report, and prints it."""

    def __init__(self, config: pytest.Config) -> None:
        super().__init__(config)
        self._rooms: Counter[str] = Counter()
        self._workers = 0.0

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._rooms[room_of(report.nodeid)] += getattr(report, "cpu_s", 0.0)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        self._workers += getattr(node, "workeroutput", {}).get("cpu_s", 0.0)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        times = os.times()
        own = self._workers + times.user + times.system if self._workers else spent()
        self._rooms[REST] = own - self._rooms.total()

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        figures = {room: round(cpu, 2) for room, cpu in self._rooms.items()}
        key, cache = f"dva-sim/cpu-of-{choice(self._config)}", self._config.cache
        known = cache.get(key, {}) if cache else {}
        terminalreporter.section("CPU seconds by room")
        for line in table(figures, *before(known)):
            terminalreporter.write_line(line)
        if self._config.option.write_cpu_by_room:
            written = {"commit": " ".join(commits()[:1]), "cpu_s": figures}
            RECORD.write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")
        if cache and (here := commits()[:1]):
            kept = [each for each in known.items() if each[0] not in here]
            cache.set(key, dict([*kept, (here[0], figures)][-MOST_KEPT:]))


def choice(config: pytest.Config) -> str:
    """Names which tests were chosen: figures of others say nothing about these."""
    option = config.option
    chosen = [option.markexpr, option.keyword, *sorted(config.args)]
    return hashlib.sha256("\n".join(chosen).encode()).hexdigest()[:16]


def room_of(nodeid: str) -> str:
    """The folder below `tests` in which a test lies."""
    parts = Path(nodeid.partition("::")[0]).parts
    return parts[1] if parts[:1] == (TESTS.name,) and len(parts) > 1 else REST


def commits() -> list[str]:
    """The commit that is checked out, and those before it; empty without Git."""
    words = ["git", "-C", str(ROOT), "log", "--first-parent", "--format=%h", "-500"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return done.stdout.split()


def before(known: dict[str, Figures]) -> tuple[str, Figures]:
    """The newest commit before this one whose figures are known, and they."""
    for commit in commits()[1:]:
        if commit in known:
            return commit, known[commit]
    record = json.loads(RECORD.read_text(encoding="utf-8"))
    return f"{record['commit']}, elsewhere", record["cpu_s"]


def table(now: Figures, commit: str, then: Figures) -> list[str]:
    """Lines: the dearest room first, and the sum."""
    rows = sorted({*now, *then}, key=lambda room: -now.get(room, 0.0))
    lines = [f"{'':24}{'now':>8}{'before':>8}   ({commit})"]
    for room, here, there in [
        *((room, now.get(room, 0.0), then.get(room, 0.0)) for room in rows),
        ("all", sum(now.values()), sum(then.values())),
    ]:
        lines.append(f"{room:24}{here:8.1f}{there:8.1f}{here - there:+8.1f}")
    return lines
