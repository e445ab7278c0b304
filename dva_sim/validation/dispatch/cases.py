"""Cases: worlds that theory has an exact answer for, written down in a file.

A case defines the timed scenario to play, the formula for the answer, where the
formula's parameters stand in the scenario, and what is compared. Other numbers, or other
worlds of the same families, need no programming: only another file.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_type_hints

from pydantic import Field, TypeAdapter, ValidationError, field_validator

from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.kernel.yaml_files import Document, load_yaml
from dva_sim.simulation.timed import distributions
from dva_sim.simulation.timed import scenario as timed
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.validation.dispatch.batch_measures import check_name
from dva_sim.validation.dispatch.exact import FORMULAS
from dva_sim.validation.dispatch.queues import Measures

A = TypeVar("A")
_LAW: TypeAdapter[distributions.Law] = TypeAdapter(distributions.Law)
_LAWS = tuple(
    type_ for type_ in get_args(get_args(distributions.Law)[0]) if isinstance(type_, type)
)


def exact_values(
    name: str | None, parameters: Mapping[str, Any], scenario: TimedScenario
) -> tuple[Measures, str]:
    """Return the exact values of a scenario by a formula, and the formula's source.

    Args:
        name: The formula's; None gives nothing.
        parameters: Values, or references such as `$demand.fire.between`.
        scenario: Scenario that the references point into.

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
    arguments = {}
    for key, value in parameters.items():
        if key not in hints or key == "return":
            names = ", ".join(inspect.signature(formula).parameters)
            raise ConfigError(f"formula {name!r} has no parameter {key!r}; it has {names}")
        suited = _suited(key, hints[key], _resolved(value, scenario), scenario)
        arguments[key] = _checked(key, hints[key], suited, value)
    for key, parameter in inspect.signature(formula).parameters.items():
        if parameter.default is parameter.empty and key not in arguments:
            raise ConfigError(f"formula {name!r} needs the parameter {key!r}")
    try:
        _, _, text = (inspect.getdoc(formula) or "").partition("References:")
        return formula(**arguments), " ".join(text.split())
    except (ArithmeticError, LookupError, TypeError) as error:
        problem = f"formula {name!r} does not hold for these parameters: {error}"
        raise ConfigError(problem) from error


def _resolved(value: Any, scenario: TimedScenario) -> Any:
    """Return the value with its references replaced by what they point to."""
    if isinstance(value, list):
        return [_resolved(item, scenario) for item in value]
    if isinstance(value, str) and value.startswith("$"):
        return _walk(scenario, value[1:].split("."), value)
    return value


def _walk(node: Any, path: list[str], whole: str) -> Any:
    """Value at a path: keys, names or numbers of items, `*` for all items."""
    if not path:
        return node
    step = path[0]
    rest = path[1:]
    if step == "*" and isinstance(node, tuple):
        return [_walk(item, rest, whole) for item in node]
    value = _item(node, step) if isinstance(node, tuple) else _inside(node, step)
    if value is None:
        raise ConfigError(f"{whole!r}: there is no {step!r} in the scenario")
    return _walk(value, rest, whole)


def _inside(node: Any, step: str) -> Any:
    return node.get(step) if isinstance(node, dict) else getattr(node, step, None)


def _item(items: tuple[Any, ...], step: str) -> Any:
    """Return an item by its number from 0, or by its name or kind."""
    if step.isdigit():
        return items[int(step)] if int(step) < len(items) else None
    named = (i for i in items if (getattr(i, "name", "") or getattr(i, "kind", "")) == step)
    return next(named, None)


def _suited(key: str, hint: Any, value: Any, scenario: TimedScenario) -> Any:
    """Return the value in the form of the parameter: a law, its mean, or its rate."""
    if key == "preferences" and isinstance(value, dict):
        return _preferences(value, scenario)
    if isinstance(value, list):
        return [_suited(key, hint, item, scenario) for item in value]
    if _wants_law(hint):
        return _valid(_LAW, value, f"{key} should be a law")
    if isinstance(value, dict):
        value = _valid(_LAW, value, f"{key} should be a law")
    if not isinstance(value, distributions._Law):
        return value
    is_rate = key.startswith("arrival_rate")
    memoryless = _mentions(hint, lambda h: "exponential" in getattr(h, "__metadata__", ()))
    if (is_rate or memoryless) and not isinstance(value, distributions.Exponential):
        law = getattr(value, "law", value)
        raise ConfigError(f"{key} needs an exponential law, not {law}")
    return 1 / value.mean if is_rate else value.mean


def _checked(key: str, hint: Any, value: Any, original: Any) -> Any:
    """Return a parameter after checking its type for the formula."""
    if _wants_law(hint):
        return value
    return _valid(TypeAdapter(hint), value, f"{key} {original!r} does not fit")


def _valid(adapter: TypeAdapter[A], value: Any, wrong: str) -> A:
    """Return the value in the type of an annotation; otherwise the mistake and its reason."""
    try:
        return adapter.validate_python(value)
    except ValidationError as error:
        problem = error.errors(include_url=False)[0]["msg"]
        raise ConfigError(f"{wrong}: {problem}") from None


