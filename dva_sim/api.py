"""What the command line does, for programs and notebooks: `import dva_sim; dva_sim.run(...)`.

The results are the same bytes as those of the same command. Nothing is printed; mistakes are
`DvaSimError`. A script needs no `if __name__ == "__main__"` around it.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim import scenario as scenarios
from dva_sim.config import parse_changes, parse_scalar
from dva_sim.errors import ConfigError, DvaSimError
from dva_sim.experiments.comparing import Comparison
from dva_sim.experiments.dictionary import describe
from dva_sim.experiments.frames import Frame, frame_of, plain
from dva_sim.experiments.models import AnyScenario, model_of
from dva_sim.experiments.results import Results

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Comparison", "Episode", "Results", "compare", "episode", "load", "run"]

Settings = Mapping[str, Any] | Iterable[str]


def run(
    study: str | Path,
    out: str | Path | None = None,
    *,
    set: Settings = (),
    seed: int | None = None,
    full: bool = False,
    pilot: int | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    limit_s: float = 600.0,
    progress: Callable[[int, int], object] | None = None,
    report: bool = True,
) -> Results:
    """Run a study, or go on with one that was interrupted, and write its report.

    Args:
        study: By name or path.
        out: Results folder; by default `results/` and the study's name.
        set: Keys to change, as a mapping or as `key=value` pairs.
        seed: Of the whole study, instead of its own.
        full: The study's larger version.
        pilot: Only so many persons, with luck of their own.
        jobs: Processes of this machine; by default one for each core.
        scheduler: Address of a dask.distributed cluster to use instead.
        limit_s: A run that takes longer, by the wall clock, has failed.
        progress: Called with the number of runs done and of all runs, as they finish.
        report: Whether to write the report.

    Returns:
        What came out; `failures` tells of runs that failed.

    Raises:
        DvaSimError: a mistake in what was asked for, a disk that is full, or runs that should be
            kept as recordings and could not.
        KeyboardInterrupt: the finished runs are kept, and the same call goes on.
    """
    from dva_sim.experiments.episode import rehearse_all
    from dva_sim.experiments.recording import record_study
    from dva_sim.experiments.runner import run_study
    from dva_sim.experiments.running import Version
    from dva_sim.experiments.study import load_study

    pairs = [*_pairs(set), *([f"seed={seed}"] if seed is not None else [])]
    asked = load_study(study, pairs, full=full, pilot=pilot)
    folder = Path(out) if out is not None else Version(full, pilot).folder(str(study))
    rehearse_all(asked)
    options: dict[str, Any] = {"jobs": jobs, "scheduler": scheduler}
    with _without_main():
        run_study(asked, folder, progress=progress, limit_s=limit_s, **options)
        problems = record_study(asked, folder, jobs=jobs, limit_s=limit_s)
    results = load(folder)
    if report:
        results.report()
    if problems:
        raise DvaSimError(f"{folder}: {'; '.join(problems)}; the results are complete")
    return results


def load(folder: str | Path) -> Results:
    """Open a results folder.

    Raises:
        ConfigError: it is not one, or its study has not been completed.
    """
    return Results.load(folder)


def compare(first: Results | str | Path, second: Results | str | Path) -> Comparison:
    """Two results, or their folders, side by side: what the second has otherwise.

    Raises:
        ConfigError: one is no results folder, or they have no configuration in common.
    """
    a, b = (x if isinstance(x, Results) else load(x) for x in (first, second))
    return Comparison(a, b)


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
    def measures(self) -> dict[str, Any]:
        """The one row of the table of runs."""
        return {name: values.tolist()[0] for name, values in self.tables["runs"].items()}

    def _repr_html_(self) -> str:
        told = describe("runs", list(self.measures), [self.scenario.model], [])
        rows = [
            f"<tr><td>{escape(c.name)}</td><td>{escape(plain(self.measures[c.name]))}</td>"
            f"<td>{escape(c.meaning)}</td></tr>"
            for c in told
        ]
        return f"<table>{''.join(rows)}</table>"


def episode(scenario: str | Path, seed: int = 1, *, set: Settings = ()) -> Episode:
    """Run one scenario once.

    Args:
        scenario: By name or path.
        seed: Of its luck.
        set: Keys to change, as a mapping or as `key=value` pairs.

    Raises:
        ConfigError: there is none, or it is not valid with these changes.
    """
    document = scenarios.load(str(scenario))
    model = model_of(document)
    built = model.build(document, parse_changes(_pairs(set)))
    tables = model.tables(built, seed, with_tracks=True)
    return Episode(built, seed, {name: frame_of(rows) for name, rows in tables.items()})


def _pairs(settings: Settings) -> list[str]:
    """Settings as on the command line."""
    if not isinstance(settings, Mapping):
        return list(settings)
    return [f"{key}={_as_text(key, value)}" for key, value in settings.items()]


def _as_text(key: str, value: Any) -> str:
    """A value as YAML: words as they are where that is possible, all else as JSON."""
    if isinstance(value, str | Path) and parse_scalar(str(value)) == str(value):
        return str(value)
    try:
        return json.dumps(value, default=_plain)
    except (TypeError, ValueError):
        raise ConfigError(f"set: {key} cannot be {value!r}") from None


def _plain(value: Any) -> Any:
    """Numbers and arrays of numpy, and paths, as JSON can hold them."""
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no number, word, list or mapping")


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the caller's script from processes that begin meanwhile.

    They would run it again to find what it defines, and none of that is needed: without a guard
    in the script, they would start the same study anew.
    """
    main: dict[str, Any] = vars(sys.modules["__main__"])
    hidden: dict[str, Any] = {}
    for name in ("__file__", "__spec__"):
        if name in main:
            hidden[name] = main.pop(name)
    main["__spec__"] = None
    try:
        yield
    finally:
        main.update(hidden)
