"""Keys for the devices of a scenario, by the names that people use."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from dva_sim.errors import ConfigError
from dva_sim.network.keys import create_keys
from dva_sim.scenario import Scenario, build, load
from dva_sim.simulation.names import DVA, id_of, label_of

_ID = re.compile(r"[0-9A-F]{2}(:[0-9A-F]{2}){5}")
_LABEL = re.compile(r"(robot|guard|operator|detector)-([1-9][0-9]{0,3})")


def make_keys(folder: Path, names: Iterable[str]) -> str:
    """Make a pair of keys for each device that has none.

    Args:
        folder: Where keys are kept.
        names: Ids, names such as `robot-1` or `dva`, or scenarios: all devices of one.

    Returns:
        What was done, in a line for people.

    Raises:
        ConfigError: a name that stands for nothing, or a folder that cannot be written.
    """
    wanted = dict.fromkeys(id_tag for name in names for id_tag in _ids(name))
    made = create_keys(folder, wanted)
    kept = len(wanted) - len(made)
    return f"{folder}: made {len(made)} pairs of keys" + (f", {kept} were there" if kept else "")


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
            raise ConfigError(f"{name!r} is no device (dva, robot-1) and no scenario") from error
        yield from _team(scenario)


def _team(scenario: Scenario) -> Iterator[str]:
    """All devices of a scenario; each report may have a detector or a caller."""
    counts = {
        "robot": scenario.robot.count,
        "guard": scenario.guard.count,
        "operator": scenario.operator.count,
        "detector": sum(event.reports for event in scenario.events),
    }
    yield DVA
    for kind, count in counts.items():
        yield from (id_of(kind, number) for number in range(1, count + 1))
