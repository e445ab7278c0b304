"""The level of every factor in every cell of a study, and how many cells and runs that makes.

A design makes rows, each with a level for some of the factors. All other factors cross them: every
row meets every combination of their levels. Without a design there are zero rows, and the cells are
the full grid.

The answer's contrast is repeated under other models of persons: each strategy with the usual
parameters (set 0) and with sets drawn from the bands within which calibration leaves them open.
Repeats share persons and random numbers with the study's runs, so that only the model differs.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from dva_sim.agents.population import Population
from dva_sim.experiments.study.designs import Row, ValueRange, keys_of, sample, value_at
from dva_sim.experiments.study.parts import POINT, REPEATS, STRATEGY, Level, Range
from dva_sim.experiments.study.study import Study
from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.yaml_files import KeyPath, load_yaml

PEOPLE = "agents/people"
PARAMETERS = "parameters"  # factor: which set of parameters
TRAITS = "operator.traits"
_DIGITS = 4  # significant ones of a drawn parameter

Floats = NDArray[np.float64]
Traits = dict[str, float]


class Bands(Config):
    """Calibration bands: the range that calibration leaves to each parameter.

    Attributes:
        bands: `[low, high]` of the median of each trait, under the trait's key.
    """

    description: str = ""
    bands: Annotated[dict[str, Range], Field(min_length=1)]

    @field_validator("bands")
    @classmethod
    def _are_of_traits(cls, value: dict[str, Range]) -> dict[str, Range]:
        traits = Population().traits
        for name, (low, _) in value.items():
            if name not in traits:
                raise ValueError(f"no trait {name!r}; traits: {', '.join(traits)}")
            if low <= 0:
                raise ValueError(f"band of {name!r} should be above zero, not from {low:g}")
        return value


def factors_of_repeats(study: Study) -> dict[str, tuple[Level, ...]]:
    """Return factors varied between and within repeats, in order; empty if none are declared."""
    robustness = study.robustness
    answer = study.answer
    if robustness is None or answer is None or answer.over is None:
        return {}
    strategies = {STRATEGY: robustness.strategies} if robustness.strategies else {}
    at = robustness.at or study.factors.get(answer.over, (None,))[-1:]
    sets = tuple(range(robustness.sets + 1))
    return {**strategies, PARAMETERS: sets, answer.factor: answer.contrast, answer.over: at}


def settings_of_repeats(study: Study) -> dict[str, Level]:
    """Return levels of the factors that do not vary between repeats.

    Those of the answer's panel.
    """
    assert study.answer is not None
    answer = study.answer
    fixed = {
        f: levels for f, levels in study.factors.items() if f not in (answer.factor, answer.over)
    }
    return {f: answer.within.get(f, levels[0]) for f, levels in fixed.items()}


def parameter_sets(study: Study) -> list[Traits]:
    """Return the traits of each set; of set 0, the usual one, none.

    Raises:
        ConfigError: the bands cannot be read.
    """
    robustness = study.robustness
    if robustness is None or not robustness.sets:
        return [{}]
    try:
        document = load_yaml(resources.find(robustness.bands, PEOPLE, base=study.folder))
    except ConfigError as error:
        here = study.error(error.problem, (REPEATS, "bands"))
        raise here if error.file is None else error from None
    bands = validate(Bands, document.data, document.error).bands
    rng = Streams(study.seed).fresh("robustness")
    places = latin_hypercube(robustness.sets, len(bands), rng)
    drawn = (zip(bands.items(), row, strict=True) for row in places)
    return [{}, *({name: _between(band, u) for (name, band), u in each} for each in drawn)]


def latin_hypercube(points: int, axes: int, rng: np.random.Generator) -> Floats:
    """Return points in the unit cube `(points, axes)`: along each axis one in each of equal slices.

    References:
        McKay, Beckman & Conover, Technometrics 21 (1979), 239-245.
    """
    slices = np.array([rng.permutation(points) for _ in range(axes)]).T.reshape(points, axes)
    return np.asarray((slices + rng.random((points, axes))) / points)


def _between(band: Range, share: float) -> float:
    """Return a value geometrically between the ends, since traits are log-normal."""
    low, high = band
    value = low * (high / low) ** share
    return float(f"{value:.{_DIGITS}g}")


def levels_of_cells(study: Study) -> Iterator[Row]:
    """Yield the level of every factor in every cell, in the order of the cells.

    Last factor fastest.
    """
    return _crossed(study, rows_of(study))


def levels_at_ends(study: Study) -> Iterator[Row]:
    """Return levels with one range at either end and all others at their middle.

    Which points are drawn depends on the seed; whether the ends are valid does not.
    """
    return _crossed(study, _ends_of(study)) if _ranges_of(study) else iter(())


def _crossed(study: Study, rows: list[Row]) -> Iterator[Row]:
    for parts in itertools.product(*_axes(study, rows)):
        yield {key: level for part in parts for key, level in part.items()}


def _axes(study: Study, rows: list[Row]) -> Iterator[list[Row]]:
    """Yield axes of the crossing: the listed rows, at their first factor, and each other factor."""
    in_rows = factors_in_rows(study)
    for factor, levels in study.factors.items():
        if factor not in in_rows:
            yield [{factor: level} for level in levels]
        elif rows:
            yield rows
            rows = []


def rows_of(study: Study) -> list[Row]:
    """Return the rows of the study's design; none where all factors are crossed."""
    design = study.design
    if design is None:
        return []
    if design.zip is not None:
        columns = [study.factors[name] for name in design.zip]
        return [dict(zip(design.zip, levels, strict=True)) for levels in zip(*columns, strict=True)]
    if design.is_sampled:
        rows = sample(design, study.seed)
    else:
        rows = study.listed_rows
    return [{POINT: i, **row} for i, row in enumerate(rows)] if POINT in study.factors else rows


