"""The page of features on a plan: geometry and properties of each kind, and qualities of Wi-Fi."""

from __future__ import annotations

from collections.abc import Iterator

from dva_sim.worlds.geojson import KINDS, FeatureKind
from dva_sim.worlds.site_parts import QUALITIES, LinkQuality
from generators.configuration import Keys
from generators.markdown import code, table
from generators.markdown import page as page_of

_HEAD = """\
Kinds of features on the GeoJSON plan of a site, with the properties that each may have beside
`kind`. [Site plans](sites.md) says what they mean."""


def page() -> str:
    """Return the page in Markdown."""
    columns = [code(name) for name in LinkQuality._fields]
    return page_of(
        "Features of plans",
        _HEAD,
        table(["kind", "geometry", "properties"], _kinds()),
        "## Wi-Fi",
        "Values of each `quality` of a `wifi` area, in each direction. They are assumed.",
        table(["quality", *columns], _qualities()),
    )


def _kinds() -> Iterator[list[str]]:
    for name, kind in KINDS.items():
        yield [code(name), ", ".join(map(code, kind.shapes)), "; ".join(_properties(kind))]


def _properties(kind: FeatureKind) -> Iterator[str]:
    keys = Keys("plan", {}, {})
    for name, value in kind.model.model_json_schema()["properties"].items():
        default = value.get("default")
        shown = "" if default is None else f", default {code(default)}"
        yield f"{code(name)}: {keys.type_of(value)}{shown}"


def _qualities() -> Iterator[list[str]]:
    for name, quality in QUALITIES.items():
        yield [code(name), *(f"{value:g}" for value in quality)]
