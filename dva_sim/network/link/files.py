"""Reads a link from a file of its keys, or from the `link:` of a scenario."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from dva_sim.kernel import config_overrides, resources
from dva_sim.kernel.config import Fail
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document, load_yaml
from dva_sim.network.link.config import LinkConfig
from dva_sim.network.link.link import check_partitions

_SCENARIOS = "experiments/scenarios"
_KEY = "link"
_OF_SCENARIOS = {"horizon_s", "model"}  # each has one of these


def read_link(name: str | None, changes: Mapping[str, Any], nodes: Collection[str]) -> LinkConfig:
    """Return a link from a file, with some keys changed.

    Args:
        name: Path of a file of a link's keys, or of a scenario, or name of a scenario; None: the
            default link.
        changes: New values by dotted key, such as `{"up.delay_s": 0.25}`.
        nodes: Names that partitions may give.

    Raises:
        ConfigError: it cannot be read, or is not a valid link; see `config_overrides.build`.
    """

    def complete(link: LinkConfig, error: Fail) -> LinkConfig:
        try:
            check_partitions(link.partitions, nodes)
        except ConfigError as problem:
            raise error(problem.problem, ("partitions",)) from None
        return link

    source: Document | Mapping[str, Any] = {}
    if name is not None:
        source = _link_in(load_yaml(resources.find(name, _SCENARIOS)))
    return config_overrides.build(LinkConfig, source, changes, complete)


def _link_in(document: Document) -> Document:
    """Return the part of a file that holds the keys of a link."""
    if _KEY not in document.data and not _OF_SCENARIOS & document.data.keys():
        return document
    data = document.data.get(_KEY, {})
    if not isinstance(data, dict):
        problem = f"{_KEY}: should be a mapping of keys to values"
        raise document.error(problem, (_KEY,))
    places = {path[1:]: at for path, at in document.places.items() if path[:1] == (_KEY,)}
    return Document(data, document.file, places)
