"""Main view of a study: runs, contrast, x axis, and the finding."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Finding, Missed
from dva_sim.experiments.analysis.run_grid import (
    Factor,
    Floats,
    RunGrid,
    Setting,
    Table,
    as_floats,
    person_means,
    plain_level,
    present,
)
from dva_sim.experiments.results.tables import DESIGN_COLUMNS
from dva_sim.experiments.study.answerable import only_contrast
from dva_sim.experiments.study.parts import ANSWER, POINT, TUNING, Level, StopRule, multiplied
from dva_sim.kernel.units import unit_of
from dva_sim.simulation.labels import brief, measure_called
from dva_sim.statistics import LEVEL, Band, Interval, adjusted, band, off_zero

MAX_PANELS = 4
_MAX_OFF = 5.0  # standard errors between the mean of a covariate and zero
ROW = "row"  # name of the factor whose levels are the rows of a list


@dataclass(frozen=True)
class StudyView:
    """View of a part: its factors as x axis, series and panels.

    Attributes:
        part: The runs.
        measure: Column the question is about.
        series_factor: Factor whose levels are the series of figures, or None.
        over: Factor along x, or None.
        contrast: The two levels of `series_factor` compared, the first minus the second; or None.
        within: The panel that the answer speaks of.
        smallest_effect: Smallest difference declared to matter, in the measure's unit.
        outside: True for cells `(levels of factor 1, ...)` that are extrapolations, beyond the
            delays at which people were watched; None if unknown.
        possible: The least and the greatest value that the measure can take at all.
        averages_points: True if the trials are points in ranges, over which means are taken.
        covariates: Covariates that differences are adjusted for, each a product of columns.
        level: Level of intervals of the contrast: 95 %, or more where looks share the 5 %.
    """

    part: RunGrid
    measure: str
    series_factor: Factor | None
    over: Factor | None
    contrast: tuple[Level, Level] | None
    within: Setting
    smallest_effect: float | None = None
    outside: NDArray[np.bool_] | None = None
    possible: tuple[float, float] = (-math.inf, math.inf)
    averages_points: bool = False
    covariates: tuple[str, ...] = ()
    level: float = LEVEL

    @property
    def series(self) -> tuple[Level, ...]:
        """Levels of the series factor; a single None where there is none."""
        return self.series_factor.levels if self.series_factor else (None,)

    @property
    def stops(self) -> tuple[Level, ...]:
        """Levels along x; a single None where there is none."""
        return self.over.levels if self.over else (None,)

    @property
    def panels(self) -> list[Setting]:
        """Settings of all other factors, the last fastest; of each, the answer's level first.

        Settings that the design leaves out have no panel.
        """
        names = [f.name for f in (self.series_factor, self.over) if f]
        every = list(self.part.settings(but=names))
        order = sorted(
            every, key=lambda panel: [self.within.get(*item) != item[1] for item in panel.items()]
        )
        return [panel for panel in order if self.part.where(self.part.ran, panel).any()] or order

    @property
    def shown(self) -> list[Setting]:
        """The panels that a figure has room for."""
        return self.panels[:MAX_PANELS]

    @property
    def widest(self) -> float:
        """The greatest difference between two values that the measure can take."""
        return self.possible[1] - self.possible[0]

    def setting(self, panel: Setting, level: Level) -> Setting:
        """Return the levels that a series in a panel stands for."""
        return dict(panel) | ({self.series_factor.name: level} if self.series_factor else {})

    def along_x(self) -> dict[str, Any]:
        """Return the levels along x under their factor's name.

        Nothing where there is no such factor.
        """
        return {self.over.name: self.over.levels} if self.over else {}

    def at_stop(self, stop: int) -> Setting:
        """Return the level along x of one stop."""
        return {self.over.name: self.over.levels[stop]} if self.over else {}

    def curve(self, grid: Floats, panel: Setting, level: Level) -> Floats:
        """Return values along x as `(stops, persons, trials)`."""
        values = self.part.where(grid, self.setting(panel, level))
        return values if self.over else values[np.newaxis]

    @property
    def values(self) -> Floats:
        """The measure as it is judged: in excess of the reference wherever there is one."""
        return self.part.outcome(self.measure)

    def stops_outside(self, panel: Setting, levels: Sequence[Level] | None = None) -> list[int]:
        """Return the stops of a panel at which a series, of some or all, is an extrapolation."""
        if self.outside is None:
            return []
        series = self.series if levels is None else levels
        outside = np.asarray(self.outside, dtype=float)
        marks = [self.part.where(outside, self.setting(panel, level)) > 0 for level in series]
        return [int(stop) for stop in np.flatnonzero(np.array(marks).any(axis=0))]

    def difference(self, panel: Setting, first: Level, second: Level) -> Floats:
        """Return first minus second, paired by person and trial: person means `(persons, stops)`.

        Where there are covariates, as values of the persons whose mean is the adjusted one.
        """

        def sides(grid: Floats) -> list[Floats]:
            return [self.curve(grid, panel, level) for level in (first, second)]

        beside = [sides(product_of(self.part, name)) for name in self.covariates]
        return adjusted_means(sides(self.values), beside)

    def band_of(self, panel: Setting, first: Level, second: Level) -> Band:
        """Return differences at all stops with their band; see `difference`."""
        return band(self.difference(panel, first, second), self.level)


def adjusted_means(sides: Sequence[Floats], covariates: Sequence[Sequence[Floats]]) -> Floats:
    """Return first minus second, paired by person and trial: person means `(persons, stops)`.

    Where there are covariates, as values of the persons whose mean is the adjusted one.

    Args:
        sides: The first and the second `(stops, persons, trials)`.
        covariates: Both sides of each.
    """
    differences = sides[0] - sides[1]
    means = person_means(differences)
    is_finite = np.isfinite(differences)
    beside = [person_means(np.where(is_finite, (a + b) / 2, np.nan)) for a, b in covariates]
    return adjusted(means, beside) if beside else means


def product_of(part: RunGrid, covariate: str) -> Floats:
    """Return a covariate's grid: the product of its columns."""
    return np.asarray(np.prod([part.grid(name) for name in multiplied(covariate)], axis=0))


