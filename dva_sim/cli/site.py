"""The commands about one site: draw it, or write it as files to edit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.labels import visible
from dva_sim.options.forms import OptionForm, argument, out_form

if TYPE_CHECKING:
    from dva_sim.worlds.site import Site

_Site = Annotated[str, argument("A site by name or path, or a ROS map by path.", "SITE", "worlds")]
_Changes = Annotated[
    tuple[str, ...],
    OptionForm("An option of a generated site.", metavar="KEY=VALUE", is_repeated=True),
]


def show(
    name: _Site,
    out: Annotated[Path | None, out_form("Picture; default: NAME.png.", "FILE")] = None,
    set: _Changes = (),
    coverage: Annotated[bool, OptionForm("Shade areas with weak Wi-Fi.")] = False,
    width: Annotated[
        int, OptionForm("Width of the picture.", metavar="PIXELS", least=200, most=8000)
    ] = 1650,
) -> None:
    """Draw a site and describe it in one line.

    Examples:
        dva-sim site show campus --coverage  # writes campus.png
        dva-sim site show office-block --set seed=7 -o block.png  # a generated site
    """
    from dva_sim.worlds.view import write_poster  # late: start-up

    site = _open(name, set)
    file = out or Path(f"{Path(name).stem}.png")
    write_poster(site, file, coverage, width)
    print(f"{describe(site)}\n{file}")


def export(
    name: _Site,
    out: Annotated[Path, out_form("Where to.")] = Path(),
    set: _Changes = (),
) -> None:
    """Export a site as YAML and GeoJSON for editing.

    Examples:
        dva-sim site export caparica -o mine  # into the folder mine
    """
    from dva_sim.worlds.site_export import write_site  # late: start-up

    site = _open(name, set)
    print(f"{describe(site)}\n{write_site(site, out)}")


def _open(name: str, changes: Sequence[str]) -> Site:
    """Return a site by name or path, or that of a ROS map.

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
    return f"{visible(site.name)}: {xmax - xmin:.1f} m x {ymax - ymin:.1f} m, {text}"
