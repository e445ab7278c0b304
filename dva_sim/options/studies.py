"""Options of the commands about studies and their results: run, tune, report, export, ..."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Literal, Protocol

from dva_sim.kernel.errors import ConfigError
from dva_sim.options.forms import (
    AnyPath,
    Jobs,
    OptionForm,
    Overwrite,
    Scheduler,
    Settings,
    argument,
    out_form,
)


class InFolder(Protocol):
    """Results that have been opened.

    Attributes:
        folder: Folder that holds them.
    """

    folder: Path


Folder = str | Path | InFolder
VALIDATED = "dispatch", "operators", "network"
STUDY = argument("A study, by name or path.", "STUDY", "experiments")
Study = Annotated[str | Path, STUDY]
ResultsFolder = Annotated[Folder, argument("A results folder.", "FOLDER")]
Full = Annotated[bool, OptionForm("The study's larger version.")]
Progress = Callable[[int, int], object] | None
DryRun = Annotated[bool, OptionForm("Show what would run, and run nothing.")]


@dataclass(frozen=True, eq=False, match_args=False)
class RunOptions:
    """Options of `run`: the study and its variant, the results folder, and the processes."""

    study: Study
    out: Annotated[AnyPath, out_form("Results folder; default: results/STUDY.")] = None
    _: KW_ONLY
    set: Settings = ()
    seed: Annotated[
        int | None, OptionForm("Random seed of the whole study.", "In place of its own.")
    ] = None
    jobs: Jobs = None
    scheduler: Scheduler = None
    limit_s: Annotated[
        float,
        OptionForm(
            "Treat a run that takes longer as failed.", "By the wall clock [s].", names=("--limit",)
        ),
    ] = 600
    quick: Annotated[bool, OptionForm("The study's small version.")] = False
    full: Full = False
    pilot: Annotated[
        int | None,
        OptionForm(
            "Run only this many persons, with a random seed of their own.",
            "The study never uses it.",
            metavar="PERSONS",
            least=1,
        ),
    ] = None
    progress: Annotated[
        Progress,
        OptionForm(also="Called with the number of runs done and of all runs, as they finish."),
    ] = None
    report: Annotated[bool, OptionForm(also="True to write the report.")] = True

    @property
    def version(self) -> Literal["quick", "full"] | None:
        """The small or the larger version; None for the study as its file says.

        Raises:
            ConfigError: both are asked for.
        """
        if self.quick and self.full:
            raise ConfigError("--quick and --full are two versions of a study; give one of them")
        return "quick" if self.quick else "full" if self.full else None

    @property
    def results_folder(self) -> Path:
        """Folder of the results; by default one for each variant of a study."""
        marks = [Path(self.study).stem, self.version, None if self.pilot is None else "pilot"]
        return Path(self.out or Path("results") / "-".join(filter(None, marks)))


@dataclass(frozen=True, eq=False, match_args=False)
class TuneOptions:
    """Options of `tune`: the study, the folder of the trials, and the processes."""

    study: Study
    out: Annotated[AnyPath, out_form("Folder of the trials; default: results/STUDY-tuning.")] = None
    _: KW_ONLY
    jobs: Jobs = None
    progress: Annotated[
        Progress,
        OptionForm(also="Called with the number of trials done and of all trials, as they finish."),
    ] = None


@dataclass(frozen=True, eq=False, match_args=False)
class NewOptions:
    """Options of `new`."""

    name: Annotated[str | Path, argument("Name or path of the new study.", "NAME")]


@dataclass(frozen=True, eq=False, match_args=False)
class RegisterOptions:
    """Options of `register`."""

    study: Study
    _: KW_ONLY
    full: Full = False
    again: Annotated[
        bool, OptionForm("Replace an earlier registration; the report will say so.")
    ] = False


@dataclass(frozen=True, eq=False, match_args=False)
class ReportOptions:
    """Options of `report`."""

    folder: ResultsFolder
    _: KW_ONLY
    pdf: Annotated[
        bool,
        OptionForm(
            "Also print it as PDF, using Chromium.", "Chrome works too; no other browser is tried."
        ),
    ] = False


@dataclass(frozen=True, eq=False, match_args=False)
class ShowOptions:
    """Options of `show`: the results, and what is shown of them."""

    folder: ResultsFolder
    _: KW_ONLY
    table: Annotated[str | None, OptionForm("Show the rows of a table.")] = None
    rows: Annotated[int, OptionForm("Number of rows to print.", least=1)] = 20
    columns: Annotated[bool, OptionForm("Explain the columns of one table or all.")] = False


@dataclass(frozen=True, eq=False, match_args=False)
class ExportOptions:
    """Options of `export`: the results, and the files that are written of them."""

    folder: ResultsFolder
    out: Annotated[str | Path, out_form("X.csv or X.parquet for one table, or a folder.", "PATH")]
    _: KW_ONLY
    table: Annotated[
        str | Sequence[str],
        OptionForm("Export only this table; may be given again.", "Or these.", is_repeated=True),
    ] = ()
    format: Annotated[
        str | None,
        OptionForm(
            "Format of tables in a folder; default: csv.", "Or `parquet`.", metavar="csv|parquet"
        ),
    ] = None
    overwrite: Overwrite = False


@dataclass(frozen=True, eq=False, match_args=False)
class CompareOptions:
    """Options of `compare`."""

    first: Annotated[Folder, argument("A results folder.", "A")]
    second: Annotated[Folder, argument("The results folder to compare with it.", "B")]


@dataclass(frozen=True, eq=False, match_args=False)
class ValidateOptions:
    """Options of `validate`: the models, their cases, and how much is run."""

    what: Annotated[
        str,
        argument("dispatch, operators or network.", "WHAT", words=VALIDATED),
    ] = "dispatch"
    _: KW_ONLY
    out: Annotated[Path | None, out_form("Write tables, figures and a page there.")] = None
    cases: Annotated[
        str | None,
        OptionForm("A file of cases, by name or path; not for operators.", metavar="FILE"),
    ] = None
    strategy: Annotated[
        str | None, OptionForm("Driving strategy of the operators; operators only.")
    ] = None
    quick: Annotated[bool, OptionForm("Run fewer cases, with wider error bounds.")] = False
    jobs: Jobs = None
    seed: Annotated[int, OptionForm("Random seed.")] = 1
    ablate: Annotated[bool, OptionForm("Remove mechanisms one by one; network only.")] = False
    live: Annotated[bool, OptionForm("Measure real sockets now; network only.")] = False
    measure: Annotated[
        Path | None, OptionForm("Measure the whole design, or resume it; network only.")
    ] = None
    beside: Annotated[
        str | None,
        OptionForm(
            "Compare results or commands of a middleware study with predictions; network only.",
            metavar="FOLDER",
        ),
    ] = None
