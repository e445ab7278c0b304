"""Logs of messages, as the web process keeps them, and how far each page has seen them.

The world tells exchanges in batches with numbers (`dva_sim.console.views.logs`); here the newest
10,000 of each log are kept, read, and filtered. A page says which logs it looks at, and how:

    {"do": "look", "logs": {"robot-1": {"kind": "SetTeleOp", "publications": true}}}

and gets lines of the kind `log` on its state socket: first the newest that match (`first` is
true: what the page has shown before is over), then what comes, at most 200 at once. `missed` says
how many were left out before the first of `lines`; an entry that was told before comes again with
its reply. An empty object takes all; a log that is not named is not told any more.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

from dva_sim.console.web.log_entries import UNANSWERED, Entry, Names
from dva_sim.console.wire.kinds import BadMessage
from dva_sim.protocol import messages as m

if TYPE_CHECKING:
    from dva_sim.console.wire.pages import LogEntry, LogLine

Line = dict[str, Any]

KEPT_ENTRIES: Final = 10_000  # exchanges of a log
KEPT_BYTES: Final = 32 << 20  # of them
ENTRIES_PER_LINE: Final = 200  # entries told to a page
WORDS: Final = ("device", "kind", "code", "text", "without")  # of a filter
TICKS: Final = {"publications": False, "renewals": True}  # of a filter, and as usual
RENEWED_WITHIN: Final = 15_000  # a device registers again and again in less than that [ms]
TABLES: Final = ("devices",)
MAX_LOGS: Final = 8  # that a page looks at
MAX_KNOWN: Final = 256  # logs of which anything is kept
MAX_NAMES: Final = 4096


@dataclass(frozen=True)
class LogFilter:
    """Filter of a page for a log.

    Attributes:
        device: Part of the id or the label of who asks or is asked.
        kind: Kind of message.
        code: Code of the reply, `none` for those without, or `refused` for all but OK.
        text: Text that occurs in a message or its reply.
        without: Id of a device whose messages are left out.
        publications: True to include publications.
        renewals: True to include registrations that only repeat the one before.
        since: Only entries of a higher number: what came before was cleared.
    """

    device: str = ""
    kind: str = ""
    code: str = ""
    text: str = ""
    without: str = ""
    publications: bool = False
    renewals: bool = True
    since: int = 0

    @classmethod
    def of(cls, fields_given: Any) -> LogFilter:
        """Parse the filter of a page.

        Raises:
            BadMessage: it makes no sense.
        """
        if not isinstance(fields_given, dict):
            raise BadMessage("a log's filter should be an object")
        words = {key: fields_given.get(key, "") for key in WORDS}
        for key, value in words.items():
            if not isinstance(value, str) or len(value) > 200:
                raise BadMessage(f"{key} should be a text of at most 200 characters")
        since = fields_given.get("since", 0)
        ticks = {key: fields_given.get(key, usual) for key, usual in TICKS.items()}
        for key, value in ticks.items():
            if not isinstance(value, bool):
                raise BadMessage(f"{key} should be true or false")
        if type(since) is not int:
            raise BadMessage("since should be a number")
        return cls(**words, **ticks, since=since)

    def takes(self, entry: Entry, names: Names) -> bool:
        """Return True if an entry passes."""
        if entry.number <= self.since or (entry.published and not self.publications):
            return False
        if self.kind and entry.kind != self.kind:
            return False
        if entry.renews and not self.renewals:
            return False
        if self.without and entry.header.get("SourceID") == self.without:
            return False
        return self._is_of_device(entry, names) and self._has_code(entry) and self._says(entry)

    def _is_of_device(self, entry: Entry, names: Names) -> bool:
        if not self.device:
            return True
        header = entry.header
        text = self.device.lower()
        ends = header.get("SourceID", ""), header.get("DestinationID", "")
        return any(text in f"{end} {names.get(end, '')}".lower() for end in ends)

    def _has_code(self, entry: Entry) -> bool:
        if not self.code:
            return True
        if self.code == UNANSWERED:
            return entry.code is None
        if self.code == "refused":
            return entry.code not in (None, m.OK)
        return str(entry.code) == self.code

    def _says(self, entry: Entry) -> bool:
        text = self.text.encode()
        return not text or text in entry.data or text in (entry.reply or b"")


class KeptLog:
    """One log.

    Attributes:
        entries: By number, the oldest first.
        changed: Number of changes: a new entry, or one that got its reply.
        lost: Number of exchanges left out by the simulation.
        bytes: Size of the messages.
        newest: Number of the newest entry.
        begun: Number of restarts, as when a recording is wound back.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.entries: dict[int, Entry] = {}
        self.changed = self.lost = self.bytes = self.newest = self.begun = 0
        self._changes: deque[int] = deque(maxlen=KEPT_ENTRIES)  # numbers

    def take(self, entries: Iterable[Entry]) -> None:
        """Take in entries from the simulation."""
        for entry in entries:
            entry_there = self.entries.get(entry.number)
            if entry.number > self.newest:
                self.lost += entry.number - self.newest - 1
                self.newest = entry.number
            elif entry_there is None:
                continue  # so old that it has been forgotten
            self.entries[entry.number] = entry  # one that is told again keeps its place
            self.bytes += entry.size - (entry_there.size if entry_there is not None else 0)
            self.changed += 1
            self._changes.append(entry.number)
        self._forget()

    def begin(self, before: int) -> None:
        """Forget all: what comes next begins after the entry of that number."""
        self.entries.clear()
        self._changes.clear()
        self.bytes = 0
        self.newest = before
        self.begun += 1

    def _forget(self) -> None:
        while len(self.entries) > KEPT_ENTRIES or self.bytes > KEPT_BYTES:
            oldest = next(iter(self.entries))
            self.bytes -= self.entries.pop(oldest).size

    def since(self, change: int) -> Iterator[Entry]:
        """Yield what has changed since, the newest change first."""
        numbers = islice(reversed(self._changes), self.changed - change)
        return (entry for n in numbers if (entry := self.entries.get(n)) is not None)

    def find(
        self, log_filter: LogFilter, names: Names, before: int | None, most: int
    ) -> list[Entry]:
        """Return the newest entries that match, below a number; the oldest first."""
        matches = (
            entry
            for entry in reversed(self.entries.values())
            if (before is None or entry.number < before) and log_filter.takes(entry, names)
        )
        return list(islice(matches, most))[::-1]


