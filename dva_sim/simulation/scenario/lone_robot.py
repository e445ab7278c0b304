"""Scenario of one robot alone, which drivers elsewhere drive by permission of a DVA elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from dva_sim.kernel.config_overrides import parse_changes, set_by
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.scenario.loading import build
from dva_sim.simulation.scenario.scenario import Scenario


def lone_robot(keys: Mapping[str, Any], changes: Sequence[str]) -> Scenario:
    """Build the scenario.

    Args:
        keys: Keys of the robot and its site, as a file would hold them.
        changes: Changes, `KEY=VALUE`.

    Raises:
        ConfigError: something that is named does not exist, or a change makes no sense.
    """
    source: dict[str, Any] = {
        "description": "One robot, driven by permission of a DVA elsewhere.",
        **keys,
        "guard": {"count": 0},
        "operator": {"count": 1},  # elsewhere
        "bystander": {"count": 0},
        # A scenario has to have an event: there is nothing to be seen of this one.
        "events": [{"kind": "fire", "false_alarm": True}],
    }
    try:
        return build(source, parse_changes(changes))
    except ConfigError as error:
        raise set_by(changes, error) from None
