"""Kinds of things that are tried rather than read: what `check` may be told to try, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from dva_sim.testing.promises import Outcome

Options = Mapping[str, Any]


@dataclass(frozen=True)
class Trial:
    """How one kind is tried.

    Attributes:
        many: What several are called.
        known: Names that are shipped or installed.
        run: Tries the one of a name with options; raises ConfigError if it cannot be had.
        ways: How it was tried, in words.
    """

    many: str
    known: Callable[[], Iterable[str]]
    run: Callable[[str, Options], Outcome]
    ways: Callable[[Outcome], str]


# Each is imported when it is asked for: `check` of a file needs none of them.
def _policies() -> Iterable[str]:
    from dva_sim.core.dispatch import known_policies

    return known_policies()


def _try_policy(name: str, options: Options) -> Outcome:
    from dva_sim.core.dispatch import load_policy
    from dva_sim.testing.policies import try_policy

    return try_policy(partial(load_policy, name, options))


def _robots() -> Iterable[str]:
    from dva_sim.kernel.resources import available

    return sorted(available("agents/robots"))


def _try_robot(name: str, options: Options) -> Outcome:
    """A profile; or motors in a file, in the body that a profile has if it says nothing else."""
    from dva_sim.agents.robot.profile import RobotProfile, load_robot
    from dva_sim.testing.robots import try_robot

    profile = RobotProfile(drive=name) if ".py" in name else load_robot(name)
    changed = profile.model_copy(update={"options": {**profile.options, **options}})
    return try_robot(changed.drive_spec())


def _operators() -> Iterable[str]:
    from dva_sim.agents.operator.strategies import known_strategies

    return known_strategies()


def _try_operator(name: str, options: Options) -> Outcome:
    from dva_sim.agents.operator.strategies import load_strategy
    from dva_sim.testing.operators import try_operator

    return try_operator(load_strategy(name, options))


def _filters() -> Iterable[str]:
    from dva_sim.agents.tilt import known_filters

    return known_filters()


def _try_filter(name: str, options: Options) -> Outcome:
    from dva_sim.agents.tilt import load_filter
    from dva_sim.testing.tilt import try_filter

    return try_filter(load_filter(name, options))


def _mappings() -> Iterable[str]:
    from dva_sim.agents.tilt import known_mappings

    return known_mappings()


def _try_mapping(name: str, options: Options) -> Outcome:
    from dva_sim.agents.tilt import load_mapping
    from dva_sim.testing.tilt import try_mapping

    return try_mapping(load_mapping(name, options))


def _decisions(outcome: Outcome) -> str:
    return f"{outcome.tries} situations, slowest decision {1000 * outcome.slowest:.1f} ms"


def _drives(outcome: Outcome) -> str:
    return f"{outcome.tries} drives, {1e6 * outcome.slowest:.0f} microseconds a tick"


def _steering(outcome: Outcome) -> str:
    return f"{outcome.tries} drives, {1e6 * outcome.slowest:.0f} microseconds a frame"


def _readings(outcome: Outcome) -> str:
    return f"{outcome.tries} runs, {1e6 * outcome.slowest:.1f} microseconds a reading"


TRIALS: Final[dict[str, Trial]] = {
    "policy": Trial("policies", _policies, _try_policy, _decisions),
    "robot": Trial("robots", _robots, _try_robot, _drives),
    "operator": Trial("operators", _operators, _try_operator, _steering),
    "filter": Trial("filters", _filters, _try_filter, _readings),
    "mapping": Trial("mappings", _mappings, _try_mapping, _readings),
}
