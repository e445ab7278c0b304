"""The command that lets faulty hours pass, and looks whether any rule breaks."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dva_sim.cli.options import Quiet
from dva_sim.kernel.errors import ConfigError, ExitCode
from dva_sim.kernel.whole_files import write_whole
from dva_sim.options.forms import Jobs, OptionForm, Scheduler, argument, out_form

if TYPE_CHECKING:
    from dva_sim.storms.campaign import StormTally
    from dva_sim.storms.outcome import StormOutcome
    from dva_sim.storms.plan import StormPlan

STORMS_FOLDER = Path("results/storms")
STORY_MARGIN_S = 20.0  # shown part of the story before and after a breach [s]
_PLAN = "Saved plan of one storm, such as a failure, to replay alone."
_HOURS = "Continue with further seeds until this many fleet-hours are reached in total."


def storm(
    plan: Annotated[Path | None, argument(_PLAN, "PLAN.yaml")] = None,
    seeds: Annotated[
        str, OptionForm("Seeds of the storms, from and to.", metavar="FIRST:LAST")
    ] = "1:16",
    hours: Annotated[float | None, OptionForm(_HOURS, metavar="H")] = None,
    profile: Annotated[
        str, OptionForm("Kinds of faults: all, messages, nodes, people or none.")
    ] = "all",
    plays: Annotated[
        str, OptionForm("Storms of one `team`, or of several DVAs (`regions`).", metavar="PLAY")
    ] = "team",
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    out: Annotated[Path, out_form("Folder for the journal and for failures.")] = STORMS_FOLDER,
    quiet: Quiet = False,
) -> None:
    """Simulate hours of faults and check the safety rules.

    Each seed draws a team, a site, a link, people, events and up to sixty faults: lost, late,
    duplicated or corrupted messages; devices that hang, restart or vanish; a DVA killed between two
    writes; revocations and emergencies at the worst moment; intruders; wrong clocks. A storm lasts
    fourteen minutes of virtual time. Rules S1 to S8, S10 and S11 are checked by observers that rely
    on no agent. Two minutes after the last fault, everything must work again.

    With `--plays regions`, two to four DVAs serve a hall: they are killed and come back, and links
    between them and to their devices are cut, lose, delay and double messages. S1 to S8 and S12 to
    S15 are checked.

    At the end, each storm that broke a rule is reduced to the faults that matter. Its plan and
    timeline are saved in the folder, and the plan can be replayed. The same seed gives the same
    storm. Storms already in the folder are counted, not repeated.

    The exit code is 1 if a rule was broken.

    Examples:
        dva-sim storm --seeds 1:256  # 60 fleet-hours
        dva-sim storm --hours 100  # continue with further seeds until 100 fleet-hours are reached
        dva-sim storm --plays regions --seeds 1:100  # 10 hours of several DVAs
        dva-sim storm results/storms/found/all-7.yaml  # replay a failure
    """
    from dva_sim.experiments.execution.dask_cluster import workers_at  # late: start-up
    from dva_sim.storms.campaign import (  # late: start-up
        REGIONS,
        Journal,
        StormTally,
        drawn,
        outcomes,
    )
    from dva_sim.storms.plan import load_plan  # late: start-up

    if plan is not None:
        raise typer.Exit(_replay(load_plan(plan)))
    first, last = _range(seeds)
    if plays not in ("team", REGIONS):
        raise ConfigError(f"--plays {plays!r} should be team or {REGIONS}")
    if plays == REGIONS and profile != "all":
        raise ConfigError(
            f"--profile {profile} is for --plays team: {REGIONS} has faults of its own"
        )
    profile = REGIONS if plays == REGIONS else profile
    drawn(first, profile)  # an unknown profile is refused before anything starts
    out.mkdir(parents=True, exist_ok=True)
    tally = StormTally()
    played_before = 0
    failed: list[StormOutcome] = []
    numbers: Iterable[int] = itertools.count(first) if hours else range(first, last + 1)
    journal = Journal(out / "storms.jsonl")
    with workers_at(scheduler, jobs) as workers:
        for outcome, is_known in outcomes(numbers, profile, journal, workers):
            tally.add(outcome)
            played_before += is_known
            if not outcome.is_clean:
                _tell_failure(outcome, profile)
                failed.append(outcome)
            if not quiet and not is_known:
                of = f" of {hours:g}" if hours else ""
                typer.echo(f"{tally.storms} storms, {tally.hours:.1f}{of} fleet-hours", err=True)
            if hours and tally.hours >= hours:
                break
    _tell(tally, played_before)
    for outcome in failed:  # last: reducing one takes minutes of a single process
        _keep_failure(drawn(outcome.seed, profile), outcome, out / "found", profile)
    raise typer.Exit(ExitCode.DOES_NOT_HOLD if tally.failures else ExitCode.OK)


def _range(seeds: str) -> tuple[int, int]:
    first, _, last = seeds.partition(":")
    if not first.isdecimal() or not (last or first).isdecimal() or int(last or first) < int(first):
        raise ConfigError(f"--seeds should be FIRST:LAST, such as 1:256, not {seeds!r}")
    return int(first), int(last or first)


def _replay(plan: StormPlan) -> ExitCode:
    """Play one storm, and tell its story."""
    from dva_sim.storms.storm import play  # late: start-up

    runs = list[Any]()
    outcome = play(plan, runs.append)
    for moment in runs[0].recorder.timeline:
        typer.echo(f"{moment.time:9.3f} s  {moment.who}: {moment.what}")
    _tell_failure(outcome, "")
    typer.echo(f"{outcome.simulated_s:.0f} s, digest {outcome.digest}")
    if outcome.is_clean:
        typer.echo("no rule was broken")
    return ExitCode.OK if outcome.is_clean else ExitCode.DOES_NOT_HOLD


def _tell_failure(outcome: StormOutcome, profile: str) -> None:
    where = f"seed {outcome.seed} ({profile}): " if profile else ""
    for breach in outcome.breaches:
        times = f", {breach.count} times" if breach.count > 1 else ""
        typer.echo(
            f"{where}{breach.rule} broken by {breach.who} at {breach.time:.2f} s{times}: "
            f"{breach.what}"
        )
    if outcome.error:
        typer.echo(f"{where}{outcome.error}")


def _keep_failure(plan: StormPlan, outcome: StormOutcome, folder: Path, profile: str) -> None:
    """Reduce a failure, and keep its plan and its story, unless an earlier call has done so."""
    from dva_sim.storms.shrinking import Shrinker  # late: start-up
    from dva_sim.storms.storm import play  # late: start-up

    file = folder / f"{profile}-{plan.seed}.yaml"
    if file.exists():
        return
    typer.echo(f"reducing the storm of seed {plan.seed} ...", err=True)
    shrinker = Shrinker(plan, outcome)
    small = shrinker.shrink()
    folder.mkdir(parents=True, exist_ok=True)
    runs = list[Any]()
    again = play(small, runs.append)
    when = min((breach.time for breach in again.breaches), default=again.simulated_s)
    story = [
        f"{moment.time:9.3f} s  {moment.who}: {moment.what}\n"
        for moment in runs[0].recorder.timeline
        if abs(moment.time - when) < STORY_MARGIN_S or moment.kind == "fault"
    ]
    file.with_suffix(".txt").write_text("".join(story) + again.error, encoding="utf-8")
    write_whole(file, small.text())
    typer.echo(f"  {len(plan.faults)} faults cut to {len(small.faults)}: dva-sim storm {file}")


def _tell(tally: StormTally, played_before: int) -> None:
    faults = sum(tally.faults.values())
    touched = sum(tally.messages.values())
    typer.echo(
        f"{tally.storms} storms ({played_before} played before), {tally.hours:.1f} fleet-hours, "
        f"{faults} faults, {touched} messages touched; {tally.cpu_s:.0f} s of CPU time"
    )
    for kind, times in sorted(tally.faults.items()):
        messages = f", {tally.messages[kind]} messages" if kind in tally.messages else ""
        typer.echo(f"  {kind}: {times}{messages}")
    typer.echo(
        f"{len(tally.failures)} storms broke a rule; with 95 % confidence at most "
        f"{tally.most_per_hour():.3g} in an hour"
    )