def _wants_law(hint: Any) -> bool:
    return _mentions(hint, lambda h: h in _LAWS or getattr(h, "__name__", "") == "DurationLaw")


def _mentions(hint: Any, test: Any) -> bool:
    """Return True if an annotation, or one inside it, passes a test."""
    return bool(test(hint)) or any(_mentions(inner, test) for inner in get_args(hint))


def _preferences(lists: dict[str, Any], scenario: TimedScenario) -> list[list[int]]:
    """Return for each stream the list of its zone, its units counted from 1."""
    orders = []
    for stream in scenario.demand:
        if len(stream.zones) != 1:
            raise ConfigError("preferences by class need streams that have one zone each")
        names = lists[next(iter(stream.zones))]
        orders.append([scenario.names.index(name) + 1 for name in names])
    return orders


FOLDER = "experiments/validation"
SHIPPED = "dispatch"


class CaseConfig(Config):
    """One case as it stands in the file.

    Attributes:
        title: Title in words.
        source: Source of the answer, if no formula here knows it, or in addition.
        scenario: A timed scenario.
        formula: Name of the formula that gives the exact values; see `exact.FORMULAS`.
        parameters: Its parameters: numbers, laws, or `$` and where they stand in the scenario,
            such as `$responders.guard.look`.
        measures: Measures to compare: the measure's name and the formula's name for it, or a plain
            number.
        loosely: Measures without a required precision: they only have to agree.
        runs: Seeds; each is a whole run of the scenario.
        quick_runs: Number of runs with `--quick`.
        batches: Number of equal parts of the measured time of each run.
    """

    title: str
    source: str = ""
    scenario: dict[str, Any]
    formula: str | None = None
    parameters: dict[str, Any] = Field(default_factory=dict)
    measures: dict[str, str | float]
    loosely: dict[str, str | float] = Field(default_factory=dict)
    runs: Annotated[int, Field(ge=1, le=100_000)] = 8
    quick_runs: Annotated[int, Field(ge=1)] = 1
    batches: Annotated[int, Field(ge=1, le=10_000)] = 20

    @field_validator(
        "measures",
        "loosely",
        mode="before",
        json_schema_input_type=dict[str, str | float] | list[str],
    )
    @classmethod
    def _same_names(cls, value: Any) -> Any:
        """Convert a list of names to pairs of measures and exact values of the same name."""
        return {name: name for name in value} if isinstance(value, list | tuple) else value


class CaseFile(Config):
    """A file of cases."""

    description: str = ""
    cases: Annotated[dict[str, CaseConfig], Field(min_length=1)]


class Case(Config):
    """One case, ready to be played.

    Attributes:
        name: Key of the case in the file.
        title: Title in words.
        source: Source of the exact values.
        scenario: Scenario to simulate.
        exact: The exact value of each measure.
        loosely: Measures without a required precision.
        runs: Seeds.
        quick_runs: Number of runs with `--quick`.
        batches: Number of parts of each run.
    """

    name: str
    title: str
    source: str
    scenario: TimedScenario
    exact: dict[str, float]
    loosely: tuple[str, ...]
    runs: int
    quick_runs: int
    batches: int


def load_cases(name: str | Path = SHIPPED) -> list[Case]:
    """Return the cases of a file, with their exact values.

    Args:
        name: A path, or the name of a file in `experiments/validation`.

    Raises:
        ConfigError: no such file, or a mistake in it, with its place.
    """
    document = load_yaml(resources.find(str(name), FOLDER))
    file = validate(CaseFile, document.data, document.error)
    return [_case(key, config, document) for key, config in file.cases.items()]


def _case(name: str, config: CaseConfig, document: Document) -> Case:
    try:
        # Waits that the horizon would cut off are played to their end; each event keeps its row.
        scenario = timed.build(config.scenario | {"drain": True, "keep": "events"})
        for measure in config.measures | config.loosely:
            check_name(measure, scenario)
        exact, source = _exact(config, scenario)
    except (ConfigError, ValueError) as error:
        raise document.error(f"case {name!r}: {error}", ("cases", name)) from error
    return Case(
        name=name,
        title=config.title,
        source="; ".join(s for s in (config.source, source) if s),
        scenario=scenario,
        exact=exact,
        loosely=tuple(config.loosely),
        runs=config.runs,
        quick_runs=min(config.quick_runs, config.runs),
        batches=config.batches,
    )


def _exact(config: CaseConfig, scenario: TimedScenario) -> tuple[dict[str, float], str]:
    """Return the exact value of each measure, and the formula's sources."""
    values, source = exact_values(config.formula, config.parameters, scenario)
    exact = {}
    for measure, answer in (config.measures | config.loosely).items():
        if isinstance(answer, str):
            if answer not in values:
                raise ConfigError(unknown("answer", answer, values))
            exact[measure] = values[answer]
        elif not config.source:
            raise ConfigError(f"measure {measure!r} is compared with a number: say its source")
        else:
            exact[measure] = float(answer)
    return exact, source
