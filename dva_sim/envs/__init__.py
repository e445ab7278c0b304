"""Gymnasium environments: sending responders, and driving a robot by delayed pictures.

Importing this package registers them with Gymnasium (extra `rl`: `pip install -e '.[rl]'`):

```
import dva_sim.envs
import gymnasium

env = gymnasium.make("dva_sim/Dispatch-v0", scenario="small-shift")
```
"""

from importlib.util import find_spec

from dva_sim.kernel.errors import ConfigError

if find_spec("gymnasium") is None:
    raise ConfigError("environments need Gymnasium: pip install -e '.[rl]'")

import gymnasium

from dva_sim.envs.dispatch import DispatchEnv, play
from dva_sim.envs.drive import DriveEnv

for _name, _entry_point in (
    ("dva_sim/Dispatch-v0", "dva_sim.envs.dispatch:DispatchEnv"),
    ("dva_sim/Drive-v0", "dva_sim.envs.drive:DriveEnv"),
):
    if _name not in gymnasium.registry:  # a reload imports this twice
        gymnasium.register(id=_name, entry_point=_entry_point)

__all__ = ["DispatchEnv", "DriveEnv", "play"]
