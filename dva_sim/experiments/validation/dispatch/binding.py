"""What a formula is given: its parameters, taken from the scenario that is played."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any, get_args, get_type_hints

from pydantic import TypeAdapter, ValidationError

from dva_sim.errors import ConfigError
from dva_sim.experiments.validation.dispatch.exact import FORMULAS, Measures
from dva_sim.guesses import unknown
from dva_sim.timed import laws
from dva_sim.timed.scenario import TimedScenario

_LAW: TypeAdapter[laws.Law] = TypeAdapter(laws.Law)
_LAWS = tuple(type_ for type_ in get_args(get_args(laws.Law)[0]) if isinstance(type_, type))


def exact_values(
    name: str | None, parameters: Mapping[str, Any], scenario: TimedScenario
) -> tuple[Measures, str]:
    """What a formula says of a scenario, and on whose authority.

    Args:
        name: The formula's; None gives nothing.
        parameters: Values, or references such as `$demand.fire.between`.
        scenario: What the references point into.

    Raises:
        ConfigError: an unknown formula, parameter or reference, or a law that the formula
            does not hold for.
        ValueError: values that the formula does not hold for.
    """
    if name is None:
        return {}, ""
    if name not in FORMULAS:
        raise ConfigError(unknown("formula", name, FORMULAS))
    formula = FORMULAS[name]
    hints = get_type_hints(formula, include_extras=True)
    given = {}
    for key, value in parameters.items():
        if key not in hints or key == "return":
            known = ", ".join(inspect.signature(formula).parameters)
            raise ConfigError(f"formula {name!r} has no parameter {key!r}; it has {known}")
        suited = _suited(key, hints[key], _resolved(value, scenario), scenario)
        given[key] = _checked(key, hints[key], suited, value)
    for key, parameter in inspect.signature(formula).parameters.items():
        if parameter.default is parameter.empty and key not in given:
            raise ConfigError(f"formula {name!r} needs the parameter {key!r}")
    try:
        return formula(**given), _references(formula)
    except (ArithmeticError, LookupError, TypeError) as error:
        problem = f"formula {name!r} does not hold for these parameters: {error}"
        raise ConfigError(problem) from error


def _resolved(value: Any, scenario: TimedScenario) -> Any:
    """The value with its references replaced by what they point to."""
    if isinstance(value, list):
        return [_resolved(item, scenario) for item in value]
    if isinstance(value, str) and value.startswith("$"):
        return _walk(scenario, value[1:].split("."), value)
    return value


def _walk(node: Any, path: list[str], whole: str) -> Any:
    """What stands at a path: keys, names or numbers of items, `*` for all items."""
    if not path:
        return node
    step, rest = path[0], path[1:]
    if step == "*" and isinstance(node, tuple):
        return [_walk(item, rest, whole) for item in node]
    found = _item(node, step) if isinstance(node, tuple) else _inside(node, step)
    if found is None:
        raise ConfigError(f"{whole!r}: there is no {step!r} in the scenario")
    return _walk(found, rest, whole)


def _inside(node: Any, step: str) -> Any:
    return node.get(step) if isinstance(node, dict) else getattr(node, step, None)


def _item(items: tuple[Any, ...], step: str) -> Any:
    """An item by its number from 0, or by its name or kind."""
    if step.isdigit():
        return items[int(step)] if int(step) < len(items) else None
    named = (i for i in items if (getattr(i, "name", "") or getattr(i, "kind", "")) == step)
    return next(named, None)


def _suited(key: str, hint: Any, value: Any, scenario: TimedScenario) -> Any:
    """The value as the parameter wants it: a law, its mean, or its rate."""
    if key == "preferences" and isinstance(value, dict):
        return _preferences(value, scenario)
    if isinstance(value, list):
        return [_suited(key, hint, item, scenario) for item in value]
    if _wants_law(hint):
        return _law(key, value)
    if isinstance(value, dict):
        value = _law(key, value)
    if not isinstance(value, laws._Law):
        return value
    is_rate = key.startswith("arrival_rate")
    memoryless = _mentions(hint, lambda h: "exponential" in getattr(h, "__metadata__", ()))
    if (is_rate or memoryless) and not isinstance(value, laws.Exponential):
        given = getattr(value, "law", value)
        raise ConfigError(f"{key} needs an exponential law, not {given}")
    return 1 / value.mean if is_rate else value.mean


def _checked(key: str, hint: Any, value: Any, said: Any) -> Any:
    """A parameter, if it is of the kind that the formula wants."""
    if _wants_law(hint):
        return value
    try:
        return TypeAdapter(hint).validate_python(value)
    except ValidationError as error:
        problem = error.errors(include_url=False)[0]["msg"]
        raise ConfigError(f"{key} {said!r} does not fit: {problem}") from None


def _wants_law(hint: Any) -> bool:
    return _mentions(hint, lambda h: h in _LAWS or getattr(h, "__name__", "") == "Law")


def _law(key: str, value: Any) -> laws.Law:
    try:
        return _LAW.validate_python(value)
    except ValidationError as error:
        problem = error.errors(include_url=False)[0]["msg"]
        raise ConfigError(f"{key} should be a law: {problem}") from None


def _mentions(hint: Any, test: Any) -> bool:
    """Whether an annotation, or one inside it, passes a test."""
    return bool(test(hint)) or any(_mentions(inner, test) for inner in get_args(hint))


def _preferences(lists: dict[str, Any], scenario: TimedScenario) -> list[list[int]]:
    """For each stream the list of its zone, its units counted from 1."""
    orders = []
    for stream in scenario.demand:
        if len(stream.zones) != 1:
            raise ConfigError("preferences by class need streams that have one zone each")
        names = lists[next(iter(stream.zones))]
        orders.append([scenario.names.index(name) + 1 for name in names])
    return orders


def _references(formula: Any) -> str:
    """The sources that a formula's docstring names, in one line."""
    _, _, text = (inspect.getdoc(formula) or "").partition("References:")
    return " ".join(text.split())
