"""Names of factors, levels, measures and numbers for readers."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from dva_sim.kernel.config import Key, Scalar, titled_keys
from dva_sim.kernel.measure import Measure
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import percent, without_unit
from dva_sim.network.patterns import PATTERNS
from dva_sim.simulation.models import MODELS

# Factors that are no keys of a scenario: of every study, or treatments of the shipped ones.
_OF_STUDIES = {
    "tuning": "gain",
    "parameters": "set of parameters",
    "crowd": "TCP flows each way",
    "team": "responder",
}
_LEVELS = {
    **{name: kind.title for name, kind in PATTERNS.items()},
    "zeromq": "ZeroMQ over TCP",
    "udp": "UDP",
    "tcp": "TCP",
    "conflate": "conflated PUB/SUB",
    "mqtt-0": "MQTT, QoS 0",
    "mqtt-1": "MQTT, QoS 1",
    "mqtt-0-nodelay": "MQTT, QoS 0, TCP_NODELAY",
    "mqtt-1-nodelay": "MQTT, QoS 1, TCP_NODELAY",
    "zenoh-tcp": "Zenoh over TCP",
    "zenoh-udp": "Zenoh over UDP",
    "webrtc": "WebRTC",
    "webrtc-unordered": "WebRTC, unordered",
    "dds": "DDS",
    "websocket": "WebSocket",
    "trinomial": "trinomial-like",
    "irtp": "IRTP-like",
    "btp": "BTP-like",
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
_SHORT_LEVELS = (
    _LEVELS
    | {name: kind.label for name, kind in PATTERNS.items()}
    | {name: name for name in ("direct", "coordinated", "supervisory")}
    | {f"mqtt-{qos}": f"MQTT {qos}" for qos in (0, 1)}
    | {f"mqtt-{qos}-nodelay": f"MQTT {qos}, nodelay" for qos in (0, 1)}
)


@cache
def _keys() -> dict[str, Key]:
    """Return the names in the scenarios' fields; a key has one name in all models."""
    values: dict[str, Key] = {}
    for model in reversed(MODELS.values()):
        values |= titled_keys(model.scenario)
    return values


@cache
def _measures() -> dict[str, Measure]:
    """Return every column by name; of several models' that of the first with a title."""
    values: dict[str, Measure] = {}
    tables = [table for model in MODELS.values() for table in model.columns.values()]
    for column in itertools.chain(*tables):
        if column.name not in values or (column.title and not values[column.name].title):
            values[column.name] = column
    return values


def stated_conditions(models: Iterable[str]) -> dict[str, str]:
    """Return keys that a table of conditions may state, with their words there, of some models."""
    entries = (titled_keys(MODELS[name].scenario) for name in models if name in MODELS)
    return {
        path: key.condition for entry in entries for path, key in entry.items() if key.condition
    }


_OWN_COLUMNS: dict[str, Measure] = {}


def take_up(columns: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> None:
    """Call the measures of users as a results folder does; the newest one counts.

    Args:
        columns: User-defined columns from the manifest, by table and name.
    """
    for table in columns.values():
        _OWN_COLUMNS.update(
            {
                name: Measure(name, entry.get("meaning", ""), entry.get("title", ""))
                for name, entry in table.items()
            }
        )


def measure_called(name: str, model: str = "") -> Measure:
    """Return the description of a measure, in a certain model if it has it; else its name."""
    columns = MODELS[model].columns["runs"] if model in MODELS else ()
    column_measure = next((column for column in columns if column.name == name), None)
    return column_measure or _measures().get(name) or _OWN_COLUMNS.get(name) or Measure(name, "")


def factor_name(factor: str) -> str:
    """Return a factor's name in words: `one-way delay` for `link.delay_s`."""
    key = _keys().get(factor)
    habit = factor.partition(".habits.")[2]
    return key.title if key else _OF_STUDIES.get(factor, without_unit(habit or factor))


def with_unit(factor: str) -> str:
    """Return a factor's name with its unit in brackets, for the head of a column."""
    unit = unit_of(factor)
    return f"{factor_name(factor)} [{unit}]" if unit else factor_name(factor)


def measure_name(measure: str) -> str:
    """Return the driving time to confirmation, for `drive_time_s`."""
    return measure_called(measure).words


def measure_of(measure: str, part: str) -> str:
    """Return a measure in the part of the study that it was taken in."""
    return f"{measure_name(measure)} of part {part}"


def level_name(
    factor: str, level: Scalar | Mapping[str, Any] | list[Any], short: bool = False
) -> str:
    """Return one level with its unit: 0.05 of `link.delay_s` is `50 ms`; a class without its file.

    The value that a treatment sets may be a law, or another group of keys:
    `law gamma, mean_s 50 ms`; or several: `from_s 7 s, for_s 2 s; from_s 20 s, for_s 1 s`.
    """
    if isinstance(level, Mapping):
        return ", ".join(f"{key} {level_name(key, value)}" for key, value in level.items())
    if isinstance(level, list):
        return "; ".join(level_name(factor, value) for value in level) or "none"
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


def is_in_file(level: Scalar) -> bool:
    """Return True if a level names a class in a file, as in `mine.py:Mine`."""
    return isinstance(level, str) and ".py:" in level


def brief(levels: Mapping[str, Scalar]) -> str:
    """Return scalars in a row, without the names of factors that go without saying.

    Words speak for themselves, as do quantities whose unit no other factor here has:
    `250 ms, latest-wins`.
    """
    units = [unit_of(factor) for factor in levels]
    return ", ".join(_brief(factor, level, units) for factor, level in levels.items())


def _brief(factor: str, level: Scalar, units: Sequence[str]) -> str:
    unit = unit_of(factor)
    name = level_name(factor, level, short=True)
    if isinstance(level, str):
        return name
    is_quantity = unit and units.count(unit) == 1 and not isinstance(level, bool)
    if not is_quantity or level is None:
        return f"{factor_name(factor)} {name}"
    return name if level else f"0\N{NO-BREAK SPACE}{'ms' if unit == 's' else unit}"


def setting(levels: Mapping[str, Scalar]) -> str:
    """Scalars of several factors in a row: `profile default, direct control, jitter 20 ms`."""
    return ", ".join(named(factor, level) for factor, level in levels.items())


def named(factor: str, level: Scalar) -> str:
    """Return a level behind its factor's name, unless its own has that: `direct control`."""
    name = factor_name(factor)
    text = level_name(factor, level)
    return text if name in text.split() else f"{name} {text}"