class KeptLogs:
    """All logs that were ever told.

    Attributes:
        names: Labels of devices by id: of the scene, of the table, of who has registered.
    """

    def __init__(self) -> None:
        self._logs: dict[str, KeptLog] = {}
        self._registered: dict[str, tuple[str, int]] = {}  # payload and time by source
        self.names: dict[str, str] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._logs

    def of(self, name: str) -> KeptLog:
        """Return a log by its name, empty if nothing was told of it."""
        if name not in self._logs and len(self._logs) >= MAX_KNOWN:
            del self._logs[next(iter(self._logs))]
        return self._logs.setdefault(name, KeptLog(name))

    def meet(self, names: Names) -> None:
        """Learn labels; of those that nobody can remember all, the oldest are forgotten."""
        self.names |= names
        while len(self.names) > MAX_NAMES:
            del self.names[next(iter(self.names))]

    def take(self, line: Line) -> None:
        """Take a line of the kind `log`."""
        entries = [Entry.of(one) for one in line["lines"]]
        for entry in entries:
            if entry.kind == "RegMsg" and entry.code == m.OK:
                self._register(entry)
        log = self.of(str(line["log"]))
        if line.get("replaces"):
            log.begin(entries[0].number - 1 if entries else 0)
        log.take(entries)

    def _register(self, entry: Entry) -> None:
        """Learn a label, and whether that registration only repeats the one before."""
        source = entry.header["SourceID"]
        payload, time = self._registered.get(source, ("", 0))
        entry.renews = payload == entry.payload and 0 <= entry.time - time < RENEWED_WITHIN
        self._registered[source] = entry.payload, entry.time
        while len(self._registered) > MAX_NAMES:
            del self._registered[next(iter(self._registered))]
        self.meet({source: entry.label})


