"""Pictures of runs: films and stills from above, and what a robot's camera sees."""

from dva_sim.recordings.pictures.requests import Wanted, joined

__all__ = ["Wanted", "joined"]
