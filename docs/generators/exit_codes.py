"""The page of exit codes, and of the errors that end with each."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

from dva_sim.kernel.errors import DvaSimError, ExitCode
from generators.markdown import code, prose, table
from generators.markdown import page as page_of

_MODULES = (
    "dva_sim.kernel.errors",
    "dva_sim.experiments.results.folder_lock",
    "dva_sim.experiments.execution.executors",
    "dva_sim.recordings.audit_log",
    "dva_sim.recordings.motion",
    "dva_sim.network.real_network",
    "dva_sim.network.emulator.needs",
    "dva_sim.live.supervisor",
    "dva_sim.simulation.full.verdicts",
)
"""Modules that define errors a caller may handle."""


def page() -> str:
    """Return the page in Markdown."""
    return page_of(
        "Exit codes",
        "Every command ends with one of these. An error prints one line on standard error that "
        "names the file, the key and what would be right.",
        table(["code", "meaning"], ([code(int(c)), prose(c.meaning)] for c in ExitCode)),
        "## Errors in Python",
        "Functions of the [Python API](python.md) raise `DvaSimError` or a class derived from it. "
        "`exit_code` is the code with which a command ends.",
        table(
            ["class", "exit code", "meaning"],
            (
                [
                    code(f"{error.__module__}.{error.__qualname__}"),
                    str(int(error.exit_code)),
                    prose((error.__doc__ or "").partition("\n\n")[0]),
                ]
                for error in errors()
            ),
        ),
    )


def errors() -> Iterator[type[DvaSimError]]:
    """Yield the classes of errors that a caller may handle."""
    for name in _MODULES:
        for error in vars(import_module(name)).values():
            is_error = isinstance(error, type) and issubclass(error, DvaSimError)
            if is_error and error.__module__ == name:
                yield error
