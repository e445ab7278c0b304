from dva_sim.api import Comparison as Comparison
from dva_sim.api import Episode as Episode
from dva_sim.api import Results as Results
from dva_sim.api import compare as compare
from dva_sim.api import dry_run as dry_run
from dva_sim.api import episode as episode
from dva_sim.api import export as export
from dva_sim.api import load as load
from dva_sim.api import new as new
from dva_sim.api import register as register
from dva_sim.api import replay as replay
from dva_sim.api import report as report
from dva_sim.api import run as run
from dva_sim.api import show as show
from dva_sim.api import tune as tune

__version__: str
