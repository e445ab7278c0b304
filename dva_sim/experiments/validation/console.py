"""What the command line does with a validation: choose what is validated."""

from __future__ import annotations

import os
from pathlib import Path

from dva_sim.errors import ConfigError
from dva_sim.experiments.validation.telling import say

WHAT = ("dispatch", "operators")
INTERRUPTED = 130  # exit code of a program ended by Ctrl-C


def validate(
    what: str,
    out: Path | None,
    cases: str | None = None,
    quick: bool = False,
    jobs: int | None = None,
    seed: int = 1,
    strategy: str | None = None,
) -> int:
    """Play, print the comparison, write it if asked to; the exit code.

    Args:
        what: `dispatch` or `operators`.
        out: Where tables, figures and the page go.
        cases: A file of cases, for dispatch.
        quick: Fewer runs.
        jobs: Processes; left out, one per core.
        seed: Of all luck.
        strategy: How the operators drive, for operators; left out, as the split file says.

    Raises:
        ConfigError: something else to validate, an option that belongs to the other, or a
            mistake in the files.
    """
    workers = jobs or os.cpu_count() or 1
    try:
        if what == "dispatch":
            if strategy is not None:
                raise ConfigError("--strategy is for `validate operators`: dispatch has none")
            from dva_sim.experiments.validation.dispatch.console import validate_dispatch

            return validate_dispatch(cases, out, quick, workers, seed)
        if what == "operators":
            if cases is not None:
                raise ConfigError("--cases is for `validate dispatch`: operators have no cases")
            from dva_sim.experiments.validation.operators.console import validate_operators

            return validate_operators(strategy, out, quick, workers, seed)
    except KeyboardInterrupt:
        say("Stopped.")
        return INTERRUPTED
    raise ConfigError(f"{what!r} cannot be validated; should be {' or '.join(WHAT)}")
