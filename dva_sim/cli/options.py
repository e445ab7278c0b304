"""Options that several commands have: one name, one form and one meaning for each."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from dva_sim.cli.completing import SCENARIOS, STUDIES
from dva_sim.cli.values import whole

MOST_JOBS = 1024

StudyName = Annotated[
    str, Argument(metavar="STUDY", autocompletion=STUDIES, help="A study by name or path.")
]
ScenarioName = Annotated[
    str, Argument(metavar="SCENARIO", autocompletion=SCENARIOS, help="A scenario by name or path.")
]
Folder = Annotated[Path, Argument(metavar="FOLDER", help="A results folder.")]

Sets = Annotated[
    list[str] | None,
    Option("--set", metavar="KEY=VALUE", help="Change one key; may be given again."),
]
Jobs = Annotated[
    int | None,
    Option(
        "-j",
        "--jobs",
        metavar="N",
        parser=whole(1, MOST_JOBS),
        help="How many processes; default: one for each core.",
    ),
]
Quiet = Annotated[bool, Option("-q", "--quiet", help="Print mistakes alone.")]
Verbose = Annotated[bool, Option("-v", "--verbose", help="Print more than usual.")]
Json = Annotated[bool, Option("--json", help="Print JSON, for other programs.")]
Seed = Annotated[int, Option("--seed", metavar="N", parser=whole(), help="The run's random seed.")]
Results = Annotated[
    Path | None,
    Option("-o", "--out", metavar="FOLDER", help="Results folder; default: results/STUDY."),
]

Video = Annotated[Path | None, Option(metavar="FILE", help="Write a film: .gif or .mp4.")]
Still = Annotated[Path | None, Option(metavar="FILE", help="Draw one moment: .png, .pdf or .svg.")]
Strip = Annotated[
    Path | None, Option(metavar="FILE", help="Draw several moments in one figure, likewise.")
]
At = Annotated[
    str | None,
    Option(metavar="SECONDS", help="Moment of --still, or moments of --strip: 10,20,30."),
]
Panels = Annotated[
    int, Option(metavar="N", parser=whole(1, 24), help="How many moments a strip has.")
]
Camera = Annotated[
    str | None,
    Option(metavar="ROBOT", help="--still shows what this robot's camera sees."),
]
Inset = Annotated[bool, Option("--inset", help="Show in --video what a robot's camera sees.")]
