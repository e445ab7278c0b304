"""One run in real time: two programs at the ends of an emulated link, and what they noted."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple

from dva_sim.kernel.errors import ConfigError, RunsFailed
from dva_sim.network.emulator.needs import EmulatorError
from dva_sim.network.emulator.process import ADDRESSES, LinkProcess
from dva_sim.network.emulator.report import LinkReport
from dva_sim.network.link import LinkConfig
from dva_sim.network.middleware import SIDES, Side, load_transport, programs
from dva_sim.network.middleware.programs import NOT_CONNECTED, Plan
from dva_sim.network.workload import FileNotes, Note
from dva_sim.serving.processes import Child, end_all
from dva_sim.simulation.middleware.scenario import MiddlewareScenario

LINGER_S: Final = 0.2  # time in which the robot still receives the last messages [s]
PATIENCE_S: Final = 10.0  # time for the operator's program to end [s]


class Window(NamedTuple):
    """The time that is measured, and when the run began, by one clock [s]."""

    start: float
    since: float
    until: float

    @property
    def length(self) -> float:
        """Length of the window [s]."""
        return self.until - self.since


class MiddlewareRun(NamedTuple):
    """Results of a run.

    Attributes:
        near: Notes of the operator's program.
        far: Notes of the robot's program.
        window: The time that was measured.
        link: Report of the link: packets, and its own lateness.
        attempts: Runs made until one was undisturbed; this is the last.
        load: Runnable processes of the machine when it began, one-minute mean.
    """

    scenario: MiddlewareScenario
    near: list[Note]
    far: list[Note]
    window: Window
    link: LinkReport
    attempts: int
    load: float

    @property
    def is_disturbed(self) -> bool:
        """True if the machine, and not the link alone, determined when packets came out."""
        return self.link.is_disturbed


def lacks(scenario: MiddlewareScenario) -> str:
    """Return, in one line, what the transport or the link lacks here; empty if nothing."""
    choice = scenario.transport
    return load_transport(choice.name, choice.options)().lacks() or _why_no_link()


@cache
def _why_no_link() -> str:
    try:
        LinkProcess(LinkConfig(), 1).close()
    except EmulatorError as error:
        return str(error)
    return ""


def measure(scenario: MiddlewareScenario, seed: int) -> MiddlewareRun:
    """Run until the link was punctual, as often as the scenario allows.

    Raises:
        ConfigError: the transport or the link needs something that is missing here.
        RunsFailed: a program failed otherwise than by finding no connection.
    """
    if missing := lacks(scenario):
        raise ConfigError(missing)
    attempt = 1
    while (run := _attempt(scenario, seed, attempt)).is_disturbed and attempt < scenario.attempts:
        attempt += 1
    return run


def _attempt(scenario: MiddlewareScenario, seed: int, attempt: int) -> MiddlewareRun:
    load = os.getloadavg()[0]
    with (
        LinkProcess(scenario.link, seed) as link,
        tempfile.TemporaryDirectory(prefix="dva-sim-") as folder,
    ):
        link.begin()
        start = time.monotonic()
        since = start + scenario.set_up_s
        window = Window(start, since, since + scenario.measure_s)
        plan = plan_of(scenario, Path(folder), window)
        far = _started(link, "far", plan)
        near = _started(link, "near", plan)
        try:
            near.wait(window.until + PATIENCE_S - time.monotonic())
        except subprocess.TimeoutExpired:
            near.kill()
        time.sleep(LINGER_S)
        problem = _problem(near) or _problem(far)
        end_all([near, far], 0.0)
        report = link.report()
        notes = [FileNotes.read(plan.notes(side).read_bytes()) for side in SIDES]
    if problem:
        raise RunsFailed(f"{scenario.transport.name}: {problem}")
    return MiddlewareRun(
        scenario,
        near=notes[0],
        far=notes[1],
        window=window,
        link=report,
        attempts=attempt,
        load=load,
    )


def plan_of(scenario: MiddlewareScenario, folder: Path, window: Window) -> Plan:
    """Return the instructions for both programs."""
    pictures = scenario.pictures
    return Plan(
        transport=scenario.transport.name,
        options=scenario.transport.options,
        near=ADDRESSES["near"],
        far=ADDRESSES["far"],
        folder=folder,
        ready_by=window.since,
        until=window.until,
        command_hz=scenario.command_rate_hz,
        picture_hz=0.0 if pictures is None else pictures.rate_hz,
        picture_bytes=8 if pictures is None else pictures.bytes,
    )


def _started(link: LinkProcess, side: Side, plan: Plan) -> Child:
    words = [sys.executable, "-P", "-m", programs.__name__, side, plan.model_dump_json()]
    return link.start(side, words, keeps_errors=True)


def _problem(program: Child) -> str:
    """Return why a program failed; empty if it runs, was done or found no connection."""
    return "" if program.poll() in (None, 0, NOT_CONNECTED) else program.why()
