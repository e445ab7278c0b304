"""A recording made of the lines that the parts of a live run have written.

The lines are in `FILE.mcap.part` until the run ends, and remain there if it is killed. Reading
never changes them, as the run may still write.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any

from dva_sim.agents.observation import CameraFrame
from dva_sim.core.events import Event, State
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.recorder import DriveLog, Moment, Recorder, Sent, Shown, TrackPoint
from dva_sim.kernel.streams import Streams
from dva_sim.live.judging import Facts, read_observation
from dva_sim.protocol.facts import Fact
from dva_sim.protocol.messages import Position
from dva_sim.recordings.writing import (
    HELD_TO,
    PART,
    SUFFIX,
    check_target,
    write_recording,
)
from dva_sim.simulation.full import Playback
from dva_sim.simulation.full.dva_trace import OWN_CODE
from dva_sim.simulation.full.hazards import draw_incidents
from dva_sim.simulation.full.recording import ending_of, event_about
from dva_sim.simulation.full.stage import DVA
from dva_sim.simulation.scenario import Scenario, site_of
from dva_sim.worlds.hazards import Surroundings

FORMAT = 1  # version of the lines
MAX_BYTES = 128 * 1024 * 1024  # maximum size of a file of lines: about an hour of driving

Line = list[Any]


def record(part: Path, target: Path) -> float:
    """Make a recording from the lines of a run, without removing them; return its duration [s].

    Args:
        part: File of the lines; the run may still write to it.
        target: The recording.

    Raises:
        DvaSimError: the lines are missing, they name a class in a file, or the recording cannot
            be written.
    """
    lines = lines_of_part(part)
    if OWN_CODE in json.dumps(lines.start["scenario"]["events"]):
        raise ConfigError("names a class in a Python file; a recording never runs code", part)
    return make_recording(lines, target)


def lines_of_part(part: Path) -> RunLines:
    """Return the lines of a file, sorted.

    Raises:
        ConfigError: they cannot be read, or are something else.
    """
    try:
        with part.open("rb") as file:
            return RunLines(file, part)
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", part) from error


def make_recording(lines: RunLines, target: Path) -> float:
    """Write a recording; return its duration [s].

    Raises:
        DvaSimError: it cannot be written.
    """
    playback = lines.playback()
    about = {"time": "real, from the start of the run", "live": "over sockets"}
    write_recording(playback, target, about=about, traces=lines.traces, audit=lines.audit)
    return playback.duration


def is_part(file: Path) -> bool:
    """Return True if a file has the name of lines of a running or killed run."""
    return file.suffix == PART


@contextmanager
def readable(file: Path, to: Path | None = None) -> Iterator[Path]:
    """Yield a recording to read: the file itself, or a temporary one made from its lines.

    Args:
        file: A recording, or the lines of a run.
        to: Path for a permanent recording; optional.

    Raises:
        DvaSimError: the recording cannot be made, or is not needed.
    """
    if not is_part(file):
        if to is not None:
            raise ConfigError(f"is already a recording; --mcap is for a {SUFFIX}{PART} file", file)
        yield file
        return
    if to is not None:
        check_target(to, remedy="give another name")
        record(file, to)
        yield to
        return
    with TemporaryDirectory(prefix="dva-sim-") as folder:
        made = Path(folder) / file.stem
        record(file, made)
        yield made


def _read_all(file: IO[bytes]) -> bytes:
    """Return the content of an unbuffered file, whose `read` may return less than requested."""
    pieces = list[bytes]()
    while piece := file.read(1 << 24):
        pieces.append(piece)
    return b"".join(pieces)[:MAX_BYTES]


class RunLines:
    """The lines of a run, sorted.

    Args:
        file: Open file of the lines.
        part: Path of the file.

    Raises:
        ConfigError: they cannot be read, or are something else.
    """

    def __init__(self, file: IO[bytes], part: Path) -> None:
        self.recorder = Recorder(keep_traffic=True)
        self.traces: dict[str, list[tuple[float, str]]] = defaultdict(list)
        self.audit: list[tuple[float, dict[str, Any]]] = []
        self.duration = 0.0
        self.radii = dict[str, float]()
        self._labels = {DVA: "dva"}
        self._contained = dict[int, float]()
        self._events: dict[int, Event] = {}
        self._facts: list[Fact] = []
        self._drives: dict[tuple[str, int], DriveLog] = {}
        try:
            file.seek(0)
            first, *lines = _read_all(file).split(b"\n")
            self.start = json.loads(first)
            if self.start["format"] > FORMAT:
                raise ValueError("made by a later version")
            # The text after the last line break is an incomplete line.
            reports = [json.loads(line) for line in lines[:-1]]
            for kind, *values in reports:
                getattr(self, f"_{kind}")(*values)
            self.recorder.facts = _facts_in(reports) if HELD_TO in self.start else None
        except OSError as error:
            raise ConfigError(f"cannot be read: {error.strerror}", part) from error
        except (ValueError, LookupError, TypeError, AttributeError) as error:
            raise ConfigError(f"contains no lines of a live run: {error}", part) from error

    def playback(self) -> Playback:
        """Return the run for stories and pictures."""
        scenario = Scenario.model_validate(self.start["scenario"])
        seed = self.start["seed"]
        site = site_of(scenario, seed)
        recorder = self.recorder
        incidents = draw_incidents(scenario.events, site, Streams(seed))
        real = [number for number, incident in enumerate(incidents) if not incident.false_alarm]
        surroundings = Surroundings(site, [incidents[number].hazard for number in real])
        for number, when in self._contained.items():
            surroundings.contain(real.index(number), when)
        recorder.timeline.sort(key=lambda moment: moment.time)
        recorder.traffic = sorted(self._traffic(), key=lambda sent: sent.time)
        recorder.drives = [drive for _, drive in sorted(self._drives.items())]
        for sent in recorder.traffic:
            for end in (sent.source, sent.destination):
                self._labels.setdefault(end, end)
        events = list(self._events.values())
        return Playback(
            scenario=scenario,
            seed=seed,
            site=site,
            recorder=recorder,
            incidents=incidents,
            surroundings=surroundings,
            labels=self._labels,
            radii=self.radii,
            duration=self.duration,
            contained=self._contained,
            endings=[ending_of(event_about(i, events, site, self.radii)) for i in incidents],
            events=events,
            facts=self._facts,
            about_robots=self.start.get(HELD_TO),
        )

    def _traffic(self) -> Iterator[Sent]:
        """Yield messages; the receiver of a frame is the robot's driver, or empty without one."""
        for sent in self.recorder.traffic or ():
            if sent.destination:
                yield sent
                continue
            drives = [d for d in self._drives.values() if d.robot == sent.source]
            watching = [d.operator for d in drives if d.ordered <= sent.time]
            yield sent._replace(destination=watching[-1] if watching else DVA)

    # --- lines by their first word -------------------------------------------------------

    def _until(self, when: float) -> None:
        self.duration = max(self.duration, when)

    def _told(self, when: float, *words: str) -> None:
        self._until(when)
        self.recorder.timeline.append(Moment(when, *words))

    def _view(self, robot: str, seen: list[float]) -> None:
        when, x, y, heading = seen
        self.recorder.views[robot].append(TrackPoint(when, x, y, heading, "seen"))

    def _team(self, labels: Mapping[str, str], radii: Mapping[str, float]) -> None:
        self._labels.update(labels)
        self.radii.update(radii)

    def _at(self, when: float, places: list[list[Any]]) -> None:
        self._until(when)
        for name, x, y, heading, mode in places:
            self.recorder.tracks[name].append(TrackPoint(when, x, y, heading, mode))

    def _sent(self, when: float, source: str, destination: str, text: str) -> None:
        self._until(when)
        data = text.encode()
        self._messages.append(Sent(when, source, destination, len(data), data))

    def _frame(self, when: float, robot: str, seen: list[Any], captured: float) -> None:
        size = self.start["scenario"]["camera"]["frame_bytes"]
        frame = CameraFrame(read_observation(seen), captured)
        self._messages.append(Sent(when, robot, "", size, frame))

    def _here(self, when: float, _: list[str]) -> None:
        self._until(when)

    def _seen(self, when: float, *_: Any) -> None:
        """Note only the time: `_facts_in` reads the fact."""
        self._until(when)

    @property
    def _messages(self) -> list[Sent]:
        assert self.recorder.traffic is not None
        return self.recorder.traffic

    def _drive(self, operator: str, number: int, facts: list[Any]) -> None:
        robot, driver, event, ordered, started, ended, outcome = facts
        log = self._drives.setdefault((operator, number), DriveLog(robot, driver, event, ordered))
        log.started = started
        log.ended = ended
        log.outcome = outcome

    def _drove(self, operator: str, number: int, seen: Line, made: Line) -> None:
        drive = self._drives[operator, number]
        drive.frames += [Shown(captured, when, 0) for captured, when in seen]
        drive.commands += [(when, speed, turn_rate) for when, speed, turn_rate in made]

    def _contains(self, number: int, when: float) -> None:
        self._contained[number] = when

    def _event(self, number: int, kind: str, at: list[float], state: str, *more: Any) -> None:
        """Read an event; older versions did not record all its values."""
        times, severity, sent = (*more, 0.0, {})[:3]
        event = Event(
            number, kind, Position(*at), severity, state=State(state), times=times, **sent
        )
        self._events[number] = event

    def _fact(self, held: dict[str, Any]) -> None:
        self._facts.append(Fact(**held))

    def _audited(self, row: dict[str, Any]) -> None:
        self.audit.append((float(row["time_s"]), row))

    def _cameras(self, _: str) -> None:
        """Ignore the address of pictures, which are not recorded."""

    def _trace(self, when: float, who: str, line: str) -> None:
        self.traces[who].append((when, line))


def _facts_in(lines: Sequence[Line]) -> list[Any]:
    """Return the facts in order of time; those of the same part keep the order of their lines."""
    reads = Facts(most=None)
    for line in lines:
        reads.note(line)
    facts = [fact for line in lines if (fact := reads.fact(line)) is not None]
    return sorted(facts, key=lambda fact: fact.time)
