"""Recording of a live run: parts write lines to one file, from which MCAP is made at the end.

Each part writes lines into a pipe and never waits: lines that do not fit are dropped and counted. A
thread of the supervisor copies them to `FILE.part`, so that no robot waits for a disk, and the
lines of a killed part are kept. When all parts have ended, the lines become a recording like that
of a virtual run. If the supervisor is killed, `FILE.part` remains, and can be read like a
recording.
"""

from __future__ import annotations

import fcntl
import json
import re
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Container, Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any

from mcap.exceptions import McapError
from typing_extensions import override

from dva_sim.agents.observation import CameraFrame
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.recorder import Moment, Recorder
from dva_sim.live.judging import FRAME, JUDGED, OWN_SIDE, SEEN, SENT_LINE, LiveJudge
from dva_sim.live.pipes import Inlets
from dva_sim.live.recorded_lines import FORMAT, MAX_BYTES, RunLines, lines_of_part, make_recording
from dva_sim.options.runs import LiveOptions
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.recordings.writing import (
    HELD_TO,
    PART,
)
from dva_sim.serving.pipes import PipeEnd
from dva_sim.simulation.full.observation_json import as_plain
from dva_sim.simulation.full.observations import FactGap, FactLog, terms_of
from dva_sim.simulation.full.verdicts import Verdict, rules_on
from dva_sim.simulation.scenario import Scenario

BYTES_PER_SECOND = 1024 * 1024  # maximum data rate of a part; a drive takes a twentieth [B/s]
SPARE = 0.5  # share reserved for facts of this run's own devices
MAX_ASKED = 5000  # maximum remembered requests of strangers that no rule needs
MAX_FACTS = 20_000  # maximum remembered keys of lines, for `put_new`
MAX_FOREIGN = 200  # maximum devices of other makers whose messages are kept
_ENDS = re.compile(
    rb"<DestinationID>([0-9A-F:]{17})</DestinationID>.{0,200}?<SourceID>([0-9A-F:]{17})<", re.DOTALL
)
_NUMBER = re.compile(rb"<MessageID>\s*(\d{1,20})")
_ANSWERS = re.compile(rb"<Answers>\s*(\d{1,20})")
_ORDERED = b"<Order>", b"<TaskAward>"
_ASKED = b"<RegMsg>", b"<GetDeviceList", b"<GetSensorInfo", b"<GetEventList", b"<GetDispatch"
"""Starts of requests that no rule needs, unless their sender has an order."""
_NOT_KEPT = "not recorded"

Line = list[Any]


