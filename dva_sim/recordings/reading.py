"""An MCAP file of a run, read back: enough to tell its story and draw it, without simulating.

A recording loads no code. Of a hazard whose class is the user's own the file has what it looked
like: its sizes once a second, and what lay over the floor every two seconds; it is shown as it was.
"""

from __future__ import annotations

import base64
import json
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, nan
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pydantic
from typing_extensions import override

from dva_sim.core.events import Event, State
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.recorder import Applied, DriveLog, Moment, Recorder, Sent, Shown, TrackPoint
from dva_sim.protocol.messages import Position
from dva_sim.recordings import channels, messages, writing
from dva_sim.recordings.audit_log import plain_row, row_in
from dva_sim.recordings.raw_records import DamagedError, RawRecords, is_camera
from dva_sim.recordings.writing import (
    FORMAT,
    RUN,
    SCENARIO,
    SITE,
    TABLES,
)
from dva_sim.simulation.full import Ending, Playback
from dva_sim.simulation.full.hazards import RunHazard
from dva_sim.simulation.full.observation_json import of_plain
from dva_sim.simulation.full.observations import SafetyTerms, terms_of
from dva_sim.simulation.scenario import Scenario
from dva_sim.worlds.hazards import KINDS, QUANTITIES, Hazard, Raster, Surroundings
from dva_sim.worlds.site import Site

MAX_LEFT_OUT = 10**6  # maximum samples left out of a standing body: days
Records = Sequence[tuple[float, Mapping[str, Any]]]  # messages of a topic, with their times [s]


class RecordedHazard(Hazard):
    """A hazard as recorded.

    Attributes:
        times: Times of its records [s], in order.
        sizes: Its radius [m], its danger radius [m] and its severity at those times.
    """

    reported_as = "fire"  # nobody asks: what was reported is in the recording

    times: tuple[float, ...]
    sizes: tuple[tuple[float, float, float], ...]

    @override
    def radius(self, time: float) -> float:
        return self._size(time)[0]

    @override
    def danger_radius(self, time: float) -> float:
        return self._size(time)[1]

    @override
    def severity(self, time: float) -> float:
        return self._size(time)[2]

    def _size(self, time: float) -> tuple[float, float, float]:
        """Return the size as last recorded."""
        index = bisect_right(self.times, time)
        return self.sizes[index - 1] if index else (0.0, 0.0, 0.0)


def recorded_hazard(number: int, entry: Mapping[str, Any], records: Records) -> Hazard:
    """Return the stand-in for a hazard.

    Args:
        number: Number of its incident, from 1.
        entry: Entry of the incident in the file.
        records: The messages about all hazards.
    """

    class AsRecorded(RecordedHazard):
        title: ClassVar[str] = entry["described"]["title"]
        shows: ClassVar[tuple[str, ...]] = tuple(entry["described"]["shows"])
        colour: ClassVar[str] = entry["described"]["colour"]
        mark: ClassVar[str] = entry["described"]["mark"]

    states = [(time, state) for time, state in records if state["number"] == number]
    keys = "radius_m", "danger_radius_m", "severity"
    position = entry["hazard"]["position"]
    start = entry["hazard"]["start"]
    return AsRecorded(
        position=tuple(position),
        start=start,
        times=tuple(time for time, _ in states),
        sizes=tuple(tuple(state[key] for key in keys) for _, state in states),
    )


