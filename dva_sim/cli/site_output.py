"""What `dva-sim site` prints and writes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dva_sim.kernel import resources
from dva_sim.kernel.config import load_yaml
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.key_changes import parse_changes
from dva_sim.worlds.layout import Site
from dva_sim.worlds.site import load_site, map_site


def show(name: str, out: Path | None, changes: Sequence[str], coverage: bool, width: int) -> None:
    """Draw a site into a PNG file, and say in a line what it is.

    Args:
        name: A site by name or path, or the path of a ROS map.
        out: The file; `NAME.png` in the working folder if None.
        changes: `key=value` pairs for a site that is generated.
        coverage: Show where the radio link is not good.
        width: Of the picture [pixels].

    Raises:
        ConfigError: the site cannot be read, or the file cannot be written.
    """
    from dva_sim.worlds.poster import write_poster

    site = _open(name, parse_changes(changes))
    file = out or Path(f"{Path(name).stem}.png")
    write_poster(site, file, coverage, width)
    print(f"{describe(site)}\n{file}")


def export(name: str, folder: Path, changes: Sequence[str]) -> None:
    """Write a site as YAML and GeoJSON.

    Raises:
        ConfigError: the site cannot be read, or the files cannot be written.
    """
    from dva_sim.worlds.site_export import write_site

    site = _open(name, parse_changes(changes))
    print(f"{describe(site)}\n{write_site(site, folder)}")


def _open(name: str, options: Mapping[str, Any]) -> Site:
    path = resources.find(name, "worlds", is_asked=True)
    if "image" not in load_yaml(path).data:
        return load_site(name, options)
    if options:
        raise ConfigError(f"map {name!r} is not generated and takes no options")
    return map_site(path, seed=1, robots=0, guards=0)


def describe(site: Site) -> str:
    """What a site is, in a line."""
    xmin, ymin, xmax, ymax = site.extent
    indoor = sum(not room.outdoor for room in site.rooms)
    parts = {
        "rooms": indoor,
        "paths and yards": len(site.rooms) - indoor,
        "doors": len(site.doors),
        "exits": len(site.exits),
        "robot bases": len(site.robot_bases),
        "guard posts": len(site.guard_posts),
        "operator desks": len(site.operator_desks),
        "detectors": len(site.detectors),
        "cameras": len(site.cameras),
        "wall segments": len(site.walls),
    }
    told = ", ".join(f"{number} {what}" for what, number in parts.items() if number)
    return f"{site.name}: {xmax - xmin:.1f} m x {ymax - ymin:.1f} m, {told}"
