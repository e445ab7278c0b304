"""Runs that can be watched again, and the typical and the worst of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.run_grid import Floats, Setting, Table, as_floats, plain_level
from dva_sim.experiments.execution.kept_recordings import FOLDER
from dva_sim.simulation.labels import measure_called


class Tables(NamedTuple):
    """Tables of the runs, events and tracks.

    Attributes:
        runs: All of them.
        tracks: Positions of agents over time, in some of the runs.
        names: Columns that name a cell: its factors.
        events: Times of each event (occurred, found, dealt with), and its room.
    """

    runs: Table
    tracks: Table
    names: Sequence[str]
    events: Table | None = None


class SeenIncident(NamedTuple):
    """Incident with its time [s], and its position [m] or else its room."""

    kind: str
    start: float
    x: float
    y: float
    room: str = ""


class Span(NamedTuple):
    """Part of a run that a measure spans: start [s], end [s], and the event that ends it."""

    begins: float
    ends: float
    by: str


@dataclass(frozen=True)
class KeptEpisode:
    """One run that was kept.

    Attributes:
        setting: Levels of its cell.
        person: Person who drove.
        trial: Trial of that person.
        value: Its measure.
        moments: Columns `agent`, `t_s`, `x_m`, `y_m`, `heading_rad`, `mode`: who was where, when.
        incidents: Kind, start [s] and place [m] of each, where a recording tells them.
        kept: Number of kept runs to choose from.
        rank: Share of all runs with a smaller value.
        span: Part of the run that the measure spans; None if it is not a duration, or never ended.
    """

    setting: Setting
    person: int
    trial: int
    value: float
    moments: Table
    incidents: tuple[SeenIncident, ...]
    kept: int
    rank: float
    span: Span | None = None


def typical_and_worst(
    folder: Path, part: str, measure: str, tables: Tables
) -> tuple[KeptEpisode, KeptEpisode] | None:
    """Find the kept run nearest to the median of all, and the kept run with the largest value.

    A recording is preferred where the study kept some; else the tracks of the table are taken.
    None where nothing was kept.

    Args:
        folder: Results folder.
        measure: By which they are judged.
        tables: The runs, their tracks, and the columns that name a cell.
    """
    here = np.asarray(tables.runs["part"]) == part
    here &= ~np.asarray(tables.runs["is_reference"]).astype(bool)
    runs = {name: np.asarray(values)[here] for name, values in tables.runs.items()}
    values = as_floats(runs[measure]) if measure in runs else np.full(here.sum(), np.nan)
    files = _recorded(folder / FOLDER, part, runs)
    rows = np.array(sorted(files)) if files else _tracked(tables.tracks, part, runs)
    rows = rows[np.isfinite(values[rows])] if len(rows) else rows
    if not len(rows):
        return None
    every = values[np.isfinite(values)]
    chosen = np.argmin(abs(values[rows] - np.median(every))), np.argmax(values[rows])
    episodes = []
    for row in (int(rows[at]) for at in chosen):
        moments, incidents = _seen(files, tables.tracks, part, runs, row)
        events = _of_run(tables.events, part, runs, row)
        where = {name: plain_level(runs[name][row]) for name in tables.names}
        value = float(values[row])
        episodes.append(
            KeptEpisode(
                setting=where,
                person=int(runs["person"][row]),
                trial=int(runs["trial"][row]),
                value=value,
                moments=moments,
                incidents=incidents or _listed_incidents(events),
                kept=len(rows),
                rank=float((every < value).mean()),
                span=_span(events, measure, value),
            )
        )
    return episodes[0], episodes[1]


def _key(runs: Table, row: int) -> tuple[int, int, int]:
    return int(runs["cell"][row]), int(runs["person"][row]), int(runs["trial"][row])


def _recorded(folder: Path, part: str, runs: Table) -> dict[int, Path]:
    """The recording of each run that has one, by the run's row."""
    if not folder.is_dir() or "cell" not in runs:
        return {}
    there = {path.name: path for path in folder.glob(f"{part}-*.mcap")}
    names = {
        row: "-".join(map(str, (part, *_key(runs, row)))) for row in range(len(runs["person"]))
    }
    return {row: there[f"{n}.mcap"] for row, n in names.items() if f"{n}.mcap" in there}


