"""The site of a recording: put into files that go with it, and made from them again."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from dva_sim.scenario import Scenario, site_of
from dva_sim.worlds.export import write_site
from dva_sim.worlds.maps import FREE, OCCUPIED, UNKNOWN, UNKNOWN_SHADE
from dva_sim.worlds.site import Site

SHADES = {FREE: 254, OCCUPIED: 0, UNKNOWN: UNKNOWN_SHADE}
NO_SITE = "its site is missing"


def pack(site: Site) -> dict[str, bytes]:
    """The files of a site by name: YAML and GeoJSON of a plan, YAML and PNG of a bare map."""
    if not site.rooms:
        return _map_files(site)
    with TemporaryDirectory() as folder:
        write_site(site, Path(folder))
        return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}


def unpack(files: Mapping[str, bytes], scenario: Scenario, seed: int) -> Site:
    """The site again, whatever has become of its own files since.

    Args:
        files: From `pack`.
        scenario: What was run; of a bare map it tells how many bases there are ...
        seed: ... and this places them.

    Raises:
        ConfigError: the files do not hold a site.
        ValueError: there is none.
    """
    name = next((name for name in files if name.endswith(".yaml")), None)
    if name is None:
        raise ValueError(NO_SITE)
    with TemporaryDirectory() as folder:
        for each, data in files.items():
            (Path(folder) / Path(each).name).write_bytes(data)
        path = str(Path(folder) / Path(name).name)
        key = "name" if scenario.site.map is None else "map"
        named = scenario.site.model_copy(update={key: path, "options": {}})
        return site_of(scenario.model_copy(update={"site": named}), seed)


def _map_files(site: Site) -> dict[str, bytes]:
    """A bare map in ROS map_server form, each cell as it was read."""
    from PIL import Image

    grid, shades = site.grid, np.zeros(256, np.uint8)
    for cell, shade in SHADES.items():
        shades[cell] = shade
    picture = io.BytesIO()
    Image.fromarray(shades[grid.cells[::-1]]).save(picture, "PNG")
    text = (
        f"image: {site.name}.png\nmode: trinary\nresolution: {grid.resolution!r}\n"
        f"origin: [{grid.origin.x!r}, {grid.origin.y!r}, {grid.origin.heading!r}]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return {f"{site.name}.yaml": text.encode(), f"{site.name}.png": picture.getvalue()}