def _ends_of(study: Study) -> list[Row]:
    spans = _ranges_of(study)
    middle: Row = {key: value_at(span, 0.5) for key, span in spans.items()}
    return [{**middle, key: value_at(spans[key], end)} for key in spans for end in (0.0, 1.0)]


def _ranges_of(study: Study) -> Mapping[str, ValueRange]:
    return study.design.ranges if study.design is not None else {}


def size(study: Study) -> int:
    """Return the number of cells in each part, without making them."""
    design = study.design
    in_rows = factors_in_rows(study)
    crossed = math.prod(len(levels) for f, levels in study.factors.items() if f not in in_rows)
    if design is None:
        return crossed
    if design.zip is not None:
        return crossed * len(study.factors[design.zip[0]])
    return crossed * (design.points or len(study.listed_rows))


def runs_of(study: Study) -> int:
    """Return the maximum number of runs, without listing them."""
    cells = size(study)
    trials = [part.replications or study.replications for part in study.parts.values()]
    has_reference = [part.reference is not None for part in study.parts.values()]
    each = sum((cells + more) * count for more, count in zip(has_reference, trials, strict=True))
    return each * study.most_persons + _runs_of_repeats(study)


def cells_of_repeats(study: Study) -> int:
    """Return the number of cells in the repeats of the answer."""
    factors = factors_of_repeats(study)
    return math.prod(map(len, factors.values())) if factors else 0


def _runs_of_repeats(study: Study) -> int:
    if study.robustness is None:
        return 0
    persons = min(study.robustness.persons, study.persons)
    return cells_of_repeats(study) * persons * study.robustness.replications


def factors_in_rows(study: Study) -> set[str]:
    """Return the factors whose levels stand in rows, and so do not cross each other."""
    design = study.design
    if design is not None and design.zip is not None:
        return set(design.zip)
    number = {POINT} & study.factors.keys()
    return number | set(keys_of(design, study.listed_rows))


def path_in_design(study: Study, key: str, value: Any) -> KeyPath | None:
    """Return the path of the design's key with that value; None if absent."""
    if study.design is not None and key in study.design.ranges:
        return "design", "ranges", key
    for index, row in enumerate(study.listed_rows):
        if key in row and row[key] == value:
            return "design", "rows", index, key
    return None
