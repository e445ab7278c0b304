"""How factors, levels, measures and numbers are called when a reader sees them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from dva_sim.experiments.study.schema import Level
from dva_sim.kernel.units import ending_of, unit_of

_FACTORS = {
    "pattern": "messaging pattern",
    "transport": "transport",
    "crowd": "TCP flows each way",
    "network_depth": "depth of the network model",
    "zeromq.high_water_mark": "high-water mark",
    "zeromq.conflate": "kept of what waits",
    "zeromq.send_buffer_bytes": "send buffer",
    "zeromq.receive_buffer_bytes": "receive buffer",
    "link.delay_s": "one-way delay",
    "link.jitter_s": "jitter",
    "link.loss": "packet loss",
    "link.rate_bps": "link rate",
    "robot.processing_s": "processing time at the robot",
    "command.rate_hz": "wanted command rate",
    "link.up.delay_s": "delay of commands",
    "link.down.delay_s": "delay of frames",
    "frames.rate_hz": "frame rate",
    "device.kind": "device",
    "device.gain": "gain of the device",
    "automation": "share of the correction that the machine makes",
    "operator.options.quality": "quality of the prediction",
    "operator.strategy": "operator strategy",
    "control": "control",
    "phone.profile": "phone",
    "phone.filter": "filter",
    "phone.filter_options.time_constant_s": "time constant of the filter",
    "phone.mapping": "mapping",
    "phone.send": "sending",
    "phone.mapping_options.gain": "gain of the phone",
    "robot.watchdog_s": "watchdog of the robot",
    "tuning": "gain",
    "parameters": "set of parameters",
    "robot.profile": "robot",
    "robot.count": "robots",
    "operator.count": "operators",
    "team": "responder",
    "guard.mobilisation_s": "time until the guard sets out",
    "guard.way_m": "way of the guard",
    "phone.max_delay_s": "longest time between two values of the phone",
    "bystander.count": "bystanders",
    "dispatch.policy": "dispatch policy",
    "intensity": "rate of alarms",
}
_LEVELS = {
    "req-rep": "REQ/REP",
    "pipelined": "pipelined requests",
    "pub-sub": "plain PUB/SUB",
    "latest-wins": "latest-wins PUB/SUB",
    "zeromq": "ZeroMQ over TCP",
    "udp": "UDP",
    "tcp": "TCP",
    "trinomial": "trinomial-like",
    "irtp": "IRTP-like",
    "btp": "BTP-like",
    "rtnp": "RTNP-like",
    "rtnp-in-network": "RTNP-like, network",
    "rtnp-in-hosts": "RTNP-like, hosts",
    "direct": "direct control",
    "coordinated": "coordinated control",
    "supervisory": "supervisory control",
    "pursuit": "pursuit",
    "two_point": "two-point steering",
    "move_and_wait": "move and wait",
    "median20-copy": "median of 20 (copy)",
    "median20-inplace": "median of 20 (in place)",
    "one_pole": "one-pole filter",
    "keep_alive": "keep-alive",
    "on_change": "on change",
}
_SHORT_LEVELS = _LEVELS | {
    name: name for name in ("latest-wins", "direct", "coordinated", "supervisory")
}
_MEASURES = {
    "completed_share": "share of trials done",
    "error_share": "share of trials with an error",
    "effective_throughput_bps": "throughput with effective width",
    "delay_felt_s": "delay as the person takes it",
    "id_slope_s_per_bit": "time for one more bit of the index of difficulty",
    "steering_slope_s": "time for one more width of a tunnel",
    "drive_time_s": "driving time to confirmation",
    "path_m": "path length",
    "command_age_p50_s": "median command age at application",
    "command_age_mean_s": "mean command age at application",
    "age_in_force_mean_s": "mean age of the command in force",
    "command_rate_hz": "applied command rate",
    "stop_share": "share of driving time in safe stop",
    "loop_delay_mean_s": "observation-to-effect delay, as the sum of its stages",
    "loop_delay_measured_s": "observation-to-effect delay, measured",
    "contacts": "contacts with walls and others",
    "contact_impulse_n_s": "impulse of all contacts",
    "person_contacts": "contacts with people",
    "jams": "jams",
    "evacuated_s": "time until the last one is out",
    "person_exposure_s": "time of people in danger",
    "round_trip_p50_s": "median time from request to answer",
    "round_trip_p95_s": "95th percentile of the time from request to answer",
    "round_trip_max_s": "longest time from request to answer",
    "samples_per_value": "accelerometer samples per value of the filter",
    "settled_per_min": "events settled",
    "queue_mean": "robots that wait for their operator",
    "response_s": "response time",
    "confirmation_s": "confirmation time",
    "response_mean_s": "restricted mean time to response",
    "confirmation_mean_s": "restricted mean time to confirmation",
    "containment_mean_s": "restricted mean time to containment",
    "response_p50_s": "median time to response",
    "response_p90_s": "90th percentile of the time to response",
    "response_p95_s": "95th percentile of the time to response",
    "exposure_s": "exposure of people per event",
    "exposure_look_s": "exposure of people in finding out, per event",
}


def plain_name(name: str) -> str:
    """A key without its unit and with spaces for the signs between its words."""
    ending = ending_of(name)
    stem = name.removesuffix(f"_{ending}") if ending else name
    return stem.replace(".", " ").replace("_", " ")


def factor_name(factor: str) -> str:
    """`link.delay_s` is the one-way delay."""
    return _FACTORS.get(factor, plain_name(factor))


def with_unit(factor: str) -> str:
    """A factor's name with its unit in brackets, for the head of a column."""
    unit = unit_of(factor)
    return f"{factor_name(factor)} [{unit}]" if unit else factor_name(factor)