class LiveRecorder(Recorder):
    """A recorder that writes to the recording at once.

    Args:
        clock: Clock of the part.
        outlet: Pipe for lines.
        keeps: True to write everything for a recording; otherwise only facts for the rules.

    Attributes:
        log: Callback for the facts that this part observes; None if it has neither robots nor DVA.
        is_own: Predicate for device ids of this run: their messages are recorded where they are
            sent, those of other devices where they arrive.
        team: Ids of all devices of the run, wherever they are; all others are strangers.
    """

    def __init__(self, clock: Clock, outlet: PipeEnd, keeps: bool = True) -> None:
        super().__init__()
        self._clock = clock
        self._outlet = outlet
        self.keeps = keeps
        self.log: FactLog | None = None
        self._filmed = set[str]()
        self._gaps: dict[bool, FactGap] = {}  # not written yet; True: of strangers
        self.is_own: Callable[[str], bool] = lambda _: False
        self.team: Container[str] = ()
        self._ordered: set[str] = set()
        self._of_strangers = False  # True while a stranger's fact is observed
        self._request_keys: OrderedDict[tuple[str, bytes], None] = OrderedDict()
        self._foreign: set[str] = set()
        self._second = 0
        self._room = BYTES_PER_SECOND
        self._drawn: dict[int, tuple[int, int]] = {}
        self._facts: dict[str, Any] = {}

    def put(self, *line: Any) -> bool:
        """Write a line; return False if it does not fit. A gap in the facts is noted later."""
        is_fact = line[0] in JUDGED
        return self._put_as(line, is_fact=is_fact, of_strangers=False)

    def _put_as(self, line: Sequence[Any], is_fact: bool, of_strangers: bool) -> bool:
        """Write a line; leave the reserved room to facts of our own devices."""
        if not self.keeps and line[0] not in JUDGED:
            return True
        is_kept = self._write_gaps() and self._put(line, spare=of_strangers or not is_fact)
        if is_fact and not is_kept:
            self._lose(of_strangers)
        return is_kept

    def _lose(self, of_strangers: bool) -> None:
        """Note that a fact could not be kept."""
        now = self._clock.now
        log = self.log
        sees_dva = log is not None and log.sees_dva
        rules = rules_on(log is not None and log.sees_robots, sees_dva, of_strangers)
        before = self._gaps.get(of_strangers, FactGap(now, 0, now, rules))
        self._gaps[of_strangers] = before._replace(missing=before.missing + 1)

    def _write_gaps(self) -> bool:
        """Write notes of missing facts, if any; return False if they do not fit yet."""
        for of_strangers, gap in list(self._gaps.items()):
            if of_strangers and self._free_bytes() <= SPARE * BYTES_PER_SECOND:
                continue
            word, time, values = as_plain(gap._replace(time=self._clock.now))
            if not self._put([SEEN, time, word, values]):
                return False
            del self._gaps[of_strangers]
        return True

    def _free_bytes(self) -> int:
        """Return the number of bytes that may still be written in this second."""
        if (second := int(time.monotonic())) != self._second:
            self._second = second
            self._room = BYTES_PER_SECOND
        return self._room

    def _put(self, line: Sequence[Any], spare: bool = False) -> bool:
        has_room = self._free_bytes() > (SPARE * BYTES_PER_SECOND if spare else 0)
        data = json.dumps(line).encode() if has_room else b""
        self._room -= len(data)
        is_kept = bool(data) and self._outlet.offer(data + b"\n")
        self.counters[_NOT_KEPT] += not is_kept
        return is_kept

    def put_new(self, *line: Any, key: str) -> None:
        """Write a line if it differs from the last one with that key."""
        if self._facts.get(key) != line and self.put(*line):
            if len(self._facts) >= MAX_FACTS:
                self._facts.clear()
            self._facts[key] = line

    def observe(self, fact: Any) -> None:
        """Write a fact for the safety rules."""
        word, time, values = as_plain(fact)
        self._put_as([SEEN, time, word, values], True, self._of_strangers)

    def is_alive(self) -> None:
        """Write that all facts of this part up to now are written."""
        self.here(())

    def here(self, nodes: Iterable[str]) -> None:
        """Note the devices of this process, whose messages only this part records."""
        self.put(OWN_SIDE, self._clock.now, sorted(nodes))

    @override
    def tell(self, time: float, who: str, what: str, kind: str = "event") -> None:
        super().tell(time, who, what, kind)
        self.put("told", time, who, what, kind)

    @override
    def view(self, time: float, robot: str, x: float, y: float, heading: float) -> None:
        self.put("view", robot, [time, x, y, heading])

    def message(self, node: str, payload: Any, sent: bool) -> None:
        """Record a message that a node of this process sends or receives."""
        now = self._clock.now
        if isinstance(payload, CameraFrame):
            if self.keeps or node not in self._filmed:  # the rules need its capture time
                self._filmed.add(node)
                self.put(FRAME, now, node, payload.observation, payload.captured)
            return
        if not self.keeps and b"<HBMsg>" in payload and sent:
            return
        if sent and self.log is not None:
            self.log.sent(now, node, "", payload)
        ends = _ENDS.search(payload, 0, 400)
        if ends is None:
            return
        destination = ends[1].decode()
        source = ends[2].decode()
        if sent:
            self._note_sent(node, destination, payload)
        else:
            self._note_arrival(node, source, destination, payload)

    def _is_stranger(self, device: str) -> bool:
        return not (self.is_own(device) or device in self.team)

    def _note_sent(self, node: str, destination: str, payload: bytes) -> None:
        """Record a message of an own device; answers that no rule needs are not facts."""
        to_stranger = self._is_stranger(destination)
        if to_stranger and any(word in payload for word in _ORDERED):
            self._ordered.add(destination)
        answers = _ANSWERS.search(payload) if to_stranger and self._request_keys else None
        is_fact = answers is None or (destination, answers[1]) not in self._request_keys
        line = SENT_LINE, self._clock.now, node, destination, payload.decode()
        self._put_as(line, is_fact, to_stranger)

    def _note_arrival(self, node: str, source: str, destination: str, payload: bytes) -> None:
        now = self._clock.now
        is_stranger = self._is_stranger(source)
        if self.keeps and self._is_news(source, payload):
            line = SENT_LINE, now, source, destination, payload.decode()
            self._put_as(line, is_fact=False, of_strangers=True)
        if self.log is None:
            return
        if is_stranger and self.log.sees_dva and self._only_asks(source, payload):
            self.log.heard(source)
        elif self._free_bytes() <= (SPARE * BYTES_PER_SECOND if is_stranger else 0):
            self._lose(is_stranger)
        elif self._is_message(payload):
            self._of_strangers = is_stranger
            self.log.delivered(now, source, node, payload)
            self._of_strangers = False

    def _only_asks(self, source: str, payload: bytes) -> bool:
        """Return True for a request that no rule needs."""
        if source in self._ordered or not any(word in payload for word in _ASKED):
            return False
        if (number := _NUMBER.search(payload)) is not None:
            self._request_keys[source, number[1]] = None
            if len(self._request_keys) > MAX_ASKED:
                self._request_keys.popitem(last=False)
        return True

    def _is_news(self, source: str, data: bytes) -> bool:
        """Return True for a message of a device outside of this run."""
        if self.is_own(source) or self._free_bytes() <= SPARE * BYTES_PER_SECOND:
            return False
        if source not in self._foreign and len(self._foreign) >= MAX_FOREIGN:
            self.counters[_NOT_KEPT] += 1
            return False
        if not self._is_message(data):
            return False  # counted where it is refused
        self._foreign.add(source)
        return True

    def _is_message(self, data: bytes) -> bool:
        """Return True for a valid message; an invalid one uses up spare room like a valid one."""
        try:
            decode(data)
        except ProtocolError:
            reserved = int(SPARE * BYTES_PER_SECOND)
            self._room = min(self._room, max(self._room - len(data), reserved))
            return False
        return True

    def catch_up(self) -> None:
        """Write the changes of drives."""
        for number, drive in enumerate(self.drives):
            frames, commands = self._drawn.get(number, (0, 0))
            facts = [drive.robot, drive.operator, drive.event, drive.ordered]
            facts += [drive.started, drive.ended, drive.outcome]
            self.put_new("drive", drive.operator, number, facts, key=f"drive {number}")
            seen = [(f.captured, f.time) for f in drive.frames[frames:]]
            made = drive.commands[commands:]
            if (seen or made) and self.put("drove", drive.operator, number, seen, made):
                self._drawn[number] = len(drive.frames), len(drive.commands)

    def trace(self, who: str, line: str) -> bool:
        """Write a line of a decider's trace."""
        return self.put("trace", self._clock.now, who, line)