class RecordedSurroundings(Surroundings):
    """Hazard fields over the floor, all hazards together, as last recorded; nothing is simulated.

    Args:
        grids: Recorded values of each quantity.
    """

    def __init__(self, site: Site, hazards: Sequence[Hazard], grids: Mapping[str, Records]) -> None:
        super().__init__(site, hazards)
        self._grids = grids

    @override
    def contain(self, number: int, time: float) -> None:
        # It was, and the file shows what came of it.
        return

    @override
    def raster(self, what: str, time: float, cell: float = 0.25) -> Raster:
        # Cells are as wide as they were recorded.
        what = "smoke" if what == "layer" else what
        west, south, east, north = self._site.extent
        records = self._grids.get(what, ())
        index = bisect_right([when for when, _ in records], time)
        if not index:
            return Raster(np.zeros((1, 1)), (west, east, south, north), QUANTITIES[what].unit)
        content = records[index - 1][1]
        cell = content["cell_size"]["x"]
        place = content["pose"]["position"]
        part = np.frombuffer(base64.b64decode(content["data"]), "<f4")
        part = part.reshape(-1, content["column_count"])
        low = round((place["y"] - south) / cell)
        left = round((place["x"] - west) / cell)
        rows = max(round((north - south) / cell), low + part.shape[0])
        columns = max(round((east - west) / cell), left + part.shape[1])
        values = np.zeros((rows, columns))
        values[low : low + part.shape[0], left : left + part.shape[1]] = part
        extent = west, west + columns * cell, south, south + rows * cell
        return Raster(values, extent, QUANTITIES[what].unit)


@dataclass(frozen=True)
class Opened:
    """A recording that has been read.

    Attributes:
        playback: Content of the run.
        about: Properties stated in the file, such as the version that made it.
        tables: Measures as rows by table, with nan for missing values; None if the file has none.
        lasted: Length of the run [s]; longer than the playback if the file was cut short.
        traces: The lines of what was decided, by who decides.
        audit: The rows of the audit log.
        terms: Limits that the safety rules hold the run to; None: the file has no facts.
        left_out: Number of messages that the file lacks on each topic, for a filtered file.
        is_counted: True if the file says how many messages it had, so that any loss is known.
    """

    playback: Playback
    about: dict[str, str]
    tables: dict[str, list[dict[str, Any]]] | None
    lasted: float
    traces: dict[str, list[str]] = field(default_factory=dict)
    audit: list[dict[str, Any]] = field(default_factory=list)
    terms: SafetyTerms | None = None
    left_out: Mapping[str, int] = field(default_factory=dict)
    is_counted: bool = False

    @property
    def is_whole(self) -> bool:
        """True if the file holds the complete run."""
        return self.playback.duration >= self.lasted


def read_recording(path: Path) -> Opened:
    """Read a recording; of one that was cut short, everything up to the cut.

    Raises:
        ConfigError: no such file, not a recording, a damaged one, or one of a later version.
    """
    raw = RawRecords()
    try:
        with path.open("rb") as file:
            raw.read(file)
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", path) from None
    except DamagedError as error:
        raise ConfigError(str(error), path) from None
    try:
        return _opened(raw)
    except (*_BROKEN, pydantic.ValidationError) as error:
        problem = f"was made by dva-sim {(raw.about or {}).get('version')} and cannot be read: "
        raise ConfigError(problem + " ".join(str(error).split())[:200], path) from None


_BROKEN = KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError, RecursionError


# --- from what was said to what can be shown -------------------------------------------
def _opened(raw: RawRecords) -> Opened:
    run = json.loads(raw.files[RUN])
    if run["format"] > FORMAT:
        raise ValueError(f"its form {run['format']} is later than {FORMAT}")
    scenario = Scenario.model_validate(json.loads(raw.files[SCENARIO]))
    files = {n.removeprefix(SITE): d for n, d in raw.files.items() if n.startswith(SITE)}
    site = writing.unpack(files, scenario, run["seed"])
    records = raw.contents.get(channels.HAZARDS, [])
    incidents = [_incident(n, entry, records) for n, entry in enumerate(run["incidents"], 1)]
    contained = {int(number): time for number, time in run["contained_s"].items()}
    playback = Playback(
        scenario=scenario,
        seed=run["seed"],
        site=site,
        recorder=_recorder(raw, run),
        incidents=incidents,
        surroundings=_surroundings(raw, site, incidents, contained),
        labels=run["labels"],
        radii=run["radii_m"],
        duration=raw.time if raw.is_cut else run["duration_s"],
        contained=contained,
        endings=[] if raw.is_cut else [_ending(entry) for entry in run.get("endings", [])],
        events=[_event(entry) for entry in run.get("events", [])],
        facts=[
            channels.fact_of(time, content)
            for time, content in raw.contents.get(channels.FACTS, ())
        ],
    )
    tables = _tables(raw.files[TABLES]) if TABLES in raw.files else None
    traces = {
        topic.removeprefix(channels.DECISIONS): [entry["line"] for _, entry in item]
        for topic, item in raw.contents.items()
        if topic.startswith(channels.DECISIONS)
    }
    rows = [json.loads(entry["row"]) for _, entry in raw.contents.get(channels.AUDIT, ())]
    terms = None
    if writing.HELD_TO in run:
        terms = terms_of(scenario, run[writing.HELD_TO])
        playback.recorder.facts = list(_facts(raw, run))
    return Opened(
        playback=playback,
        about=raw.about or {},
        tables=tables,
        lasted=run["duration_s"],
        traces=traces,
        audit=[plain_row(row_in(row)) for row in rows],
        terms=terms,
        left_out=Counter(raw.written) - raw.found,
        is_counted=bool(raw.written),
    )


