"""Conditions of a study: the settings that were equal for all compared levels."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from dva_sim.experiments.analysis.run_grid import Factor
from dva_sim.experiments.study.parts import POINT
from dva_sim.simulation.labels import factor_name, level_name, stated_conditions
from dva_sim.simulation.scenario import TRIPS_OF_A_START, time_out_s

_VARIED = "varied"
_NO_VALUE = "–"
_OF_WAITING = (
    *("command.timeout_s", "robot.processing_s"),
    *("link.delay_s", "link.up.delay_s", "link.down.delay_s"),
)


def conditions(
    scenarios: Mapping[str, Mapping[str, Any]], factors: Sequence[Factor], also: Sequence[str] = ()
) -> list[tuple[str, list[str]]]:
    """Return each condition with its value in every part, and `varied` where it is a factor.

    Args:
        scenarios: Those of the parts.
        factors: The keys that vary.
        also: Further keys that matter here, such as those a study has changed.
    """
    if not scenarios:
        return []
    varied = {factor.name for factor in factors}
    sites = [_site(s) for s in scenarios.values()]
    rows = [("site", sites)] if any(site != _NO_VALUE for site in sites) else []
    stated = stated_conditions(dict.fromkeys(s.get("model", "full") for s in scenarios.values()))
    stated |= {key: factor_name(key) for key in also if key not in stated}
    for key, name in stated.items():
        settings = [get(s, key) for s in scenarios.values()]
        values = [None if v is False or v == [] else v for v in settings]  # which go without saying
        if key in varied:
            rows.append((name, [_VARIED] * len(values)))
        elif any(v is not None for v in values):
            rows.append((name, [_text(key, v) for v in values]))
    return rows


def get(scenario: Mapping[str, Any], key: str) -> Any:
    """Return the value at a dotted key; None where there is none."""
    value: Any = scenario
    for name in key.split("."):
        value = value.get(name) if isinstance(value, Mapping) else None
    return value


def waits(
    scenarios: Mapping[str, Mapping[str, Any]], study: Mapping[str, Any]
) -> list[RequestWait]:
    """List what requests wait for, condition by condition; nothing without requests.

    Args:
        scenarios: Those of the parts.
        study: Its factors, treatments and the ends of its ranges say which conditions there are.
    """
    played = itertools.product(scenarios.values(), _changes(study))
    return list(filter(None, (_waiting(*pair) for pair in played)))


class RequestWait(NamedTuple):
    """Time-out of a request, and the time a reply needs [s]."""

    timeout: float
    round_trip: float
    needed: float

    @property
    def is_short(self) -> bool:
        """True if a request that is sent again does not get its reply in time."""
        return self.timeout <= self.needed


def _waiting(scenario: Mapping[str, Any], changes: Mapping[str, Any]) -> RequestWait | None:
    """Return time-out and needed time of one condition; None without requests."""

    def base(key: str) -> Any:
        return get(scenario, key)

    def of(key: str) -> Any:
        return changes[key] if key in changes else base(key)

    timeout, processing, delay = (
        of(key) for key in ("command.timeout_s", "robot.processing_s", "link.delay_s")
    )
    if timeout is None or processing is None or delay is None:
        return None
    trip, needed = _needed(of)
    if "command.timeout_s" not in changes and timeout == _usual(base):
        timeout = time_out_s(needed)  # nobody gave one, so it follows the link
    return RequestWait(float(timeout), trip, needed)


def _usual(of: Callable[[str], Any]) -> float | None:
    """Return the time-out where nobody gives one [s]; None where that cannot be known."""
    is_timed = of("link.delay_s") is not None and of("robot.processing_s") is not None
    return time_out_s(_needed(of)[1]) if is_timed else None


def _needed(of: Callable[[str], Any]) -> tuple[float, float]:
    """Return the round trip, and the time to the first answer over a new connection [s]."""
    delay = of("link.delay_s")
    processing = of("robot.processing_s")
    ways = (of(f"link.{direction}.delay_s") for direction in ("up", "down"))
    trip = float(sum(delay if direction is None else direction for direction in ways))
    mean = processing["mean_s"] if isinstance(processing, Mapping) else processing
    return trip, TRIPS_OF_A_START * trip + float(mean)


def _changes(study: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the scenario changes of each combination of levels and of range ends."""
    named = study.get("treatments", {})
    factors = [
        [named[name][str(level)] if name in named else {name: level} for level in levels]
        for name, levels in study.get("factors", {}).items()
        if name != POINT
    ]
    ranges = (study.get("design") or {}).get("ranges") or {}
    ends = [
        [{key: range_[end]} for end in ("low", "high")]
        for key, range_ in ranges.items()
        if key in _OF_WAITING
    ]
    for levels in itertools.product(*factors, *ends):
        yield {key: value for level in levels for key, value in level.items()}


def _site(scenario: Mapping[str, Any]) -> str:
    chosen = get(scenario, "site.map") or get(scenario, "site.name")
    return str(chosen).rpartition("/")[2] if chosen else _NO_VALUE


def _text(key: str, value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, int | float) and key.endswith(".rate_bps"):
        return f"{value / 1e6:g} Mbit/s"
    if isinstance(value, int | float) and key.endswith(("_bytes", ".bytes")):
        return f"{value / 1000:g} kB"
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {v}" for k, v in value.items() if v is not None) or _NO_VALUE
    if isinstance(value, list | tuple):
        return ", ".join(_text(key, item) for item in value)
    if isinstance(value, str):
        return value.rpartition("/")[2]
    return level_name(key, value)
