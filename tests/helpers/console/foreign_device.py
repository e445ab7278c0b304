"""A robot of another make that registers at the DVA of a run."""

from dva_sim.agents.device import AgentDevice
from dva_sim.protocol.devices import ROBOT
from dva_sim.simulation.full.run import Run

FOREIGN = "AA:BB:CC:00:00:01"
LABEL = "theirs"


def foreign_device(run: Run) -> AgentDevice:
    """Return its device, which has not registered yet."""
    ours = run.dva.device
    return AgentDevice(
        id_tag=FOREIGN,
        label=LABEL,
        device_type=ROBOT,
        address="192.0.2.7",
        dva=ours.id_tag,
        network=run.network,
        recorder=run.stage.recorder,
        frame=ours.frame,
        timeout=ours.timeout,
        attempts=ours.attempts,
    )
