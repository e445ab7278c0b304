"""Lines for pages about a system of which only messages are known; what is unknown is null."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from dva_sim.console.run.lag import LIMIT
from dva_sim.console.views.scene import RULES, legend, patterns_of, site_of
from dva_sim.console.views.system_state import DeviceState
from dva_sim.console.views.things import UNKNOWN_PERSON, UNKNOWN_ROBOT
from dva_sim.console.wire.scenes import LinkShown, SceneLine, SiteShown, ThingBody, ThingShown
from dva_sim.protocol.devices import GUARD, ROBOT
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.site import Site

LINK: Final[LinkShown] = {"kind": "attached", "processing_s": None}
AROUND: Final = 40.0  # of the first position, where no site is known [m]
KINDS: Final = {ROBOT: "robot", GUARD: "guard"}
BODIES: Final[Mapping[str, ThingBody]] = {"robot": UNKNOWN_ROBOT, "guard": UNKNOWN_PERSON}


def things_of(devices: Iterable[DeviceState], numbers: dict[str, int]) -> list[ThingShown]:
    """Everybody, with numbers that stay as they are."""
    things: list[ThingShown] = []
    for entry in devices:
        device = entry.device
        kind = KINDS.get(device.device_type, "operator")
        number = numbers.setdefault(device.id_tag, len(numbers))
        body = BODIES.get(kind, {})
        things.append(
            {"i": number, "id": device.id_tag, "label": device.label, "kind": kind, **body}
        )
    return things


def attached_scene(
    things: list[ThingShown], address: str, own_pattern: str, site: Site | None, frame: GeoFrame
) -> SceneLine:
    """The first line that a page gets."""
    return {
        "k": "scene",
        "t": 0,
        "scenario": f"DVA at {address}",
        "title": f"What runs at the DVA at {address}",
        "seed": None,
        "attached": True,
        "site": site_of(site) if site is not None else nowhere(frame),
        "things": things,
        "patterns": patterns_of(own_pattern),
        "link": LINK,
        "link_limits": {},
        "pace_limits": [1.0, 1.0],
        "watchdog_s": None,
        "stale_s": None,
        "lag_limit_s": LIMIT,
        "rules": RULES,
        "legend": legend(()),
        "dva_address": address,
    }


def nowhere(frame: GeoFrame) -> SiteShown:
    """A site of which nothing is known but where on earth it lies."""
    return {
        "name": "unknown",
        "extent_m": [-AROUND, -AROUND, AROUND, AROUND],
        "origin": {"latitude_deg": frame.latitude, "longitude_deg": frame.longitude},
        "features": {"type": "FeatureCollection", "features": []},
        "rooms": [],
        "walls_m": [],
        "solids_m": [],
        "doors_m": [],
        "exits_m": [],
    }