def covariates_of(study: Mapping[str, Any], part: RunGrid) -> tuple[list[str], list[str]]:
    """Return the covariates for which the answer is adjusted, and those whose mean cannot be zero.

    Nobody can prove of a column that its mean over all persons and trials is zero. One that is
    more than five standard errors off, which happens to one in a million, is not.
    """
    names = list(study.get("covariates") or ())
    off = {name: off_zero(_of_persons(part, name)) > _MAX_OFF for name in names}
    return [n for n in names if not off[n]], [n for n in names if off[n]]


def _of_persons(part: RunGrid, covariate: str) -> Floats:
    """Return the mean over all runs of each person."""
    by_person = np.moveaxis(product_of(part, covariate), -2, 0)
    return person_means(by_person.reshape(1, len(by_person), -1))[:, 0]


def factors_of(study: Mapping[str, Any]) -> list[Factor]:
    """Return the declared factors, in order."""
    return [Factor(name, tuple(levels)) for name, levels in study.get("factors", {}).items()]


def part_of(
    study: Mapping[str, Any], runs: Table, name: str, *, are_points_trials: bool = True
) -> RunGrid:
    """Return the runs of a part, laid out by the factors that tell its cells apart.

    In the full grid these are the factors declared. Factors whose levels are taken together are
    one, that of which the answer speaks or the first. Points in ranges are like trials: a person
    meets them all, and what is compared is compared at each. Rows that leave most of their grid
    empty are one factor, unless the answer needs the others.

    Args:
        study: Study as the manifest has it.
        runs: The table of runs.
        name: Name of the part.
        are_points_trials: Otherwise the point is a factor of its own.
    """
    factors = factors_of(study)
    design = study.get("design") or {}
    if together := design.get("zip"):
        declared = study.get("answer") or {}
        named = [declared.get("factor"), declared.get("over"), *(declared.get("within") or {})]
        first = next((factor for factor in named if factor in together), together[0])
        factors = [f for f in factors if f.name not in together or f.name == first]
    elif POINT in study.get("factors", {}) and POINT in runs and are_points_trials:
        runs = _as_trials(runs)
        factors = [f for f in factors if f.name != POINT]
    elif names := row_names(study, runs):
        runs = with_rows(runs, names)
        factors = [Factor(ROW, tuple(names.values()))]
    return RunGrid(runs, name, factors)


def parts_of(study: Mapping[str, Any], runs: Table) -> list[RunGrid]:
    """Return every part that has runs, with each point as a level of its own."""
    names = dict.fromkeys(map(str, runs["part"]))
    return [part_of(study, runs, name, are_points_trials=False) for name in names]


def points_of(study: Mapping[str, Any], runs: Table) -> list[str]:
    """Return continuous factors: columns of numbers that tell where in its ranges each run lies."""
    if POINT not in study.get("factors", {}) or POINT not in runs:
        return []
    design = list(runs)[: list(runs).index("is_reference")]
    names = [n for n in design if n not in DESIGN_COLUMNS and n not in study["factors"]]
    return [n for n in names if np.isfinite(as_floats(runs[n])).any()]


