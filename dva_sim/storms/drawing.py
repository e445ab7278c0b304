"""Random draw of a storm: team, site, link, policy, pattern, people, events and faults."""

from __future__ import annotations

import random
from typing import Any, Final

from dva_sim.core.dispatch import POLICIES
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.network.patterns import PATTERNS
from dva_sim.simulation.full.stage import id_of
from dva_sim.storms.drivers import FIRST_NUMBER
from dva_sim.storms.faults import DEADLINES, FAULTS, FaultKind
from dva_sim.storms.plan import Fault, StormPlan

FIRST = 15.0  # earliest start of a fault [s]
STORM = 600.0  # end of the last fault [s]
_SOURCES: Final = "", "operator", "driver", "dva", "robot"
PROFILES: Final[dict[str, tuple[str, ...]]] = {
    "all": tuple(FAULTS),
    "messages": tuple(
        kind for kind in FAULTS if kind.startswith(("messages", "partition", "replay", "junk"))
    ),
    "nodes": tuple(
        kind
        for kind in FAULTS
        if kind.startswith(("robot", "dva", "disk", "frozen", "clock", "vanishes", "replies"))
    ),
    "people": (
        *("revocation", "take-over", "emergency", "emergency-button", "asks-twice", "old-session"),
        *("held-tilt", "second-driver", "flood", "flood-in-doubt", "taken-by-hand", "vanishes"),
        *("replay-by-another", "order-again", "guard-idle", "app-restarts"),
    ),
    "none": (),
}
"""Kinds of faults that each profile draws from."""
SLOW_LINK = 1.0  # delay from which on TCP sends its first segment twice [s]
SLOW_TIMEOUT = 12.0  # time-out there: the first answer over a new connection takes 9.1 s [s]


def draw(seed: int, profile: str = "all") -> StormPlan:
    """Draw a storm.

    Args:
        seed: Random seed of the storm.
        profile: Profile of fault kinds, as in `PROFILES`.

    Raises:
        ConfigError: there is no such profile.
    """
    if profile not in PROFILES:
        raise ConfigError(unknown("profile", profile, PROFILES))
    chance = random.Random(f"storm {seed}")
    robots = chance.choice((2, 2, 3, 4, 6))
    guards = chance.choice((0, 0, 1, 2))
    scenario: dict[str, Any] = {
        "site": _site(chance),
        "robot": {
            "count": robots,
            "watchdog_s": chance.choice((1.0, 3.0, 3.0)),
            "processing_s": chance.choice((0.05, 0.05, 0.01)),
            "sensors": [{"name": name} for name in chance.choice(((), ("smoke", "temperature")))],
        },
        "guard": {"count": guards, "mobilisation_s": chance.choice((15.0, 25.0))},
        "operator": {
            "count": chance.randint(min(2, robots), min(4, robots)),
            "strategy": chance.choice(("adaptive", "pursuit", "move_and_wait")),
            "span": chance.choice((1, 1, 2)),
            "person": chance.randrange(100),
        },
        "control": chance.choice(("direct", "direct", "coordinated", "supervisory")),
        "pattern": chance.choice(sorted(PATTERNS)),
        "command": {"rate_hz": chance.choice((2, 5, 10))},
        "camera": {"rate_hz": chance.choice((2, 5)), "frame_bytes": 4000},
        "request": {"timeout_s": 9.0, "attempts": 3},
        "link": _link(chance),
        "dva": {
            "sensors": chance.choice(([], [], [], ["temperature", "smoke"])),
            "supervisors": [id_of("operator", FIRST_NUMBER + 1)],
        },
        "dispatch": {
            "policy": chance.choice(sorted(POLICIES.keys() - {"oracle"})),
            "containment": guards > 0 and chance.random() < 0.5,
            "escalate_after_s": chance.choice((10.0, 30.0, 120.0)),
            "order_limit_s": chance.choice((90.0, 300.0)),
            "depart_within_s": chance.choice((30.0, 60.0)),
            "still_within_s": chance.choice((None, 45.0)),
            "mode": chance.choice(("automatic", "automatic", "ask_first")),
            "decide_within_s": 10.0,
        },
        "events": [_event(chance, number) for number in range(chance.randint(5, 16))],
    }
    if scenario["link"]["delay_s"] >= SLOW_LINK:
        scenario["request"]["timeout_s"] = SLOW_TIMEOUT
    counts = {kind: scenario[kind]["count"] for kind in ("robot", "guard", "operator")}
    counts["driver"] = drivers = chance.randint(1, min(3, counts["robot"]))
    kinds = PROFILES[profile]
    count = round(chance.uniform(10, 60)) if kinds else 0
    faults = sorted((_fault(chance, kinds, counts) for _ in range(count)), key=lambda f: f.at_s)
    return StormPlan(seed, scenario, tuple(faults), STORM, drivers)


