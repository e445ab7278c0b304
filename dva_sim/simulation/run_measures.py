"""Measures that a study names: a number that a class in a file, or in a package, takes of a run.

Ours are covariates: what is known of a run beforehand, less what that is on the average.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.measure import Measure
from dva_sim.kernel.plugins import FAILURES, Plugins, error_text
from dva_sim.kernel.read_once import read_once
from dva_sim.kernel.yaml_files import file_in

_NAME: Final = re.compile(r"[a-z][a-z0-9_]{0,59}")


class RunMeasure:
    """A number from the results of a run; it becomes a column of the table of runs.

    Attributes:
        about: Its name, meaning, title and bounds; the name ends in the unit.
        models: Names of the models whose runs it can read: a `Recording` of `full`, a
            `TimedRecording` of `timed`, the rows of the trials of `task`, a `SessionRecording`
            of `transports`, and of a user's model whatever that simulates.
    """

    about: Measure
    models: tuple[str, ...] = ("full",)

    def of(self, recording: Any) -> float | None:
        """Return the number, finite and within its bounds; None where the run has none.

        The recording is left as it is: other measures read it, too.
        """
        raise NotImplementedError


class CautionOff(RunMeasure):
    """Caution of the driver, relative to the median of the population."""

    about = Measure(
        "caution_off",
        "the first operator's caution beside the population's median, in standard deviations of "
        "its logarithm: zero on the average of all persons",
        title="the person's caution",
    )

    def of(self, recording: Any) -> float:
        """Return the value, which is the same in each run of a person."""
        from dva_sim.simulation.full.scenes import trait_off  # late: start-up

        return trait_off(recording.scenario, "caution")


class WayOff(RunMeasure):
    """Length of the path, relative to its usual length."""

    about = Measure(
        "way_off_m",
        "planned way from the first robot's base to the first event, less its average over all "
        "places where the event may begin; near walls a metre counts more",
        title="length of the way",
        low=-math.inf,
    )

    def of(self, recording: Any) -> float | None:
        """Return the value, which is the same in each run of a seed."""
        from dva_sim.simulation.full.scenes import way_off  # late: start-up

        return way_off(recording.scenario, recording.seed)


COVARIATES: Final[dict[str, Callable[..., RunMeasure]]] = {
    "caution_off": CautionOff,
    "way_off_m": WayOff,
}

PLUGINS: Final = Plugins[RunMeasure](
    kind="measure",
    base=RunMeasure,
    shipped=COVARIATES,
    folder="experiments/measures",
    group="dva_sim.measures",
    key="measures",
    needs="of(recording)",
    public="dva_sim.simulation.run_measures.RunMeasure",
)


def load_measure(name: str, base: Path | None = None) -> RunMeasure:
    """Return a measure by name: `mine.py:Mine`, or what an installed package calls it.

    Args:
        name: The measure.
        base: Folder in which a file is looked for first.

    Raises:
        ConfigError: there is none, it cannot be made, or does not say what it is.
    """
    plugin = PLUGINS.located(name, base)
    return _loaded(plugin)


@read_once(lambda name: [Path(file_in(name))])
def _loaded(name: str) -> RunMeasure:
    """Return one object for each state of a file; it keeps nothing from run to run."""
    made = PLUGINS.make(name, PLUGINS.find(name), {})
    about = getattr(made, "about", None)
    if not isinstance(about, Measure):
        raise ConfigError(f"measure {name!r} should say what it is: about = Measure(name, meaning)")
    if not _NAME.fullmatch(about.name):
        form = "small letters, digits and _, as in wall_time_s"
        raise ConfigError(f"measure {name!r} is called {about.name!r}; should be {form}")
    return made


def values_of(measures: Iterable[RunMeasure], recording: Any, model: str) -> dict[str, float]:
    """Return the values of measures for a run of a model; nan where one has none.

    Raises:
        ConfigError: a measure fails, or answers what is no finite number.
    """
    return {m.about.name: value_of(m, recording) for m in measures if reads(m, model)}


def value_of(measure: RunMeasure, recording: Any) -> float:
    """Return the value of a measure for a run; see `values_of`."""
    name = measure.about.name
    try:
        answer = measure.of(recording)
        if answer is None:
            return math.nan
        if math.isfinite(answer):
            return float(answer)
    except FAILURES as error:
        raise ConfigError(f"measure {name!r} cannot be taken: {error_text(error)}") from error
    raise ConfigError(f"measure {name!r} is {answer!r}; should be a finite number, or None")


def reads(measure: RunMeasure, model: str) -> bool:
    """Return True if a measure can be taken of runs of a model."""
    return model in measure.models


def refuse_twins(measures: Iterable[RunMeasure], taken: Iterable[str]) -> None:
    """Refuse two columns of one name, which would be one.

    Raises:
        ConfigError: a measure is called as another column is.
    """
    names = [measure.about.name for measure in measures]
    for name in names:
        if names.count(name) > 1 or name in set(taken):
            raise ConfigError(f"a measure cannot be called {name!r}: another column is")
