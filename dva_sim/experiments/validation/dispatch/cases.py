"""Cases: worlds that theory has an exact answer for, written down in a file.

A case says what is played (a timed scenario), which formula knows the answer, where the
formula's parameters stand in the scenario, and what is compared. Other numbers, or other
worlds of the same families, need no programming: only another file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, field_validator

from dva_sim import resources
from dva_sim.config import Config, Document, load_yaml, validate
from dva_sim.errors import ConfigError
from dva_sim.experiments.validation.dispatch.binding import exact_values
from dva_sim.experiments.validation.dispatch.measures import check_name
from dva_sim.guesses import unknown
from dva_sim.timed import scenario as timed
from dva_sim.timed.scenario import TimedScenario

FOLDER = "experiments/validation"
SHIPPED = "dispatch"


class CaseConfig(Config):
    """One case as it stands in the file.

    Attributes:
        title: What it is, in words.
        source: Where the answer comes from, if no formula here knows it, or to add to that.
        scenario: A timed scenario.
        formula: Name of the formula that gives the exact values; see `exact.FORMULAS`.
        parameters: Its parameters: numbers, laws, or `$` and where they stand in the scenario,
            such as `$responders.guard.look`.
        measures: What is compared: the measure's name and the formula's name for it, or a
            plain number.
        loosely: The same, of what no precision is asked for: it only has to agree.
        runs: Seeds; each is a whole run of the scenario.
        quick_runs: The same with `--quick`.
        batches: Parts of equal length that the measured time of each run is cut into.
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
        """A list compares each measure with the exact value of the same name."""
        return {name: name for name in value} if isinstance(value, list | tuple) else value


class CaseFile(Config):
    """A file of cases."""

    description: str = ""
    cases: dict[str, CaseConfig]


class Case(Config):
    """One case, ready to be played.

    Attributes:
        name: Its key in the file.
        title: What it is, in words.
        source: Where the exact values come from.
        scenario: What is played.
        exact: The exact value of each measure.
        loosely: Those of them that no precision is asked for.
        runs: Seeds.
        quick_runs: The same with `--quick`.
        batches: Parts of each run.
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
    """The cases of a file, with their exact values.

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
    """The exact value of each measure, and the formula's sources."""
    known, source = exact_values(config.formula, config.parameters, scenario)
    exact = {}
    for measure, answer in (config.measures | config.loosely).items():
        if isinstance(answer, str):
            if answer not in known:
                raise ConfigError(unknown("answer", answer, known))
            exact[measure] = known[answer]
        elif not config.source:
            raise ConfigError(f"measure {measure!r} is compared with a number: say its source")
        else:
            exact[measure] = float(answer)
    return exact, source