def _site(chance: random.Random) -> dict[str, Any]:
    name = chance.choice(("caparica", "caparica", "hall", "office-block"))
    if name != "office-block":
        return {"name": name}
    return {"name": name, "options": {"seed": chance.randint(1, 4), "width_m": 40, "depth_m": 30}}


def _link(chance: random.Random) -> dict[str, Any]:
    link: dict[str, Any] = {"delay_s": chance.choice((0.005, 0.05, 0.2, 0.5, 1.0))}
    if chance.random() < 0.3:
        link["loss"] = chance.choice((0.005, 0.02))
    if chance.random() < 0.3:
        link["outages"] = [
            {"from_s": chance.uniform(FIRST, STORM - 60), "for_s": chance.uniform(1, 30)}
        ]
    return link


def _event(chance: random.Random, number: int) -> dict[str, Any]:
    kind = chance.choice(("fire", "gas_leak", "flood"))
    last = chance.choice((60.0, STORM - 100.0))  # early: many events within a minute
    return {
        "kind": kind,
        "at_s": round(chance.uniform(5.0, last), 1),
        "reported": True,
        "false_alarm": chance.random() < 0.2,
        "reports": chance.choice((1, 1, 3)),
    }


def _fault(chance: random.Random, kinds: tuple[str, ...], counts: dict[str, int]) -> Fault:
    there = [name for name in kinds if any(counts.get(each, 1) for each in FAULTS[name].strikes)]
    (name,) = chance.choices(there, [FAULTS[name].weight for name in there])
    kind = FAULTS[name]
    target = _device(chance, kind.strikes, counts)
    source = _device(chance, _SOURCES, counts) if name.startswith(("messages", "partition")) else ""
    lasts = _duration(chance, kind)
    at = round(chance.uniform(FIRST, STORM - lasts - 45.0), 3)
    on = chance.choice(kind.on) if kind.on and chance.random() < 0.6 else ""
    if on and target.startswith("robot") and chance.random() < 0.7:
        target = "robot-*"
    return Fault(
        kind=name,
        at_s=at,
        for_s=lasts,
        target=target,
        source=source if source != target else "",
        on=on,
        value=round(chance.uniform(*kind.value), 3),
    )


def _duration(chance: random.Random, kind: FaultKind) -> float:
    low, high = kind.lasts
    near = [deadline for deadline in DEADLINES if low <= deadline <= high]
    if near and chance.random() < 0.5:
        return round(chance.choice(near) + chance.uniform(-0.3, 0.3), 3)
    return round(chance.uniform(low, high), 3)


def _device(chance: random.Random, kinds: tuple[str, ...], counts: dict[str, int]) -> str:
    """Draw a device of some kinds, by label."""
    kind = chance.choice([kind for kind in kinds if counts.get(kind, 1)])
    if kind in ("", "dva"):
        return kind
    return f"{kind}-{chance.randint(1, counts[kind])}"
