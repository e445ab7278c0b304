"""Rows for the audit log, written by a thread of its own: the world waits for no disk.

An action is reported as done once its row is on the disk. While no row can
be written, nothing new is begun (an emergency stop always is), and what waits is tried again.
"""

from __future__ import annotations

import queue
import socket
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from dva_sim.console.wire.events import AuditLine
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.realtime import PacedClock
from dva_sim.recordings.audit_log import (
    BEGIN,
    END,
    SUFFIX,
    AuditEntry,
    AuditLog,
    AuditRow,
    AuditWriteError,
)

RETRY_DELAY_S: Final = 1.0  # pause before writing to a full disk is tried again [s]
MAX_AT_ONCE: Final = 500  # rows of a transaction
MAX_WAITING: Final = 10_000  # rows that wait for a disk; more are counted, and told of in a row
SYSTEM: Final = "console"  # author of the rows that no person is behind

Then = Callable[[str], object]
_Asked = tuple[AuditEntry | None, Then]


def now_utc() -> str:
    """Return the clock on the wall, to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def check_target(path: Path) -> None:
    """See whether an audit log can be kept there, before anything starts.

    Raises:
        ConfigError: its name does not say what it is, or its folder is not there.
    """
    if path.suffix.lower() != SUFFIX:
        raise ConfigError(f"--audit: audit log should end in {SUFFIX}, not {path.name!r}")
    if not path.parent.is_dir():
        raise ConfigError(f"folder {str(path.parent)!r} for the audit log does not exist")
    if path.is_dir():
        raise ConfigError("is a folder; give the name of a file", path)


class AuditKeeper:
    """The audit log of one console.

    Args:
        path: File; an existing log is appended to. None: a temporary file, removed with the
            console.
        now: Time of the run [s].
        about: Facts about the run for the first row.

    Attributes:
        path: File of the log.
        is_lasting: True if it stays when the console has ended.
        problem: Reason why nothing can be written now; empty if it can.
        head: The hash of the last row that is on the disk.
        number: And its number.
        on_rows: Callback for each row that is on disk.

    Raises:
        ConfigError: the file cannot be used, or its chain is broken.
    """

    def __init__(
        self, path: Path | None, now: Callable[[], float], about: Mapping[str, Any]
    ) -> None:
        self._folder = TemporaryDirectory(prefix="dva-sim-audit-") if path is None else None
        folder = self._folder and Path(self._folder.name)
        self.path = folder / f"audit{SUFFIX}" if folder else path or Path()
        self.is_lasting = path is not None
        self._now = now
        self.problem = ""
        self._lost = 0
        self._log = AuditLog(self.path)
        self.number = self._log.number
        self.head = self._log.head
        self.on_rows: Callable[[Sequence[AuditRow]], object] = lambda _: None
        self._asked: queue.SimpleQueue[_Asked | None] = queue.SimpleQueue()
        self._done: deque[tuple[Sequence[AuditRow], Sequence[Then], str]] = deque()
        self._hears, self._wakes = socket.socketpair()
        self._hears.setblocking(False)
        self._wakes.setblocking(False)
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()
        self.put(self.entry(BEGIN, details=about))

    def entry(self, action: str, author: str = SYSTEM, **more: Any) -> AuditEntry:
        """Return an entry for an action that happens now."""
        now = round(self._now(), 6)
        return AuditEntry(time_s=now, at_utc=now_utc(), author=author, action=action, **more)

    def put(self, entry: AuditEntry, then: Then = lambda _: None) -> None:
        """Queue a row; `then` is called once it is on disk, or with the reason why not."""
        if self._asked.qsize() >= MAX_WAITING:
            self._lost += 1
            then("the audit log cannot be written, and too much waits for it already")
            return
        self._asked.put((entry, then))

    def when_safe(self, then: Then) -> None:
        """Call `then` once all rows so far are on disk, or with the reason why not."""
        self._asked.put((None, then))

    def line(self, now_ms: int) -> AuditLine:
        """Return the state of the log for pages."""
        return {
            "k": "audit",
            "t": now_ms,
            "rows": self.number,
            "hash": self.head,
            "problem": self.problem,
            "lasting": self.is_lasting,
            "file": str(self.path) if self.is_lasting else "",
        }

    # --- in the world's thread ------------------------------------------------------------------

    def fileno(self) -> int:
        """Return the file that can be read when there is something for `take`."""
        return self._hears.fileno()

    def take(self) -> None:
        """Run the callbacks of rows that are on disk, or that could not be written."""
        with suppress(BlockingIOError):
            self._hears.recv(4096)
        while self._done:
            rows, waiting, self.problem = self._done.popleft()
            if rows:
                self.number = rows[-1].number
                self.head = rows[-1].hash
                self.on_rows(rows)
            for then in waiting:
                then(self.problem)

    def close(self) -> None:
        """Write the last row; what can still not be written is lost."""
        if not self._thread.is_alive():
            return
        lost = f"rows that found no room: {self._lost}" if self._lost else ""
        self.put(self.entry(END, text=lost))
        self._asked.put(None)
        self._thread.join()
        self.take()
        self._log.close()
        self._hears.close()
        self._wakes.close()
        if self._folder is not None:
            self._folder.cleanup()

    # --- in its own -----------------------------------------------------------------------------

    def _write(self) -> None:
        """Write what is asked for, in its order, until the end is."""
        waiting = list[AuditEntry]()
        is_over = False
        while not is_over:
            new, is_over = self._next(bool(waiting))
            waiting += [entry for entry, _ in new if entry is not None]
            rows = list[AuditRow]()
            problem = ""
            try:
                rows = self._log.append(waiting) if waiting else rows
                waiting = []
            except AuditWriteError as error:
                problem = str(error)
            if rows or new or problem != self.problem:
                self._tell(rows, [then for _, then in new], problem)

    def _next(self, is_behind: bool) -> tuple[list[_Asked], bool]:
        """Return what was asked for meanwhile, and whether that was all; wait a while for more."""
        entries = list[_Asked]()
        with suppress(queue.Empty):
            entry = self._asked.get(timeout=RETRY_DELAY_S if is_behind else None)
            while entry is not None:
                entries.append(entry)
                if len(entries) >= MAX_AT_ONCE:
                    return entries, False
                entry = self._asked.get_nowait()
            return entries, True
        return entries, False

    def _tell(self, rows: Sequence[AuditRow], waiting: Sequence[Then], problem: str) -> None:
        self._done.append((rows, waiting, problem))
        with suppress(BlockingIOError):  # then it is awake already
            self._wakes.send(b"!")


@contextmanager
def auditing(
    path: Path | None, clock: PacedClock, about: Mapping[str, Any], say: Callable[[str], object]
) -> Iterator[AuditKeeper]:
    """Keep who does what, and say in the end by which hash that can be held against.

    Args:
        path: See `AuditKeeper`.
        clock: Clock of the displayed run.
        about: Facts for the first row.
        say: Prints a line.

    Raises:
        ConfigError: the file cannot be used, or its chain is broken.
    """
    keeper = AuditKeeper(path, lambda: clock.now, about)
    clock.watch(keeper.fileno(), keeper.take)
    try:
        yield keeper
    finally:
        clock.unwatch(keeper.fileno())
        keeper.close()
        if keeper.is_lasting:
            say(f"{keeper.path} written: {keeper.number} rows, the last {keeper.head}")
