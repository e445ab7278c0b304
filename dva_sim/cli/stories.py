"""`dva-sim episode` and `replay`: a run played or read, drawn, kept, and told in a terminal.

Each model has a story, a table, and a few lines on its outcome.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console, JustifyMethod
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from dva_sim.cli.console import console, print_lines, warn
from dva_sim.cli.verbosity import is_verbose, lines_of, tell_measures
from dva_sim.experiments.report.episode import (
    EpisodeRequest,
    Played,
    doubts,
    open_recording,
    write_replay,
)
from dva_sim.kernel.measure import Measure
from dva_sim.recordings.channels import STORY
from dva_sim.recordings.pictures import Wanted
from dva_sim.recordings.pictures.run_endings import story
from dva_sim.simulation.full import Playback, Recording
from dva_sim.simulation.full.verdicts import (
    BROKEN,
    HELD,
    RulesNotJudged,
    Verdict,
    unjudged_rules,
)
from dva_sim.simulation.measures.episodes import RUN_COLUMNS
from dva_sim.simulation.models import Tables, model_for
from dva_sim.simulation.task import TaskScenario
from dva_sim.simulation.timed import TimedRecording, TimedScenario
from dva_sim.simulation.timed.recording import OUTCOMES
from dva_sim.simulation.transports import TransportScenario

Row = Mapping[str, Any]

STYLES = {"safety": "bold red", "mode": "dim", "order": "cyan", "drive": "cyan", "link": "yellow"}
DRIVES = {
    "lost link": "given up, the link was presumed lost",
    "gave up": "given up",
    "refused": "ended, the robot no longer obeyed",
}
EVENTS = 30  # maximum events of a shift in its table; the lines below it count all
TRIALS = 20  # maximum trials of a task in its table; the lines below it count all
EVENT_HEADS = ("detected", "kind", "where", "outcome", "looked", "after", "acted")
COLUMNS = {
    "id_bits": "index\n[bit]",
    "steering_id": "index",
    "movement_time_s": "time\n[s]",
    "error": "error",
    "overshoots": "over-\nshoots",
    "wall_crossings": "crossings",
    "path_error_rms_m": "off the\nmiddle,\nrms [m]",
    "tracking_error_rms_m": "off the\ntarget,\nrms [m]",
    "crossover_rad_s": "crossover\n[rad/s]",
    "phase_margin_deg": "phase\nmargin\n[deg]",
    "waits": "waits",
    "delay_felt_s": "delay\nfelt\n[s]",
}
"""Columns of the printed trials with their heads; a task has some of them."""


def tell_any(run: Played, console: Console) -> None:
    """Print a run of any model: the measures of its row."""
    console.rule(f"{Path(run.scenario.model).name}, seed {run.seed}")
    print_lines(lines_of(run.tables["runs"][0], _columns(run)), console)
    console.print(f"simulated in {run.took_s:.2f} s", soft_wrap=True)


def _table(heads: Sequence[str], right: Sequence[str], no_wrap: bool = False) -> Table:
    """Return an empty table without lines; heads may have units in brackets."""
    table = Table(box=None, pad_edge=False)
    for head in heads:
        side: JustifyMethod = "right" if head in right else "left"
        table.add_column(Text(head), justify=side, no_wrap=no_wrap)
    return table


def _columns(run: Played) -> Sequence[Measure]:
    return tuple(model_for(run.scenario).columns["runs"])


# --- a full run ----------------------------------------------------------------------
def tell_story(playback: Playback, console: Console) -> None:
    """Print the events of a run in order."""
    scenario = playback.scenario
    delay = scenario.link.delay_s * 1000
    phone = scenario.phone.profile
    console.rule(f"{scenario.pattern}, {delay:g} ms each way, phone {phone}, seed {playback.seed}")
    table = _table(["time", "who", "what"], right=["time"])
    for moment in playback.recorder.timeline:
        style = STYLES.get(moment.kind, "")
        table.add_row(f"{moment.time:7.1f} s", moment.who, escape(moment.what), style=style)
    console.print(table)


def tell_outcome(
    tables: Tables, how: str, console: Console, verdicts: Sequence[Verdict] = ()
) -> None:
    """Print the outcome of a run.

    Args:
        tables: The rows of the run, by table.
        how: Way in which it ran, printed after its length in seconds.
        verdicts: Verdicts on the safety rules, where facts may be missing to judge them.
    """
    row = tables["runs"][0]
    lines = [_event(event) for event in tables["events"]]
    if "commands_sent" in row:
        cause = f" ({row['cause']})" if row["cause"] not in ("", row["outcome"]) else ""
        attempts = f"in {row['attempts']} attempt{'s' * (row['attempts'] != 1)}"
        outcome = DRIVES.get(row["outcome"], row["outcome"])
        lines.append(f"robots: {outcome}{cause} {attempts}, {_driven(row)}")
    if tables["people"]:
        lines.append(f"people: {_fared(row, tables['people'])}")
    lines.append(f"{row['simulated_s']:.0f} s {how}, {row['messages']:,} messages")
    if unjudged_rules(verdicts):
        lines.append(_unjudged(verdicts))
    else:
        lines.append(f"safety rules: {_violations(row['violations'])}")
    lines += _failed(row)
    print_lines(["", *lines], console)
    tell_measures(row, RUN_COLUMNS)


def _failed(row: Row) -> list[str]:
    """List failures of the user's classes, if there were any."""
    times = row.get("plugin_failures", row.get("policy_failed"))
    whose = "a class of yours (policy, operator, filter, ...)"
    return [f"{whose} gave no answer, or an invalid one, {times} times"] if times else []


