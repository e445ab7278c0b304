"""The files that a study names, and its own measures: each is read when needed, and once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from dva_sim.experiments.study.factor_levels import Traits, parameter_sets
from dva_sim.experiments.study.parts import DESIGN, TUNED, TUNING
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuning import TunedValues, load_tuned
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.models import measured_names
from dva_sim.simulation.run_measures import PLUGINS, RunMeasure, load_measure, reads, refuse_twins


def own_measures(study: Study) -> dict[str, RunMeasure]:
    """Return the measures that a study brings itself, by names that hold in any process.

    Raises:
        ConfigError: one cannot be had, or has the name of another column.
    """
    measures: dict[str, RunMeasure] = {}
    for number, name in enumerate(study.measures):
        try:
            located = PLUGINS.located(name, study.folder)
            measures[located] = load_measure(located)
            refuse_twins(measures.values(), {*DESIGN, *study.factors, *measured_names()})
        except ConfigError as error:
            if error.file is not None:
                raise
            raise study.error(error.problem, ("measures", number)) from None
    return measures


def own_columns(measures: Iterable[RunMeasure]) -> dict[str, Any]:
    """Describe user-defined columns, by table and name; kept with the results.

    They are read without the files that the columns come from.

    Args:
        measures: Measures that the study itself defines.
    """
    columns = {measure.about.name: measure.about.as_json() for measure in measures}
    return {"runs": columns} if columns else {}


@dataclass(frozen=True, eq=False)
class StudyInputs:
    """Contents of a study's files.

    Each property raises a `ConfigError` if its file cannot be read or is not valid.
    """

    study: Study

    @cached_property
    def scenarios(self) -> Mapping[str, Document]:
        """The scenario of each part, as its file says."""
        return {part: self._scenario(part) for part in self.study.parts}

    def _scenario(self, part: str) -> Document:
        try:
            return scenarios.load(self.study.parts[part].scenario, base=self.study.folder)
        except ConfigError as error:
            if error.file is not None:
                raise
            raise self.study.error(error.problem, ("parts", part, "scenario")) from None

    @cached_property
    def tuned(self) -> TunedValues | None:
        """The tuned values; None if no cell has any."""
        listed = (row.get(TUNING) for row in self.study.listed_rows)
        is_tuned = TUNED in (*self.study.factors.get(TUNING, ()), *listed)
        return load_tuned(self.study) if is_tuned else None

    @cached_property
    def parameter_sets(self) -> list[Traits]:
        """The traits of each set of parameters of the persons, drawn within their bands."""
        return parameter_sets(self.study)

    @cached_property
    def measures(self) -> Mapping[str, RunMeasure]:
        """The measures that the study brings itself, by names that hold in any process."""
        return own_measures(self.study)

    def measures_of(self, model: str) -> list[str]:
        """Return names of its own measures that can be taken of the runs of a model."""
        return [each.about.name for each in self.measures.values() if reads(each, model)]
