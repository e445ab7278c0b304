"""Workload and steering of operators: pure functions of what a run has recorded.

References:
    O. Nakayama, T. Futami, T. Nakamura, E. R. Boer: Development of a steering entropy method for
    evaluating driver workload. SAE Technical Paper 1999-01-0892.
    E. R. Boer: Behavioral entropy as an index of workload. Proc. Human Factors and Ergonomics
    Society 44 (2000) 125-128.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from dva_sim.kernel.measure import Measure, names_of, text
from dva_sim.kernel.recorder import DriveLog, TrackPoint
from dva_sim.protocol.messages import CODE_NAMES
from dva_sim.simulation.full import Recording
from dva_sim.simulation.full.stage import id_of
from dva_sim.simulation.measures.commands import Floats, Row, mean

Span = tuple[float, float]  # from when to when [s]

GAP = 0.1  # smallest change of the turn rate that counts as a reversal [rad/s]; assumed
STEP = 0.15  # resampling step of the entropy, as published [s]
BAND = 0.05  # unit of prediction errors, see `steering_entropy` [rad/s]; assumed
EDGES = (
    -5.0,
    -2.5,
    -1.0,
    -0.5,
    0.5,
    1.0,
    2.5,
    5.0,
)  # edges of the nine bins in bands, as published
TRACK_STEP = 0.5  # interval of the points of a track that was not filmed [s]
LEVEL_SPEED = 0.025  # speed below which the phone counts as level: half a step [m/s]
LEVEL_TURN = 0.035  # turn rate below which it counts as level: two degrees a second [rad/s]


# --- columns -----------------------------------------------------------------------------------
TURNS = Measure("turns_per_min", "turning from one robot to another, per minute with work in hand")
STEERING = (
    Measure("reversals_per_min", "reversals of the turn rate wanted by at least 0.1 rad/s"),
    Measure("command_changes_per_min", "commands that are clearly others than the last"),
    Measure("steering_entropy", "how unpredictably somebody steers, 0 like clockwork to 1"),
    Measure("waiting_share", "share of the steering time in which the robot was asked to stand"),
    Measure("move_waits", "waits to see the result of a move"),
    Measure("move_and_wait_share", "share of the driving time steered by moving and waiting"),
)
_WRONG = (
    Measure("missed", "events refuted although they were there"),
    Measure("false_confirmations", "events confirmed although nothing was there"),
)
COLUMNS = (
    Measure("utilisation", "share of the run with an order in hand, mean over operators"),
    Measure("attending_share", "share of the run with eyes on a picture, mean over operators"),
    Measure(
        "queue_mean",
        "robots that waited for their operator, mean over time and operators",
        title="robots that wait for their operator",
    ),
    TURNS,
    *STEERING,
    Measure("path_error_rms_m", "distance from the ways planned, root mean square"),
    Measure("path_error_max_m", "greatest distance from the ways planned"),
    *_WRONG,
)
"""Columns and measures of a run."""
OPERATOR_COLUMNS = (
    text("operator_name", "who"),
    Measure("orders", "orders received"),
    Measure("utilisation", "share of the run with an order in hand"),
    Measure("attending_share", "share of the run with eyes on a picture"),
    Measure("robots_mean", "robots in hand, mean over time"),
    Measure("robots_max", "most robots in hand at once"),
    Measure("queue_mean", "robots that waited for it, mean over time"),
    Measure("queue_max", "most robots that waited at once"),
    Measure("turns", "times that it turned from one robot to another"),
    TURNS,
    *STEERING,
    *_WRONG,
    Measure("gave_up", "drives that it gave up"),
    Measure("lost_links", "drives that ended by a lost link"),
    Measure("refused_drives", "drives that ended since the robot obeyed no more"),
    Measure("alerts", "alerts of the phone: the link may be lost, or the robot obeys no more"),
    text("refusals", "how often commands were refused, as the app was told, by reply code"),
)


# --- spans of time -----------------------------------------------------------------------------
def covered(spans: Iterable[Span]) -> float:
    """Return the length of the union of the spans [s]."""
    total = 0.0
    end = -math.inf
    for since, until in sorted(spans):
        total += max(0.0, until - max(since, end))
        end = max(end, until)
    return total


def most_at_once(spans: Iterable[Span]) -> int:
    """Return the greatest number of overlapping spans."""
    changes = sorted((t, d) for since, until in spans for t, d in ((since, 1), (until, -1)))
    return max(np.cumsum([change for _, change in changes]).tolist(), default=0)


def in_hand(log: DriveLog, end: float) -> Span:
    """Return from the order until the operator is done with it, or the run ends at `end` [s]."""
    return log.ordered, end if log.ended is None else log.ended


def attended(log: DriveLog, end: float) -> list[Span]:
    """Return when its operator looked at a robot's picture."""
    now = [] if log.looks_since is None else [(log.looks_since, max(end, log.looks_since))]
    return log.attended + now


