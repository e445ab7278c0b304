"""From a study to its runs: the cells of its design, which share their random numbers."""

from __future__ import annotations

import copy
import itertools
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from dva_sim.experiments.study.addresses import REFERENCE, Address
from dva_sim.experiments.study.factor_levels import (
    PARAMETERS,
    TRAITS,
    factors_of_repeats,
    levels_at_ends,
    levels_of_cells,
    path_in_design,
    settings_of_repeats,
)
from dva_sim.experiments.study.hashing import stable_hash
from dva_sim.experiments.study.inputs import StudyInputs
from dva_sim.experiments.study.parts import POINT, REPEATS, TUNED, TUNING, Level, multiplied
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuning import TuningBasis
from dva_sim.kernel.config_overrides import blame
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import derive_seed
from dva_sim.kernel.suggestions import listed, unknown
from dva_sim.kernel.yaml_files import KeyPath
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.models import AnyScenario, model_for, model_of
from dva_sim.simulation.run_measures import COVARIATES


def located(study: Study, part: str, error: ConfigError, changes: Mapping[str, Any]) -> ConfigError:
    """Return the mistake at its place in the study; unchanged if it names a file already.

    Args:
        study: Study that runs the scenario.
        error: Error with the keys at fault, if changes of the scenario caused it.
        changes: All changes of the scenario.
    """
    if error.file is not None:
        return error
    problem = error.problem
    named = [
        k for k, v in changes.items() if k in problem or (isinstance(v, str) and repr(v) in problem)
    ]
    keys = error.keys if len(error.keys) == 1 else (named or list(error.keys))
    for key in keys:
        if pair := study.setting_of(tuple(key.split("."))):
            return ConfigError(f"--set {pair}: {error.problem.removeprefix(f'{key}: ')}")
    for key in keys:
        for path in _places(study, part, key, changes[key]):
            if study.is_from_file(path):
                return study.error(error.problem, path)
    # What the study's file does not say is in the settings, if there are any.
    pairs = ", ".join(f"--set {pair}" for pair in study.settings)
    return ConfigError(f"{pairs}: {error.problem}") if keys and pairs else error


def _places(study: Study, part: str, key: str, value: Any) -> Iterator[KeyPath]:
    """Yield places where the study may give a scenario key that value."""
    yield "factors", key
    yield "parts", part, "reference", key
    yield "parts", part, "changes", key
    for factor, levels in study.treatments.items():
        for level in levels:
            yield "treatments", factor, level, key
    if study.version is not None:
        yield study.version, key
    if (in_design := path_in_design(study, key, value)) is not None:
        yield in_design


_IN_FILES = {"dispatch.policy", "events", "events.table"}

RunKey = tuple[str, int]


@dataclass(frozen=True, slots=True)
class DesignCell:
    """One configuration of one part.

    Attributes:
        part: Name of the part.
        cell: Position in the design, or `REFERENCE`.
        levels: Level of each factor; none for the reference.
        scenario: Scenario to be run, except for the person.
        config: Hash of that scenario.
        changes: Changes to the scenario's file, by dotted key.
    """

    part: str
    cell: int
    levels: Mapping[str, Level]
    scenario: AnyScenario
    config: str
    changes: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class StudyRun:
    """Run of a study, by its cell of the design.

    Attributes:
        part: Name of the part.
        cell: Position of the cell in the design, or `REFERENCE`.
        levels: Level of each factor; none for a reference run.
        person: Index of the simulated person, from 0.
        trial: Index of the trial, from 0.
        seed: Random seed of the run: the same for this person and trial in every cell.
        config: Hash of the scenario but for the person.
    """

    part: str
    cell: int
    levels: Mapping[str, Level]
    person: int
    trial: int
    seed: int
    config: str

    @property
    def address(self) -> Address:
        """Its place among the runs of all parts."""
        return Address(self.part, self.cell, self.person, self.trial)

    @property
    def is_reference(self) -> bool:
        """True if this is the reference run of its part."""
        return self.cell == REFERENCE

    @property
    def is_repeat(self) -> bool:
        """True if it repeats the answer under another model of the persons."""
        return self.part == REPEATS

    @property
    def key(self) -> RunKey:
        """Identity of the run: runs with equal keys are the same."""
        return self.config, self.seed


