"""The tasks of the literature as scenarios: a published table, asked of any operator model.

Pointing, tunnels, tracking, corners, slaloms, courses and an excavator's reach, by mouse, tilt or
joystick, over links with delay, jitter and loss. No site, no DVA and no messages: the persons and
their strategies are those of the full model, and so are hands, accelerometers and links.
"""

from dva_sim.simulation.task.block import play, rehearse, trace_of
from dva_sim.simulation.task.scenario import TaskScenario, build
from dva_sim.simulation.task.trial import Trace

__all__ = ["TaskScenario", "Trace", "build", "play", "rehearse", "trace_of"]