def waits(log: DriveLog, end: float) -> list[Span]:
    """Return when a robot waited for its operator: for its turn, or for attention."""
    until = in_hand(log, end)[1]
    spans = [(log.ordered, until if log.taken_up is None else log.taken_up)]
    if log.waits_from is not None:
        times = [
            max(since, log.waits_from) for since, to in attended(log, end) if to > log.waits_from
        ]
        spans.append((log.waits_from, min(times, default=until)))
    return [span for span in spans if span[1] > span[0]]


# --- steering ----------------------------------------------------------------------------------
def reversals(values: Iterable[float], gap: float = GAP) -> int:
    """Count how often a signal reverses, counting only changes of at least `gap`."""
    count = 0
    direction = 0
    low = math.inf
    high = -math.inf
    for value in values:
        low = min(low, value)
        high = max(high, value)
        if direction <= 0 and value >= low + gap:
            count += direction < 0
            direction = 1
            high = value
            low = value
        elif direction >= 0 and value <= high - gap:
            count += direction > 0
            direction = -1
            low = value
            high = value
    return count


def changes(commands: Iterable[tuple[float, float]]) -> int:
    """Count how often a command [m/s, rad/s] clearly differed from the last one that counted."""
    count = -1
    last = (math.inf, math.inf)
    for speed, turn in commands:
        if abs(speed - last[0]) > LEVEL_SPEED or abs(turn - last[1]) > LEVEL_TURN:
            count += 1
            last = (speed, turn)
    return max(count, 0)


def steering_entropy(turn_rate: Floats, band: float = BAND) -> float:
    """Return the steering entropy, from 0 (regular) to 1; nan for less than 3 s.

    Each value, sampled every 0.15 s, is predicted from the three before it by a Taylor expansion
    of second order; the errors fall into nine bins, and the entropy is -sum p log9 p. Published,
    the width of the bins is each person's own: the 90th percentile of the errors in a drive
    without a second task. Here it is the same for all and given, so that cells can be compared.

    Args:
        turn_rate: Asked for, every 0.15 s, shape `(n,)` [rad/s].
        band: The width of the bins [rad/s].
    """
    if len(turn_rate) < 20:
        return math.nan
    third = turn_rate[:-3]
    second = turn_rate[1:-2]
    first = turn_rate[2:-1]
    slope = first - second
    predicted = first + slope + 0.5 * (slope - (second - third))
    bins = np.searchsorted(EDGES, (turn_rate[3:] - predicted) / band)
    share = np.bincount(bins, minlength=9) / len(bins)
    share = share[share > 0.0]
    return float(-(share * np.log(share)).sum() / math.log(9)) + 0.0


def sampled(log: DriveLog, end: float, step: float = STEP) -> Floats:
    """Sample the phone's commands every `step` [s]: shape `(n, 2)` [m/s, rad/s]."""
    if not log.commands:
        return np.empty((0, 2))
    times, *values = np.array(log.commands).T
    until = in_hand(log, end)[1]
    at = np.arange(times[0], max(until, times[0]), step)
    return np.stack(values, axis=1)[np.searchsorted(times, at, side="right") - 1]


def steering(logs: Sequence[DriveLog], end: float) -> Row:
    """Return how these drives were steered, taken together; nan where nobody steered."""
    samples = [sampled(log, end) for log in logs]
    minutes = sum(map(len, samples)) * STEP / 60.0
    if not minutes:
        return dict.fromkeys(names_of(STEERING), math.nan)
    entropies = [(len(s), steering_entropy(s[:, 1])) for s in samples]
    finite = [(weight, value) for weight, value in entropies if not math.isnan(value)]
    level = sum(int(_is_level(s).sum()) for s in samples) * STEP / 60.0
    made = sum(changes((speed, turn) for _, speed, turn in log.commands) for log in logs)
    turns = sum(reversals(turn for _, _, turn in log.commands) for log in logs)
    weights = sum(weight for weight, _ in finite)
    shares = [log.workload.get("move_and_wait_share", 0.0) for log in logs]
    return {
        "reversals_per_min": turns / minutes,
        "command_changes_per_min": made / minutes,
        "steering_entropy": sum(w * v for w, v in finite) / weights if finite else math.nan,
        "waiting_share": level / minutes,
        "move_waits": sum(log.workload.get("waits", 0.0) for log in logs),
        "move_and_wait_share": float(np.average(shares, weights=[len(s) for s in samples])),
    }


def _is_level(samples: Floats) -> NDArray[np.bool_]:
    """Return where the phone asks the robot to stand."""
    level: NDArray[np.bool_] = np.all(np.abs(samples) < (LEVEL_SPEED, LEVEL_TURN), axis=1)
    return level


