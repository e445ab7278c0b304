"""One run: the session is simulated beside its competitors, then somebody drives over it.

What is sent does not depend on what is driven, so the fates of commands and pictures are the same
as if both were simulated together. A drive begins at some moment of the time that is measured, and
goes on from its beginning when it outlasts it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dva_sim.network.transports import Contest, Fates, play
from dva_sim.simulation import task
from dva_sim.simulation.task.delays import Recording, Stream
from dva_sim.simulation.transport.measures import Row, contest_row, flow_rows
from dva_sim.simulation.transport.scenario import TransportScenario

DRIVEN = (
    *("movement_time_s", "completed", "path_error_rms_m", "wall_crossings"),
    *("waits", "wait_s", "delay_felt_s", "plugin_failures"),
)
"""What is taken over of a drive."""


def simulate_transports(scenario: TransportScenario, seed: int) -> dict[str, list[Row]]:
    """Simulate; a row of the run, and one of each flow."""
    contest = play(scenario, seed)
    trial = task.play(scenario.task(), seed, recording_of(scenario, contest))[-1]
    driven: dict[str, Any] = {name: trial[name] for name in DRIVEN}
    row = contest_row(scenario, contest) | driven
    row["simulated_s"] = contest.until + float(trial["trial_time_s"])
    return {"runs": [row], "flows": flow_rows(contest)}


def rehearse(scenario: TransportScenario) -> None:
    """Make what drives, and let no time pass.

    Raises:
        ConfigError: who drives cannot be made.
    """
    task.rehearse(scenario.task())


def recording_of(scenario: TransportScenario, contest: Contest) -> Recording:
    """What the session did to commands and pictures while it was measured."""
    return Recording(
        _stream(contest, contest.commands, scenario.commands.rate_hz),
        _stream(contest, contest.pictures, scenario.pictures.rate_hz),
    )


def _stream(contest: Contest, fates: Fates, rate: float) -> Stream:
    made, arrived = np.array(fates.made), np.array(fates.arrived)
    counts = (made >= contest.since) & (made < contest.until)
    return Stream(1.0 / rate, (arrived - made)[counts])
