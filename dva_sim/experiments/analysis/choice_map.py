"""Choice of a level of one factor at each level of another, over all models of persons.

The answer's factor is what one can choose (a messaging pattern), the factor it runs over is what
one is given (a link), and the levels of a third are models of the persons that the data leave open.
The regret of a choice is what it costs more than the best choice for the same link and persons. In
a mix of two models the regret is at most that of the worse one, so that the range over models
bounds it for every share of persons in between.

References:
    L. J. Savage, The theory of statistical decision, J. Am. Stat. Assoc. 46 (1951), 55-67.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.run_grid import Factor, Floats, RunGrid, nan_mean, person_means
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.units import unit_of
from dva_sim.simulation.labels import factor_name, measure_called
from dva_sim.statistics import band

SIDE_MEASURES = ("contacts", "stop_share")
_OF_PERSONS = "operator.", "phone.", "guard.", "bystander."
_WAITS = "move_and_wait_share"
_SMALLEST_REGRET = 0.05  # regret that is not printed as 0.0


@dataclass(frozen=True)
class ChoiceMap:
    """The regret of each choice in each situation, under each model of the persons.

    Attributes:
        measure: Column in which the loss is counted; its negative is the loss where more of it is
            better.
        choice: Factor of the choices, `c` levels.
        given: Factor of the situations, `g` levels.
        models: Factor of the models of persons, or of other circumstances, `m` levels.
        over: Words for its levels.
        mean: Mean of the measure, `(g, c, m)`.
        regret: Mean loss beyond the least one, `(g, c, m)`; 0 for the best choice.
        is_clear: True where the 95 % band of the regret lies above 0 and the regret above
            `smallest`, `(g, c, m)`. The band, paired by person and trial, is simultaneous for all
            differences in a situation, so it stays valid for the best choice found.
        is_same: True where the bands of the differences from all other choices exclude a loss above
            `smallest` beyond any of them, `(g, c, m)`: the least mean alone shows nothing.
        high: Upper end of that band, `(g, c, m)`; 0 for the best choice.
        smallest: Smallest difference that matters; 0 where none was declared.
        most: Value of runs that never ended; infinite if the measure is unbounded.
        outside: True for cells beyond the delays at which people were watched, `(g, c, m)`.
        median: Median of the measure, `(g, c, m)`.
        beside: Means of further measures of the runs, `(g, c, m)` each, by column.
        waiting: Share of the persons who choose how they steer that move and wait, `(g, c)`; None
            where no model lets them choose.
        notes: Further assumptions, by situation.
    """

    measure: str
    choice: Factor
    given: Factor
    models: Factor
    over: str
    mean: Floats
    regret: Floats
    is_clear: NDArray[np.bool_]
    is_same: NDArray[np.bool_]
    high: Floats
    smallest: float
    most: float
    outside: NDArray[np.bool_]
    median: Floats
    beside: Mapping[str, Floats]
    waiting: Floats | None
    notes: Mapping[str, str]

    @property
    def unit(self) -> str:
        """Unit of the loss."""
        return unit_of(self.measure)

    @cached_property
    def least(self) -> Floats:
        """Least regret over the models, `(g, c)`."""
        return np.asarray(self.regret.min(axis=2))

    @cached_property
    def worst(self) -> Floats:
        """Greatest regret over the models, `(g, c)`; infinite where another finishes runs alone."""
        fails = (self.never & ~self.never.all(axis=1, keepdims=True)).any(axis=2)
        return np.where(fails, np.inf, self.regret.max(axis=2))

    @property
    def is_worse(self) -> NDArray[np.bool_]:
        """True for a choice that is clearly worse than the best under some model, `(g, c)`."""
        return np.asarray(self.is_clear.any(axis=2))

    @property
    def is_shaded(self) -> NDArray[np.bool_]:
        """True for a choice that is worse under some model, the best under none, `(g, c)`."""
        return np.asarray(self.is_worse & (self.least >= _SMALLEST_REGRET))

    @property
    def is_best(self) -> NDArray[np.bool_]:
        """True for a choice that is shown to be as good as any under every model, `(g, c)`."""
        return np.asarray((self.is_same & ~self.never).all(axis=2))

    @property
    def is_lost(self) -> NDArray[np.bool_]:
        """True for a situation in which no choice ends any run, `(g,)`."""
        return np.asarray(self.never.all(axis=(1, 2)))

    @property
    def overall(self) -> Floats:
        """Greatest regret of each choice in any situation, settled or not, `(c,)`."""
        return np.asarray(self.worst.max(axis=0))

    @property
    def advised(self) -> Level:
        """The choice whose greatest regret is least."""
        return self.choice.levels[int(np.argmin(self.overall))]

    @property
    def is_tall(self) -> bool:
        """True if there are more choices than situations: they then read better as rows."""
        return len(self.choice.levels) > len(self.given.levels)

    @property
    def is_beyond(self) -> bool:
        """Return True if every situation is beyond what people were watched at."""
        return bool(self.outside.any(axis=(1, 2)).all())

    @cached_property
    def never(self) -> NDArray[np.bool_]:
        """True for a choice that ends no run in a situation under a model, `(g, c, m)`.

        This is what "never" means wherever a map is shown.
        """
        return np.asarray(self.mean >= self.most)

    def best_of(self, situation: int) -> list[Level]:
        """Return the choices that are not clearly worse than the best.

        All where nothing differs.
        """
        return [
            level
            for level, worse in zip(self.choice.levels, self.is_worse[situation], strict=True)
            if not worse
        ]


def choice_map(study: Mapping[str, Any], view: StudyView) -> ChoiceMap | None:
    """Read the map of a study; None where it declares none, or a cell has no run yet.

    Args:
        study: Study as the manifest holds it.
    """
    declared = study.get("map")
    if not declared or view.series_factor is None or view.over is None:
        return None
    models = next((f for f in view.part.factors if f.name == declared["models"]), None)
    if models is None:
        return None
    axes = (view.over, view.series_factor, models)
    cells = _cells(view.part, view.part.grid(view.measure), axes)  # (g, c, m, persons, trials)
    is_loss = measure_called(view.measure).better == "small"
    losses = cells if is_loss else -cells
    loss = nan_mean(nan_mean(losses, axis=-1), axis=-1)
    if not np.isfinite(loss).all():
        return None
    smallest = view.smallest_effect or 0.0
    is_clear, is_same, high = _judged(losses, loss.argmin(axis=1), smallest)
    return ChoiceMap(
        measure=view.measure,
        choice=view.series_factor,
        given=view.over,
        models=models,
        over=_words_for(models, study),
        mean=loss if is_loss else -loss,
        regret=loss - loss.min(axis=1, keepdims=True),
        is_clear=is_clear,
        is_same=is_same,
        high=high,
        smallest=smallest,
        most=view.possible[1] if is_loss else np.inf,
        outside=_outside(view, axes),
        median=np.nanmedian(cells, axis=(3, 4)),
        beside={
            column: nan_mean(
                nan_mean(_cells(view.part, view.part.grid(column), axes), axis=-1), axis=-1
            )
            for column in SIDE_MEASURES
        },
        waiting=_waiting(view, axes, declared.get("choosing")),
        notes=dict(declared.get("notes") or {}),
    )


def _words_for(models: Factor, study: Mapping[str, Any]) -> str:
    """Return words for the levels of a factor: models of the persons, if it changes those alone."""
    levels = (study.get("treatments") or {}).get(models.name, {}).values()
    keys = {key for changes in levels for key in changes} or {models.name}
    is_of_persons = all(key.startswith(_OF_PERSONS) for key in keys)
    return "models of the persons" if is_of_persons else f"levels of {factor_name(models.name)}"


def _cells(part: RunGrid, grid: NDArray[Any], axes: tuple[Factor, ...]) -> NDArray[Any]:
    """Return a grid with the three factors first, in this order.

    Other factors must have one level.
    """
    names = [factor.name for factor in part.factors]
    order = [names.index(factor.name) for factor in axes]
    rest = [n for n in range(grid.ndim) if n not in order]
    moved = np.transpose(grid, [*order, *rest])
    remaining = len(names) - len(axes)
    return np.asarray(moved.reshape(*moved.shape[:3], *moved.shape[3 + remaining :]))


def _judged(
    losses: Floats, best: NDArray[np.intp], smallest: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], Floats]:
    """Return where a choice is clearly worse than the best, where as good, and how far at most."""
    clear, same = np.zeros((2, *losses.shape[:3]), dtype=bool)
    ends = np.zeros(losses.shape[:3])
    for g in range(len(losses)):
        mean, low, high = _differences(losses[g])
        for c, m in np.ndindex(clear.shape[1:]):
            to_best = c, best[g, m], m
            clear[g, c, m] = low[to_best] > 0.0 and mean[to_best] > smallest
            others = np.arange(len(high)) != c
            same[g, c, m] = bool((high[c, others, m] <= smallest).all())
            ends[g, c, m] = 0.0 if c == best[g, m] else high[to_best]
    return clear, same, ends


def _differences(losses: Floats) -> tuple[Floats, Floats, Floats]:
    """Mean and band of each choice's loss minus each other's, all at once, `(c, c, m)` each.

    Args:
        losses: Losses in one situation, `(c, m, persons, trials)`.
    """
    count, models = losses.shape[:2]
    mean, low, high = np.full((3, count, count, models), np.nan)
    one, other = np.triu_indices(count, 1)
    pairs = losses[one] - losses[other]
    bands = band(person_means(pairs.reshape(-1, *losses.shape[2:])))
    alike = (bands.n_persons > 1) & ~np.isfinite(bands.low)  # all persons differ by the same
    ends = (np.where(alike, bands.mean, edge) for edge in (bands.low, bands.high))
    means, lows, highs = (x.reshape(-1, models) for x in (bands.mean, *ends))
    mean[one, other] = means
    low[one, other] = lows
    high[one, other] = highs
    mean[other, one] = -means
    low[other, one] = -highs
    high[other, one] = -lows
    return mean, low, high


def _waiting(view: StudyView, axes: tuple[Factor, ...], choosing: Any) -> Floats | None:
    """Return the share of persons who moved and waited at any time, `(g, c)`."""
    if choosing is None:
        return None
    grid = view.part.grid(_WAITS)
    waited = np.where(np.isnan(grid), np.nan, grid > 0.0)
    shares = nan_mean(nan_mean(_cells(view.part, waited, axes), axis=-1), axis=-1)
    return np.asarray(shares[:, :, axes[2].levels.index(choosing)])


def _outside(view: StudyView, axes: tuple[Factor, ...]) -> NDArray[np.bool_]:
    shape = tuple(len(factor.levels) for factor in axes)
    if view.outside is None:
        return np.zeros(shape, dtype=bool)
    return _cells(view.part, view.outside, axes).reshape(shape)
