"""The commands about one site: draw it, or write it as files to edit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from dva_sim.cli.completing import SITES
from dva_sim.cli.options import whole

SiteName = Annotated[
    str,
    Argument(
        metavar="SITE",
        autocompletion=SITES,
        help="A site by name or path, or a ROS map by path.",
    ),
]
SiteSets = Annotated[
    list[str] | None,
    Option("--set", metavar="KEY=VALUE", help="An option of a generated site."),
]


def show(
    name: SiteName,
    out: Annotated[
        Path | None, Option("-o", "--out", metavar="FILE", help="Picture; default: NAME.png.")
    ] = None,
    set_: SiteSets = None,
    coverage: Annotated[bool, Option("--coverage", help="Show where Wi-Fi is not good.")] = False,
    width: Annotated[
        int,
        Option(metavar="PIXELS", parser=whole(200, 8000), help="Of the picture."),
    ] = 1650,
) -> None:
    """Draw a site and say in a line what it is.

    Examples:
        dva-sim site show campus --coverage  # writes campus.png
        dva-sim site show office-block --set seed=7 -o block.png  # a generated site
    """
    from dva_sim.cli import site_output

    site_output.show(name, out, set_ or [], coverage, width)


def export(
    name: SiteName,
    out: Annotated[Path, Option("-o", "--out", metavar="FOLDER", help="Where to.")] = Path(),
    set_: SiteSets = None,
) -> None:
    """Write a site as YAML and GeoJSON, to go on drawing.

    Examples:
        dva-sim site export caparica -o mine  # into the folder mine
    """
    from dva_sim.cli import site_output

    site_output.export(name, out, set_ or [])
