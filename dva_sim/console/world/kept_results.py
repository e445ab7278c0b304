"""Drives of people as a results folder, with the tables of any run: a study of one run.

The study asks nothing; its scenario and seed are those of the console. Who drove has a number and
no name: what a phone calls itself stays out of the tables.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from dva_sim.console.world.world import ConsoleWorld
from dva_sim.experiments.execution.kept_run import KeptRun, complete, is_left
from dva_sim.experiments.results.folder_lock import LOCK, FolderLock
from dva_sim.experiments.results.manifest import manifest_of
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.config_overrides import parse_changes
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.recorder import DriveLog
from dva_sim.simulation.full.run_journal import RunJournal
from dva_sim.simulation.full.stage import kind_of
from dva_sim.simulation.scenario import Scenario

PART = "console"
LOOK = 1.0  # from one look at who drives with what to the next, real time [s]


class KeptResults:
    """A results folder in the making, which no other process writes into until it is closed.

    Events are in its journal within a second, whatever becomes of the console.

    Args:
        out: The folder.
        scenario: Name or path.
        changes: Changes of the scenario, `KEY=VALUE`.
        seed: Random seed of the study.
        overwrite: True to replace existing files.

    Attributes:
        scenario: Scenario to be run.
        seed: Random seed of the run.

    Raises:
        ConfigError: no such scenario, or the folder holds something already.
        FolderInUse: another process writes into the folder.
    """

    def __init__(
        self, out: Path, scenario: str, changes: Sequence[str], seed: int, overwrite: bool
    ) -> None:
        if out.exists() and not out.is_dir():
            raise ConfigError(f"{out} holds something already: give the name of a folder")
        part = {"scenario": scenario, "changes": dict(parse_changes(changes))}
        design = {"persons": 1, "replications": 1, "seed": seed, "parts": {PART: part}}
        question = f"What did people do in {scenario!r} at a console?"
        self._out = out
        self._study = Study.model_validate({"question": question} | design)
        self._plan = StudyPlan.of(self._study)
        (self._job,) = self._plan.jobs
        assert isinstance(self._job.scenario, Scenario)
        self.scenario = self._job.scenario
        self.seed = self._job.seed
        self._persons: dict[str, int] = {}  # numbers by page or device, as they took part
        self._rooms: dict[str, int] = {}  # numbers by control room
        self._contacts: dict[int, int] = {}  # of robots before a drive, by the drive's identity
        self._world: ConsoleWorld | None = None
        self._kept: KeptRun | None = None
        self._problem = ""
        was_left = is_left(out) and not overwrite
        if was_left:
            complete(out)
        self._is_new = not out.exists()
        self._lock = FolderLock(out)
        try:
            if any(path.name != LOCK for path in out.iterdir()) and not overwrite:
                held = (
                    "a run that was cut off, whose tables are made now" if was_left else "something"
                )
                raise ConfigError(
                    f"{out} holds {held} already: give another folder, or --overwrite"
                )
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Let others write into the folder; a new one in which nothing was kept is removed."""
        self._lock.close()
        if self._is_new:
            with suppress(OSError):
                self._out.rmdir()

    def follow(self, world: ConsoleWorld) -> None:
        """Keep from now on what happens: who drives, with what, and all that is measured.

        Raises:
            DvaSimError: the folder cannot be written.
        """
        manifest = manifest_of(self._plan)
        manifest |= {"runs": 1, "stopped": None, "failures": [], "by_people": True}
        self._kept = KeptRun(self._out, manifest, self.scenario, self.seed)
        self._world, self._journal = world, RunJournal(world.run, self._label_of)
        world.recorder.on_ordered = self._attribute  # one that is over soon is never looked at
        world.recorder.on_tidy = self._keep
        world.recorder.on_tidied = self._journal.forget
        world.clock.pulse(LOOK, self._look)

    def _label_of(self, id_tag: str) -> str:
        """Return the label of a device, unless a person may have given it."""
        assert self._world is not None
        if id_tag in self._rooms:
            return f"person-{self._rooms[id_tag]}"
        if kind_of(id_tag)[0] in PEOPLES:
            return name_of(id_tag)
        return self._world.run.stage.labels.get(id_tag, id_tag)

    def _keep(self) -> None:
        assert self._world is not None
        assert self._kept is not None
        self._look()
        self._kept.put(self._journal.lines())
        if self._kept.problem != self._problem:
            self._problem = self._kept.problem
            text = f"cannot be written: {self._problem}" if self._problem else "is written again"
            self._world.note(f"the results folder {self._out} {text}")

    def _look(self) -> None:
        assert self._world is not None
        for client, room in self._world.rooms.by_client.items():
            self._rooms.setdefault(room.device.id_tag, self._number(client))
        for log in self._world.recorder.drives:
            if log.ended is None:
                self._attribute(log)
            elif id(log) in self._contacts:
                self._count_contacts(log)
                del self._contacts[id(log)]

    def _number(self, person: str) -> int:
        """Return the number of a person, by their page, or by their device if they have none."""
        return self._persons.setdefault(person, len(self._persons) + 1)

    def _count_contacts(self, log: DriveLog) -> None:
        assert self._world is not None
        robot = self._world.run.field.robots.get(log.robot)
        if robot is not None:
            before = self._contacts.setdefault(id(log), robot.body.contacts)
            log.by = log.by._replace(contacts=float(robot.body.contacts - before))

    def _attribute(self, log: DriveLog) -> None:
        """Say which person drives, and with what; nothing of a simulated one."""
        assert self._world is not None
        world = self._world
        seats = world.phones.by_client.values()
        phones = {seat.person.device.id_tag: seat for seat in seats if seat.person}
        phone = phones.get(log.operator)
        at_page = {person.device.id_tag for person in world.seating.persons.values()}
        if phone is None and log.operator not in at_page:
            return
        clients = {
            person.device.id_tag: world.seating.client_of.get(seat)
            for seat, person in world.seating.persons.items()
        }
        number = self._number(clients.get(log.operator) or log.operator)
        pattern = world.run.stage.pattern_name(log.robot)
        delay = float(world.sliders.line().get("delay_s", math.nan))
        by = log.by._replace(person=f"person-{number}", pattern=pattern, link_delay_s=delay)
        if phone is not None:
            by = by._replace(
                pipeline=phone.settings.pipeline, sensor_hz=phone.rate_hz or by.sensor_hz
            )
        log.by = by
        self._count_contacts(log)

    def write(self) -> None:
        """Write all; nothing where nothing was followed.

        Raises:
            DvaSimError: the disk is full or refuses to be written, or some tables cannot be made.
        """
        if self._world is None or self._kept is None:
            return
        try:
            self._world.run.recording()  # the last look at rules and places
            self._keep()
        finally:
            self._kept.close()


PEOPLES = ("console", "control-room", "phone")  # kinds of devices that people name


def name_of(id_tag: str) -> str:
    """Return a device by its kind and number, whatever its owner calls it."""
    kind, number = kind_of(id_tag)
    return f"{kind}-{number}"