def tell_full(run: Played, console: Console) -> None:
    """Print the story of a run of the full model, and its outcome."""
    assert isinstance(run.kept, Recording)
    tell_story(run.kept, console)
    tell_outcome(run.tables, f"simulated in {run.took_s:.2f} s", console)


def _event(row: Row) -> str:
    is_reached = row["response_s"] == row["response_s"]
    response = f", on scene {row['response_s']:.1f} s after detection" if is_reached else ""
    by = " by" if row["outcome"] in ("confirmed", "refuted") else ", looked at by"
    who = f"{by} {row['responder']}" if row["responder"] else ""
    return f"{row['kind']}: {row['outcome']}{who}{response}"


def _driven(row: Row) -> str:
    parts = [f"{row['contacts']} contacts"]
    if row["jams"]:
        parts.append(f"{row['jams']} jams")
    if row["commands_sent"]:
        commands = f"{row['commands_applied']} of {row['commands_sent']} commands applied"
        age = f"median age {row['command_age_p50_s']:.2f} s"
        parts = [commands, age, f"{row['command_rate_hz']:.1f} per s", *parts]
    return ", ".join(parts)


def _fared(row: Row, people: list[dict[str, Any]]) -> str:
    parts = [f"{row['person_exposure_s']:.0f} s in danger"]
    doses = f"{row['dose_heat_max']:.2g} of heat, {row['dose_toxic_max']:.2g} of carbon monoxide"
    parts.append(f"largest dose {doses}")
    if row["incapacitated"]:
        parts.append(f"{row['incapacitated']} incapacitated")
    if "evacuated_share" in row:
        out = [p["t_out_s"] for p in people if p["t_out_s"] == p["t_out_s"]]
        count = sum(p["kind"] == "bystander" for p in people)
        last = f", the last at {max(out):.0f} s" if out else ""
        parts.insert(0, f"{len(out)} of {count} bystanders out{last}")
    return ", ".join(parts)


def _unjudged(verdicts: Sequence[Verdict]) -> str:
    """Describe the safety rules: not judged and why, broken, or held."""
    why: dict[str, list[str]] = {}
    for verdict in verdicts:
        if verdict.lacks_facts:
            why.setdefault(verdict.text, []).append(verdict.rule)
    parts = [f"{', '.join(rules)} not judged: {text}" for text, rules in why.items()]
    for state in (BROKEN, HELD):
        if rules := list(dict.fromkeys(v.rule for v in verdicts if v.state == state)):
            parts.append(f"{', '.join(rules)} {state}")
    return f"safety rules: {'; '.join(parts)}"


def _violations(count: int) -> str:
    """Return a count of broken rules in words."""
    times = "once" if count == 1 else f"{count} times"
    page = "docs/explanation/safety-rules.md"
    return "none was broken" if not count else f"broken {times}; see {page}"


# --- a shift -------------------------------------------------------------------------
def tell_shift(run: Played, console: Console) -> None:
    """Print the first events of a shift, and the totals of all its events."""
    scenario = run.scenario
    recording = run.kept
    assert isinstance(scenario, TimedScenario)
    assert isinstance(recording, TimedRecording)
    console.rule(f"{scenario.dispatch.policy}, seed {run.seed}")
    if recording.columns:
        console.print(_first_events(recording))
    row = run.tables["runs"][0]
    print_lines([*_shift_lines(recording), *_failed(row)], console)
    broken = sum(recording.violations.values())
    console.print(
        f"{recording.ended:.0f} s simulated in {run.took_s:.2f} s, "
        f"{recording.messages:,} messages\n"
        f"safety rules S6 and S7: {_violations(broken)}",
        soft_wrap=True,
    )
    if is_verbose() and scenario.keep == "events":
        tell_measures(row, _columns(run))


