"""The model `middleware`: commands over real middleware and an emulated link, in real time."""

from dva_sim.simulation.middleware.run import MiddlewareRun, lacks, measure
from dva_sim.simulation.middleware.scenario import MiddlewareScenario, build

__all__ = ["MiddlewareRun", "MiddlewareScenario", "build", "lacks", "measure"]
