"""Designs: which levels are combined, if not all with all.

Levels are listed, in the study or in a CSV file, or drawn as points of continuous factors: Latin
hypercubes, Sobol' sequences, and samples for Sobol' indices. The same seed gives the same points.
Values have six significant digits, so that the last bits of a machine's logarithm do not make
another configuration.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, model_validator

from dva_sim.experiments.study.parts import (
    POINT,
    SPARES_THE_DESIGN,
    Level,
    Levels,
    refuse_keys_of_the_design,
    says,
)
from dva_sim.kernel.config import Config
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import derive_seed
from dva_sim.kernel.yaml_files import MAX_VALUES, Document, KeyPath, parse_scalar, read_text

Row = dict[str, Level]

MAX_POINTS = 2**16
MAX_CELLS = 10_000  # of a grid, which listed rows may leave empty in part
MAX_RUNS = 1_000_000  # whose list takes a gigabyte, and whose runs take days of CPU time


class ValueRange(Config):
    """The values of a continuous factor, evenly spread on some scale.

    Attributes:
        low: Least value.
        high: Greatest value.
        scale: `linear`, `log` for even ratios, or `whole` for whole numbers.
    """

    low: float
    high: float
    scale: Literal["linear", "log", "whole"] = "linear"

    @model_validator(mode="after")
    def _ascends(self) -> ValueRange:
        if self.low >= self.high:
            raise ValueError(f"range should ascend, not go from {self.low:g} to {self.high:g}")
        if self.scale == "log" and self.low <= 0:
            raise ValueError(f"range on a log scale should be above zero, not from {self.low:g}")
        if self.scale == "whole" and not (self.low.is_integer() and self.high.is_integer()):
            raise ValueError("range of whole numbers should begin and end with one")
        return self


def _spelled_out(value: Any) -> Any:
    """Return a linear range for `[low, high]`."""
    if isinstance(value, list | tuple) and len(value) == 2:
        return {"low": value[0], "high": value[1]}
    return value


def _power_of_two(count: int) -> int:
    if count & (count - 1):
        below = 2 ** int(math.log2(count))
        raise ValueError(f"should be a power of 2, such as {below} or {2 * below}")
    return count


Ranges = dict[
    str,
    Annotated[
        ValueRange,
        BeforeValidator(_spelled_out, json_schema_input_type=ValueRange | tuple[float, float]),
    ],
]
Points = Annotated[int, Field(ge=2, le=MAX_POINTS)]
Dyadic = Annotated[
    Points,
    AfterValidator(_power_of_two),
    Field(json_schema_extra={"enum": [2**n for n in range(1, 17)]}),
]

Rows = Annotated[tuple[Annotated[Row, SPARES_THE_DESIGN], ...], Field(min_length=1)]

LISTED = ("zip", "rows", "csv")
SAMPLED = ("latin_hypercube", "sobol")
KINDS = (*LISTED, *SAMPLED)

_ONE_KIND: list[Any] = [
    *(says(kind, not_="ranges") for kind in LISTED),
    *(says(kind, "ranges") for kind in SAMPLED),
]


class Design(Config):
    """Experimental design: which levels are combined. One of the first five keys chooses how.

    Attributes:
        zip: Factors whose levels are taken together: the first of each, the second of each, ...
        rows: Levels of some factors, row by row; these are not declared as factors again.
        csv: File of such rows beside the study; its first line names the factors.
        latin_hypercube: Number of points in the ranges, one in each equal slice of each range.
        sobol: Number of points in the ranges by a scrambled Sobol' sequence; a power of 2.
        ranges: Continuous factors: `[low, high]`, or `{low, high, scale}`.
    """

    model_config = ConfigDict(json_schema_extra={"oneOf": _ONE_KIND})

    zip: Annotated[tuple[str, ...], Field(min_length=2)] | None = None
    rows: Rows | None = None
    csv: str | None = None
    latin_hypercube: Points | None = None
    sobol: Dyadic | None = None
    ranges: Annotated[Ranges, SPARES_THE_DESIGN] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _is_of_one_kind(self) -> Design:
        chosen = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(chosen) != 1:
            raise ValueError(f"should have one of {', '.join(KINDS)}")
        if self.is_sampled != bool(self.ranges):
            raise ValueError(f"{chosen[0]} {'needs' if self.is_sampled else 'has no'} ranges")
        return self

    @property
    def is_sampled(self) -> bool:
        """True if its rows are points in ranges."""
        return self.points > 0

    @property
    def points(self) -> int:
        """Number of points in ranges; 0 for listed levels."""
        return self.latin_hypercube or self.sobol or 0


def all_factors(
    design: Design | None, declared: Mapping[str, Levels], rows: Sequence[Row]
) -> dict[str, Levels]:
    """Return every factor with its levels: first those of the design, then declared ones.

    Listed levels come in the order met. Points in ranges have one factor, their number; so have
    listed rows whose levels are so many that their grid would be nearly empty.
    """
    if design is None or design.zip is not None:
        return dict(declared)
    if design.is_sampled:
        return {POINT: tuple(range(design.points)), **declared}
    levels = {key: tuple(dict.fromkeys(row[key] for row in rows)) for key in rows[0]}
    if math.prod(map(len, levels.values())) > MAX_CELLS:
        return {POINT: tuple(range(len(rows))), **declared}
    return {**levels, **declared}


def keys_of(design: Design | None, rows: Sequence[Row]) -> list[str]:
    """Return the factors that a design brings, beside those declared."""
    return [*(rows[0] if rows else ()), *(design.ranges if design is not None else ())]


Floats = NDArray[np.float64]

_DIGITS = 6


def sample(design: Design, seed: int) -> list[dict[str, Level]]:
    """Return the value of each continuous factor at each point, in order."""
    spans = design.ranges
    places = _places(design, len(spans), np.random.default_rng(derive_seed(seed, "design")))
    return [
        {
            key: value_at(span, float(u))
            for (key, span), u in zip(spans.items(), numbers, strict=True)
        }
        for numbers in places
    ]


def _places(design: Design, axes: int, rng: np.random.Generator) -> Floats:
    """Return points in the unit cube `(points, axes)`.

    References:
        McKay, Beckman & Conover, Technometrics 21 (1979), 239-245.
        Owen, Journal of Complexity 14 (1998), 466-489.
    """
    from scipy.stats import qmc  # late: start-up

    if design.sobol is not None:
        return np.asarray(qmc.Sobol(axes, rng=rng).random_base2(int(math.log2(design.sobol))))
    return np.asarray(qmc.LatinHypercube(axes, rng=rng).random(design.points))


def value_at(span: ValueRange, share: float) -> float | int:
    """Value at a share of the range from `low` to `high`."""
    if span.scale == "whole":
        return min(int(span.high), math.floor(span.low + share * (span.high - span.low + 1)))
    if span.scale == "log":
        value = span.low * (span.high / span.low) ** share
    else:
        value = span.low + share * (span.high - span.low)
    return float(f"{value:.{_DIGITS}g}")


ROWS = "rows"
_CELL = re.compile(r'("(?:[^"]|"")*"|[^,]*)(?:,|$)')


def read_table(path: Path) -> Document:
    """Return the rows of a CSV file, under the key `rows`, with the place of every level.

    Levels are read as YAML would read them: `0.5` is a number, `true` is true, `null` is nothing.

    Raises:
        ConfigError: unreadable, a row of another length, an empty cell, a key twice.
    """
    lines = read_text(path).split("\n")
    places: dict[KeyPath, tuple[int, int]] = {}
    header: list[str] = []
    rows: list[dict[str, Level]] = []
    for number, line, cells in _cells(path, lines):
        # Columns, from 1, at which cells begin; the pattern also finds the empty end.
        starts = [match.start() + 1 for match in _CELL.finditer(line)][: len(cells)]
        if not header:
            header = _header(path, number, starts, cells)
            continue
        if len(cells) != len(header):
            problem = f"row should have {len(header)} cells as the header has, not {len(cells)}"
            raise ConfigError(problem, path, number, 1)
        if len(places) > MAX_VALUES:
            raise ConfigError(f"has more than {MAX_VALUES} values", path, number, 1)
        places[ROWS, len(rows)] = (number, 1)
        row: dict[str, Level] = {}
        for key, text, start in zip(header, cells, starts, strict=True):
            places[ROWS, len(rows), key] = (number, start)
            row[key] = _level(path, number, start, key, text)
        rows.append(row)
    if not rows:
        raise ConfigError("should have a header of factors, and rows of levels", path, 1, 1)
    return Document({ROWS: rows}, path, places)


def _cells(path: Path, lines: list[str]) -> Iterator[tuple[int, str, list[str]]]:
    """Yield Number, text and cells of each line that is not blank.

    A cell does not go on to the next.
    """
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            (cells,) = csv.reader([line.rstrip("\r")], strict=True)
        except csv.Error as error:
            raise ConfigError(f"is not CSV: {error}", path, number, 1) from None
        yield number, line, cells


def _header(path: Path, number: int, starts: list[int], cells: list[str]) -> list[str]:
    keys = [cell.strip() for cell in cells]
    for index, (key, start) in enumerate(zip(keys, starts, strict=True)):
        if not key:
            raise ConfigError("a factor without a name", path, number, start)
        if key in keys[:index]:
            raise ConfigError(f"factor {key!r} appears twice", path, number, start)
        if ";" in key:
            raise ConfigError("cells are separated by commas, not by ;", path, number, start)
        try:
            refuse_keys_of_the_design([key])
        except ValueError as error:
            raise ConfigError(str(error), path, number, start) from None
    return keys


def _level(path: Path, line: int, column: int, key: str, text: str) -> Level:
    if not text.strip():
        raise ConfigError(f"no level of {key!r}; write null for none", path, line, column)
    try:
        level = parse_scalar(text.strip())
    except ConfigError as error:
        raise ConfigError(error.problem, path, line, column) from None
    if not isinstance(level, bool | int | float | str | None):
        raise ConfigError(f"{text.strip()!r} is not one level of {key!r}", path, line, column)
    if isinstance(level, float) and not math.isfinite(level):
        problem = f"level of {key!r} should be a finite number, not {level}"
        raise ConfigError(problem, path, line, column)
    return level
