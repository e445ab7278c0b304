"""The timed world: thousands of events through the DVA's own core, responders as times only.

Nobody drives and nothing is sent over a network; the messages, the core, the policies and the
clock are the real ones. It serves the study of policies over whole shifts, and the validation
of the dispatch against what theory says exactly.
"""

from dva_sim.simulation.timed.recording import TimedRecording, UnitRecord
from dva_sim.simulation.timed.run import rehearse_timed, simulate_timed
from dva_sim.simulation.timed.scenario import TimedScenario, build

__all__ = [
    "TimedRecording",
    "TimedScenario",
    "UnitRecord",
    "build",
    "rehearse_timed",
    "simulate_timed",
]