# --- the way -----------------------------------------------------------------------------------
def off_the_way(log: DriveLog, track: Iterable[TrackPoint], end: float) -> Floats:
    """Return the robot's distance from its operator's planned path, shape `(n,)` [m]."""
    if log.started is None or not log.ways:
        return np.empty(0)
    until = in_hand(log, end)[1]
    starts = np.array([time for time, _ in log.ways])
    ways = [shapely.linestrings(points) if len(points) > 1 else None for _, points in log.ways]
    gaps = []
    for point in filter(_is_sample, track):
        path = ways[max(int(np.searchsorted(starts, point.time, side="right")) - 1, 0)]
        if starts[0] <= point.time <= until and path is not None:
            gaps.append(float(shapely.distance(path, shapely.points(point.x, point.y))))
    return np.array(gaps)


def _is_sample(point: TrackPoint) -> bool:
    """Return True for a point that every track has, however closely it was filmed."""
    return abs(point.time / TRACK_STEP - round(point.time / TRACK_STEP)) < 1e-6


def path_error(recording: Recording) -> Row:
    """Root mean square and greatest distance from the ways planned, over all drives [m]."""
    tracks = recording.recorder.tracks
    gaps = np.concatenate(
        [
            np.empty(0),
            *(
                off_the_way(log, tracks[recording.label_of(log.robot)], recording.duration)
                for log in recording.recorder.drives
            ),
        ]
    )
    rms = float(np.sqrt((gaps**2).mean())) if len(gaps) else math.nan
    return {
        "path_error_rms_m": rms,
        "path_error_max_m": float(gaps.max()) if len(gaps) else math.nan,
    }


# --- right and wrong ---------------------------------------------------------------------------
def was_there(recording: Recording, event: int, time: float) -> bool:
    """Return True if the DVA's event of that number was about something real at `time` [s]."""
    for number, incident in enumerate(recording.incidents):
        other = recording.event_of(number)
        over = recording.contained.get(number, math.inf)
        if other is not None and other.number == event and incident.is_there(time) and time <= over:
            return True
    return False


def judgement(recording: Recording, log: DriveLog) -> str:
    """`missed`: refuted though it was there. `false`: confirmed though nothing was. Else empty."""
    if log.ended is None or log.outcome not in ("confirmed", "refuted"):
        return ""
    is_real = was_there(recording, log.event, log.ended)
    if log.outcome == "refuted":
        return "missed" if is_real else ""
    return "" if is_real else "false"


# --- rows --------------------------------------------------------------------------------------
def operator_rows(recording: Recording) -> list[Row]:
    """Return one row per operator, simulated or a person who has driven."""
    numbers = range(1, recording.scenario.operator.count + 1)
    ids = [id_of("operator", n) for n in numbers if n not in recording.persons]
    ids += sorted({log.operator for log in recording.recorder.drives}.difference(ids))
    return [operator_row(recording, id_tag) for id_tag in ids]


def operator_row(recording: Recording, operator: str) -> Row:
    """Return the workload of one operator; shares are of the whole run.

    `utilisation` is the share of time with an order in hand, `attending_share` that of looking
    at a picture. A robot waits for attention while its operator is at another one, and
    `turns_per_min` counts turning from one robot to another per minute with work in hand.
    """
    end = recording.duration
    logs = [log for log in recording.recorder.drives if log.operator == operator]
    hands = [in_hand(log, end) for log in logs]
    queue = [span for log in logs for span in waits(log, end)]
    busy = covered(hands)
    turned = sum(log.turned_to for log in logs)
    judged = [judgement(recording, log) for log in logs]
    return {
        "operator_name": recording.label_of(operator),
        "orders": len(logs),
        "utilisation": busy / end,
        "attending_share": covered(span for log in logs for span in attended(log, end)) / end,
        "robots_mean": sum(until - since for since, until in hands) / end,
        "robots_max": most_at_once(hands),
        "queue_mean": sum(until - since for since, until in queue) / end,
        "queue_max": most_at_once(queue),
        "turns": turned,
        "turns_per_min": 60.0 * turned / busy if busy else math.nan,
        **steering(logs, end),
        "missed": judged.count("missed"),
        "false_confirmations": judged.count("false"),
        "gave_up": sum(log.outcome == "gave up" for log in logs),
        "lost_links": sum(log.outcome == "lost link" for log in logs),
        "refused_drives": sum(log.outcome == "refused" for log in logs),
        "alerts": sum(log.alerts for log in logs),
        "refusals": ", ".join(
            f"{CODE_NAMES.get(code, code)} {count}"
            for code, count in sorted(sum((log.refused for log in logs), Counter[int]()).items())
        ),
    }


_OF_A_RUN = ("utilisation", "attending_share", "queue_mean", "turns_per_min")


def run_measures(recording: Recording) -> Row:
    """Return the workload of a run: shares are means over operators, steering over all drives."""
    rows = operator_rows(recording)
    if not rows:
        return {}
    row: Row = {}
    for name in _OF_A_RUN:
        row[name] = mean([r[name] for r in rows if not math.isnan(r[name])])
    row |= steering(recording.recorder.drives, recording.duration) | path_error(recording)
    row["missed"] = sum(r["missed"] for r in rows)
    row["false_confirmations"] = sum(r["false_confirmations"] for r in rows)
    return row
