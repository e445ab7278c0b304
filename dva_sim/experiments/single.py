"""Single runs for programs and notebooks, played now or read from a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim import scenario as scenarios
from dva_sim.changing import parse_changes
from dva_sim.experiments.dictionary import describe
from dva_sim.experiments.frames import Frame, frame_of, plain
from dva_sim.experiments.models import AnyScenario, Tables, model_of, tables_of
from dva_sim.experiments.opening import mistakes_of
from dva_sim.experiments.settings import Settings, pairs_of
from dva_sim.guesses import listed
from dva_sim.scenario import Scenario, contradictions

if TYPE_CHECKING:
    from dva_sim.experiments.pictures import Wanted


@dataclass(frozen=True)
class Episode:
    """One run of one scenario.

    Attributes:
        scenario: As it was run.
        seed: Of its luck.
        tables: Its rows as columns, by table: `runs`, `events`, ...
    """

    scenario: AnyScenario
    seed: int
    tables: dict[str, Frame]

    @property
    def warnings(self) -> list[str]:
        """What in the scenario does not go together, each in a sentence."""
        return contradictions(self.scenario) if isinstance(self.scenario, Scenario) else []

    @property
    def measures(self) -> dict[str, Any]:
        """The one row of the table of runs."""
        return {name: values.tolist()[0] for name, values in self.tables["runs"].items()}

    def __repr__(self) -> str:
        """What came out of it, and what to ask it for."""
        told = {name: plain(value) for name, value in self.measures.items()}
        some = listed(f"{name} {value}" for name, value in told.items() if value)
        tables = ", ".join(f"{name} ({table.rows})" for name, table in self.tables.items())
        head = f"Episode of a {self.scenario.model} scenario, seed {self.seed}"
        return "\n".join((head, f"measures: {some}", f"tables: {tables}"))

    def _repr_html_(self) -> str:
        told = describe("runs", list(self.measures), [self.scenario.model], [])
        rows = [
            f"<tr><td>{escape(c.name)}</td><td>{escape(plain(self.measures[c.name]))}</td>"
            f"<td>{escape(c.meaning)}</td></tr>"
            for c in told
        ]
        return f"<table>{''.join(rows)}</table>"


def episode(
    scenario: str | Path,
    seed: int = 1,
    *,
    set: Settings = (),
    video: str | Path | None = None,
    still: str | Path | None = None,
    strip: str | Path | None = None,
    at: float | str | Sequence[float] | None = None,
    panels: int = 6,
    camera: str | None = None,
    inset: bool = False,
    side_by_side: str | Sequence[str] | None = None,
    record: str | Path | None = None,
) -> Episode:
    """Run one scenario once, and draw or keep it if asked to.

    Args:
        scenario: By name or path.
        seed: Of its luck.
        set: Keys to change, as a mapping or as `key=value` pairs.
        video: Write a film: `.gif` or `.mp4`.
        still: Write one moment: `.png`, `.pdf` or `.svg`.
        strip: Write several moments in one figure, likewise.
        at: Moment of the still, or moments of the strip [s].
        panels: Moments in a strip.
        camera: The still shows what this robot's camera sees.
        inset: Show in the film what a robot's camera sees.
        side_by_side: Run and draw the same seed under two patterns; the episode is that of the
            first.
        record: Keep the run as a file: `.mcap`.

    Raises:
        ConfigError: there is none, it is not valid with these changes, or it cannot be drawn so.
    """
    wanted = _wanted(video, still, strip, at, panels, camera, inset)
    sides = None if side_by_side is None else _joined(side_by_side)
    kept, pairs = None if record is None else Path(record), pairs_of(set)
    with mistakes_of(str(scenario), pairs, seed):
        built, tables = _played(str(scenario), pairs, seed, wanted, sides, kept)
    return Episode(built, seed, {name: frame_of(rows) for name, rows in tables.items()})


def _played(
    scenario: str,
    pairs: list[str],
    seed: int,
    wanted: Wanted,
    sides: str | None,
    kept: Path | None,
) -> tuple[AnyScenario, Tables]:
    """The scenario as it was run, and its rows by table."""
    from dva_sim.experiments import console
    from dva_sim.experiments.metrics import track_rows

    document = scenarios.load(scenario)
    model = model_of(document)
    built = model.build(document, parse_changes(pairs))
    run = None
    if wanted.any or sides is not None or kept is not None:
        run = console.episode(scenario, seed, pairs, sides, wanted, kept, console.nowhere())
    if run is None:
        return built, model.tables(built, seed, with_tracks=True)
    return run.scenario, tables_of(run) | {"tracks": track_rows(run)}


def replay(
    file: str | Path,
    *,
    video: str | Path | None = None,
    still: str | Path | None = None,
    strip: str | Path | None = None,
    at: float | str | Sequence[float] | None = None,
    panels: int = 6,
    camera: str | None = None,
    inset: bool = False,
    ros2: str | Path | None = None,
) -> Episode:
    """A recorded run from its file alone, drawn or taken to ROS 2 if asked to; see `episode`.

    Raises:
        ConfigError: not a recording, or what is asked for is not in it.
    """
    from dva_sim.experiments import console, replaying

    wanted = _wanted(video, still, strip, at, panels, camera, inset)
    bag = None if ros2 is None else Path(ros2)
    opened = replaying.replay(Path(file), wanted, bag, console.nowhere())
    run, tables = opened.playback, opened.tables or {}
    return Episode(run.scenario, run.seed, {name: frame_of(rows) for name, rows in tables.items()})


def _wanted(
    video: str | Path | None,
    still: str | Path | None,
    strip: str | Path | None,
    at: float | str | Sequence[float] | None,
    panels: int,
    camera: str | None,
    inset: bool,
) -> Wanted:
    from dva_sim.experiments.pictures import Wanted

    film, moment, moments = (None if p is None else Path(p) for p in (video, still, strip))
    times = None if at is None else _joined(at)
    return Wanted(film, moment, moments, times, panels, camera, inset)


def _joined(words: object) -> str:
    """One word or number, or several, as on the command line."""
    several = words if isinstance(words, list | tuple) else [words]
    return ",".join(map(str, several))
