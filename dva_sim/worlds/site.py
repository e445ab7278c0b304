"""Sites by name: drawn, generated, or from a bare ROS map."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from dva_sim import resources
from dva_sim.config import Config, Document, load_yaml, validate
from dva_sim.errors import ConfigError
from dva_sim.guesses import hint
from dva_sim.worlds.bare_map import DEFAULT_FRAME, map_site
from dva_sim.worlds.geo import GeoFrame, Pose
from dva_sim.worlds.layout import FOOTPRINT, STANDING, Site
from dva_sim.worlds.maps import rasterise
from dva_sim.worlds.office_block import OfficeBlock, office_block
from dva_sim.worlds.parts import CEILING, Detector, Room
from dva_sim.worlds.plan import Plan, make_plan, read_plan

__all__ = [
    "DEFAULT_FRAME",
    "FOOTPRINT",
    "Detector",
    "Pose",
    "Room",
    "Site",
    "SiteFile",
    "load_site",
    "map_site",
]


class SiteFile(Config):
    """`worlds/NAME.yaml`: where the origin lies, and which plan belongs to it.

    The plan is drawn, in a GeoJSON file, or generated.
    """

    class Origin(Config):
        """Geographic position of x = y = 0 [deg]."""

        latitude: Annotated[float, Field(gt=-89, lt=89)]
        longitude: Annotated[float, Field(ge=-180, le=180)]

    name: str
    description: str = ""
    origin: Origin
    plan: str | None = None
    generate: OfficeBlock | None = None
    resolution_m: Annotated[float, Field(gt=0.005, le=0.5)] = 0.05
    ceiling_m: Annotated[float, Field(ge=1.5, le=50)] = CEILING

    @model_validator(mode="after")
    def _one_plan(self) -> SiteFile:
        if (self.plan is None) == (self.generate is None):
            raise ValueError("should have a plan (a GeoJSON file) or generate, and not both")
        return self


def load_site(name_or_path: str | Path, options: Mapping[str, Any] | None = None) -> Site:
    """Read a site in our own format, by name or path; once per process.

    Args:
        name_or_path: Such as `caparica`.
        options: Replace keys of `generate`, such as the seed, where a site is generated.

    Raises:
        ConfigError: not found, unknown key or kind, a base inside a wall.
    """
    path = resources.find(str(name_or_path), "worlds").resolve()
    return _load_site(path, json.dumps(dict(options or {}), sort_keys=True))


@lru_cache(maxsize=16)
def _load_site(path: Path, options: str) -> Site:
    document = load_yaml(path)
    if "image" in document.data and "plan" not in document.data:
        problem = "is a bare ROS map; give it as site.map, not as site.name"
        raise document.error(problem, ("image",))
    config = validate(SiteFile, document.data, document.error)
    frame = GeoFrame(config.origin.latitude, config.origin.longitude)
    plan = _plan(config, document, frame, json.loads(options))
    return _site(config, frame, plan)


def _plan(
    config: SiteFile, document: Document, frame: GeoFrame, options: Mapping[str, Any]
) -> Plan:
    if config.generate is not None:
        wanted = _with_options(config.name, config.generate, options)
        return make_plan(office_block(wanted), config.ceiling_m)
    if options:
        given = ", ".join(options)
        raise ConfigError(f"site {config.name!r} is drawn and takes no options; given: {given}")
    file = document.file.parent / str(config.plan)
    if not resources.is_file(file):
        raise document.error(f"plan {config.plan!r} not found", ("plan",))
    return read_plan(file, frame, config.ceiling_m)


def _with_options(name: str, block: OfficeBlock, options: Mapping[str, Any]) -> OfficeBlock:
    known = [key for key in type(block).model_fields if key != "kind"]
    for key in options:
        if key not in known:
            raise ConfigError(f"site {name!r} has no option {key!r}; {hint(key, known)}")
    data = block.model_dump() | dict(options)
    return validate(OfficeBlock, data, lambda text, _: ConfigError(f"site {name!r}: {text}"))


def _site(config: SiteFile, frame: GeoFrame, plan: Plan) -> Site:
    site = Site(
        name=config.name,
        frame=frame,
        walls=plan.walls,
        rooms=plan.rooms,
        doors=plan.doors,
        robot_bases=plan.poses("robot_base"),
        guard_posts=plan.poses("guard_post"),
        operator_desks=plan.poses("operator_desk"),
        detectors=plan.detectors,
        extent=plan.floor.bounds,
        grid=rasterise(plan.floor, plan.walls, config.resolution_m),
        solids=plan.solids,
        door_heights=plan.door_heights,
        exits=plan.exits,
        zones=plan.zones,
        cameras=plan.cameras,
        base_stations=plan.base_stations,
        wifi=plan.wifi,
        ceiling=config.ceiling_m,
    )
    for kind, radius in (("robot_base", FOOTPRINT), ("guard_post", STANDING)):
        for pose, error in plan.places[kind]:
            if not site.is_free(pose.x, pose.y, radius):
                raise error(f"{kind} needs {radius:g} m of free floor around it: it is in a wall")
    return site