def _facts(raw: RawRecords, run: Mapping[str, Any]) -> Iterator[Any]:
    """Yield the facts that safety rules are judged by, with messages and pictures in between."""
    ids = {name: device for device, name in channels.names_of(run["labels"]).items()}
    for time, topic, content in raw.order:
        if topic.startswith(channels.OBSERVED):
            yield of_plain(topic.removeprefix(channels.OBSERVED), time, content)
        elif is_camera(topic):
            yield Sent(time, ids[topic.split("/")[1]], "", 0, content)
        else:
            ends = raw.ends[topic]["source"], raw.ends[topic]["destination"]
            yield Sent(time, *ends, len(content), content)


def _tables(data: bytes) -> dict[str, list[dict[str, Any]]]:
    return {
        name: [{key: nan if v is None else v for key, v in row.items()} for row in rows]
        for name, rows in json.loads(data).items()
    }


def _incident(number: int, entry: Mapping[str, Any], records: Records) -> RunHazard:
    detected = inf if entry["detected_s"] is None else entry["detected_s"]
    if "described" in entry:
        hazard = recorded_hazard(number, entry, records)
    else:
        settings = dict(entry["hazard"])
        place = tuple(settings.pop("position"))
        hazard = KINDS[entry["kind"]](place, settings.pop("start"), **settings)
    return RunHazard(
        kind=entry["kind"],
        room=entry["room"],
        start=entry["start_s"],
        detected=detected,
        detector=None,
        hazard=hazard,
        false_alarm=entry["false_alarm"],
    )


def _ending(entry: Mapping[str, Any]) -> Ending:
    return Ending(entry["outcome"], inf if entry["time_s"] is None else entry["time_s"])


def _event(entry: Mapping[str, Any]) -> Event:
    return Event(
        number=entry["number"],
        kind=entry["kind"],
        position=Position(entry["latitude_deg"], entry["longitude_deg"]),
        severity=entry["severity"],
        state=State(entry["state"]),
        **{role: entry[role] for role in writing.SENT},
        times=dict(entry["times_s"]),
    )


def _surroundings(
    raw: RawRecords, site: Site, incidents: list[RunHazard], contained: dict[int, float]
) -> Surroundings:
    """Return the hazards' fields: solved again, but for foreign hazards, as recorded."""
    real = [number for number, incident in enumerate(incidents) if not incident.false_alarm]
    hazards = [incidents[number].hazard for number in real]
    if any(isinstance(hazard, RecordedHazard) for hazard in hazards):
        grids = {
            topic.removeprefix(channels.GRIDS): entry
            for topic, entry in raw.contents.items()
            if topic.startswith(channels.GRIDS)
        }
        return RecordedSurroundings(site, hazards, grids)
    surroundings = Surroundings(site, hazards)
    for number, time in contained.items():
        surroundings.contain(real.index(number), time)
    return surroundings