class TraceLines:
    """Trace of a decider in the recording; it ends at a gap, after which it cannot be replayed."""

    def __init__(self, recorder: LiveRecorder, who: str) -> None:
        self._recorder = recorder
        self._who = who
        self._is_complete = True

    def __call__(self, line: str) -> None:
        """Write a line, unless an earlier one was dropped."""
        self._is_complete = self._is_complete and self._recorder.trace(self._who, line)


class TraceFile:
    """Trace in a file, written before each next decision; a full disk ends the trace only.

    Args:
        path: File of the trace.
        complain: Callback for the error once writing fails.

    Raises:
        ConfigError: it cannot be written.
    """

    def __init__(self, path: Path, complain: Callable[[str], object]) -> None:
        self._complain = complain
        try:
            self._file: IO[bytes] | None = path.open("wb", buffering=0)
        except OSError as error:
            raise ConfigError(f"cannot be written: {error.strerror}", path) from error

    def __call__(self, line: str) -> None:
        """Write a line, unless writing has failed before."""
        data = line.encode() + b"\n"
        try:
            while data and self._file is not None:
                data = data[self._file.write(data) :]
        except OSError as error:
            if self._file is not None:
                self._file.close()
            self._file = None
            self._complain(f"keeps no trace any longer: {error.strerror}")


def _lock(file: IO[bytes], path: Path) -> None:
    """Lock a file for this process while it is open.

    Raises:
        ConfigError: another process has locked it.
    """
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise ConfigError("belongs to a run that is still in progress", path) from error


def _emptied(path: Path) -> IO[bytes]:
    """Return an emptied, locked file; its old content is lost only if the disk takes a byte.

    Raises:
        ConfigError: it cannot be written, or another process has locked it.
    """
    try:
        with ExitStack() as stack:
            file = stack.enter_context(path.open("a+b", buffering=0))
            _lock(file, path)
            file.write(b"?")  # a full disk is found before the old content is lost
            file.truncate(0)
            stack.pop_all()
            return file
    except OSError as error:
        raise ConfigError(f"cannot be written: {error.strerror}", path) from error