def _tracked(tracks: Table, part: str, runs: Table) -> NDArray[np.intp]:
    """Rows of the runs whose tracks are in the table."""
    if not tracks or "cell" not in runs:
        return np.array([], dtype=np.intp)
    here = np.asarray(tracks["part"]) == part
    columns = [np.asarray(tracks[name])[here].tolist() for name in ("cell", "person", "trial")]
    known = set(zip(*columns, strict=True))
    rows = range(len(runs["person"]))
    return np.array([row for row in rows if _key(runs, row) in known], dtype=np.intp)


def _seen(
    files: Mapping[int, Path], tracks: Table, part: str, runs: Table, row: int
) -> tuple[Table, tuple[SeenIncident, ...]]:
    """Return tracks and incidents of a run, from its recording or else from the tables."""
    if row in files:
        from dva_sim.recordings.reading import read_lapse  # late: start-up

        lapse = read_lapse(files[row])
        places = [(i, i.hazard.position) for i in lapse.incidents]
        found = (SeenIncident(i.kind, float(i.start), float(x), float(y)) for i, (x, y) in places)
        return lapse.tracks, tuple(found)
    return _of_run(tracks, part, runs, row), ()


def _of_run(table: Table | None, part: str, runs: Table, row: int) -> Table:
    """The rows of another table that are about a run."""
    if not table or "cell" not in table:
        return {}
    mine = np.asarray(table["part"]) == part
    for name, value in zip(("cell", "person", "trial"), _key(runs, row), strict=True):
        mine &= np.asarray(table[name]) == value
    return {name: np.asarray(values)[mine] for name, values in table.items()}


def _listed_incidents(events: Table) -> tuple[SeenIncident, ...]:
    """Incidents listed in the table of events, with their rooms."""
    if "t_occurred_s" not in events:
        return ()
    columns = (events["kind"], as_floats(events["t_occurred_s"]), events["room"], events["is_true"])
    rows = zip(*(np.asarray(column).tolist() for column in columns), strict=True)
    real = [(kind, t, math.nan, math.nan, room or "") for kind, t, room, true in rows if true]
    return tuple(SeenIncident(*fields) for fields in real)


_ENDS = {"confirmation": "t_confirmed_s", "response": "t_arrived_s"}


def _span(events: Table, measure: str, value: float) -> Span | None:
    """Return the span that a waiting measure covers in a run with one event."""
    by = measure_called(measure).awaits
    ends = as_floats(events[_ENDS[by]]) if _ENDS.get(by) in events else np.array([])
    if len(ends) != 1 or not np.isfinite(ends[0]) or ends[0] < value:
        return None
    return Span(float(ends[0]) - value, float(ends[0]), by)


def agents_of(moments: Table) -> list[str]:
    """Agents whose ways are known, in order."""
    return sorted({str(name) for name in moments["agent"]})


def way_of(moments: Table, agent: str) -> tuple[Floats, Floats]:
    """Times `(n,)` [s] and places with headings `(n, 3)` of one agent, in order of time."""
    mine = np.asarray(moments["agent"]).astype(str) == agent
    times = as_floats(np.asarray(moments["t_s"])[mine])
    columns = [as_floats(np.asarray(moments[k])[mine]) for k in ("x_m", "y_m", "heading_rad")]
    order = np.argsort(times, kind="stable")
    return times[order], np.column_stack(columns)[order]


def instants(episode: KeptEpisode, count: int) -> Sequence[float]:
    """Times [s] spread evenly over what the measure is the length of, else over the whole run."""
    times = as_floats(np.asarray(episode.moments["t_s"]))
    begins, ends = episode.span[:2] if episode.span else (times.min(), times.max())
    return [float(t) for t in np.linspace(begins, ends, count)]
