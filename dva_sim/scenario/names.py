"""What a scenario names, and whether it is there."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim import resources
from dva_sim.config import Fail, Path_
from dva_sim.errors import ConfigError
from dva_sim.guesses import unknown

if TYPE_CHECKING:
    from dva_sim.agents.tilt import PhoneProfile
    from dva_sim.scenario.scenario import Scenario


_OPTION = re.compile(r"option '([^']+)'")  # as those who make things by name say it
_IN_FILES = (
    ("dispatch", "policy"),
    ("operator", "strategy"),
    ("phone", "filter"),
    ("phone", "mapping"),
)


def locate_files(data: dict[str, Any], folders: Sequence[Path]) -> None:
    """Let a class in a file beside the one that names it be found from anywhere."""
    for part, key in _IN_FILES:
        holder = data.get(part)
        named = holder.get(key) if isinstance(holder, dict) else None
        file, colon, wanted = named.rpartition(":") if isinstance(named, str) else ("", "", "")
        beside = [folder / file for folder in folders if colon and resources.is_file(folder / file)]
        if beside and isinstance(holder, dict):
            holder[key] = f"{beside[0]}:{wanted}"


def check_names(scenario: Scenario, error: Fail) -> None:
    """Refuse a profile, strategy or policy that does not exist, before anything runs."""
    choices: dict[Path_, tuple[str | tuple[str, ...], str]] = {
        ("phone", "profile"): (scenario.phone.profile, "agents/phones"),
        ("robot", "profile"): (scenario.robot.profile, "agents/robots"),
        ("guard", "profile"): (scenario.guard.profile, "agents/people"),
        ("bystander", "profile"): (scenario.bystander.profile, "agents/people"),
        ("operator", "population"): (scenario.operator.population, "agents/people"),
    }
    for path, (given, folder) in choices.items():
        for name in (given,) if isinstance(given, str) else given:
            if not resources.is_there(name, folder) and not resources.is_file(Path(name)):
                key, known = ".".join(str(p) for p in path), resources.available(folder)
                raise error(unknown(key, name, sorted(known)), path)
    check_strategy(scenario.operator.strategy, scenario.operator.options, error)
    check_policy(scenario.dispatch.policy, scenario.dispatch.options, error)


def check_strategy(strategy: str, options: Mapping[str, Any], error: Fail) -> None:
    """Refuse a way of steering that cannot be loaded, or does not know its options."""
    from dva_sim.agents.operator.strategies import try_strategy

    with _told(error, lambda problem: _place(problem, "operator", "strategy", "options")):
        try_strategy(strategy, options)


def check_policy(policy: str, options: Mapping[str, Any], error: Fail) -> None:
    """Refuse a policy that cannot be loaded, or does not know its options."""
    from dva_sim.core.dispatch import load_policy

    with _told(error, lambda problem: _place(problem, "dispatch", "policy", "options")):
        load_policy(policy, options)


def check_phone(profile: PhoneProfile, error: Fail) -> None:
    """Refuse a phone whose part, filter or mapping cannot be had, or does not know its options."""
    from dva_sim.agents.tilt import try_phone

    def place(problem: ConfigError) -> Path_:
        stages = ("accelerometer", "mapping", "filter")
        key = next((s for s in stages if problem.problem.startswith(s)), "filter")
        return _place(problem, "phone", key, f"{key}_options")

    with _told(error, place):
        try_phone(profile)


@contextmanager
def _told(error: Fail, place: Callable[[ConfigError], Path_]) -> Iterator[None]:
    """Tell a mistake at its key of the scenario, unless it is in another file."""
    try:
        yield
    except ConfigError as problem:
        if problem.file is not None:
            raise
        raise error(problem.problem, place(problem)) from None


def _place(problem: ConfigError, part: str, key: str, options: str) -> Path_:
    """The key that a problem is told at: the option that it speaks of, or the name."""
    found = _OPTION.search(problem.problem)
    return (part, options, found[1]) if found else (part, key)
