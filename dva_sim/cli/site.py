"""The commands about one site: draw it, or write it as files to edit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dva_sim.cli.options import REQUIRED, SITES, argument, asks, count, file, flag, several
from dva_sim.kernel.errors import ConfigError

if TYPE_CHECKING:
    from dva_sim.worlds.site import Site

_NAME = argument("A site by name or path, or a ROS map by path.", "SITE", SITES), REQUIRED
_CHANGES = several("An option of a generated site.", "KEY=VALUE", "--set"), ()


@asks(
    name=_NAME,
    out=(file("Picture; default: NAME.png.", "-o", "--out"), None),
    set_=_CHANGES,
    coverage=(flag("--coverage", "Shade areas with weak Wi-Fi."), False),
    width=(count("Width of the picture.", metavar="PIXELS", least=200, most=8000), 1650),
)
def show(name: str, out: Path | None, set_: list[str], coverage: bool, width: int) -> None:
    """Draw a site and describe it in one line.

    Examples:
        dva-sim site show campus --coverage  # writes campus.png
        dva-sim site show office-block --set seed=7 -o block.png  # a generated site
    """
    from dva_sim.worlds.view import write_poster  # late: start-up

    site = _open(name, set_)
    file = out or Path(f"{Path(name).stem}.png")
    write_poster(site, file, coverage, width)
    print(f"{describe(site)}\n{file}")


@asks(
    name=_NAME,
    out=(file("Where to.", "-o", "--out", metavar="FOLDER", of=Path), Path()),
    set_=_CHANGES,
)
def export(name: str, out: Path, set_: list[str]) -> None:
    """Export a site as YAML and GeoJSON for editing.

    Examples:
        dva-sim site export caparica -o mine  # into the folder mine
    """
    from dva_sim.worlds.site_export import write_site  # late: start-up

    site = _open(name, set_)
    print(f"{describe(site)}\n{write_site(site, out)}")


def _open(name: str, changes: Sequence[str]) -> Site:
    """A site by name or path, or that of a ROS map.

    Raises:
        ConfigError: it cannot be read, or takes no options.
    """
    from dva_sim.kernel import resources  # late: start-up
    from dva_sim.kernel.config_overrides import parse_changes  # late: start-up
    from dva_sim.kernel.yaml_files import load_yaml  # late: start-up
    from dva_sim.worlds.site import load_site, map_site  # late: start-up

    options = parse_changes(changes)
    path = resources.find(name, "worlds", is_asked=True)
    if "image" not in load_yaml(path).data:
        return load_site(name, options)
    if options:
        raise ConfigError(f"map {name!r} is not generated and takes no options")
    return map_site(path, seed=1, robots=0, guards=0)


def describe(site: Site) -> str:
    """Describe a site in a line."""
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
    text = ", ".join(f"{number} {what}" for what, number in parts.items() if number)
    return f"{site.name}: {xmax - xmin:.1f} m x {ymax - ymin:.1f} m, {text}"