@dataclass(frozen=True, slots=True)
class StudyJob(StudyRun):
    """A run with all that is needed to make it.

    Attributes:
        scenario: Complete scenario of the run, without its seed.
    """

    scenario: AnyScenario


def cells(study: Study, inputs: StudyInputs | None = None) -> list[DesignCell]:
    """Return all configurations, by part, the reference first, then those of the design in order.

    The repeats of the answer come last, as if they were a part of their own.

    Args:
        inputs: Contents of its files, if already read.

    Raises:
        ConfigError: a scenario that cannot be read, or is not valid with some change, or a
            measure that its runs do not have.
    """
    inputs = inputs or StudyInputs(study)
    refuse_unknown_measures(inputs)
    _at_ends(inputs)
    made = [cell for name in study.parts for cell in _cells_of(inputs, name)]
    _refuse_impossible_measures(inputs, made)
    return [*made, *_repeats_of(inputs)]


def refuse_unknown_measures(inputs: StudyInputs) -> None:
    """Reject a study that asks for a measure its runs do not have.

    Raises:
        ConfigError: it is none.
    """
    study = inputs.study
    for path, part, measure in _asked_measures(study):
        source = inputs.scenarios[part]
        plugins = inputs.measures_of(str(source.data.get("model", "full")))
        measures = [*model_of(source).measures(), *plugins]
        if measure in COVARIATES and measure not in measures:
            problem = f"{measure!r} is measured where the key 'measures' names it"
            raise study.error(problem, path)
        if measure not in measures:
            raise study.error(unknown("measure", measure, measures), path)


def _refuse_impossible_measures(inputs: StudyInputs, every: Sequence[DesignCell]) -> None:
    """Reject measures that no run of a part can produce, before running anything."""
    study = inputs.study
    for path, part, measure in _asked_measures(study):
        made = [c.scenario for c in every if c.part == part and c.cell != REFERENCE]
        plugins = inputs.measures_of(made[0].model) if made else []
        possible = [[*model_for(scenario).measures(scenario), *plugins] for scenario in made]
        if not any(measure in names for names in possible):
            problem = f"no run of part {part!r} has a value of the measure {measure!r}"
            raise study.error(f"{problem}; it has: {listed(possible[0])}", path)


def _asked_measures(study: Study) -> Iterator[tuple[KeyPath, str, str]]:
    """Yield each place where a measure is requested, with its part and name."""
    if study.answer is not None:
        yield ("answer", "measure"), study.answer.part, study.answer.measure
        for number, covariate in enumerate(study.covariates):
            for name in multiplied(covariate):
                yield ("covariates", number), study.answer.part, name
    for name, contrast in study.comparisons.items():
        yield ("comparisons", name, "measure"), contrast.part, contrast.measure
    if study.tuning is not None:
        yield ("tuning", "measure"), study.tuning.part, study.tuning.measure
    if study.stop is not None and study.stop.part and study.stop.measure:
        yield ("stop", "measure"), study.stop.part, study.stop.measure


def base_scenario(inputs: StudyInputs, part: str) -> AnyScenario:
    """Return a part's scenario before any factor has changed it."""
    return _build(inputs, part, _every_change(inputs, part, {}))


def basis_of_tuning(inputs: StudyInputs) -> TuningBasis:
    """Return the persons and phones that tuned values should rest on."""
    assert inputs.study.tuning is not None
    scenario = base_scenario(inputs, inputs.study.tuning.part).model_dump(mode="json")
    return TuningBasis.of(scenario.get("operator", {}).get("population", "operators"))


