"""Office blocks of any size, from a seed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dva_sim.config import Config
from dva_sim.worlds.drawing import Feature


class OfficeBlock(Config):
    """An office block: which one, and how large."""

    kind: Literal["office_block"] = "office_block"
    seed: Annotated[int, Field(ge=0)] = 1
    width_m: Annotated[float, Field(ge=24, le=300)] = 60.0
    depth_m: Annotated[float, Field(ge=12, le=200)] = 40.0


def office_block(block: OfficeBlock) -> tuple[Feature, ...]:
    """Its features."""
    return ()
