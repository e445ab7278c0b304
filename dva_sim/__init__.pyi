from dva_sim.api import Comparison as Comparison
from dva_sim.api import Episode as Episode
from dva_sim.api import Results as Results
from dva_sim.api import compare as compare
from dva_sim.api import episode as episode
from dva_sim.api import load as load
from dva_sim.api import run as run

__version__: str
