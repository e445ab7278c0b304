"""dva-sim: a test bench for surveillance teams of people and teleoperated robots.

    import dva_sim

    results = dva_sim.run("my-study.yaml", set={"persons": 4}, jobs=2)
    results.answer.lead
    results.runs["drive_time_s"]

Names are loaded when first used; `dva_sim.api` explains it.
"""

from importlib import import_module
from typing import Any

__version__ = "0.9.0"
__all__ = [
    "Comparison",
    "Episode",
    "Results",
    "compare",
    "dry_run",
    "episode",
    "export",
    "load",
    "new",
    "register",
    "replay",
    "report",
    "run",
    "show",
    "tune",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'dva_sim' has no attribute {name!r}")
    # By name, since what lies below must not seem to depend on what lies above it.
    value = getattr(import_module("dva_sim.api"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