def measure_name(measure: str) -> str:
    """`drive_time_s` is the driving time to confirmation."""
    return _MEASURES.get(measure, plain_name(measure))


def number(value: float) -> str:
    """Three figures at most, and never more decimals than the size deserves."""
    if not math.isfinite(value):
        return "–"
    decimals = 0 if abs(value) >= 100 else 1 if abs(value) >= 1 else 2
    text = f"{value:.{decimals}f}"
    return text.replace("-", "\N{MINUS SIGN}") if float(text) else "0"


def capital(text: str) -> str:
    """A capital letter first, unless that is of a name such as `min_eta`; others as they are."""
    return text if "_" in text.partition(" ")[0] else text[:1].upper() + text[1:]


def quantity(value: float, unit: str) -> str:
    """A number with its unit, apart by a space that does not break."""
    return f"{number(value)}\N{NO-BREAK SPACE}{unit}" if unit else number(value)


def percent(share: float) -> str:
    """A share as a whole percentage; small ones keep a decimal so that they are not zero."""
    if not math.isfinite(share):
        return "–"
    text = f"{100 * share:.0f}" if share == 0 or 0.01 <= share <= 0.99 else f"{100 * share:.1f}"
    return f"{text.removesuffix('.0')}\N{NO-BREAK SPACE}%"


def measure_of(measure: str, part: str) -> str:
    """A measure in the part of the study that it was taken in."""
    return f"{measure_name(measure)} of part {part}"


def level_name(factor: str, level: Level | Mapping[str, Any], short: bool = False) -> str:
    """One level with its unit: 0.05 of `link.delay_s` is `50 ms`; a class without its file.

    What a treatment sets may be a law, or another group of keys: `law gamma, mean_s 50 ms`.
    """
    if isinstance(level, Mapping):
        return ", ".join(f"{key} {level_name(key, value)}" for key, value in level.items())
    if isinstance(level, str):
        name = level.rpartition(":")[2] if is_in_file(level) else level
        return (_SHORT_LEVELS if short else _LEVELS).get(name, name)
    if level is None or isinstance(level, bool):
        return {None: "none", True: "yes", False: "no"}[level]
    if factor.endswith(".loss"):
        return percent(level)
    unit = unit_of(factor)
    if unit == "s" and 0 < abs(level) < 1:
        return f"{1000 * level:g}\N{NO-BREAK SPACE}ms"
    return f"{level:g}\N{NO-BREAK SPACE}{unit}" if unit and level else f"{level:g}"


def is_in_file(level: Level) -> bool:
    """Whether a level names a class in a file, as in `mine.py:Mine`."""
    return isinstance(level, str) and ".py:" in level


def brief(levels: Mapping[str, Level]) -> str:
    """Levels in a row, without the names of factors that go without saying.

    Words speak for themselves, as do quantities whose unit no other factor here has:
    `250 ms, latest-wins`.
    """
    units = [unit_of(factor) for factor in levels]
    return ", ".join(_brief(factor, level, units) for factor, level in levels.items())


def _brief(factor: str, level: Level, units: Sequence[str]) -> str:
    unit, name = unit_of(factor), level_name(factor, level, short=True)
    if isinstance(level, str):
        return name
    is_quantity = unit and units.count(unit) == 1 and not isinstance(level, bool)
    if not is_quantity or level is None:
        return f"{factor_name(factor)} {name}"
    return name if level else f"0\N{NO-BREAK SPACE}{'ms' if unit == 's' else unit}"


def setting(levels: Mapping[str, Level]) -> str:
    """Levels of several factors in a row: `profile default, direct control, jitter 20 ms`."""
    return ", ".join(named(factor, level) for factor, level in levels.items())


def named(factor: str, level: Level) -> str:
    """A level behind its factor's name, unless its own has that: `direct control`."""
    name, own = factor_name(factor), level_name(factor, level)
    return own if name in own.split() else f"{name} {own}"


def listing(words: Sequence[str], last: str = "and") -> str:
    """`a`, `a and b`, `a, b and c`."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"