def _first_events(recording: TimedRecording) -> Table:
    table = _table(EVENT_HEADS, right=["detected", "after"], no_wrap=True)
    columns = recording.columns
    for row in np.argsort(columns["detected"], kind="stable")[:EVENTS]:
        response = float(columns["arrived"][row] - columns["detected"][row])
        zone = int(columns["zone"][row])
        table.add_row(
            _seconds(float(columns["detected"][row])),
            recording.streams[int(columns["stream"][row])],
            recording.zones[zone] if zone >= 0 else "",
            OUTCOMES[int(columns["outcome"][row])],
            _who(recording, int(columns["responder"][row])),
            _seconds(response),
            _who(recording, int(columns["actor"][row])),
        )
    return table


def _shift_lines(recording: TimedRecording) -> Iterator[str]:
    total = recording.count()
    parts = [f"{n} {name}" for name in OUTCOMES if (n := recording.count(name))]
    yield f"{total} events measured: {', '.join(parts)}"
    if recording.columns:
        columns = recording.columns
        here = recording.measured
        response = (columns["arrived"] - columns["detected"])[here]
        times = response[np.isfinite(response)]
        if len(times):
            median, late = np.percentile(times, [50, 90])
            yield f"on scene after {median:.1f} s (median), {late:.1f} s (90 % of those reached)"
    for kind in ("guard", "robot"):
        units = [n for n, unit in enumerate(recording.units) if unit.kind == kind]
        if units:
            shares = ", ".join(f"{100 * recording.utilisation(n):.0f} %" for n in units)
            yield f"{kind}s at work: {shares}"
    if recording.exposure:
        yield f"people in danger: {recording.exposure:.0f} s"
    if recording.counters:
        counted = (f"{what} {n}" for what, n in sorted(recording.counters.items()))
        yield f"counted: {', '.join(counted)}"


def _who(recording: TimedRecording, number: int) -> str:
    return recording.responders[number] if number >= 0 else ""


def _seconds(value: float) -> str:
    return f"{value:.1f} s" if math.isfinite(value) else ""


# --- a session on a congested link ---------------------------------------------------
def tell_session(run: Played, console: Console) -> None:
    """Print a session on a congested link: each flow, and the outcome of the drive."""
    scenario = run.scenario
    row = run.tables["runs"][0]
    assert isinstance(scenario, TransportScenario)
    console.rule(f"{scenario.transport.kind}, {scenario.operator.strategy}, seed {run.seed}")
    console.print(_flows(run.tables["flows"]))
    print_lines([*_session_lines(row), *_failed(row)], console)
    console.print(f"{row['simulated_s']:.0f} s simulated in {run.took_s:.2f} s", soft_wrap=True)
    tell_measures(row, _columns(run))


def _flows(flows: Sequence[Row]) -> Table:
    rate = "rate\n[kbit/s]"
    table = _table(["way", "flow", rate], right=[rate])
    for flow in flows:
        table.add_row(flow["way"], flow["flow"], f"{flow['rate_bps'] / 1000.0:.0f}")
    return table


def _session_lines(row: Row) -> Iterator[str]:
    yield (
        f"commands: {100 * row['delivered_share']:.1f} % delivered, "
        f"{row['command_rate_hz']:.1f} Hz applied, "
        f"{_ms(row['command_age_mean_s'])} old on average, "
        f"95 % within {_ms(row['command_age_p95_s'])}"
    )
    if math.isfinite(row["crucial_delivered_share"]):
        yield (
            f"crucial ones: {100 * row['crucial_delivered_share']:.1f} % delivered, "
            f"95 % within {_ms(row['crucial_age_p95_s'])}"
        )
    yield (
        f"pictures: {row['picture_rate_hz']:.1f} Hz shown, "
        f"{_ms(row['picture_age_mean_s'])} old on average, "
        f"95 % within {_ms(row['picture_age_p95_s'])}"
    )
    mean = _ms(row["round_trip_mean_s"])
    late = _ms(row["round_trip_p95_s"])
    yield f"round trip: {mean} on average, {late} at 95 %"
    done = "done" if row["completed"] else "not done"
    yield (
        f"drive: {done} in {row['movement_time_s']:.1f} s, "
        f"{row['path_error_rms_m']:.2f} m off the middle (rms), "
        f"{row['wall_crossings']} crossings"
    )


def _ms(seconds: float) -> str:
    return f"{1000.0 * seconds:.0f} ms" if math.isfinite(seconds) else "never"


# --- a task --------------------------------------------------------------------------
def tell_task(run: Played, console: Console) -> None:
    """Tell of a block of trials: the first ones, and all in a few words."""
    scenario = run.scenario
    trials = run.tables["trials"]
    row = run.tables["runs"][0]
    assert isinstance(scenario, TaskScenario)
    console.rule(f"{scenario.task.kind}, {scenario.operator.strategy}, seed {run.seed}")
    console.print(_first_trials(trials))
    if len(trials) > TRIALS:
        console.print(f"... and {len(trials) - TRIALS} more")
    console.print(f"{_count(row['trials'])}: {', '.join(_task_lines(row))}", soft_wrap=True)
    print_lines(_failed(row), console)
    console.print(f"{row['simulated_s']:.0f} s simulated in {run.took_s:.2f} s", soft_wrap=True)
    tell_measures(row, _columns(run))


