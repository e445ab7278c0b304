"""Plays a recording to pages: its time goes on, faster or slower, stands, or jumps.

All who look see the same moment. Nothing that a page asks for reaches anybody: there is nobody.

Logs list messages in the order in which they were sent, because a recording does not know when they
arrived.
"""

from __future__ import annotations

import json
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dva_sim.cameras.lines import Show, contained_line, scene_line
from dva_sim.console.asking.dispatcher import ActionDispatcher, does
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.replay.recorded_run import RecordedRun
from dva_sim.console.replay.shelf import Shelf
from dva_sim.console.views.event_details import details_shown
from dva_sim.console.wire.actions import ActionPlace
from dva_sim.console.wire.arguments import (
    DetailsAsked,
    LogsLooked,
    MomentAsked,
    PaceChange,
    RecordingAsked,
    RobotsWatched,
)
from dva_sim.console.wire.events import AuditLine
from dva_sim.console.wire.limits import LOG_BATCH
from dva_sim.console.wire.lines import Tell
from dva_sim.console.wire.records import ExchangesLine
from dva_sim.console.wire.rows import ClockShown, RowsLine
from dva_sim.console.wire.seats import DoneLine
from dva_sim.kernel.recorder import Sent
from dva_sim.network.realtime import PacedClock
from dva_sim.recordings.audit_log import NOTHING_BEFORE
from dva_sim.recordings.reading import read_recording
from dva_sim.recordings.writing import pack

FIRST = 2000  # of those before the moment that is shown
# What is published, to whom it may concern; nobody answers it.
PUBLISHED = re.compile(
    rb"<(HBMsg|RobotStatus|PersonStatus|RobotHolder|SensorValue|MissionStatus|EventStatus)>"
)
_REPLY = re.compile(rb"<reply>\s*<Answers>(\d+)</Answers>")
_NUMBER = re.compile(rb"<MessageID>(\d+)</MessageID>")
_COMMAND = b"<SetTeleOp>"


class ExchangeLog:
    """The exchanges of one device, by time.

    Args:
        traffic: All messages of a run, by time.
        node: Id of the device.
    """

    def __init__(self, traffic: Iterable[Sent], node: str) -> None:
        self._lines: list[list[Any]] = []
        self._times: list[float] = []
        line_by_request: dict[tuple[str, bytes], list[Any]] = {}
        for sent in traffic:
            data = sent.payload
            if not isinstance(data, bytes) or node not in (sent.source, sent.destination):
                continue
            answered = _REPLY.search(data)
            if sent.source == node:
                line = line_by_request.get((sent.destination, answered[1])) if answered else None
                if line is not None:
                    line[3] = data.decode("latin-1")
                    line[5] = 0
            elif answered is None:
                self._add(line_by_request, sent, data)

    def _add(
        self, line_by_request: dict[tuple[str, bytes], list[Any]], sent: Sent, data: bytes
    ) -> None:
        """Add a line; a command counts as published until it is found to be answered."""
        is_published = PUBLISHED.search(data) is not None or _COMMAND in data
        when = round(1000 * sent.time)
        line = [len(self._lines) + 1, when, data.decode("latin-1"), None, None, int(is_published)]
        self._lines.append(line)
        self._times.append(sent.time)
        if number := _NUMBER.search(data):
            line_by_request[sent.source, number[1]] = line

    def until(self, now: float) -> int:
        """Return how many there were up to a moment [s]."""
        return bisect_right(self._times, now)

    def batches(self, name: str, sent: int, end: int) -> list[ExchangesLine]:
        """Return lines for pages, of those after the first `sent` up to the first `end`."""
        starts = range(max(sent, end - FIRST), end, LOG_BATCH)
        return [
            {"k": "log", "log": name, "lines": self._lines[start : min(end, start + LOG_BATCH)]}
            for start in starts
        ]


# From one line to the next, real time [s].
POSITIONS = 0.1
ROWS = 0.25
HAZARDS = 1.0
FRAMES = 0.1
LOGS = 0.2
NOBODY = "this is a recording: nothing in it can be controlled"


