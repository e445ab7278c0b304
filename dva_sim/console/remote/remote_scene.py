"""Lines for pages about a system of which only messages are known; what is unknown is null."""

from __future__ import annotations

from typing import Final

from dva_sim.console.run.lag import LIMIT
from dva_sim.console.views.scene import RULES, legend, patterns_of, site_of
from dva_sim.console.wire.scenes import LinkShown, SceneLine, SiteShown, ThingShown
from dva_sim.simulation.scenario.regions import RegionPlan
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.site import Site

LINK: Final[LinkShown] = {"kind": "attached", "processing_s": None}
DEFAULT_REACH_M: Final = 40.0  # half-width of a map without a site [m]


def remote_scene(
    things: list[ThingShown],
    address: str,
    own_pattern: str,
    site: Site | None,
    frame: GeoFrame,
    regions: RegionPlan | None,
) -> SceneLine:
    """Return the first line that a page gets."""
    return {
        "k": "scene",
        "t": 0,
        "scenario": f"DVA at {address}",
        "title": f"What runs at the DVA at {address}",
        "seed": None,
        "attached": True,
        "site": site_of(site, regions) if site is not None else nowhere(frame),
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
    """Return a site of which nothing is known but where on earth it lies."""
    return {
        "name": "unknown",
        "extent_m": [-DEFAULT_REACH_M, -DEFAULT_REACH_M, DEFAULT_REACH_M, DEFAULT_REACH_M],
        "origin": {"latitude_deg": frame.latitude, "longitude_deg": frame.longitude},
        "features": {"type": "FeatureCollection", "features": []},
        "rooms": [],
        "walls_m": [],
        "solids_m": [],
        "doors_m": [],
        "exits_m": [],
        "regions": [],
    }