def _as_trials(runs: Table) -> Table:
    """Return each point and trial as a trial of its own; a reference run is that of every point."""
    aside = np.asarray(runs["is_reference"]).astype(bool)
    points = np.unique(as_floats(runs[POINT])[~aside]).astype(int)
    own = np.flatnonzero(~aside)
    shared = np.flatnonzero(aside)
    rows = np.concatenate([own, np.tile(shared, len(points))])
    point = np.concatenate([as_floats(runs[POINT])[own].astype(int), points.repeat(len(shared))])
    trial = np.asarray(runs["trial"])[rows]
    count = int(trial.max(initial=0)) + 1
    return {key: np.asarray(v)[rows] for key, v in runs.items()} | {"trial": point * count + trial}


def _is_sparse(runs: Table, factors: Sequence[Factor]) -> bool:
    """Return True if fewer than half of the grid's cells were run."""
    treated = ~np.asarray(runs["is_reference"]).astype(bool)
    ran = len(np.unique(np.asarray(runs["cell"])[treated])) if "cell" in runs else 0
    return 2 * ran < math.prod(len(f.levels) for f in factors)


def row_names(study: Mapping[str, Any], runs: Table) -> dict[int, str]:
    """Return names of the cells of a listed design, by their settings.

    Empty for factorial designs.
    """
    factors = factors_of(study)
    listed = bool(study.get("design")) and not study.get("answer") and "cell" in runs
    if not listed or POINT in study["factors"] or not _is_sparse(runs, factors):
        return {}
    cells, first = np.unique(np.asarray(runs["cell"]), return_index=True)
    return {
        int(cell): brief({f.name: plain_level(runs[f.name][at]) for f in factors})
        for cell, at in zip(cells, first, strict=True)
        if cell >= 0
    }


def with_rows(table: Table, names: Mapping[int, str]) -> Table:
    """Return a table with a column that says which row of the list each of its rows belongs to."""
    column = np.array([names.get(int(cell), "") for cell in table["cell"]], dtype=object)
    return dict(table) | {ROW: column}


def keys_of(study: Mapping[str, Any]) -> list[Factor]:
    """Return the scenario keys that vary, with their levels: treatments by what they change.

    For a range these are its ends.
    """
    ranges = (study.get("design") or {}).get("ranges") or {}
    keys: dict[str, list[Level]] = {key: [r["low"], r["high"]] for key, r in ranges.items()}
    for factor, levels in study.get("factors", {}).items():
        named = study.get("treatments", {}).get(factor)
        if factor == POINT:
            continue
        if factor == TUNING:
            keys[study["tuning"]["key"]] = list(study["tuning"]["levels"])
        elif named is None:
            keys[factor] = list(levels)
        else:
            for level in levels:
                for key, value in named[level].items():
                    keys.setdefault(key, []).append(value)
    # Each level once; a treatment may set a whole block, such as a law, which has no hash.
    return [
        Factor(key, tuple(level for i, level in enumerate(levels) if level not in levels[:i]))
        for key, levels in keys.items()
    ]


def view_of(study: Mapping[str, Any], runs: Table) -> StudyView | None:
    """Return the view that the declared answer asks for.

    Without one, that of the only contrast possible.

    Returns None where there is no run to look at.
    """
    declared = study.get("answer") or {}
    parts = list(map(str, runs["part"]))
    name = declared.get("part") if declared.get("part") in parts else next(iter(parts), None)
    part = part_of(study, runs, name) if name else None
    if part is None or not len(part):
        return None
    declared = declared or _only_answer(part)
    factor_by_name = {f.name: f for f in part.factors}
    over = factor_by_name.get(declared.get("over", ""))
    factor = factor_by_name.get(declared.get("factor", ""))
    if over is None and not (factor and "over" in declared):
        free = [f for f in part.factors if f is not factor]
        numeric = [f for f in free if f.is_numeric and len(f.levels) > 1]
        longest = max(numeric, key=lambda f: len(f.levels), default=None)
        over = longest or next(iter(free), None)
    factor = factor or next((f for f in part.factors if f is not over), None)
    within = {k: v for k, v in (declared.get("within") or {}).items() if k in factor_by_name}
    measure = declared.get("measure") or _first_measure(part)
    return StudyView(
        part=part,
        measure=measure,
        series_factor=factor,
        over=over,
        contrast=_contrast(declared, factor),
        within=within,
        averages_points=POINT in study.get("factors", {}),
        covariates=tuple(covariates_of(study, part)[0]) if study.get("answer") else (),
        level=_level_of(study),
        smallest_effect=declared.get(f"smallest_effect_{measure.rpartition('_')[2]}")
        or declared.get("smallest_effect"),
    )