class Keeper:
    """Writes the lines of all parts into one file.

    Args:
        target: The recording that is to be made.
        seed: Random seed.
        judge: Judge of the safety rules during the run; None: the lines are judged elsewhere.
        also: Further callback for whole lines; optional.

    Attributes:
        inlets: Pipes that parts write to.

    Raises:
        ConfigError: the recording cannot be written.
    """

    def __init__(
        self,
        target: Path,
        scenario: Scenario,
        seed: int,
        judge: LiveJudge | None = None,
        also: Callable[[bytes], object] | None = None,
    ) -> None:
        self._target = target
        self.path = target.with_name(target.name + PART)
        start = {"format": FORMAT, "scenario": scenario.model_dump(mode="json"), "seed": seed}
        start[HELD_TO] = terms_of(scenario, attended=True).about_robots()
        self.problem: str | None = None
        self._room = MAX_BYTES
        self._file = _emptied(self.path)
        self.inlets = Inlets(self.keep, judge, also)
        self._lock = threading.Lock()
        self.keep(json.dumps(start).encode() + b"\n")

    def inlet(self) -> int:
        """Implement `Inlets`."""
        return self.inlets.inlet()

    def keep(self, lines: bytes) -> None:
        """Write whole lines to the file until it fails or is full."""
        with self._lock:
            if self.problem is not None:
                return
            self._room -= len(lines)
            if self._room < 0:
                self.problem = f"it has come to {MAX_BYTES >> 20} MB"
                return
            try:
                while lines:
                    lines = lines[self._file.write(lines) :]
            except OSError as error:
                self.problem = error.strerror or str(error)

    def close(self) -> None:
        """Wait until all parts have ended and their lines are in the file."""
        self.inlets.join()
        self._file.close()

    def finish(self) -> str | None:
        """Make the recording once all parts have ended; return a line if it is incomplete.

        Raises:
            KeyboardInterrupt: the message names the file of lines that remains.
        """
        self.inlets.join()
        try:
            if self.path.exists():
                lines = lines_of_part(self.path)
            else:  # the folder was removed; the open file still has the lines
                lines = RunLines(self._file, self.path)
                self._target.parent.mkdir(parents=True, exist_ok=True)
            lasted = make_recording(lines, self._target)
            self.path.unlink(missing_ok=True)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(self._not_recorded("stopped")) from None
        except (DvaSimError, McapError, MemoryError, OSError) as error:
            return self._not_recorded(self.problem or str(error) or "out of memory")
        finally:
            self._file.close()
        if self.problem is None:
            return None
        return f"{self._target} is recorded up to {lasted:.0f} s only: {self.problem}"

    def _not_recorded(self, why: str) -> str:
        remainder = f"; {self.path} is left; dva-sim replay reads it" if self.path.exists() else ""
        return f"{self._target} was not recorded: {why}{remainder}"


class RunKeeping:
    """Records a live run, if requested, and judges it by the safety rules.

    Args:
        options: Options of the run.
        scenario: Scenario of the run.
        also: Callback for whole lines, too; optional.

    Raises:
        ConfigError: the recording cannot be written.
    """

    def __init__(
        self,
        options: LiveOptions,
        scenario: Scenario,
        also: Callable[[bytes], object] | None = None,
    ) -> None:
        self._judge = LiveJudge(terms_of(scenario, attended=True))
        self._keeper: Keeper | None = None
        self._inlets = Inlets(judge=self._judge, also=also)
        if options.records_run and options.record is not None:
            self._keeper = Keeper(
                options.record, scenario, options.seed, judge=self._judge, also=also
            )
            self._inlets = self._keeper.inlets

    def inlet(self) -> int:
        """Implement `Inlets`."""
        return self._inlets.inlet()

    def news(self) -> list[Moment]:
        """Return the breaches since the last call, after recording them."""
        moments = self._judge.news()
        if self._keeper is not None:
            for moment in moments:
                self._keeper.keep(json.dumps(["told", *moment]).encode() + b"\n")
        return moments

    def finish(self) -> str | None:
        """Make the recording once all parts have ended; see `Keeper`."""
        self._inlets.join()
        self.news()
        return None if self._keeper is None else self._keeper.finish()

    def verdicts(self) -> list[Verdict]:
        """Return the verdicts on the safety rules, once all parts have ended."""
        return self._judge.verdicts()
