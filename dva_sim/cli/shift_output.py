"""What the command line tells of a timed run: its events, and what it took to deal with them.

What the command line tells of a session on a congested link.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import numpy as np
from rich.console import Console
from rich.table import Table

from dva_sim.cli.verbose_details import tell_measures
from dva_sim.kernel.verbosity import is_verbose
from dva_sim.simulation.shift import TimedRecording, TimedScenario, simulate_timed
from dva_sim.simulation.shift.measures import tables
from dva_sim.simulation.shift.statistics import OUTCOMES
from dva_sim.simulation.transport.measures import Row
from dva_sim.simulation.transport.run import simulate_transports
from dva_sim.simulation.transport.scenario import TransportScenario

SHOWN = 30  # events in the table; the lines below it count them all
WORDS = ("detected", "kind", "where", "outcome", "looked", "after", "acted")


def tell_shift(scenario: TimedScenario, seed: int, console: Console) -> None:
    """Run a shift and print it."""
    started = time.perf_counter()
    recording = simulate_timed(scenario, seed)
    took = time.perf_counter() - started
    console.rule(f"{scenario.dispatch.policy}, seed {seed}")
    if recording.columns:
        console.print(_table(recording))
    for line in _shift_lines(recording):
        console.print(line, soft_wrap=True)
    broken = sum(recording.violations.values())
    console.print(
        f"{recording.ended:.0f} s simulated in {took:.2f} s, {recording.messages} messages, "
        f"{broken} rules broken",
        soft_wrap=True,
    )
    if is_verbose() and scenario.keep == "events":
        tell_measures(tables(recording)["runs"][0], "timed")


def _table(recording: TimedRecording) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in WORDS:
        right = heading in ("detected", "after")
        table.add_column(heading, justify="right" if right else "left", no_wrap=True)
    columns = recording.columns
    for row in np.argsort(columns["detected"], kind="stable")[:SHOWN]:
        response = float(columns["arrived"][row] - columns["detected"][row])
        zone = int(columns["zone"][row])
        table.add_row(
            _seconds(float(columns["detected"][row])),
            recording.streams[int(columns["stream"][row])],
            recording.zones[zone] if zone >= 0 else "",
            OUTCOMES[int(columns["outcome"][row])],
            _who(recording, int(columns["responder"][row])),
            _seconds(response),
            _who(recording, int(columns["actor"][row])),
        )
    return table


def _shift_lines(recording: TimedRecording) -> Iterator[str]:
    total = recording.count()
    parts = [f"{n} {name}" for name in OUTCOMES if (n := recording.count(name))]
    yield f"{total} events measured: {', '.join(parts)}"
    if recording.columns:
        columns, here = recording.columns, recording.measured
        response = (columns["arrived"] - columns["detected"])[here]
        there = response[np.isfinite(response)]
        if len(there):
            median, late = np.percentile(there, [50, 90])
            yield f"on scene after {median:.1f} s (median), {late:.1f} s (90 % of those reached)"
    for kind in ("guard", "robot"):
        units = [n for n, unit in enumerate(recording.units) if unit.kind == kind]
        if units:
            shares = ", ".join(f"{100 * recording.utilisation(n):.0f} %" for n in units)
            yield f"{kind}s at work: {shares}"
    if recording.exposure:
        yield f"people in danger: {recording.exposure:.0f} s"
    if recording.counters:
        counted = (f"{what} {n}" for what, n in sorted(recording.counters.items()))
        yield f"counted: {', '.join(counted)}"


def _who(recording: TimedRecording, number: int) -> str:
    return recording.responders[number] if number >= 0 else ""


def _seconds(value: float) -> str:
    return f"{value:.1f} s" if math.isfinite(value) else ""


def tell_session(scenario: TransportScenario, seed: int, console: Console) -> None:
    """Run it and print what came of it."""
    started = time.perf_counter()
    tables = simulate_transports(scenario, seed)
    took = time.perf_counter() - started
    row = tables["runs"][0]
    console.rule(f"{scenario.transport.kind}, {scenario.operator.strategy}, seed {seed}")
    console.print(_flows(tables["flows"]))
    for line in _session_lines(row):
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


def _session_lines(row: Row) -> Iterator[str]:
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
