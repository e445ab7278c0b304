"""Keys for the devices of a scenario, by the names that people use."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.keys import create_keys
from dva_sim.simulation.full.stage import DVA, id_of, label_of, team_of
from dva_sim.simulation.scenario import build, load

_ID = re.compile(r"[0-9A-F]{2}(:[0-9A-F]{2}){5}")
_LABEL = re.compile(r"(robot|guard|operator|detector|control-room)-([1-9][0-9]{0,3})")


def make_keys(folder: Path, names: Iterable[str]) -> str:
    """Create a key pair for each device that has none.

    Args:
        folder: Folder of the keys.
        names: Ids, names such as `robot-1` or `dva`, or scenarios: all devices of one.

    Returns:
        What was done, in a line for people.

    Raises:
        ConfigError: a name that stands for nothing, or a folder that cannot be written.
    """
    id_tags = dict.fromkeys(id_tag for name in names for id_tag in _ids(name))
    made = create_keys(folder, id_tags)
    already = len(id_tags) - len(made)
    return f"{folder}: made {len(made)} pairs of keys" + (
        f", {already} were there" if already else ""
    )


def _ids(name: str) -> Iterator[str]:
    label = _LABEL.fullmatch(name)
    if _ID.fullmatch(name):
        yield name
    elif name == label_of("dva", 1):
        yield DVA
    elif label:
        yield id_of(label[1], int(label[2]))
    else:
        try:
            scenario = build(load(name))
        except ConfigError as error:
            raise ConfigError(
                f"{name!r} is neither a device (dva, robot-1) nor a scenario"
            ) from error
        yield from team_of(scenario)
