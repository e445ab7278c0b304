"""The lines that whoever draws is told; times are of the run's clock [ms]."""

from __future__ import annotations

from typing import Any, Literal, Protocol, TypeAlias

from typing_extensions import TypedDict


class DrawnSceneLine(TypedDict):
    """What there is to be seen."""

    k: Literal["scene"]
    t: int
    scenario: dict[str, Any]
    seed: int


class ContainedLine(TypedDict):
    """A hazard is contained, at a time."""

    k: Literal["contain"]
    t: int
    n: int


class FrameLine(TypedDict):
    """What was true when a frame was taken that has arrived.

    `figures`: of each the kind, number, place [m], heading [rad] and what it does.
    """

    k: Literal["frame"]
    t: int
    robot: int
    number: int
    captured_ms: int
    pose: list[float]
    figures: list[list[Any]]


PaintersLine: TypeAlias = DrawnSceneLine | ContainedLine | FrameLine


class Show(Protocol):
    """Takes lines for whoever draws, and a key for those of which the newest counts."""

    def __call__(self, line: PaintersLine, key: object = "", /) -> object:
        """Take one."""


def contained_line(number: int, when: float) -> ContainedLine:
    """A hazard is contained at a time [s]."""
    return {"k": "contain", "t": round(1000 * when), "n": number}


def scene_line(scenario: dict[str, Any], seed: int) -> DrawnSceneLine:
    """What there is to be seen, by the scenario as plain data."""
    return {"k": "scene", "t": 0, "scenario": scenario, "seed": seed}
