"""What the command line tells of a session on a congested link."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

from rich.console import Console
from rich.table import Table

from dva_sim.experiments.details import tell_measures
from dva_sim.experiments.transports.measures import Row
from dva_sim.experiments.transports.run import simulate_transports
from dva_sim.experiments.transports.scenario import TransportScenario


def tell(scenario: TransportScenario, seed: int, console: Console) -> None:
    """Run it and print what came of it."""
    started = time.perf_counter()
    tables = simulate_transports(scenario, seed)
    took = time.perf_counter() - started
    row = tables["runs"][0]
    console.rule(f"{scenario.transport.kind}, {scenario.operator.strategy}, seed {seed}")
    console.print(_flows(tables["flows"]))
    for line in _lines(row):
        console.print(line, soft_wrap=True)
    console.print(f"{row['simulated_s']:.0f} s simulated in {took:.2f} s", soft_wrap=True)
    tell_measures(row, "transports")


def _flows(flows: list[Row]) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in ("way", "flow", "rate\n[kbit/s]"):
        table.add_column(heading, justify="right" if "rate" in heading else "left")
    for flow in flows:
        table.add_row(flow["way"], flow["flow"], f"{flow['rate_bps'] / 1000.0:.0f}")
    return table


def _lines(row: Row) -> Iterator[str]:
    yield (
        f"commands: {100 * row['delivered_share']:.1f} % delivered, "
        f"{row['command_rate_hz']:.1f} Hz applied, "
        f"{_ms(row['command_age_mean_s'])} old on average, "
        f"95 % within {_ms(row['command_age_p95_s'])}"
    )
    if math.isfinite(row["crucial_delivered_share"]):
        yield (
            f"crucial ones: {100 * row['crucial_delivered_share']:.1f} % delivered, "
            f"95 % within {_ms(row['crucial_age_p95_s'])}"
        )
    yield (
        f"pictures: {row['picture_rate_hz']:.1f} Hz shown, "
        f"{_ms(row['picture_age_mean_s'])} old on average, "
        f"95 % within {_ms(row['picture_age_p95_s'])}"
    )
    mean, late = _ms(row["round_trip_mean_s"]), _ms(row["round_trip_p95_s"])
    yield f"round trip: {mean} on average, {late} at 95 %"
    done = "done" if row["completed"] else "not done"
    yield (
        f"drive: {done} in {row['movement_time_s']:.1f} s, "
        f"{row['path_error_rms_m']:.2f} m off the middle (rms), "
        f"{row['wall_crossings']} crossings"
    )


def _ms(seconds: float) -> str:
    return f"{1000.0 * seconds:.0f} ms" if math.isfinite(seconds) else "never"
