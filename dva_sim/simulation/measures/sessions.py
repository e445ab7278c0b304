"""Measures of a session on a congested link: meaning of each column, and its computation.

**Delivered** is a message all of which has arrived before the run was over, some time after the
last message that counts. The **round trip** of an applied command lasts from when it was made until
the first picture taken after it was applied has arrived, so it holds the wait for that picture.

Rates are of bytes put on the line, with all headers and what is sent again. **Jain's index** is of
the rates of session and TCP flows in one direction, 1 if all are alike, 1/n if one has everything.
A session that does not want its share lowers it without doing harm, so `share_of_fair` and
`bulk_use` stand beside it: its rate in shares of an equal one, and what TCP gets of the line.

References:
    R. Jain, D. Chiu, W. Hawe: A quantitative measure of fairness and discrimination for resource
    allocation in shared computer systems. DEC-TR-301, 1984.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.measure import Measure, names_of, text
from dva_sim.network.age_in_force import AgeInForce
from dva_sim.network.link import Direction
from dva_sim.network.transports import Contest, ContestConfig, Fates
from dva_sim.network.transports.competition import WAYS
from dva_sim.simulation.measures.commands import (
    AGE_IN_FORCE,
    COMMAND_AGE_MEAN,
    COMMAND_AGE_P50,
    COMMAND_AGE_P95,
    COMMAND_RATE,
    PICTURE_AGE_P95,
    PICTURE_RATE,
    Floats,
    Row,
    applied,
    mean,
    percentile,
    percentiles,
    round_trips,
)
from dva_sim.simulation.measures.trials import DRIVEN_COLUMNS
from dva_sim.simulation.transports import SessionRecording

_WHERE: dict[Direction, str] = {"up": "towards the robot", "down": "from the robot"}


def _of_way(direction: Direction) -> tuple[Measure, ...]:
    where = _WHERE[direction]
    return (
        Measure(
            f"bulk_use_{direction}", f"share of the line that TCP flows get {where}", low=0, high=1
        ),
        Measure(
            f"jain_{direction}", f"Jain's index of all rates {where}", better="large", low=0, high=1
        ),
        Measure(f"share_of_fair_{direction}", f"session's rate over a fair one, {where}", low=0),
        Measure(f"session_{direction}_bps", f"rate of the session {where}"),
        Measure(f"bulk_{direction}_bps", f"mean rate of a TCP flow {where}"),
    )


RUN_COLUMNS = (
    Measure("commands", "commands made in the time measured"),
    Measure("delivered_share", "share of the commands that arrived whole", better="large"),
    Measure(
        "crucial_delivered_share",
        "share of the crucial commands that arrived whole",
        better="large",
    ),
    Measure("crucial_age_p95_s", "percentile 95 of the age of crucial commands at arrival"),
    COMMAND_RATE,
    COMMAND_AGE_MEAN,
    COMMAND_AGE_P50,
    COMMAND_AGE_P95,
    AGE_IN_FORCE,
    Measure("picture_delivered_share", "share of the pictures that arrived whole", better="large"),
    PICTURE_RATE,
    Measure("picture_age_mean_s", "mean age of pictures at arrival"),
    PICTURE_AGE_P95,
    Measure(
        "round_trip_mean_s", "command until the first picture taken after it was applied, mean"
    ),
    Measure(
        "round_trip_p95_s",
        "percentile 95 of this time",
        title="95th percentile of the time from request to answer",
    ),
    *(column for way in WAYS for column in _of_way(way)),
    *DRIVEN_COLUMNS,
    Measure("plugin_failures", "invalid answers of a user's class"),
    Measure("simulated_s", "virtual time simulated"),
)
"""Columns of a run, which a study may ask for."""
_DRIVEN = (*names_of(DRIVEN_COLUMNS), "plugin_failures")
FLOW_COLUMNS = (
    text("way", "up is towards the robot"),
    text("flow", "session, or a TCP flow beside it"),
    Measure("rate_bps", "rate on the line, with headers and what is sent again"),
)


def tables(recording: SessionRecording) -> dict[str, list[Row]]:
    """Return a row of the run, and one of each flow."""
    scenario, contest, trial = recording
    row = contest_row(scenario, contest) | {name: trial[name] for name in _DRIVEN}
    row["simulated_s"] = contest.until + float(trial["trial_time_s"])
    return {"runs": [row], "flows": flow_rows(contest)}


def contest_row(config: ContestConfig, contest: Contest) -> Row:
    """Return everything that is measured of the network."""
    commands = _counted(contest, contest.commands)
    pictures = _counted(contest, contest.pictures)
    row = _command_row(contest, *commands) | _picture_row(contest, *pictures)
    trips = round_trips(commands[0], commands[1], pictures[0], pictures[1])
    row |= {"round_trip_mean_s": mean(trips), "round_trip_p95_s": percentile(trips, 95)}
    for direction in WAYS:
        per_byte = 8.0 / (contest.until - contest.since)
        line = config.bottleneck.rate_bps
        session = contest.session_bytes[direction] * per_byte
        bulk = [took * per_byte for took in contest.bulk_bytes[direction]]
        fair = line / (1 + len(bulk))
        row |= {
            f"session_{direction}_bps": session,
            f"bulk_{direction}_bps": mean(bulk),
            f"bulk_use_{direction}": sum(bulk) / line if bulk else math.nan,
            f"jain_{direction}": jain([session, *bulk]) if bulk else math.nan,
            f"share_of_fair_{direction}": session / fair if bulk else math.nan,
        }
    return row


def flow_rows(contest: Contest) -> list[Row]:
    """Return the rate of each flow in each direction [bit/s]."""
    per_byte = 8.0 / (contest.until - contest.since)
    rows = []
    for direction in WAYS:
        rates = {"session": contest.session_bytes[direction]}
        rates |= {f"bulk {n + 1}": took for n, took in enumerate(contest.bulk_bytes[direction])}
        rows += [
            {"way": direction, "flow": flow, "rate_bps": took * per_byte}
            for flow, took in rates.items()
        ]
    return rows


# --- messages ----------------------------------------------------------------------------
def _counted(contest: Contest, fates: Fates) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return when messages were made and arrived, and which are counted; shape `(n,)` each."""
    made = np.array(fates.made)
    arrived = np.array(fates.arrived)
    return made, arrived, (made >= contest.since) & (made < contest.until)


