"""The command `answers`: what published studies answered, and whether it is still given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dva_sim import __version__
from dva_sim.kernel.errors import ConfigError, ExitCode
from dva_sim.kernel.suggestions import hint
from dva_sim.kernel.wording import first_and_rest
from dva_sim.options.forms import Jobs, OptionForm, argument

if TYPE_CHECKING:
    from dva_sim.experiments.execution.sampled_runs import SampledRun
    from dva_sim.experiments.report.kept_answers import KeptAnswer


def answers(
    studies: Annotated[
        tuple[str, ...], argument("Only these studies.", "STUDY", is_repeated=True)
    ] = (),
    keep: Annotated[
        tuple[str, ...],
        OptionForm("Keep the answer of a results folder.", metavar="FOLDER", is_repeated=True),
    ] = (),
    mark: Annotated[bool, OptionForm("Mark answers that are no longer given.")] = False,
    jobs: Jobs = None,
) -> None:
    """Check which published answers this version still gives.

    Each study, its scenarios and its files are compared with those of the answer that is kept,
    and a few runs are repeated: every level of every factor, once.

    Examples:
        dva-sim answers  # all of them: a few minutes
        dva-sim answers --keep results/filters  # keep what a study has answered
    """
    folder = _folder()
    for name in keep:
        _keep(Path(name), folder, jobs)
    if not keep:
        raise typer.Exit(_compare(folder, studies, mark, jobs))


def _folder() -> Path:
    """Return where answers are kept: beside the shipped studies."""
    from dva_sim.experiments.report.kept_answers import FOLDER  # late: start-up
    from dva_sim.experiments.study.study import FOLDER as STUDIES  # late: start-up
    from dva_sim.kernel import resources  # late: start-up

    return next(root / STUDIES / FOLDER for root in resources.roots() if (root / STUDIES).is_dir())


def _keep(results: Path, folder: Path, jobs: int | None) -> None:
    from dva_sim.experiments.execution.sampled_runs import digests_of  # late: start-up
    from dva_sim.experiments.report import kept_answers  # late: start-up
    from dva_sim.experiments.study.file_kinds import open_study  # late: start-up

    answer, manifest = kept_answers.answer_in(results)
    if changed := kept_answers.changed_since(manifest, open_study(answer.study)):
        raise ConfigError(f"{results}: {changed} has changed since; run the study again")
    sampled = _sampled([answer.study], jobs)[answer.study]
    kept_answers.refuse_other_runs(results, sampled)
    digests = digests_of(sampled)
    print(f"Kept in {kept_answers.keep(replace(answer, sampled=digests), manifest, folder)}")


def _compare(folder: Path, studies: Sequence[str], mark: bool, jobs: int | None) -> ExitCode:
    """Say of each kept answer whether it is still given; a gate fails if an unmarked one is not."""
    from dva_sim.experiments.execution.sampled_runs import digests_of  # late: start-up
    from dva_sim.experiments.report import kept_answers  # late: start-up

    kept = [a for a in kept_answers.all_kept(folder) if not studies or a.study in studies]
    if missing := [name for name in studies if name not in {answer.study for answer in kept}]:
        kept_names = [answer.study for answer in kept_answers.all_kept(folder)]
        raise ConfigError(
            f"no answer of {missing[0]!r} is kept; {hint(missing[0], kept_names, 'kept')}"
        )
    changes = {answer.study: _changed(answer.study, folder) for answer in kept}
    now = _sampled([answer.study for answer in kept if answer.sampled], jobs)
    code = ExitCode.OK
    for answer in kept:
        digests = digests_of(now.get(answer.study, []))
        lines, is_stale = _described(answer, digests, changes[answer.study])
        print(f"{answer.study}: {lines}. {first_and_rest(answer.answer)[0]}")
        if is_stale and not answer.stale_since:
            if mark:
                _mark(answer, folder)
            else:
                code = ExitCode.GATE_FAILED
    return code


def _described(answer: KeptAnswer, now: dict[str, str], changed: str) -> tuple[str, bool]:
    """Describe whether an answer is still given; and whether it is stale.

    Args:
        answer: The answer.
        now: Digests of the few runs.
        changed: Name of what the study asks for otherwise; empty if nothing.
    """
    dated = f"{answer.status}, {answer.version}, {answer.date}"
    since = f", marked since {answer.stale_since}" if answer.stale_since else ""
    if changed:
        return f"no longer given: {changed} has changed ({dated}{since})", True
    if not answer.sampled:
        return f"measured in real time, so not compared ({dated})", False
    same = sum(answer.sampled.get(key) == digest for key, digest in now.items())
    if same == len(answer.sampled) == len(now):
        return f"still given ({dated})", False
    return f"no longer given: {same} of {len(now)} runs are the same ({dated}{since})", True


def _mark(answer: KeptAnswer, folder: Path) -> None:
    from dva_sim.experiments.report import kept_answers  # late: start-up

    kept_answers.mark_stale(answer, __version__, folder)


def _changed(name: str, folder: Path) -> str:
    from dva_sim.experiments.report import kept_answers  # late: start-up
    from dva_sim.experiments.study.file_kinds import open_study  # late: start-up

    return kept_answers.changed_since(kept_answers.read_manifest(name, folder), open_study(name))


def _sampled(names: list[str], jobs: int | None) -> dict[str, list[SampledRun]]:
    from dva_sim.experiments.execution.executors import cores  # late: start-up
    from dva_sim.experiments.execution.sampled_runs import sampled_runs  # late: start-up
    from dva_sim.experiments.study.file_kinds import open_study  # late: start-up

    return dict(sampled_runs({name: open_study(name) for name in names}, jobs or cores()))