class Player:
    """A recording that is being played.

    Args:
        run: Recording being played; None until one is taken from the shelf.
        shelf: Others that can be played instead.
        clock: Clock of the viewer; the recording's own time follows it.

    Attributes:
        tell: Callback for lines to pages, with a key where only the newest counts.
        show: Callback for lines to the renderer, with a key likewise.
        audit: The audit log in the recording.
        take: Does what a page asks for; what would tell somebody something is refused.
    """

    def __init__(
        self, run: RecordedRun | None, shelf: Shelf | None = None, clock: PacedClock | None = None
    ) -> None:
        self.run = run
        self.shelf = shelf
        self.audit = RecordedAudit()
        self.clock = clock or PacedClock()
        self.tell: Tell = lambda *_: None
        self.show: Show = lambda *_: None
        self.dropped: Callable[[], int] = lambda: 0
        self._offset = 0.0
        self._jumps = 0
        self._frames = 0
        self._watched: set[str] = set()
        self._logs: dict[str, ExchangeLog] = {}
        self._looks_at_devices = False
        self._sent: dict[str, int] = {}  # exchanges of each log that somebody looks at
        self._site: TemporaryDirectory[str] | None = None
        self.take = ActionDispatcher(ActionPlace.REPLAY, [self], self._tell, NOBODY).take

    @property
    def now(self) -> float:
        """The moment that is shown, in the recording's time [s]."""
        return min(max(0.0, self._offset + self.clock.now), self._duration)

    @property
    def _duration(self) -> float:
        return 0.0 if self.run is None else self.run.duration

    # --- what a console shows: see `ConsoleSubject` ------------------------------------------

    def serve_cameras(self, base: str) -> None:
        """See `ConsoleSubject`: pages know by the robots' labels."""

    def begin(self) -> None:
        """Implement `ConsoleSubject`."""
        self._tell_scene()
        self.clock.pulse(POSITIONS, self._tell_positions)
        self.clock.pulse(ROWS, self._tell_rows)
        self.clock.pulse(HAZARDS, self._tell_hazards)
        self.clock.pulse(FRAMES, self._show_frames)
        self.clock.pulse(LOGS, self._tell_logs)
        self.clock.pulse(HAZARDS, self._tell_devices)

    def show_scene(self) -> None:
        """See `ConsoleSubject`: the site is the one in the file, whatever became of it since."""
        run = self.run
        if run is None or not run.is_drawn:
            return
        site = self._site_files(run)
        named = run.playback.scenario.site.model_copy(
            update={"name" if run.playback.site.rooms else "map": str(site), "options": {}}
        )
        scenario = run.playback.scenario.model_copy(update={"site": named})
        document = scenario.model_dump(mode="json")
        self.show(scene_line(document, run.playback.seed))
        for number, when in run.playback.contained.items():
            self.show(contained_line(number, when))

    def note(self, text: str) -> None:
        """Implement `ConsoleSubject`."""
        self.tell({"k": "pictures", "t": round(1000 * self.now), "ok": False, "text": text})

    def close(self) -> None:
        """Leave nothing behind."""
        self.audit.close()
        if self._site is not None:
            self._site.cleanup()
            self._site = None

    def _site_files(self, run: RecordedRun) -> Path:
        """Return where the site of a recording lies as files, while it is played."""
        if self._site is not None:
            self._site.cleanup()
        self._site = TemporaryDirectory(prefix="dva-sim-")
        folder = Path(self._site.name)
        files = pack(run.playback.site)
        for name, data in files.items():
            (folder / name).write_bytes(data)
        return folder / next(name for name in files if name.endswith(".yaml"))

    # --- what is told ----------------------------------------------------------------------

    def _tell_scene(self) -> None:
        if self.run is None:
            self.tell({"k": "scene", "t": 0, "things": [], "replay": None, "shelf": True})
        else:
            self.tell(self.run.scene())
            self.tell(self.audit.show(self.run.audit, self.run.name))
            self.show_scene()
            if not self.run.is_drawn:
                self.note("no pictures: a hazard of this run has a class that is not loaded")
        if self.shelf is not None:
            self.tell(self.shelf.line())
        self.tell_now()

    def tell_now(self) -> None:
        """Tell everything about the moment."""
        self._tell_rows()
        self._tell_positions()
        self._tell_hazards()
        self._tell_devices()

    def _tell_positions(self) -> None:
        if self.run is not None:
            self.tell(self.run.positions(self.now), "")

    def _tell_rows(self) -> None:
        run = self.run
        now = self.now
        if run is None:
            return
        if now >= run.duration and not self.clock.paused:
            self.clock.pace(paused=True)
        rows: RowsLine = {
            "k": "rows",
            "t": round(1000 * now),
            "clock": self._clock_line(),
            "link": None,
            "dropped": self.dropped(),
            "robots": run.robots(now),
            "people": run.bench.people(now),
            "order": None,
            "regions": run.system.regions(now),
        }
        self.tell(rows)
        self.tell(run.events(now))
        self.tell(run.story(now))
        for robot in self._watched:
            self.tell(run.window(robot, now))

    def _clock_line(self) -> ClockShown:
        return {
            "factor": self.clock.factor,
            "paused": self.clock.paused,
            "lag_s": 0.0,
            "given_up_s": 0.0,
            "held_by_lag": False,
            "jumps": self._jumps,
        }

    def _tell_hazards(self) -> None:
        if self.run is not None:
            self.tell(self.run.hazards(self.now))

    def _show_frames(self) -> None:
        run = self.run
        for robot in self._watched if run is not None else ():
            frame = run.frame(robot, self._frames + 1, self.now) if run is not None else None
            if frame is not None:
                self._frames += 1
                self.show(frame, frame["robot"])

    def _tell_logs(self) -> None:
        """Tell the messages since the last time; after a jump, all of them again."""
        run = self.run
        now = self.now
        for name, entry in self._sent.items() if run is not None else ():
            log = self._log(name)
            is_again = entry < 0
            end = log.until(now)
            lines = log.batches(name, max(0, entry), end)
            if is_again and not lines:
                lines = [{"k": "log", "log": name, "lines": []}]
            if is_again:
                lines[0]["replaces"] = True
            for line in lines:
                self.tell(line)
            self._sent[name] = end

    def _tell_devices(self) -> None:
        if self._looks_at_devices and self.run is not None:
            self.tell(self.run.devices(self.now))

    def _log(self, name: str) -> ExchangeLog:
        assert self.run is not None
        if name not in self._logs:
            playback = self.run.playback
            node = next((i for i, label in playback.labels.items() if label == name), name)
            self._logs[name] = ExchangeLog(playback.recorder.traffic or (), node)
        return self._logs[name]

    # --- what is asked for -----------------------------------------------------------------

    def _tell(self, answer: DoneLine) -> None:
        self.tell({**answer, "t": round(1000 * self.now)})

    @does("pace")
    def _pace(self, _: str, line: PaceChange, on_result: OnResult) -> None:
        factor = line.get("factor")
        paused = line.get("paused")
        if paused is False and self.now >= self._duration:
            self._go_to(0.0)
        self.clock.pace(factor, paused)
        self.tell_now()
        now = "it stands" if self.clock.paused else f"{self.clock.factor:g} times real time"
        on_result(True, now)

    @does("seek")
    def _seek(self, _: str, line: MomentAsked, on_result: OnResult) -> None:
        self._go_to(line["t_ms"] / 1000)
        self.tell_now()
        on_result(True, f"at {self.now:.1f} s")

    def _go_to(self, time: float) -> None:
        self._offset = min(max(0.0, time), self._duration) - self.clock.now
        self._jumps += 1
        self._sent = dict.fromkeys(self._sent, -1)

    @does("open_recording")
    def _open(self, _: str, line: RecordingAsked, on_result: OnResult) -> None:
        if self.shelf is None:
            raise Refused("There are no other recordings.")
        path = self.shelf.find(line["name"])
        self.run = RecordedRun(read_recording(path), path.name)
        self._watched.clear()
        self._logs.clear()
        self._go_to(0.0)
        self.clock.pace(paused=False)
        self._tell_scene()
        on_result(True, f"{path.name} is played")

    @does("event_details")
    def _details(self, _: str, line: DetailsAsked, on_result: OnResult) -> None:
        if self.run is None:
            raise Refused("No recording is played.")
        histories = self.run.system.room(self.now).histories
        details = details_shown(line.get("event"), histories, self.run.playback.label_of)
        on_result(True, "", details=details)

    @does("watch")
    def _watch(self, _: str, line: RobotsWatched) -> None:
        things = () if self.run is None else self.run.things.all
        watched = (t for t in things if t["i"] in line["robots"])
        self._watched = {t["id"] for t in watched if t["kind"] == "robot"}

    @does("look")
    def _look(self, _: str, line: LogsLooked) -> None:
        """Select the logs that pages view; new ones are sent from the beginning."""
        self._looks_at_devices = "devices" in line["tables"]
        self._tell_devices()
        self._sent = {name: self._sent.get(name, -1) for name in line["logs"]}
        self._tell_logs()


@contextmanager
def playing(player: Player) -> Iterator[Player]:
    """Yield a player that leaves nothing behind."""
    try:
        yield player
    finally:
        player.close()


class RecordedAudit:
    """The rows of whichever recording is played; a file that is gone with the player.

    Attributes:
        path: File of the rows.
    """

    def __init__(self) -> None:
        self._folder = TemporaryDirectory(prefix="dva-sim-audit-")
        self.path = Path(self._folder.name) / "audit.json"
        self.path.write_text("[]")

    def show(self, rows: Sequence[Mapping[str, Any]], name: str) -> AuditLine:
        """Open the log of another recording; returns the line for the pages."""
        new = self.path.with_suffix(".new")
        new.write_text(json.dumps(rows))
        new.replace(self.path)  # at once: somebody may be reading
        last = rows[-1] if rows else None
        return {
            "k": "audit",
            "t": 0,
            "rows": 0 if last is None else last["number"],
            "hash": NOTHING_BEFORE if last is None else last["hash"],
            "problem": "",
            "lasting": True,
            "file": name,
        }

    def close(self) -> None:
        """Leave nothing behind."""
        self._folder.cleanup()
