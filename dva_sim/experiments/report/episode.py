"""Single run of a scenario on request: changed, played, drawn and kept.

Nothing is printed here; functions return lines about the files written.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from dva_sim.experiments.study.loading import pairs_of
from dva_sim.kernel.config_overrides import parse_changes
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.patterns import known_patterns
from dva_sim.options.runs import EpisodeOptions
from dva_sim.recordings.pictures import Wanted, joined
from dva_sim.recordings.reading import Opened, read_recording
from dva_sim.recordings.writing import check_target, write_recording
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import Recording, simulate
from dva_sim.simulation.models import AnyScenario, Tables, model_for, model_of
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.task import TaskScenario


@dataclass(frozen=True)
class Played:
    """One run.

    Attributes:
        kept: Whatever its model keeps of the run.
        took_s: By the clock [s].
    """

    scenario: AnyScenario
    seed: int
    kept: Any
    took_s: float

    @cached_property
    def tables(self) -> Tables:
        """Its rows, by table.

        Raises:
            ConfigError: it is too short for what is measured.
        """
        return model_for(self.scenario).rows(self.kept)


class EpisodeRequest:
    """Request to run one scenario, with changes, recording and pictures.

    Args:
        options: Scenario, its changes, and the files to write.

    Attributes:
        scenario: Name or path.
        changes: Keys to change, as `key=value`.
        pictures: Pictures to draw.

    Raises:
        ConfigError: options that do not go together, before anything is run.
    """

    def __init__(self, options: EpisodeOptions) -> None:
        self.scenario = str(options.scenario)
        self.seed = options.seed
        self.changes = pairs_of(options.set)
        self.pictures = Wanted.of(options)
        both = options.side_by_side
        self._patterns = None if both is None else joined(both)
        self._record = None if options.record is None else Path(options.record)
        if self._record is not None:
            if self._patterns is not None:
                raise ConfigError("--record keeps one run; it does not go with --side-by-side")
            check_target(self._record, options.overwrite)
        if self._patterns is not None and self.pictures.camera is not None:
            raise ConfigError("--camera shows one run; it does not go with --side-by-side")

    def scenarios(self) -> list[AnyScenario]:
        """Return scenarios to run: one, or two that differ by their pattern.

        Raises:
            ConfigError: it is not there or not valid, or its model has not what is asked for.
        """
        document = scenarios.load(self.scenario)
        changes = parse_changes(self.changes)
        model = model_of(document)
        built = model.build(document, changes)
        if not isinstance(built, Scenario):
            self._check_other(built)
            return [built]
        self.pictures.check(built)
        if self._patterns is None:
            return [built]
        patterns = _two_patterns(self._patterns)
        return [scenarios.build(document, changes | {"pattern": each}) for each in patterns]

    def _check_other(self, scenario: AnyScenario) -> None:
        """Reject options that only the full model supports, before anything runs."""
        it = f"{self.scenario} is a {scenario.model} scenario"
        if self._record is not None:
            raise ConfigError(f"{it}: only full ones are recorded")
        if self._patterns is not None:
            raise ConfigError(f"{it}: only full ones run twice")
        if self.pictures.any and not isinstance(scenario, TaskScenario):
            raise ConfigError(f"{it}: there is nothing to see")
        if self.pictures.any and not self.pictures.is_plain_still:
            raise ConfigError(f"{it}: only --still shows something of it")

    def play(self, scenario: AnyScenario) -> Played:
        """Run one of its scenarios."""
        started = time.perf_counter()
        if isinstance(scenario, Scenario):
            run = simulate(scenario, self.seed, self.pictures.any or self._record is not None)
        else:
            run = model_for(scenario).simulate(scenario, self.seed)
        return Played(scenario, self.seed, run, time.perf_counter() - started)

    def write(self, runs: Sequence[Played]) -> Iterator[str]:
        """Write the requested files; return a line with the kind and path of each.

        Raises:
            ConfigError: a moment after the run ended, or a file that cannot be written.
        """
        first = runs[0]
        pictures = self.pictures
        recordings = [run.kept for run in runs if isinstance(run.kept, Recording)]
        if self._record is not None:
            about = {"scenario": self.scenario}
            write_recording(recordings[0], self._record, tables=first.tables, about=about)
            yield f"Recording: {self._record}"
        if recordings and pictures.any:
            yield from pictures.write(recordings)
        elif isinstance(first.scenario, TaskScenario) and pictures.still is not None:
            from dva_sim.experiments.report.figures.trial import draw_trial  # late: start-up

            draw_trial(first.scenario, self.seed, pictures.still)
            yield f"Still: {pictures.still}"


def doubts(played: Sequence[AnyScenario]) -> list[str]:
    """List the scenarios' contradictory settings, one sentence each, without duplicates."""
    every = (model_for(scenario).contradictions(scenario) for scenario in played)
    return list(dict.fromkeys(doubt for of_one in every for doubt in of_one))


def open_recording(file: Path, pictures: Wanted) -> Opened:
    """Return a recorded run that is to be drawn.

    Raises:
        ConfigError: not a recording, or what is asked for is not in it.
    """
    opened = read_recording(file)
    pictures.check(opened.playback.scenario)
    return opened


def write_replay(opened: Opened, pictures: Wanted, ros2: Path | None) -> Iterator[str]:
    """Draw a recorded run, and take it to ROS 2; a line for each file.

    Raises:
        ConfigError: a moment after the run ended, or what cannot be written.
    """
    if pictures.any:
        yield from pictures.write([opened.playback])
    if ros2 is not None:
        from dva_sim.recordings.ros2 import write_bag  # late: start-up

        write_bag(opened.playback, ros2)
        yield f"ROS 2 bag: {ros2}"


def _two_patterns(text: str) -> list[str]:
    patterns = [p.strip() for p in text.split(",")]
    if len(patterns) != 2 or any(":" not in p and p not in known_patterns() for p in patterns):
        valid = f"two of {', '.join(known_patterns())}, as in req-rep,latest-wins"
        raise ConfigError(f"--side-by-side {text!r} should name {valid}")
    return patterns
