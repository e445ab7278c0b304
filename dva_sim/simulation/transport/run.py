"""One run: the session is simulated beside its competitors, then somebody drives over it.

What is sent does not depend on what is driven, so the fates of commands and pictures are the same
as if both were simulated together. A drive begins at some moment of the time that is measured, and
goes on from its beginning when it outlasts it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dva_sim.kernel.measure import names_of
from dva_sim.network.transports import Contest, Fates, play
from dva_sim.simulation import task
from dva_sim.simulation.task.delays import FrameStream, RecordedDelays
from dva_sim.simulation.task.measures import DRIVEN_COLUMNS
from dva_sim.simulation.transport.measures import Row, contest_row, flow_rows
from dva_sim.simulation.transport.scenario import TransportScenario

DRIVEN = (*names_of(DRIVEN_COLUMNS), "plugin_failures")
"""What is taken over of a drive."""


class SessionRecording(NamedTuple):
    """What is left of a run.

    Attributes:
        scenario: As it was run.
        contest: What became of all that was sent.
        trial: What was measured of the drive.
    """

    scenario: TransportScenario
    contest: Contest
    trial: Row


def simulate_session(scenario: TransportScenario, seed: int) -> SessionRecording:
    """The network first, and then one drive over what it delivers."""
    contest = play(scenario, seed)
    trial = task.play(scenario.task(), seed, recording_of(scenario, contest))[-1]
    return SessionRecording(scenario, contest, trial)


def tables(recording: SessionRecording) -> dict[str, list[Row]]:
    """A row of the run, and one of each flow."""
    scenario, contest, trial = recording
    row = contest_row(scenario, contest) | {name: trial[name] for name in DRIVEN}
    row["simulated_s"] = contest.until + float(trial["trial_time_s"])
    return {"runs": [row], "flows": flow_rows(contest)}


def rehearse(scenario: TransportScenario) -> None:
    """Make what drives, and let no time pass.

    Raises:
        ConfigError: who drives cannot be made.
    """
    task.rehearse(scenario.task())


def recording_of(scenario: TransportScenario, contest: Contest) -> RecordedDelays:
    """What the session did to commands and pictures while it was measured."""
    return RecordedDelays(
        _stream(contest, contest.commands, scenario.commands.rate_hz),
        _stream(contest, contest.pictures, scenario.pictures.rate_hz),
    )


def _stream(contest: Contest, fates: Fates, rate: float) -> FrameStream:
    made, arrived = np.array(fates.made), np.array(fates.arrived)
    counts = (made >= contest.since) & (made < contest.until)
    return FrameStream(1.0 / rate, (arrived - made)[counts])
