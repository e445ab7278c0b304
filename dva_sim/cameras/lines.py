"""Lines sent to the process that draws pictures; times are of the run's clock [ms]."""

from __future__ import annotations

from typing import Any, Literal, Protocol, TypeAlias

from typing_extensions import TypedDict


class DrawnSceneLine(TypedDict):
    """Everything that can appear in a picture."""

    k: Literal["scene"]
    t: int
    scenario: dict[str, Any]
    seed: int


class ContainedLine(TypedDict):
    """The containment of a hazard, with its time."""

    k: Literal["contain"]
    t: int
    n: int


class FrameLine(TypedDict):
    """The state of the world when a frame that has arrived was taken.

    `figures`: kind, number, position [m], heading [rad] and activity of each.
    """

    k: Literal["frame"]
    t: int
    robot: int
    number: int
    captured_ms: int
    pose: list[float]
    figures: list[list[Any]]


class PictureLine(TypedDict):
    """A picture that a real camera has taken; `jpeg` is base64."""

    k: Literal["picture"]
    t: int
    robot: int
    number: int
    captured_ms: int
    jpeg: str


class ReadyLine(TypedDict):
    """Note that all pictures come from real cameras, so that no scene has to be built."""

    k: Literal["ready"]
    t: int


PaintersLine: TypeAlias = DrawnSceneLine | ContainedLine | FrameLine | PictureLine | ReadyLine


class Show(Protocol):
    """Takes lines for the drawing process, with a key where only the newest line counts."""

    def __call__(self, line: PaintersLine, key: object = "", /) -> object:
        """Take a line."""


def contained_line(number: int, when: float) -> ContainedLine:
    """Return the line for the containment of a hazard at a time [s]."""
    return {"k": "contain", "t": round(1000 * when), "n": number}


def scene_line(scenario: dict[str, Any], seed: int) -> DrawnSceneLine:
    """Return everything that can appear in a picture, as the scenario's plain data."""
    return {"k": "scene", "t": 0, "scenario": scenario, "seed": seed}
