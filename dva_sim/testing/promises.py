"""What came of trying something that users bring, and problems that were found in a file.

Kinds of things that are tried rather than read: what `check` may be told to try, by word.

An index, not the things: modules are named, and imported when one of their kind is asked for.
To add a kind, add its `Trial` here, and the module that its `check` names.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from dva_sim.kernel.plugins import FAILURES

if TYPE_CHECKING:
    from dva_sim.kernel.plugins import Plugins


Case = tuple[str, str]  # a promise in words, and what happened


@dataclass(frozen=True)
class Outcome:
    """What came of trying it.

    Attributes:
        broken: One line for each promise that it broke, with the first case.
        warnings: The same of what is made good when it runs, or what is only slow.
        tries: How often it was tried.
        slowest: Its longest answer [s].
    """

    broken: tuple[str, ...]
    warnings: tuple[str, ...]
    tries: int
    slowest: float


class BrokenPromises(AssertionError):
    """Something breaks what all of its kind promise; a line for each promise.

    Attributes:
        outcome: All that came of trying it.
    """

    def __init__(self, outcome: Outcome) -> None:
        super().__init__("\n".join(outcome.broken))
        self.outcome = outcome


def kept(outcome: Outcome) -> Outcome:
    """What came of it, if all promises were kept.

    Raises:
        BrokenPromises: they were not.
    """
    if outcome.broken:
        raise BrokenPromises(outcome)
    return outcome


def part_by_part(parts: Iterable[Callable[[], Iterable[Case]]]) -> Iterator[Case]:
    """What the first part finds broken that finds anything: each builds on those before it."""
    for part in parts:
        try:
            broken = list(part())
        except FAILURES as error:
            broken = [("raises", said(error))]
        yield from broken
        if broken:
            return


def line(promise: str, cases: Sequence[str]) -> str:
    """A promise with the first case in which it was broken."""
    more = f"; and {len(cases) - 1} times more" if len(cases) > 1 else ""
    return f"{promise}: {cases[0]}{more}"


def said(error: BaseException) -> str:
    """An error in one line, with the line of the file that it comes from."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return f"{text} ({frame.filename.rsplit('/', 1)[-1]}:{frame.lineno})"


@dataclass(frozen=True)
class CheckedKind:
    """How one kind is tried.

    Attributes:
        kind: The word for one: `dva-sim check KIND NAME`.
        plugins: Where its `Plugins` are: `module:NAME`.
        check: What tries one, by name or as a class, with options: `module:function`.
        told: How it was tried, in words, with `{tries}`, and `{ms}` or `{us}` of the slowest.
        folder: Of the files that are named, where it is not the class itself that is.
    """

    kind: str
    plugins: str
    check: str
    told: str
    folder: str = ""

    @property
    def many(self) -> str:
        """What several are called."""
        return plural(self.kind)

    def load_plugins(self) -> Plugins[Any]:
        """What users may add of this kind."""
        found: Plugins[Any] = _named(self.plugins)
        return found

    def known(self) -> list[str]:
        """Names that are shipped or installed."""
        from dva_sim.kernel.resources import available  # late: start-up

        return sorted(available(self.folder)) if self.folder else self.load_plugins().known()

    def run(self, name: str, options: Mapping[str, Any]) -> Outcome:
        """Try the one of a name.

        Raises:
            ConfigError: it cannot be had.
        """

        try:
            outcome: Outcome = self.load_check()(name, options)
        except BrokenPromises as error:
            return error.outcome
        return outcome

    def load_check(self) -> Callable[..., Outcome]:
        """What users call in tests of their own."""
        found: Callable[..., Outcome] = _named(self.check)
        return found

    def ways(self, outcome: Outcome) -> str:
        """How it was tried, in words."""
        slowest = outcome.slowest
        return self.told.format(tries=outcome.tries, ms=1e3 * slowest, us=1e6 * slowest)


def plural(kind: str) -> str:
    """What several of a kind are called."""
    return f"{kind.removesuffix('y')}ies" if kind.endswith("y") else f"{kind}s"


def _named(place: str) -> Any:
    """What `module:name` names."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


TRIALS: Final[dict[str, CheckedKind]] = {
    trial.kind: trial
    for trial in (
        CheckedKind(
            "pattern",
            "dva_sim.network.patterns:PLUGINS",
            "dva_sim.testing.patterns:check_pattern",
            "{tries} drives, {us:.0f} microseconds a command",
        ),
        CheckedKind(
            "policy",
            "dva_sim.core.dispatch:PLUGINS",
            "dva_sim.testing.policies:check_policy",
            "{tries} situations, slowest decision {ms:.1f} ms",
        ),
        CheckedKind(
            "operator",
            "dva_sim.agents.operator.strategies.loading:PLUGINS",
            "dva_sim.testing.operators:check_operator",
            "{tries} drives, {us:.0f} microseconds a frame",
        ),
        CheckedKind(
            "filter",
            "dva_sim.agents.tilt.filters:PLUGINS",
            "dva_sim.testing.tilt:check_filter",
            "{tries} runs, {us:.1f} microseconds a reading",
        ),
        CheckedKind(
            "mapping",
            "dva_sim.agents.tilt.mappings:PLUGINS",
            "dva_sim.testing.tilt:check_mapping",
            "{tries} runs, {us:.1f} microseconds a reading",
        ),
        CheckedKind(
            "hazard",
            "dva_sim.worlds.hazards.registry:PLUGINS",
            "dva_sim.testing.hazards:check_hazard",
            "{tries} questions, {us:.0f} microseconds an answer",
        ),
        CheckedKind(
            "measure",
            "dva_sim.simulation.run_measures:PLUGINS",
            "dva_sim.testing.measures:check_measure",
            "{tries} runs, {ms:.1f} ms an answer",
        ),
        CheckedKind(
            "model",
            "dva_sim.simulation.models:PLUGINS",
            "dva_sim.testing.models:check_model",
            "{tries} runs, slowest {ms:.0f} ms",
        ),
        CheckedKind(
            "figure",
            "dva_sim.experiments.report.figures.registry:PLUGINS",
            "dva_sim.testing.figures:check_figure",
            "{tries} drawings, slowest {ms:.0f} ms",
        ),
        CheckedKind(
            "measure",
            "dva_sim.simulation.run_measures:PLUGINS",
            "dva_sim.testing.measures:check_measure",
            "{tries} answers, slowest {ms:.1f} ms",
        ),
        CheckedKind(
            "model",
            "dva_sim.simulation.models:PLUGINS",
            "dva_sim.testing.models:check_model",
            "{tries} runs, slowest {ms:.0f} ms",
        ),
        CheckedKind(
            "robot",
            "dva_sim.worlds.drives:PLUGINS",
            "dva_sim.testing.robots:check_robot",
            "{tries} drives, {us:.0f} microseconds a tick",
            folder="agents/robots",
        ),
    )
}
