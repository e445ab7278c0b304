"""What the command line does with a validation: choose what is validated."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from dva_sim.kernel.errors import ConfigError, ExitCode
from dva_sim.kernel.verbosity import detail
from dva_sim.validation.frame import say

WHAT = ("dispatch", "operators", "network")


@dataclass(frozen=True)
class Sockets:
    """What is done beside comparing the network model with the shipped measurements.

    Attributes:
        ablate: Leave mechanisms of the model out one by one.
        live: Measure now, and compare with that alone.
        measure: Measure the whole design into this table; nothing is compared.
    """

    ablate: bool = False
    live: bool = False
    measure: Path | None = None


def validate(
    what: str,
    out: Path | None,
    cases: str | None = None,
    quick: bool = False,
    jobs: int | None = None,
    seed: int = 1,
    strategy: str | None = None,
    sockets: Sockets = Sockets(),
) -> ExitCode:
    """Play, print the comparison, write it if asked to; how it ended.

    Args:
        what: `dispatch`, `operators` or `network`.
        out: Where tables, figures and the page go.
        cases: A file of cases, for dispatch and network.
        quick: Fewer runs.
        jobs: Processes; left out, one per core.
        seed: Of all luck.
        strategy: How the operators drive, for operators; left out, as the split file says.
        sockets: What is measured and left out, for network.

    Raises:
        ConfigError: something else to validate, an option that belongs to the other, or a
            mistake in the files.
    """
    _refuse_foreign(what, cases, strategy, sockets)
    if out is not None and out.exists() and not out.is_dir():
        raise ConfigError(f"--out {out} is a file; give a folder")
    workers = jobs or os.cpu_count() or 1
    detail(f"{what}, seed {seed}, {workers} processes{', quick' if quick else ''}")
    for key, value in (("cases", cases), ("strategy", strategy), ("out", out)):
        detail(f"  {key}: {'as shipped' if value is None else value}")
    try:
        if what == "dispatch":
            from dva_sim.cli.validate_dispatch import validate_dispatch

            return validate_dispatch(cases, out, quick, workers, seed)
        if what == "operators":
            from dva_sim.cli.validate_operators import validate_operators

            return validate_operators(strategy, out, quick, workers, seed)
        from dva_sim.cli.validate_network import validate_network
        from dva_sim.validation.network.comparison import Setting

        setting = Setting(seed, quick, workers, sockets.ablate)
        return validate_network(cases, out, setting, sockets.measure, sockets.live)
    except KeyboardInterrupt:
        say("Stopped.")
        return ExitCode.INTERRUPTED


def _refuse_foreign(what: str, cases: str | None, strategy: str | None, sockets: Sockets) -> None:
    """Refuse something else to validate, and options that belong to another."""
    if what not in WHAT:
        known = f"{', '.join(WHAT[:-1])} or {WHAT[-1]}"
        raise ConfigError(f"{what!r} cannot be validated; should be {known}")
    if strategy is not None and what != "operators":
        raise ConfigError(f"--strategy is for `validate operators`: {what} has none")
    if cases is not None and what == "operators":
        raise ConfigError(
            "--cases is for `validate dispatch` and `validate network`: operators have no cases"
        )
    if sockets != Sockets() and what != "network":
        raise ConfigError("--ablate, --live and --measure are for `validate network`")