class Looks:
    """Logs and tables that a page looks at, and what it has seen of each log.

    Args:
        logs: All there are.
        acts: True if the page may drive; others do not see sessions, which allow driving.

    Attributes:
        wanted: The logs it looks at.
        tables: The tables it looks at: lines that only such pages get.
    """

    def __init__(self, logs: KeptLogs, acts: bool) -> None:
        self._logs = logs
        self.acts = acts
        self.wanted: dict[str, LogFilter] = {}
        self.tables: frozenset[str] = frozenset()
        self._seen: dict[str, tuple[int, int, int]] = {}  # changes, lost, begun

    def look(self, logs: Any, tables: Any) -> None:
        """Select the logs that the page looks at from now on.

        Raises:
            BadMessage: it makes no sense.
        """
        if not isinstance(logs, dict) or len(logs) > MAX_LOGS:
            raise BadMessage(f"logs should be an object of at most {MAX_LOGS} logs")
        if not isinstance(tables, list) or any(one not in TABLES for one in tables):
            raise BadMessage(f"tables should be some of: {', '.join(TABLES)}")
        filters = {str(name)[:64]: self.filter(one) for name, one in logs.items()}
        same = {name for name, one in filters.items() if self.wanted.get(name) == one}
        self._seen = {name: seen for name, seen in self._seen.items() if name in same}
        self.wanted, self.tables = filters, frozenset(tables)

    def filter(self, fields_given: Any) -> LogFilter:
        """Set the page's filter; clients that may not act cannot search whole messages.

        Raises:
            BadMessage: it makes no sense.
        """
        log_filter = LogFilter.of(fields_given)
        return log_filter if self.acts else replace(log_filter, text="")

    def next(self) -> LogLine | None:
        """Return the next line of the logs that the page looks at; None if it has everything."""
        for name, log_filter in self.wanted.items():
            log = self._logs.of(name)
            goes_on = name in self._seen and self._seen[name][2] == log.begun
            line = self._more(log, log_filter) if goes_on else self._first(log, log_filter)
            self._seen[name] = log.changed, log.lost, log.begun
            if line is not None:
                return line
        return None

    def brief(self, entry: Entry) -> LogEntry:
        """Return what a page may see of an entry in a table."""
        brief = entry.brief(self._logs.names)
        return brief if self.acts else {**brief, "session": "", "payload": ""}

    def _first(self, log: KeptLog, log_filter: LogFilter) -> LogLine:
        entries = log.find(log_filter, self._logs.names, None, ENTRIES_PER_LINE)
        return self._line(log, True, 0, entries)

    def _more(self, log: KeptLog, log_filter: LogFilter) -> LogLine | None:
        changed, lost, _ = self._seen[log.name]
        entries = {
            entry.number: entry
            for entry in log.since(changed)
            if log_filter.takes(entry, self._logs.names)
        }
        missed = max(0, len(entries) - ENTRIES_PER_LINE) + log.lost - lost
        if not entries and not missed:
            return None
        return self._line(
            log, False, missed, [entries[n] for n in sorted(entries)[-ENTRIES_PER_LINE:]]
        )

    def _line(self, log: KeptLog, first: bool, missed: int, entries: Iterable[Entry]) -> LogLine:
        return {
            "k": "log",
            "log": log.name,
            "total": log.newest,
            "first": first,
            "missed": missed,
            "lines": [self.brief(entry) for entry in entries],
        }