def _level_of(study: Mapping[str, Any]) -> float:
    """Return the level of the answer's intervals, by the study's stopping rule."""
    stop = study.get("stop") or {}
    if stop.get("comparison") != ANSWER:
        return LEVEL
    return StopRule.model_validate(stop).level(int(study["persons"]))


def _only_answer(part: RunGrid) -> dict[str, Any]:
    """Return the only contrast that a part without a declared one allows; empty if several do."""
    contrast = only_contrast({factor.name: factor.levels for factor in part.factors})
    return (
        {} if contrast is None else {k: v for k, v in contrast._asdict().items() if v is not None}
    )


def finding_of(view: StudyView) -> Finding | None:
    """Return the declared contrast, measured; None where no contrast was declared or run."""
    if view.contrast is None or view.series_factor is None:
        return None
    panel = view.panels[0]
    bands = view.band_of(panel, *view.contrast)
    return Finding(
        measure=view.measure,
        in_excess=view.part.has_reference(view.measure),
        factor=view.series_factor.name,
        first=view.contrast[0],
        second=view.contrast[1],
        over=view.over.name if view.over else "",
        levels=view.stops,
        within=panel,
        mean=bands.mean,
        low=np.maximum(bands.low, -view.widest),
        high=np.minimum(bands.high, view.widest),
        persons=bands.n_persons,
        smallest_effect=view.smallest_effect,
        usual=_usual(view, view.contrast[1]),
        missed=_missed(view),
        horizon=_horizon(view),
        widest=view.widest,
        all_confirmed=view.part.has("confirmed")
        and bool((present(view.part.grid("confirmed")) == 1).all()),
        everywhere="on average over the ranges" if view.averages_points else "",
        part=view.part.name,
    )


def _usual(view: StudyView, level: Level) -> Floats:
    """Return the median of all runs under a level `(stops,)`; nan where there is none."""
    values = view.curve(view.part.grid(view.measure), view.panels[0], level)
    present_runs = [present(runs) for runs in values]
    return np.array([float(np.median(runs)) if len(runs) else math.nan for runs in present_runs])


def possible_values(measure: str, scenario: Mapping[str, Any]) -> tuple[float, float]:
    """Return the least and the greatest value that a measure can take in a run of a scenario."""
    column = measure_called(measure, scenario.get("model", "full"))
    low, high = column.bounds
    return low, min(high, float(scenario.get("horizon_s", math.inf))) if column.awaits else high


def interval_of(values: Floats, level: float = LEVEL) -> Interval | None:
    """Return the mean of `(persons, trials)` over persons, with its bootstrap interval.

    The interval of persons who are all alike is that one value. None where nobody has a value.
    """
    bands = band(person_means(values[np.newaxis]), level)
    mean, low, high = (float(x[0]) for x in (bands.mean, bands.low, bands.high))
    if not np.isfinite(mean):
        return None
    if bands.n_persons > 1 and not np.isfinite(low):
        low = high = mean
    return Interval(mean, low, high, bands.n_persons)


def _missed(view: StudyView) -> tuple[Missed, ...]:
    """Return runs without confirmation at the last stop, for every series."""
    if not view.part.has("confirmed"):
        return ()
    grid = view.part.grid("confirmed")
    panel = view.panels[0]
    runs_by_level = [(level, present(view.curve(grid, panel, level)[-1])) for level in view.series]
    return tuple(Missed(level, int((runs < 1).sum()), len(runs)) for level, runs in runs_by_level)


def _horizon(view: StudyView) -> float | None:
    """Return the value that missed runs count with, if all have the same [s]."""
    if not view.part.has("confirmed") or unit_of(view.measure) != "s":
        return None
    missed = as_floats(view.part.treated["confirmed"]) == 0
    counted = np.unique(present(view.part.values(view.measure)[missed]))
    return float(counted[0]) if len(counted) == 1 else None


def _first_measure(part: RunGrid) -> str:
    keys = {*DESIGN_COLUMNS, *(f.name for f in part.factors)}
    measures = [c for c in part.treated if c not in keys and part.has(c)]
    times = (name for name in measures if measure_called(name).awaits)
    return next(times, next(iter(measures), "seed"))


def _contrast(declared: Mapping[str, Any], factor: Factor | None) -> tuple[Level, Level] | None:
    levels = tuple(declared.get("contrast") or ())
    if factor is None or len(levels) != 2 or not set(levels) <= set(factor.levels):
        return None
    return levels[0], levels[1]
