"""Modules that plug-ins may import by an earlier name: told in one line where they are."""

# What pages and examples have named, and whole rooms; names are relative to `dva_sim`.
MOVED = {
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
    "experiments.fan_out": "experiments.analysis.fan_out",
    "experiments.figures": "experiments.report.figures",
    "experiments.metrics": "simulation.full.episode_measures",
    "experiments.pictures": "recordings.pictures",
    "experiments.runner": "experiments.execution.runner",
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


def name_now(module: str | None) -> str:
    """Return the present name of a module that is imported by an earlier one; else nothing."""
    package, _, rest = (module or "").partition(".")
    return f"; it is now dva_sim.{MOVED[rest]}" if package == "dva_sim" and rest in MOVED else ""
