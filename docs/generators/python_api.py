"""The page of the Python API: what `import dva_sim` offers, and the classes that users derive from.

Sphinx reads signatures and docstrings from the code; this page only names the objects.
"""

from __future__ import annotations

import dva_sim
from dva_sim.testing.promises import TRIALS
from generators.markdown import page as page_of

_VALUES = {
    "dva_sim.core.dispatch": (
        *("Situation", "Task", "Responder", "Assignment", "Announcement", "Relocation"),
    ),
    "dva_sim.agents.operator.strategies": (
        *("Intent", "View", "Route", "Person", "Reach", "PointView", "PathView"),
    ),
    "dva_sim.network.patterns": ("Line",),
    "dva_sim.network.middleware": ("Rendezvous", "TransportEnd"),
    "dva_sim.worlds.hazards": ("HazardField", "Conditions"),
    "dva_sim.kernel.measure": ("Measure",),
}
"""Classes of what plug-ins receive and return, by the package that they are imported from."""
_HEAD = """\
`import dva_sim` loads nothing else: a function imports what it needs when it is called. The
functions take the options of the [commands](command-line.md) of the same name and write the same
bytes. Errors are listed under [exit codes](exit-codes.md)."""


def page() -> str:
    """Return the page in Markdown, with directives for Sphinx's autodoc."""
    public = vars(dva_sim)["__all__"]
    functions = [name for name in public if name[0].islower()]
    classes = [name for name in public if name[0].isupper()]
    bases = [trial.load_plugins().public for trial in TRIALS.values()]
    checks = [f"dva_sim.testing.{t.module}.check_{t.kind}" for t in TRIALS.values()]
    return page_of(
        "Python API",
        _HEAD,
        "## Functions",
        _directives("autofunction", [f"dva_sim.api.{name}" for name in functions]),
        "## Results",
        _directives("autoclass", [f"dva_sim.api.{name}" for name in classes], members=True),
        "## Base classes of plug-ins",
        "[Plug-ins](plugins.md) says where a file is looked for, and what each kind promises.",
        _directives("autoclass", bases, members=True),
        "## Values that plug-ins receive and return",
        _directives(
            "autoclass", [f"{m}.{name}" for m, names in _VALUES.items() for name in names], True
        ),
        "## Recordings",
        _directives("autofunction", ["dva_sim.recordings.reading.read_recording"]),
        "## Checks for tests of your own",
        "`dva-sim check KIND NAME` calls these.",
        _directives("autofunction", checks),
    )


def _directives(directive: str, names: list[str], members: bool = False) -> str:
    blocks = [
        f".. {directive}:: {name}" + "\n   :members:" * members for name in dict.fromkeys(names)
    ]
    return "\n".join(["```{eval-rst}", "\n\n".join(blocks), "```"])