def _command_row(contest: Contest, made: Floats, arrived: Floats, counts: NDArray[np.bool_]) -> Row:
    crucial = counts & np.array(contest.commands.crucial)
    late = (arrived - made)[crucial & np.isfinite(arrived)]
    used = applied(arrived)
    ages = (arrived - made)[counts & used]
    seconds = contest.until - contest.since
    force = AgeInForce(made[used], arrived[used], start=0.0)
    return {
        "commands": int(counts.sum()),
        "delivered_share": mean(np.isfinite(arrived[counts])),
        "crucial_delivered_share": mean(np.isfinite(arrived[crucial])),
        "crucial_age_p95_s": percentile(late, 95),
        "command_rate_hz": len(ages) / seconds,
        "command_age_mean_s": mean(ages),
        **percentiles("command_age", ages, (50, 95)),
        "age_in_force_mean_s": force.over(contest.since, contest.until).mean,
    }


def _picture_row(contest: Contest, made: Floats, arrived: Floats, counts: NDArray[np.bool_]) -> Row:
    ages = (arrived - made)[counts & applied(arrived)]
    return {
        "picture_delivered_share": mean(np.isfinite(arrived[counts])),
        "picture_rate_hz": len(ages) / (contest.until - contest.since),
        "picture_age_mean_s": mean(ages),
        "picture_age_p95_s": percentile(ages, 95),
    }


# --- rates -------------------------------------------------------------------------------
def jain(rates: Sequence[float]) -> float:
    """Return Jain's index of fairness; nan if there is nothing to share."""
    squares = sum(rate * rate for rate in rates)
    return sum(rates) ** 2 / (len(rates) * squares) if squares else math.nan
