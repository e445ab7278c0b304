"""Traffic between DVAs by their number, in virtual time, as a table.

    .venv/bin/python tests/benchmarks/backbone_traffic.py 2 4 8    # numbers of regions

Messages and bytes are those of the protocol, without headers of ZeroMQ and TCP. A quiet run gives
what flows all the time, a second one with more guards what a device adds; two more what an event
adds from its report to its end, where there are guards enough, and where there are too few, so that
help is asked for again and again.
"""

from __future__ import annotations

import argparse
from typing import Any, NamedTuple

from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run

LASTS_S = 300.0
FIRST_S = 20.0  # everybody has registered
WIDTH_M, DEPTH_M = 60.0, 40.0  # extent of the hall
EVENTS = 8
FEW, MANY = 2, 12  # guards


class Traffic(NamedTuple):
    """Messages and bytes between DVAs."""

    messages: int
    size: int


class BackboneMeter:
    """Counts what DVAs send each other, and heeds nothing else."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self.messages = self.size = 0

    def sent(self, now: float, source: str, to: str, payload: Any) -> None:
        """Count a message; what is published goes to nobody by name, once for each subscriber."""
        if now >= FIRST_S and source in self._run.dvas and to in self._run.dvas:
            self.messages += 1
            self.size += len(payload)

    def __getattr__(self, name: str) -> Any:
        return lambda *_, **__: None


def traffic(regions: int, guards: int, events: int) -> Traffic:
    """Return what DVAs say in a run, of which each event is at another place."""
    division = {}
    for number in range(regions):
        west, east = (WIDTH_M * n / regions for n in (number, number + 1))
        corners = [[west, 0.0], [east, 0.0], [east, DEPTH_M], [west, DEPTH_M]]
        division[f"part-{number + 1}"] = {"polygon": corners}
    found = [
        {
            "kind": "flood",
            "position": [WIDTH_M * (n + 0.5) / EVENTS, 10.0 + 20.0 * (n % 2)],
            "at_s": FIRST_S + 20.0 * n if n < events else 2 * LASTS_S,
            "reported": True,
        }
        for n in range(max(events, 1))
    ]
    plan = {
        "site": {"name": "hall"},
        "robot": {"count": 0},
        "operator": {"count": 0},
        "guard": {"count": guards},
        "events": found,
        "dva": {"regions": division},
        "horizon_s": 4 * LASTS_S,
    }
    run = Run(scenarios.build(plan), seed=1)
    meter = BackboneMeter(run)
    run.observe(meter)
    run.clock.run(FIRST_S + LASTS_S)
    return Traffic(meter.messages, meter.size)


def row(regions: int) -> tuple[float, ...]:
    """Return the costs with a number of regions; see `HEADS`."""
    quiet, crowd = (traffic(regions, guards, 0) for guards in (FEW, MANY))
    short, ample = (traffic(regions, guards, EVENTS) for guards in (FEW, MANY))
    links = regions * (regions - 1)
    return (
        regions,
        quiet.size / LASTS_S / links / 1e3,
        quiet.size / LASTS_S / 1e3,
        (crowd.size - quiet.size) / (MANY - FEW) / LASTS_S * 3.6,
        (ample.messages - crowd.messages) / EVENTS,
        (ample.size - crowd.size) / EVENTS / 1e3,
        (short.messages - quiet.messages) / EVENTS,
    )


HEADS = (
    *("regions", "one way [kB/s]", "in all [kB/s]", "per device-hour [kB]"),
    *("messages per event", "kB per event", "messages if too few"),
)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("regions", nargs="*", type=int, default=[2, 3, 4, 6, 8])
    print(*(head.rjust(21) for head in HEADS))
    for regions in parser.parse_args().regions:
        print(*(f"{value:21.3g}" for value in row(regions)), flush=True)


if __name__ == "__main__":
    main()