def _recorder(raw: RawRecords, run: Mapping[str, Any]) -> Recorder:
    recorder = Recorder(keep_traffic=True)
    recorder.timeline = [
        Moment(time, log["name"], log["message"], log["kind"])
        for time, log in raw.contents[channels.STORY]
    ]
    end = raw.time if raw.is_cut else inf
    for topic in raw.contents:
        name, _, what = topic[1:].partition("/")
        if what == channels.POSE:
            modes = raw.contents.get(f"/{name}/{channels.ACTIVITY}", [])
            recorder.tracks[name] = _track(raw.contents[topic], modes, run["sampled_s"], end)
    robots = {run["labels"][robot]: robot for robot in run["radii_m"]}
    for name, robot in robots.items():
        views = raw.contents.get(f"/{name}/{channels.SEEN}")
        if views:
            recorder.views[robot] = [_point(time, content, "seen") for time, content in views]
    recorder.traffic = sorted(_traffic(raw, run), key=lambda sent: sent.time)
    recorder.drives = _drives(raw, run)
    return recorder


def _point(time: float, content: Mapping[str, Any], mode: str) -> TrackPoint:
    place = content["pose"]["position"]
    turn = content["pose"]["orientation"]
    return TrackPoint(time, place["x"], place["y"], messages.heading_of(turn), mode)


def _track(
    contents: list[tuple[float, Any]], modes: list[tuple[float, Any]], period: float, end: float
) -> list[TrackPoint]:
    """Return all samples of a track, also those left out while its agent stands still."""
    track: list[TrackPoint] = []
    turns = iter([*modes, (inf, {"activity": ""})])
    mode = ""
    since, following = next(turns)
    for time, content in contents:
        while since <= time:
            mode = following["activity"]
            since, following = next(turns)
        here = _point(time, content, mode)
        track += _left_out(track[-1], here.time, period) if track else ()
        track.append(here)
    # Whoever was there shortly before the file was cut is there up to its end.
    if end - track[-1].time <= channels.ALIVE_S:
        track += [*_left_out(track[-1], end, period), track[-1]._replace(time=end)]
    return track


def _left_out(before: TrackPoint, until: float, period: float) -> Iterator[TrackPoint]:
    missing = max(0, round((until - before.time) / period) - 1)
    if missing > MAX_LEFT_OUT:
        raise ValueError(f"somebody stands for {until - before.time:g} s between two samples")
    return (before._replace(time=before.time + (n + 1) * period) for n in range(missing))


def _traffic(raw: RawRecords, run: Mapping[str, Any]) -> Iterator[Sent]:
    ids = {name: device for device, name in channels.names_of(run["labels"]).items()}
    for topic, entry in raw.contents.items():
        if topic in raw.ends:
            ends = raw.ends[topic]["source"], raw.ends[topic]["destination"]
            yield from (Sent(time, *ends, len(data), data) for time, data in entry)
        elif topic.endswith(f"/{channels.CAMERA}"):
            source = ids[topic.split("/")[1]]
            for time, frame in entry:
                yield Sent(time, source, ids[frame["to"]], frame["size_bytes"], frame)


def _drives(raw: RawRecords, run: Mapping[str, Any]) -> list[DriveLog]:
    drives = [
        DriveLog(**{key.removesuffix("_s"): entry[key] for key in writing.DRIVE})
        for entry in run["drives"]
    ]
    for topic, contents in raw.contents.items():
        for time, content in contents if topic.endswith(f"/{channels.SCREEN}") else ():
            drives[content["drive"]].frames.append(Shown(content["captured_s"], time, 0))
        for time, made in contents if topic.endswith(f"/{channels.COMMANDS}") else ():
            command = time, made["speed_m_s"], made["turn_rate_rad_s"]
            drives[made["drive"]].commands.append(command)
    for drive in drives:
        for time, item in raw.contents.get(f"/{run['labels'][drive.robot]}/{channels.APPLIED}", ()):
            if drive.ordered <= time and (drive.ended is None or time <= drive.ended):
                drive.applied.append(_applied(time, item))
    return drives


def _applied(time: float, content: Mapping[str, Any]) -> Applied:
    until = content["until_s"]
    captured = content["captured_s"]
    return Applied(
        issued=content["made_s"],
        sent=content["sent_s"],
        arrived=content["arrived_s"],
        time=time,
        until=inf if until is None else until,
        sample_age=nan,
        captured=nan if captured is None else captured,
    )