def jobs(study: Study, grid: Sequence[DesignCell] | None = None) -> list[StudyJob]:
    """Return all runs in a fixed order: part, cell, person, trial; the repeats last.

    Args:
        grid: Its cells, if they have been made already.

    Raises:
        ConfigError: a scenario that cannot be read, or is not valid with some change.
    """
    every = cells(study) if grid is None else grid
    teams: dict[str, int] = defaultdict(lambda: 1)
    for cell in every:
        teams[cell.part] = max(teams[cell.part], model_for(cell.scenario).team(cell.scenario))
    draws = _draws(study, teams)
    # Persons of one cluster follow each other, so that no two clusters share an operator; repeats
    # have the persons of the part that they repeat.
    study_jobs = []
    for cell in every:
        team = teams[_source_of(study, cell.part)]
        play = partial(model_for(cell.scenario).played_by, cell.scenario)
        scenarios = {person: play(person * team) for person, _, _ in draws[cell.part]}
        study_jobs += [
            StudyJob(cell.part, cell.cell, cell.levels, *draw, cell.config, scenarios[draw[0]])
            for draw in draws[cell.part]
        ]
    return study_jobs


def runs_in(manifest: Mapping[str, Any]) -> list[StudyRun]:
    """Return the runs that a manifest tells of, in the order of `jobs`.

    Args:
        manifest: Manifest of a study that may be running; only its study and cells are read.
    """
    rows = manifest["cells"]
    parts = dict.fromkeys(row["part"] for row in rows)
    draws = _draws(Study.model_validate(manifest["study"]), parts)
    return [
        StudyRun(row["part"], row["cell"], row["levels"], *draw, row["config"])
        for row in rows
        for draw in draws[row["part"]]
    ]


def to_rehearse(
    study: Study, every: Iterable[DesignCell], inputs: StudyInputs | None = None
) -> list[DesignCell]:
    """Return the cells in which a mistake would show.

    Instead of points in ranges, the ranges' ends.
    """
    ends = _at_ends(inputs or StudyInputs(study))
    return [*ends, *(cell for cell in every if not (ends and cell.levels))]


def _at_ends(inputs: StudyInputs) -> list[DesignCell]:
    """Return cells at both ends of every range, whichever points are drawn; none without ranges.

    Raises:
        ConfigError: a range has an end that is not valid.
    """
    rows = list(levels_at_ends(inputs.study))
    return [cell for name in inputs.study.parts if rows for cell in _cells_at(inputs, name, rows)]


def _cells_of(inputs: StudyInputs, name: str) -> Iterator[DesignCell]:
    reference = inputs.study.parts[name].reference
    if reference is not None:
        yield _cell(inputs, name, REFERENCE, {}, reference)
    yield from _cells_at(inputs, name, levels_of_cells(inputs.study))


def _cells_at(
    inputs: StudyInputs, name: str, rows: Iterable[Mapping[str, Level]]
) -> Iterator[DesignCell]:
    for cell, levels in enumerate(rows):
        yield _cell(inputs, name, cell, levels, _changes(inputs, levels))


def _repeats_of(inputs: StudyInputs) -> Iterator[DesignCell]:
    """Yield the answer's contrast under every strategy and every set of parameters."""
    study = inputs.study
    factors = factors_of_repeats(study)
    if not factors or study.answer is None:
        return
    fixed = settings_of_repeats(study)
    for cell, values in enumerate(itertools.product(*factors.values())):
        levels = dict(zip(factors, values, strict=True))
        traits = inputs.parameter_sets[int(str(levels[PARAMETERS]))]
        chosen = {factor: level for factor, level in levels.items() if factor != PARAMETERS}
        changes = _changes(inputs, fixed | chosen)
        set_keys = {*study.parts[study.answer.part].changes, *study.changes, *changes}
        drawn = {f"{TRAITS}.{name}": value for name, value in traits.items()}
        changes |= {key: value for key, value in drawn.items() if key not in set_keys}
        yield _cell(inputs, REPEATS, cell, levels, changes)


