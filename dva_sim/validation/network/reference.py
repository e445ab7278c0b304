"""Measurements on real sockets: the document that names them, the tables, and the design of ours.

The reference is shipped; our own conditions are a design, in each block of which every link
meets every pair of programs.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.network.pattern_runs import CONDITION, Condition

FOLDER = "experiments/validation"
NUMBERS = (
    *("n_sent", "n_applied", "n_distinct", "send_hz", "applied_hz", "skip_frac", "first_seq"),
    *("age_mean", "age_p50", "age_p95", "rtt_p50", "rtt_p95", "stale_p50", "stale_p95"),
    *("timeouts", "alerts", "t_conn_ms", "t_hs_ms"),
    *("emu_tail_ab", "emu_tail_ba", "emu_late_p99_ms"),
)
"""Columns of results that a table of measurements must have."""


class SourceConfig(Config):
    """A table of measurements and where it comes from.

    Attributes:
        file: CSV file, beside the document or by path.
        made_with: Versions of libraries and kernel, and the machine.
        independent: Groups of runs with independent random numbers. The others share one seed, so
            nothing can be concluded from them under loss. By default all are independent.
        realtime: True if the emulated link had real-time priority where the table does not say.
    """

    file: str
    made_with: dict[str, str]
    independent: tuple[str, ...] | None = None
    realtime: bool = False


@dataclass(frozen=True)
class SocketRun:
    """One run on real sockets.

    Attributes:
        source: `reference` or `own`.
        group: Block of the design it belongs to.
        seed: Random seed of the emulated link.
        independent: True if no other condition had the same random numbers.
        realtime: True if the emulated link had real-time priority.
        values: Measured values by column; nan where not defined.
    """

    condition: Condition
    source: str
    group: str
    seed: int
    independent: bool
    realtime: bool
    values: Mapping[str, float]


def load_runs(sources: Mapping[str, SourceConfig]) -> list[SocketRun]:
    """Return every run of some tables, in their order.

    Raises:
        ConfigError: a table cannot be read, or something in it is not as it should be.
    """
    return [run for name, source in sources.items() for run in read_runs(name, source)]


def read_runs(name: str, source: SourceConfig) -> list[SocketRun]:
    """Return the runs of one table.

    Raises:
        ConfigError: it cannot be read, or something in it is not as it should be.
    """
    path = resources.find(source.file, FOLDER, ".csv")
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ConfigError(f"cannot be read: {error}", str(path)) from None
    if not rows:
        raise ConfigError("holds no runs, so there is nothing to compare with", str(path))
    missing = [c for c in ("group", "seed", *NUMBERS) if c not in rows[0]]
    if missing:
        raise ConfigError(f"has no column {', '.join(missing)}", str(path))
    return [_run(name, source, row, str(path), line) for line, row in enumerate(rows, start=2)]


def _run(name: str, source: SourceConfig, row: dict[str, str], path: str, line: int) -> SocketRun:
    try:
        condition = Condition.from_row(row)
        values = {column: _number(row[column]) for column in NUMBERS}
        seed = int(row["seed"])
        realtime = bool(int(row["realtime"])) if row.get("realtime") else source.realtime
    except (ConfigError, ValueError, KeyError) as error:
        raise ConfigError(str(error), path, line, 1) from None
    own = source.independent is None or row["group"] in source.independent
    return SocketRun(
        condition=condition,
        source=name,
        group=row["group"],
        seed=seed,
        independent=own,
        realtime=realtime,
        values=values,
    )


def _number(text: str) -> float:
    return float(text) if text else math.nan


SHIPPED = "network"

ConditionSettings = dict[str, float | int | str | bool]


class BlockConfig(Config):
    """Links and programs that are crossed.

    Attributes:
        group: Name of the block in the tables.
        seeds: Number of runs of each condition, each with random numbers of its own.
        settings: Settings common to the whole block, by column of a condition.
        links: Settings of the links, by name.
        programs: Settings of the programs at both ends, by name.
    """

    group: str
    seeds: Annotated[int, Field(ge=1, le=100)] = 1
    settings: ConditionSettings = Field(default_factory=dict)
    links: dict[str, ConditionSettings]
    programs: dict[str, ConditionSettings]


class OwnConfig(Config):
    """Our own measurements.

    Attributes:
        table: The table that they are kept in, and how it was made; left out before there is one.
        blocks: The design.
    """

    table: SourceConfig | None = None
    blocks: tuple[BlockConfig, ...]


class PlanConfig(Config):
    """The whole document.

    Attributes:
        reference: The measurements that are shipped.
        own: Those of our own campaign.
        causes: Causes of conditions that miss, by their labels, as far as known.
    """

    reference: SourceConfig
    own: OwnConfig
    causes: dict[str, str] = Field(default_factory=dict)

    @property
    def sources(self) -> dict[str, SourceConfig]:
        """Tables by name."""
        own = {"own": self.own.table} if self.own.table is not None else {}
        return {"reference": self.reference} | own


def load_plan(name: str = SHIPPED) -> PlanConfig:
    """Return the document, by name or path.

    Raises:
        ConfigError: no such file, or a mistake in it, with its place.
    """
    document = load_yaml(resources.find(name, FOLDER))
    plan = validate(PlanConfig, document.data, document.error)
    try:
        for block in plan.own.blocks:
            conditions_of(block)
    except ConfigError as error:
        raise document.error(str(error), ("own", "blocks")) from None
    return plan


def conditions_of(block: BlockConfig) -> list[Condition]:
    """Return every link with every pair of programs.

    Raises:
        ConfigError: a setting that no condition has.
    """
    conditions = []
    for link in block.links.values():
        for programs in block.programs.values():
            settings = {**block.settings, **link, **programs}
            if odd := settings.keys() - set(CONDITION):
                raise ConfigError(unknown("setting", min(odd), CONDITION))
            try:
                conditions.append(Condition.from_row(settings))
            except TypeError:
                problem = f"block {block.group!r} does not say which pattern and how many hz"
                raise ConfigError(problem) from None
    return conditions
