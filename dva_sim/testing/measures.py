"""Checks of user-defined measures, on short runs of the models that they read."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.plugins import FAILURES
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.models import MODELS, Model, model_of
from dva_sim.simulation.run_measures import RunMeasure, load_measure, reads
from dva_sim.testing.promises import Case, Outcome, broken_in, is_slow, kept, part_by_part

SHORT: Final[dict[str, tuple[tuple[str, Mapping[str, Any]], ...]]] = {
    "full": (
        ("drive-to-event", {"horizon_s": 40}),
        ("evacuation", {"horizon_s": 20, "robot.count": 1, "operator.count": 1}),
    ),
    "timed": (("patrol-shift", {"warm_up_s": 0, "horizon_s": 1800}),),
    "task": (
        ("tasks/fitts-lag", {"trials": 1, "practice": 0}),
        ("tasks/corner", {"trials": 1, "practice": 0, "task.width_m": [1.2]}),
    ),
    "transports": (("congested-link", {"measure_s": 5, "warm_up_s": 2}),),
    "middleware": (("commands-over-middleware", {"measure_s": 1, "set_up_s": 2}),),
}
"""Scenarios that are run of each model, made short."""
SEED: Final = 1  # random seed of the runs
SLOW: Final = 1.0  # time of an answer above which a study takes much longer [s]


def check_measure(
    measure: str | Callable[[], RunMeasure],
    options: Mapping[str, Any] | None = None,
    *,
    slow: float = SLOW,
) -> Outcome:
    """See that a measure keeps what every measure promises, on runs of our models.

    One of a user's own model is tried with that.

    Args:
        measure: Name, as in a study, or its class.
        options: It has none.
        slow: An answer that takes longer earns a warning [s].

    Raises:
        BrokenPromises: it does not; a line for each promise.
        ConfigError: there is none of that name, it cannot be made, it reads none of our models,
            or options were given.
    """
    if options:
        raise ConfigError(f"measure {measure!r} has no option {next(iter(options))!r}; it has none")
    make = type(load_measure(measure)) if isinstance(measure, str) else measure
    models = [name for name in MODELS if reads(make(), name)]
    if not models:
        raise ConfigError(f"should read one of our models to be tried: models = {tuple(MODELS)}")
    trial = _Trial(make, models)
    broken = broken_in(part_by_part((trial.says_what_it_is, trial.answer_all)))
    slowest = max(trial.took, default=0.0)
    is_mute = not broken and not any(map(math.isfinite, trial.answers))
    warnings = ["says nothing of any run that was tried"] * is_mute
    return kept(broken, warnings + is_slow(slowest, slow, "an answer"), len(trial.took), slowest)


class _Trial:
    """All that is tried with one measure.

    Attributes:
        took: Duration of each answer [s].
        answers: Answer for each run, nan for None.
    """

    def __init__(self, make: Callable[[], RunMeasure], models: list[str]) -> None:
        self._make = make
        self._models = models
        self._used = make()
        self.took = list[float]()
        self.answers = list[float]()

    def says_what_it_is(self) -> Iterator[Case]:
        """Yield its name, its meaning and its bounds."""
        about = self._used.about
        if not about.meaning.strip():
            yield "does not say what it means", f"about.meaning of {about.name!r} is empty"
        low, high = about.bounds
        if not low <= high:
            yield "has bounds that nothing is within", f"{low:g} to {high:g}"
        if any(about.name == c.name for name in self._models for c in MODELS[name].columns["runs"]):
            yield "is called as another measure is", about.name

    def answer_all(self) -> Iterator[Case]:
        """Check the answers for short runs of all models that it reads."""
        for name in self._models:
            for scenario, changes in SHORT[name]:
                document = scenarios.load(scenario)
                model = model_of(document)
                built = model.build(document, changes)
                runs = [model.simulate(built, SEED) for _ in range(2)]
                yield from self._of_run(model, runs, f"of {scenario}, seed {SEED}")

    def _of_run(self, model: Model[Any], runs: list[Any], where: str) -> Iterator[Case]:
        """Check the answers for a run, for the same run again, and for a replaced copy."""
        before = repr(model.rows(runs[0], with_tracks=True))  # in which missing numbers are alike
        first = self._ask(self._used, runs[0])
        if not _is_answer(first):
            yield "answers what is no finite number and not None", f"{first!r} {where}"
            return
        value = math.nan if first is None else float(first)
        low, high = self._used.about.bounds
        if value < low or value > high:
            yield "leaves its bounds", f"{value:g} {where}; bounds {low:g} to {high:g}"
        if not _is_as_before(model, runs[0], before):
            yield "changes the recording", where
            return
        again = self._ask(self._used, runs[0]), self._ask(self._make(), runs[1])
        if not _same(first, again[0]):
            yield "answers differently when it is asked again", f"{first!r}, {again[0]!r} {where}"
        elif not _same(first, again[1]):
            yield "a new copy answers differently", f"{first!r}, {again[1]!r} {where}"
        self.answers.append(value)

    def _ask(self, measure: RunMeasure, recording: Any) -> Any:
        started = time.perf_counter()
        answer = measure.of(recording)
        self.took.append(time.perf_counter() - started)
        return answer


def _is_answer(value: Any) -> bool:
    if value is None:
        return True
    try:
        return not isinstance(value, str) and math.isfinite(value)
    except TypeError:
        return False


def _same(one: Any, other: Any) -> bool:
    return bool(one == other) if _is_answer(other) else False


def _is_as_before(model: Model[Any], recording: Any, before: str) -> bool:
    """Return True if all other measures of a recording are unchanged."""
    try:
        return repr(model.rows(recording, with_tracks=True)) == before
    except FAILURES:
        return False
