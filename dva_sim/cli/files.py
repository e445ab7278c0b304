"""The commands about names and files, and validate for the program itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer
from typer import Argument, Option

from dva_sim.cli.options import Json, Quiet, Verbose
from dva_sim.cli.verbosity import loudness, print_json
from dva_sim.kernel.suggestions import either
from dva_sim.options.forms import OptionForm, argument
from dva_sim.options.studies import ValidateOptions
from dva_sim.testing.promises import TRIALS

_FILES = (
    "Messages, studies, scenarios, sites, plans, maps, agents, recordings, traces, audit logs; "
    f"or - for a message from stdin. Or {either(TRIALS)}, then names or mine.py:Mine. "
    "Or link, to test the emulated link."
)
_SCHEMAS = "message", "study", "scenario", "cases", "site", "agent"
_RATE = "Rate of the printed commands."
_UNIT = "Unit of acceleration, if the log's header does not give it."


def _listed(incomplete: str) -> list[str]:
    """Return names that complete a kind of things that can be listed."""
    from dva_sim.cli import names  # late: start-up

    return [kind for kind in names.kinds() if kind.startswith(incomplete)]


def list_(
    kind: Annotated[
        str | None,
        Argument(metavar="KIND", autocompletion=_listed, help="Only this kind, such as studies."),
    ] = None,
    as_json: Json = False,
) -> None:
    """List all studies, scenarios, sites, agents and policies.

    Prints one line per name, with a description.

    Examples:
        dva-sim list  # all of them
        dva-sim list scenarios  # of one kind
        dva-sim list --json  # for other programs
    """
    from dva_sim.cli import names  # late: start-up

    if as_json:
        print_json(names.as_json(kind))
    else:
        names.tell(names.lines(kind))


def plugins(as_json: Json = False) -> None:
    """List the kinds of plug-ins, and how to add your own.

    Policies, operators, filters and other plug-ins are classes in your own files or in installed
    packages. Shows the kinds, what is available, and how to name one.

    Examples:
        dva-sim plugins  # all kinds
        dva-sim plugins --json  # for other programs
    """
    from dva_sim.cli import names  # late: start-up

    if as_json:
        print_json(names.plugins_as_json())
    else:
        names.tell(names.plugin_lines())


def assumed(as_json: Json = False) -> None:
    """List all assumed numbers about people and phones.

    Each is a scenario key that a study can vary as a factor.

    Examples:
        dva-sim assumed  # key, default, band and reason
        dva-sim assumed --json  # for other programs
    """
    from dva_sim.cli import names  # late: start-up
    from dva_sim.simulation.scenario import assumptions as listed  # late: start-up

    if as_json:
        print_json(listed.as_json())
    else:
        names.tell(listed.lines())


def check(
    files: Annotated[tuple[str, ...], argument(_FILES, "FILE...", is_repeated=True)],
    set: Annotated[
        tuple[str, ...],
        OptionForm("An option of the plug-in under test.", metavar="KEY=VALUE", is_repeated=True),
    ] = (),
) -> None:
    """Check files and point to each error in them.

    Plug-ins such as policies and robots are tested against the promises of their kind. The emulated
    link is tested with real packets.

    Examples:
        dva-sim check message.xml my-study.yaml worlds/*.yaml  # files of any kind
        dva-sim check - < message.xml  # a message from a pipe
        dva-sim check run.mcap  # is it valid, and are its decisions reproduced?
        dva-sim check policy agents/policies/patrol.py:Patrol  # does it keep its promises?
        dva-sim check link  # does the emulated link behave as configured?
    """
    from dva_sim.cli import checks  # late: start-up

    raise typer.Exit(checks.check(files, set))


def phone_log(
    file: Annotated[Path, argument("A log of a phone's motion sensor.", "FILE")],
    commands: Annotated[bool, OptionForm("Print the commands that the app would send.")] = False,
    rate: Annotated[float, Option(metavar="HZ", min=0.1, max=100.0, help=_RATE)] = 10.0,
    part: Annotated[
        Path | None, OptionForm("Write an accelerometer part with these properties.", metavar="OUT")
    ] = None,
    unit: Annotated[Literal["m/s2", "g"] | None, Option(help=_UNIT)] = None,
    as_json: Json = False,
) -> None:
    """Analyse or replay a log of a phone's motion sensor.

    FILE comes from a console with --keep-motion, or from a logger app: a table of time and of
    acceleration including gravity along x, y and z.

    Examples:
        dva-sim phone-log motion-1.csv  # rate, jitter, gaps, noise at rest
        dva-sim phone-log motion-1.csv --commands  # what the app made of it
        dva-sim phone-log motion-1.csv --part mine.yaml  # for phone.accelerometer
    """
    from dva_sim.cli import phone_log  # late: start-up

    if part is not None:
        phone_log.write_part(file, part, unit)
    elif commands:
        phone_log.tell_commands(file, rate)
    else:
        phone_log.tell(file, as_json, unit)


def schema(
    kind: Annotated[
        str, argument(f"{', '.join(_SCHEMAS[:-1])} or {_SCHEMAS[-1]}.", "KIND", words=_SCHEMAS)
    ],
) -> None:
    """Print the schema of a file type.

    The schema is XSD for messages and JSON Schema for everything else.

    Examples:
        dva-sim schema scenario > scenario.schema.json  # for an editor
    """
    from dva_sim.cli import checks  # late: start-up

    checks.print_schema(kind)


def validate(options: ValidateOptions, quiet: Quiet = False, verbose: Verbose = False) -> None:
    """Compare the models with theory, people and sockets.

    Runs cases with known answers. The exit code is 4 if a prediction misses.

    Examples:
        dva-sim validate dispatch --quick  # against queueing theory and geometry
        dva-sim validate operators -o evidence  # against published experiments
        dva-sim validate network --live --quick  # against sockets of this machine
    """
    from dva_sim.cli import validation  # late: start-up

    with loudness(quiet, verbose):
        code = validation.validate(options)
    raise typer.Exit(code)