def _changes(inputs: StudyInputs, levels: Mapping[str, Level]) -> dict[str, Any]:
    """Return the scenario changes that the levels of a cell make."""
    changes: dict[str, Any] = {}
    for factor, level in levels.items():
        if factor in inputs.study.treatments:
            changes |= inputs.study.treatments[factor][str(level)]
        elif factor == TUNING:
            if level == TUNED and inputs.tuned is not None:
                changes[inputs.tuned.tuning.key] = inputs.tuned.value_for(levels)
        elif factor != POINT:
            changes[factor] = level
    return changes


def _cell(
    inputs: StudyInputs,
    part: str,
    cell: int,
    levels: Mapping[str, Level],
    changes: Mapping[str, Any],
) -> DesignCell:
    every = _every_change(inputs, part, changes)
    scenario = _build(inputs, part, every)
    config = stable_hash(scenario.model_dump(mode="json"))
    return DesignCell(part, cell, levels, scenario, config, every)


def _every_change(inputs: StudyInputs, part: str, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return all changes to a scenario's file: by the part, by `--set` and by the cell."""
    study = inputs.study
    part = _source_of(inputs.study, part)
    fixed = {**study.parts[part].changes, **study.changes}
    of_study = model_of(inputs.scenarios[part]).set_by_study(study.seed)
    return _located({**fixed, **of_study, **changes}, study.folder)


def _build(inputs: StudyInputs, part: str, changes: Mapping[str, Any]) -> AnyScenario:
    """Build the part's scenario; an error in a change names its place in the study."""
    part = _source_of(inputs.study, part)
    source = inputs.scenarios[part]
    try:
        built: AnyScenario = model_of(source).build(source, changes)
        return built
    except ConfigError as error:
        raise located(inputs.study, part, error, changes) from None


def rehearse(study: Study, cell: DesignCell) -> None:
    """Find what cannot work in a cell before anything runs.

    Raises:
        ConfigError: what cannot be read or placed, told where the study asks for it.
    """
    model = model_for(cell.scenario)
    try:
        model.rehearse(cell.scenario, study.seed)
    except ConfigError as error:
        part = _source_of(study, cell.part)
        source = StudyInputs(study).scenarios[part]

        def make(changes: Mapping[str, Any]) -> None:
            model.rehearse(model.build(source, changes), study.seed)

        raise located(study, part, blame(error, cell.changes, make), cell.changes) from None


def _source_of(study: Study, part: str) -> str:
    """Return the part whose scenario is run: repeats have that of the answer."""
    return study.answer.part if part == REPEATS and study.answer is not None else part


def _located(changes: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Let a policy or a table of events in a file beside the study be found from anywhere."""
    with_paths = dict(changes)
    for key in _IN_FILES & changes.keys():
        part, _, inner = key.partition(".")
        named = {part: {inner: changes[key]} if inner else copy.deepcopy(changes[key])}
        scenarios.locate_files(named, [folder])
        with_paths[key] = named[part][inner] if inner else named[part]
    return with_paths


def _draws(study: Study, parts: Iterable[str]) -> dict[str, list[tuple[int, int, int]]]:
    """Return the person, trial and seed of each run in a cell of every part, in order."""
    draws = {}
    for name in parts:
        persons, trials, part = _size(study, name)
        draws[name] = [
            (person, trial, derive_seed(study.seed, part, person, trial))
            for person, trial in itertools.product(range(persons), range(trials))
        ]
    return draws


def _size(study: Study, name: str) -> tuple[int, int, str]:
    """Return persons, trials, and the part whose random seeds it has.

    A repeat shares its part's.
    """
    if name == REPEATS and study.robustness is not None and study.answer is not None:
        persons = min(study.robustness.persons, study.persons)
        return persons, study.robustness.replications, study.answer.part
    return study.most_persons, study.parts[name].replications or study.replications, name
