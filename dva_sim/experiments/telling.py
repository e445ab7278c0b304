"""A run told in the terminal: its story line by line, then what came of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from dva_sim.experiments.details import tell_measures
from dva_sim.experiments.models import Tables
from dva_sim.experiments.verdicts import story
from dva_sim.simulation import Playback

STYLES = {"safety": "bold red", "mode": "dim", "order": "cyan", "drive": "cyan", "link": "yellow"}
DRIVES = {"lost link": "given up, the link was taken for lost", "gave up": "given up"}

Row = Mapping[str, Any]


def tell_story(playback: Playback, console: Console) -> None:
    """What happened, in order."""
    scenario = playback.scenario
    delay, phone = scenario.link.delay_s * 1000, scenario.phone.profile
    console.rule(f"{scenario.pattern}, {delay:g} ms each way, phone {phone}, seed {playback.seed}")
    table = Table(box=None, pad_edge=False)
    for heading in ("time", "who", "what"):
        table.add_column(heading, justify="right" if heading == "time" else "left", style="")
    for moment in playback.recorder.timeline:
        style = STYLES.get(moment.kind, "")
        table.add_row(f"{moment.time:7.1f} s", moment.who, escape(moment.what), style=style)
    console.print(table)


def tell_side_by_side(runs: Sequence[Playback], console: Console) -> None:
    """How runs under several patterns ended, beside each other."""
    console.rule("side by side")
    for line in story(runs):
        console.print(line, soft_wrap=True)


def tell_outcome(tables: Tables, how: str, console: Console) -> None:
    """What came of it.

    Args:
        tables: The rows of the run, by table.
        how: How it came about, after its length in seconds.
        console: Where.
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
    counts = f"{row['messages']} messages, {row['violations']} safety rules broken"
    lines.append(f"{row['simulated_s']:.0f} s {how}, {counts}")
    if failures := row["plugin_failures"]:
        lines.append(
            f"{failures} times an operator, filter, mapping or drive of yours gave no answer"
        )
    for line in ("", *lines):
        console.print(line, soft_wrap=True)
    tell_measures(row, "full")


def _event(row: Row) -> str:
    known = row["response_s"] == row["response_s"]
    response = f", on scene {row['response_s']:.1f} s after detection" if known else ""
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
