"""What people did at a console as a results folder, with the tables of any run: a study of one run.

The study asks nothing; its scenario and seed are those of the console. Who drove has a number and
no name: what a phone calls itself stays out of the tables.
"""

from __future__ import annotations

import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dva_sim.console.world import ConsoleWorld
from dva_sim.experiments.results.manifest import machine, manifest_of, write_json
from dva_sim.experiments.results.results import MACHINE, MANIFEST, TABLES, digests
from dva_sim.experiments.results.tables import write_tables
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.config_overrides import parse_changes
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.full.drive_tables import drive_tables
from dva_sim.simulation.full.measures import tables_of
from dva_sim.simulation.full.stage import kind_of
from dva_sim.simulation.scenario import Scenario

PART = "console"
LOOK = 1.0  # from one look at who drives with what to the next, real time [s]


class KeptResults:
    """A results folder in the making.

    Args:
        out: The folder.
        scenario: By name or path.
        changes: Of the scenario, `KEY=VALUE`.
        seed: Of the study.
        overwrite: What is there may be replaced.

    Attributes:
        scenario: As it is to be run.
        seed: Of the run.

    Raises:
        ConfigError: no such scenario, or the folder holds something already.
    """

    def __init__(
        self, out: Path, scenario: str, changes: Sequence[str], seed: int, overwrite: bool
    ) -> None:
        if out.exists() and (not out.is_dir() or (any(out.iterdir()) and not overwrite)):
            raise ConfigError(f"{out} holds something already: give another folder, or --overwrite")
        part = {"scenario": scenario, "changes": dict(parse_changes(changes))}
        asked = {"persons": 1, "replications": 1, "seed": seed, "parts": {PART: part}}
        question = f"What did people do who drove in {scenario!r} at a console?"
        self._out, self._study = out, Study.model_validate({"question": question} | asked)
        self._cells = cell_grid.cells(self._study)
        (self._job,) = cell_grid.jobs(self._study, self._cells)
        assert isinstance(self._job.scenario, Scenario)
        self.scenario, self.seed = self._job.scenario, self._job.seed
        self._persons: dict[str, int] = {}  # numbers by device, as they began to drive
        self._world: ConsoleWorld | None = None

    def follow(self, world: ConsoleWorld) -> None:
        """Note from now on who drives, and with what."""
        self._world = world
        world.clock.pulse(LOOK, self._look)

    def _look(self) -> None:
        assert self._world is not None
        world = self._world
        persons = {person.device.id_tag: person for person in world.persons}
        phones = {s.person.device.id_tag: s for s in world.phones.by_client.values() if s.person}
        for log in world.recorder.drives:
            if log.ended is not None or log.operator not in persons | phones:
                continue
            phone = phones.get(log.operator)
            number = self._persons.setdefault(log.operator, len(self._persons) + 1)
            pattern = world.feed.pattern_of(log.robot)
            by = log.by._replace(person=f"person-{number}", pattern=pattern)
            if phone is not None:
                by = by._replace(
                    pipeline=phone.settings.pipeline, sensor_hz=phone.rate_hz or by.sensor_hz
                )
            log.by = by

    def write(self) -> None:
        """Write all.

        Raises:
            DvaSimError: the disk is full or refuses to be written.
        """
        assert self._world is not None
        self._look()
        recording = self._world.run.recording()
        names = {tag: name_of(tag) for tag in recording.labels if kind_of(tag)[0] in PEOPLES}
        recording.labels = recording.labels | names
        tables = tables_of(recording) | drive_tables(recording)
        study, jobs = self._study, [self._job]
        manifest = manifest_of(study, self._cells, jobs)
        self._out.mkdir(parents=True, exist_ok=True)
        write_tables(self._out, jobs, lambda _: tables)
        manifest |= {"runs": 1, "stopped": None, "failures": []}
        write_json(self._out / MANIFEST, manifest | {"tables": digests(self._out / TABLES)})
        facts: dict[str, Any] = {"wall_s": recording.duration, "platform": platform.platform()}
        write_json(self._out / MACHINE, machine(jobs, {}) | facts)


PEOPLES = ("console", "phone")  # kinds of devices that people name


def name_of(id_tag: str) -> str:
    """A device by its kind and number, whatever its owner calls it."""
    kind, number = kind_of(id_tag)
    return f"{kind}-{number}"