def _count(trials: int) -> str:
    return "1 trial" if trials == 1 else f"{trials} trials"


def _first_trials(trials: Sequence[Row]) -> Table:
    heads_shown = {name: head for name, head in COLUMNS.items() if name in trials[0]}
    heads = ["trial", *map(_head, list(trials[0])[2:4]), *heads_shown.values()]
    table = _table(heads, right=heads, no_wrap=True)
    for trial in trials[:TRIALS]:
        first, second = list(trial.values())[2:4]
        values = (_number(trial[name]) for name in heads_shown)
        table.add_row(str(trial["number"] + 1), f"{first:.4g}", f"{second:.4g}", *values)
    return table


def _head(key: str) -> str:
    """Return a column of a condition as a head, with its unit."""
    from dva_sim.experiments.report.figures.trial import name_and_unit  # late: start-up

    name, unit = name_and_unit(key)
    return f"{name}\n[{unit}]"


def _number(value: Any) -> str:
    if isinstance(value, int):
        return str(value)
    return f"{value:.3g}" if math.isfinite(value) else "–"


def _task_lines(row: Row) -> list[str]:
    parts = [f"{100 * row['completed_share']:.0f} % done"]
    if "error_share" in row:
        parts.append(f"{100 * row['error_share']:.0f} % with an error")
    parts.append(f"{row['movement_time_s']:.2f} s on average")
    if math.isfinite(row.get("throughput_bps", math.nan)):
        parts.append(f"{row['throughput_bps']:.2f} bit/s")
    parts.append(f"{row['waits']:.1f} waits in each")
    return parts


def episode(request: EpisodeRequest, where: Console = console) -> None:
    """Play the requested runs, print them, and write their files.

    Raises:
        ConfigError: a run cannot be played, drawn or kept.
    """
    scenarios = request.scenarios()
    warn(doubts(scenarios), where)
    runs = []
    for scenario in scenarios:
        runs.append(request.play(scenario))
        tell(runs[-1], where)
    if len(runs) > 1:
        where.rule("side by side")
        print_lines(story([run.kept for run in runs if isinstance(run.kept, Recording)]), where)
    _say_written(request.write(runs), request.pictures, where)


def replay(
    file: Path,
    pictures: Wanted,
    ros2: Path | None = None,
    mcap: Path | None = None,
    where: Console = console,
) -> None:
    """Print the story of a recording, and draw or export it as requested.

    Raises:
        ConfigError: not a recording, or a requested part is not in it.
        RulesNotJudged: facts are missing to judge it by all safety rules.
    """
    from dva_sim.live.recorded_lines import is_part, readable  # late: start-up
    from dva_sim.testing.evidence import judged_recording  # late: start-up

    with readable(file, mcap) as recording:
        opened = open_recording(recording, pictures)
        run = opened.playback
        verdicts = judged_recording(opened)
        tell_story(run, where)
        if not run.recorder.timeline:
            where.print(f"[yellow]the recording lacks {STORY}: nothing to tell[/yellow]")
        if opened.tables is not None:
            how = f"simulated by dva-sim {opened.about['version']}"
            tell_outcome(opened.tables, how, where, verdicts)
        elif unjudged_rules(verdicts):
            print_lines([_unjudged(verdicts)], where)
        length = f"{run.duration:.0f} of {opened.lasted:.0f} s are there"
        if is_part(file):
            length = f"{run.duration:.0f} s are there; the run was interrupted or is still running"
        if is_part(file) or not opened.is_whole:
            where.print(f"[yellow]{file} was cut short: {length}[/yellow]", soft_wrap=True)
        made = [] if mcap is None else [f"Recording: {mcap}"]
        _say_written(chain(made, write_replay(opened, pictures, ros2)), pictures, where)
    if unjudged := unjudged_rules(verdicts):
        raise RulesNotJudged(unjudged)


def _say_written(files: Iterable[str], pictures: Wanted, where: Console) -> None:
    """Write files, and say where they are."""
    if pictures.any:
        with where.status("Drawing ..."):
            files = list(files)
    print_lines(files, where)


def tell(run: Played, console: Console) -> None:
    """Tell a run as it suits its model, one of a user's by its measures."""
    _TELLERS.get(run.scenario.model, tell_any)(run, console)


_TELLERS: dict[str, Callable[[Played, Console], None]] = {
    "full": tell_full,
    "timed": tell_shift,
    "task": tell_task,
    "transports": tell_session,
}
