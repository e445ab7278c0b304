"""Load that a DVA takes, and where it breaks."""

from contextlib import suppress
from pathlib import Path

from benchmarks.goals import goal

from dva_sim.cli.load import lines
from dva_sim.kernel.errors import DvaSimError
from dva_sim.live.load import run_load
from dva_sim.options.runs import LoadOptions


def devices_at_a_dva(_: Path) -> None:
    """Replies, memory and files of a DVA with ever more devices."""
    options = LoadOptions(
        devices=250, sessions=25, duration=15.0, processes=4, until_it_breaks=True
    )
    taken = 0
    with suppress(DvaSimError):  # the load has no more open files
        for figures in run_load(options):
            print("", *lines(figures), sep="\n", end="")
            taken = taken if figures.broke else figures.devices
            if figures.devices == options.devices:
                goal("p99 of replies with 250 devices [s]", figures.requests_p99_s, most=0.1)
                goal("p99 of the first order [s]", figures.orders_p99_s, most=1.0)
    goal("devices before it breaks", taken, least=1000)
