"""The document of the comparison: where measurements come from, and what is measured here.

Our own conditions are a design: in each block every link meets every pair of programs.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from dva_sim import resources
from dva_sim.config import Config, load_yaml, validate
from dva_sim.errors import ConfigError
from dva_sim.experiments.validation.network.measured import FOLDER, SourceConfig
from dva_sim.guesses import unknown
from dva_sim.network.condition import CONDITION, Condition

SHIPPED = "network"

Settings = dict[str, float | int | str | bool]


class BlockConfig(Config):
    """Links and programs that are crossed.

    Attributes:
        group: Name of the block in the tables.
        seeds: Runs of each condition, each with luck of its own.
        settings: What is the same in the whole block, by column of a condition.
        links: What lies between, by name.
        programs: What the two ends do, by name.
    """

    group: str
    seeds: Annotated[int, Field(ge=1, le=100)] = 1
    settings: Settings = Field(default_factory=dict)
    links: dict[str, Settings]
    programs: dict[str, Settings]


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
    """

    reference: SourceConfig
    own: OwnConfig

    @property
    def sources(self) -> dict[str, SourceConfig]:
        """The tables there are, by name."""
        own = {"own": self.own.table} if self.own.table is not None else {}
        return {"reference": self.reference} | own


def load_plan(name: str = SHIPPED) -> PlanConfig:
    """The document, by name or path.

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
    """Every link with every pair of programs.

    Raises:
        ConfigError: a setting that no condition has.
    """
    found = []
    for link in block.links.values():
        for programs in block.programs.values():
            settings = {**block.settings, **link, **programs}
            if odd := settings.keys() - set(CONDITION):
                raise ConfigError(unknown("setting", min(odd), CONDITION))
            try:
                found.append(Condition.from_row(settings))
            except TypeError:
                problem = f"block {block.group!r} does not say which pattern and how many hz"
                raise ConfigError(problem) from None
    return found
