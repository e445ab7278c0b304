"""A run as lines of JSON while it runs, and its measures computed from these lines.

Lists that grow (commands, pictures, tracks) are written once and may be forgotten afterwards.
Values that change are written again, and the newest counts. So the memory of a journaled run stays
bounded, and a run that is killed loses only what happened since its last lines.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from itertools import islice
from typing import Any, Final

import numpy as np
from pydantic import TypeAdapter

from dva_sim.core.events import Choice, Event
from dva_sim.kernel.recorder import (
    Applied,
    DriveLog,
    DrivenBy,
    Followed,
    Recorder,
    Shown,
    TrackPoint,
)
from dva_sim.kernel.streams import Streams
from dva_sim.protocol.facts import Fact
from dva_sim.simulation.full.hazards import draw_incidents
from dva_sim.simulation.full.recording import (
    PersonLog,
    Recording,
    RobotLog,
    ending_of,
    event_about,
)
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.scenario import Scenario, site_of
from dva_sim.worlds.hazards import Surroundings

JournalLine = tuple[str, str]
"""A key and JSON. The newest line of a key counts; all lines without a key do, in their order."""

_GROWS: Final[dict[str, Callable[[Any], Any]]] = {
    "applied": Applied._make,
    "frames": Shown._make,
    "intents": Followed._make,
    "attended": tuple,
    "commands": tuple,
    "round_trips": lambda trip: trip,
    "ways": lambda way: (way[0], np.array(way[1], dtype=np.float64)),
}  # lists of a drive, and what makes an entry of its JSON
_FACTS: Final = [field.name for field in fields(DriveLog) if field.name not in _GROWS]
_COUNTED: Final = ("counters", "violations", "exposure")
_EVENT: Final = TypeAdapter(Event)


class RunJournal:
    """Writes the changes of a run as lines.

    Args:
        run: The run, which samples tracks and keeps its events.
        label_of: Returns the name of a device in the journal, by its id.
    """

    def __init__(self, run: Run, label_of: Callable[[str], str]) -> None:
        self._run = run
        self._label_of = label_of
        self._newest: dict[str, str] = {}
        self._drives: dict[int, tuple[int, DriveLog]] = {}  # by identity: number, and the drive
        self._count = 0
        self._written: dict[tuple[str, str], int] = {}  # how much of each list
        self._facts = 0

    def lines(self) -> list[JournalLine]:
        """Return the lines for all changes since the last call."""
        grown = [*self._of_drives(), *self._of_tracks(), *self._of_facts()]
        lines = [("", json.dumps(line)) for line in grown]
        for key, value in self._states():
            text = json.dumps(value)
            if self._newest.get(key) != text:
                self._newest[key] = text
                lines.append((key, text))
        return lines

    def forget(self) -> None:
        """Forget the tracks that are written; lists of drives may have become shorter."""
        recorder = self._run.recorder
        for points in recorder.tracks.values():
            points.clear()
        self._drives = {id(drive): self._drives[id(drive)] for drive in recorder.drives}
        self._written = {
            (str(number), name): len(getattr(drive, name))
            for number, drive in self._drives.values()
            for name in _GROWS
        }

    # --- what grows ------------------------------------------------------------------------

    def _of_drives(self) -> Iterable[list[Any]]:
        for drive in self._run.recorder.drives:
            if id(drive) not in self._drives:
                self._count += 1
                self._drives[id(drive)] = self._count, drive
            number = self._drives[id(drive)][0]
            for name in _GROWS:
                if new := self._new(str(number), name, getattr(drive, name)):
                    if name == "ways":
                        new = [(time, points.tolist()) for time, points in new]
                    yield ["drive", number, name, new]

    def _of_tracks(self) -> Iterable[list[Any]]:
        for name, points in self._run.recorder.tracks.items():
            if new := self._new("track", name, points):
                yield ["track", name, new]

    def _of_facts(self) -> Iterable[list[Any]]:
        facts = self._run.dva.facts
        for fact in islice(facts, self._facts, None):
            yield ["fact", fact.row() | {"label": self._label_of(fact.author)}]
        self._facts = len(facts)

    def _new(self, about: str, name: str, values: Any) -> list[Any]:
        """Return the entries of a list that are not written yet."""
        written = self._written.get((about, name), 0)
        self._written[about, name] = len(values)
        return list(islice(values, written, None))

    # --- what changes ----------------------------------------------------------------------

    def _states(self) -> Iterable[tuple[str, Any]]:
        recording = self._run.recording(sampled=False)
        recorder = self._run.recorder
        yield (
            "run",
            {
                "duration": recording.duration,
                "depth": recording.depth,
                "persons": recording.persons,
                "messages": recorder.messages,
                "bytes": recorder.bytes,
                "people": recording.people,
                "contained": list(recording.contained.items()),
            },
        )
        yield "labels", {tag: self._label_of(tag) for tag in recording.labels}
        yield "radii", recording.radii
        for name in _COUNTED:
            yield name, getattr(recorder, name)
        for tag, robot in recording.robots.items():
            yield f"robot {tag}", robot
        for number, drive in self._drives.values():
            facts = {name: getattr(drive, name) for name in _FACTS}
            yield f"drive {number}", facts | {"refused": list(drive.refused.items())}
        for event in recording.events:
            yield f"event {event.number}", self._event(event)

    def _event(self, event: Event) -> dict[str, Any]:
        """Return an event without the names of people and without their notes."""
        values: dict[str, Any] = _EVENT.dump_python(event, mode="json")
        handling = values["handling"] | {"note": ""}
        for name in ("last", "acknowledged"):
            choice: Choice | None = getattr(event.handling, name)
            if choice is not None:
                handling[name] = choice._replace(label=self._label_of(choice.author))
        return values | {"handling": handling}


def compute_recording(scenario: Scenario, seed: int, lines: Iterable[JournalLine]) -> Recording:
    """Compute a recording of a run from its journal.

    Args:
        scenario: Scenario of the run.
        seed: Seed of the run.
        lines: In their order.

    Raises:
        ConfigError: the site's files are not what they were.
        ValueError: these are not the lines of a run.
    """
    state: dict[str, Any] = {}
    grown: list[list[Any]] = []
    for key, text in lines:
        if key:
            state[key] = json.loads(text)
        else:
            grown.append(json.loads(text))
    try:
        return _assembled(scenario, seed, state, grown)
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error


def _assembled(
    scenario: Scenario, seed: int, state: Mapping[str, Any], grown: Iterable[list[Any]]
) -> Recording:
    recorder = Recorder()
    run_state = state["run"]
    recorder.messages = run_state["messages"]
    recorder.bytes = run_state["bytes"]
    for name in _COUNTED:
        getattr(recorder, name).update(state[name])
    drives = {int(n): _drive(facts) for n, facts in _numbered(state, "drive")}
    recorder.drives = [drives[number] for number in sorted(drives)]
    facts = []
    for kind, *line in grown:
        if kind == "drive":
            number, name, values = line
            getattr(drives[number], name).extend(map(_GROWS[name], values))
        elif kind == "track":
            recorder.tracks[line[0]] += map(TrackPoint._make, line[1])
        else:
            facts.append(Fact(**line[0]))
    robots = {tag: RobotLog._make(values) for tag, values in _numbered(state, "robot")}
    events = [_EVENT.validate_python(event) for _, event in _numbered(state, "event")]
    site = site_of(scenario, seed)
    incidents = draw_incidents(scenario.events, site, Streams(seed))
    return Recording(
        scenario=scenario,
        seed=seed,
        site=site,
        recorder=recorder,
        incidents=incidents,
        surroundings=Surroundings(site, [i.hazard for i in incidents if not i.false_alarm]),
        labels=state["labels"],
        radii=state["radii"],
        duration=run_state["duration"],
        contained=dict(run_state["contained"]),
        endings=[ending_of(event_about(i, events, site, robots)) for i in incidents],
        events=events,
        facts=facts,
        robots=robots,
        people=[PersonLog._make(values) for values in run_state["people"]],
        depth=run_state["depth"],
        persons=tuple(run_state["persons"]),
    )


def _numbered(state: Mapping[str, Any], kind: str) -> Iterable[tuple[str, Any]]:
    """Return the states of the things of a kind, in the order of their first lines."""
    for key, value in state.items():
        what, _, which = key.partition(" ")
        if what == kind:
            yield which, value


def _drive(facts: dict[str, Any]) -> DriveLog:
    refused = Counter(dict(facts.pop("refused")))
    by = DrivenBy(*facts.pop("by"))
    return DriveLog(**facts, refused=refused, by=by, round_trips=[])
