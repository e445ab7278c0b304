"""User-defined measures and models of a study."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dva_sim.experiments.study.parts import DESIGN
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.models import measured_names
from dva_sim.simulation.run_measures import PLUGINS, RunMeasure, load_measure, refuse_twins


def own_measures(study: Study) -> dict[str, RunMeasure]:
    """The measures that a study brings itself, by names that hold in any process.

    Raises:
        ConfigError: one cannot be had, or has the name of another column.
    """
    found: dict[str, RunMeasure] = {}
    for number, name in enumerate(study.measures):
        try:
            located = PLUGINS.located(name, study.folder)
            found[located] = load_measure(located)
            refuse_twins(found.values(), {*DESIGN, *study.factors, *measured_names()})
        except ConfigError as error:
            if error.file is not None:
                raise
            raise study.error(error.problem, ("measures", number)) from None
    return found


def own_columns(measures: Iterable[RunMeasure]) -> dict[str, Any]:
    """Describe user-defined columns, by table and name; kept with the results.

    They are read without the files that the columns come from.

    Args:
        measures: Measures that the study itself defines.
    """
    own = {measure.about.name: measure.about.as_json() for measure in measures}
    return {"runs": own} if own else {}
