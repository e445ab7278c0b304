"""Public names of earlier versions: moved modules, and replacements of retired names."""

import re
from typing import Final

# Modules that documentation and examples named, and packages; all relative to `dva_sim`.
MOVED: Final = {
    "agents.camera": "agents.observation",
    "agents.operator.person": "agents.population",
    "agents.steering": "agents.route_following",
    "changing": "kernel.config_overrides",
    "checking": "testing",
    "clock": "kernel.clock",
    "config": "kernel.config",
    "core.dispatch.options": "kernel.options",
    "emulator": "network.emulator",
    "errors": "kernel.errors",
    "experiments.dispatch": "simulation.timed",
    "experiments.execution.runner": "experiments.runner",
    "experiments.fan_out": "experiments.analysis.fan_out",
    "experiments.figures": "experiments.report.figures",
    "experiments.metrics": "simulation.measures.episodes",
    "experiments.pictures": "recordings.pictures",
    "experiments.statistics": "statistics",
    "experiments.transports": "simulation.transports",
    "experiments.validation": "validation",
    "network.measures": "network.pattern_runs",
    "network.virtual": "network.virtual_network",
    "plugins": "kernel.plugins",
    "recorder": "kernel.recorder",
    "recordings.lapse": "recordings.reading",
    "resources": "kernel.resources",
    "scenario": "simulation.scenario",
    "simulation.full.episode_measures": "simulation.measures.episodes",
    "simulation.full.field": "simulation.full.physical_world",
    "simulation.run": "simulation.full",
    "simulation.shift": "simulation.timed",
    "simulation.transport": "simulation.transports",
    "streams": "kernel.streams",
    "tasks": "simulation.task",
    "timed": "simulation.timed",
    "validation.network.emulator": "network.emulator",
    "validation.operators.experiment_runs": "validation.operators.experiments",
    "worlds.drawing": "worlds.geojson",
    "worlds.layout": "worlds.site",
    "worlds.robot_body": "worlds.bodies",
}

RETIRED: Final[dict[str, dict[str, str]]] = {
    "key": {
        "design.saltelli": "use design.sobol, which fills the same ranges",
        "figures": "draw your own from the tables, which `dva-sim export` writes",
    },
    "kind": {
        name: f"use kind: datagrams, as the study `transports` does for {name}"
        for name in ("btp", "irtp", "rtnp", "trinomial")
    },
    "model": {
        "FILE:CLASS": "add a measure of your own to a shipped model; see `dva-sim plugins`",
    },
    "name": {
        "factorial_effects": "use paired_difference of dva_sim.statistics",
        "read_lapse": "use read_recording(path).playback",
        "sobol_indices": "use a package for sensitivity analysis on the table runs, such as SALib",
    },
    "option": {
        "--figure": "draw your own from the tables, which `dva-sim export` writes",
        "--mutants": "use `make mutants PLANTED=NAME` in a copy of the source",
        "--panels": "use --still with --at once for each moment, or --video",
        "--strip": "use --still with --at once for each moment, or --video",
        "--transport": "ZeroMQ carries a run; the study `middleware` compares it with MQTT",
    },
}
"""Replacements of retired names, by the kind of name in messages."""


def use_now(kind: str, name: str) -> str:
    """Return a line with the replacement of a retired name; empty for any other name."""
    instead = RETIRED.get(kind, {}).get(name)
    return f"{kind} {name!r} has been retired; {instead}" if instead else ""


def import_now(error: BaseException) -> str:
    """Return the end of a message with the replacement of a moved or retired import."""
    package, _, module = (getattr(error, "name", "") or "").partition(".")
    if not isinstance(error, ImportError) or package != "dva_sim":
        return ""
    if module in MOVED:
        return f"; it is now dva_sim.{MOVED[module]}"
    name = re.match(r"cannot import name '(\w+)'", str(error))
    instead = RETIRED["name"].get(name[1]) if name else None
    return f"; it has been retired: {instead}" if instead else ""
