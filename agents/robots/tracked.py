"""An example of own motors: copy this file, change it, and name it as `drive: tracked.py:Tracked`.

`dva-sim check robot tracked` tells whether it keeps what every drive promises.
"""

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.drives import Differential, DriveSpec


class Tracked(Differential):
    """Two tracks: they scrub sideways in a curve, so turning costs speed.

    Args:
        spec: Mass, size and limits of the robot.
        scrub: Share of the speed that is lost at the highest turn rate.
    """

    def __init__(self, spec: DriveSpec, scrub: float = 0.5) -> None:
        super().__init__(spec)
        if not 0 <= scrub <= 1:
            raise ConfigError(f"option 'scrub' is {scrub!r}; should be from 0 to 1")
        self.scrub = scrub

    def set_point(self, speed: float, turn_rate: float) -> tuple[float, float]:
        """Slower in a curve."""
        share = abs(turn_rate) / self.spec.max_turn_rate
        return speed * (1 - self.scrub * share), turn_rate
