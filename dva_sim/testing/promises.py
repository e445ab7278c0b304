"""Kinds of plug-ins that are tried rather than read, and the outcomes of trials.

`TRIALS` is an index, not the things: modules are named, and imported when one of their kind is
asked for. To add a kind, add it there, and the module whose `check_KIND` tries one.
"""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from dva_sim.testing.shipped_words import shipped_words

if TYPE_CHECKING:
    from dva_sim.kernel.plugins import Plugins

Case = tuple[str, str]  # a promise in words, and what happened


@dataclass(frozen=True)
class Outcome:
    """Result of checking a plug-in.

    Attributes:
        broken: One line for each promise that it broke, with the first case.
        warnings: Faults that are corrected at run time, and slowness.
        tries: Number of tries.
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


def kept(broken: Sequence[str], warnings: Sequence[str], tries: int, slowest: float) -> Outcome:
    """Return the outcome, or raise if a promise was broken; see `Outcome`.

    Raises:
        BrokenPromises: they were not.
    """
    outcome = Outcome(tuple(broken), tuple(warnings), tries, slowest)
    if broken:
        raise BrokenPromises(outcome)
    return outcome


def tried(check: Callable[..., Outcome], *arguments: Any, **options: Any) -> Outcome:
    """Run a check and return its outcome, even if promises were broken.

    Raises:
        ConfigError: there is nothing to try.
    """
    try:
        return check(*arguments, **options)
    except BrokenPromises as error:
        return error.outcome


def broken_in(cases: Iterable[Case]) -> list[str]:
    """Return a line for each promise that is broken, with the first case of it."""
    breaches: dict[str, list[str]] = {}
    for promise, case in cases:
        breaches.setdefault(promise, []).append(case)
    return [line(promise, cases_of_promise) for promise, cases_of_promise in breaches.items()]


def is_slow(slowest: float, slow: float, what: str) -> list[str]:
    """Return a warning where one takes longer than it should [s]."""
    return [f"is slow: {slowest:.2g} s {what}; should be {slow:g} s"] * (slowest > slow)


def part_by_part(parts: Iterable[Callable[[], Iterable[Case]]]) -> Iterator[Case]:
    """Yield the faults of the first part that has any: later parts build on earlier ones."""
    from dva_sim.kernel.plugins import FAILURES  # late: start-up

    for part in parts:
        try:
            broken = list(part())
        except FAILURES as error:
            broken = [("raises", error_with_line(error))]
        yield from broken
        if broken:
            return


def line(promise: str, cases: Sequence[str]) -> str:
    """Return a promise with the first case in which it was broken."""
    more = f"; and {len(cases) - 1} times more" if len(cases) > 1 else ""
    return f"{promise}: {cases[0]}{more}"


def error_with_line(error: BaseException) -> str:
    """Return an error in one line, with the line of the file that it comes from."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return f"{text} ({frame.filename.rsplit('/', 1)[-1]}:{frame.lineno})"


@dataclass(frozen=True)
class CheckedKind:
    """Kind of plug-in, and the way it is checked.

    Attributes:
        kind: The word for one: `dva-sim check KIND NAME`.
        room: The module whose `PLUGINS` tells what there is of it, below `dva_sim`.
        module: The one here whose `check_KIND` tries one.
        summary: Description of the check, with `{tries}`, and `{ms}` or `{us}` of the slowest.
        folder: Folder of the named files, for kinds that are not classes.
        class_word: The word for a class of it, where that is another.
    """

    kind: str
    room: str
    module: str
    summary: str
    folder: str = ""
    class_word: str = ""

    @property
    def classes(self) -> str:
        """Plural of the word for its classes."""
        return plural(self.class_word or self.kind)

    @property
    def many(self) -> str:
        """Plural of the kind."""
        return plural(self.kind)

    def load_plugins(self) -> Plugins[Any]:
        """Load the plug-ins of this kind."""
        plugins: Plugins[Any] = import_module(f"dva_sim.{self.room}").PLUGINS
        return plugins

    @property
    def group(self) -> str:
        """Entry points of installed packages."""
        return f"dva_sim.{self.classes}"

    def words(self) -> dict[str, str]:
        """Describe the shipped ones by name, without loading them."""
        return shipped_words()[self.kind]

    def docstrings(self) -> dict[str, str]:
        """Load the shipped ones; the first paragraph of each docstring, by name."""
        plugins = self.load_plugins()
        texts = {
            name: inspect.getdoc(plugins.shipped[name]) or ""
            for name in plugins.shipped.keys() - plugins.hidden
        }
        return {name: " ".join(text.partition("\n\n")[0].split()) for name, text in texts.items()}

    def known(self) -> list[str]:
        """Return names that are shipped or installed."""
        from dva_sim.kernel.resources import available  # late: start-up

        return sorted(available(self.folder)) if self.folder else self.load_plugins().known()

    def load_check(self) -> Callable[..., Outcome]:
        """Load the check that users call in their own tests, by name or class, with options."""
        module = import_module(f"dva_sim.testing.{self.module}")
        check: Callable[..., Outcome] = getattr(module, f"check_{self.kind}")
        return check

    def ways(self, outcome: Outcome) -> str:
        """Describe how it was checked."""
        slowest = outcome.slowest
        return self.summary.format(tries=outcome.tries, ms=1e3 * slowest, us=1e6 * slowest)


def plural(kind: str) -> str:
    """Return the plural of a kind's name."""
    return f"{kind.removesuffix('y')}ies" if kind.endswith("y") else f"{kind}s"


_US = "{us:.0f} microseconds"
_READINGS = "{us:.1f} microseconds a reading"
_STRATEGIES = "agents.operator.strategies.loading"
TRIALS: Final[dict[str, CheckedKind]] = {
    row[0]: CheckedKind(*row)
    for row in (
        ("pattern", "network.patterns", "patterns", f"{{tries}} drives, {_US} a command"),
        ("transport", "network.middleware", "transports", "{tries} messages, slowest {ms:.0f} ms"),
        ("policy", "core.dispatch", "policies", "{tries} situations, slowest decision {ms:.1f} ms"),
        ("operator", _STRATEGIES, "operators", f"{{tries}} drives, {_US} a frame"),
        ("filter", "agents.tilt.filters", "tilt", f"{{tries}} runs, {_READINGS}"),
        ("mapping", "agents.tilt.mappings", "tilt", f"{{tries}} runs, {_READINGS}"),
        ("hazard", "worlds.hazards", "hazards", f"{{tries}} questions, {_US} an answer"),
        ("measure", "simulation.run_measures", "measures", "{tries} answers, slowest {ms:.1f} ms"),
        (
            *("robot", "worlds.drives", "robots", f"{{tries}} drives, {_US} a tick"),
            *("agents/robots", "drive"),
        ),
    )
}
