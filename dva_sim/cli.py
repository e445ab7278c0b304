"""The words on the command line: what to run, where to write, what to show. No logic."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from dva_sim.errors import DvaSimError

app = typer.Typer(
    help="A test bench for surveillance teams of people and teleoperated robots.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # a third of the time that help takes
    pretty_exceptions_enable=False,
)

Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change one key; may be given again."),
]


@app.command()
def run(
    study: Annotated[str, typer.Argument(help="A study by name or path.")],
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Results folder.")] = None,
    set_: Sets = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the whole study.")] = None,
    jobs: Annotated[int | None, typer.Option(help="Processes; default: all cores.")] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="tcp://HOST:PORT", help="Use a dask.distributed cluster instead."),
    ] = None,
    limit: Annotated[
        float, typer.Option(metavar="SECONDS", min=1, help="A run that takes longer has failed.")
    ] = 600,
    full: Annotated[bool, typer.Option("--full", help="The study's larger version.")] = False,
    pilot: Annotated[
        int | None,
        typer.Option(metavar="PERSONS", min=1, help="Only so many, with luck of their own."),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would run.")] = False,
) -> None:
    """Run a study, or go on with one that was interrupted, and write its report."""
    from dva_sim.experiments import running

    changes = [*(set_ or []), *([f"seed={seed}"] if seed is not None else [])]
    version, workers = running.Version(full, pilot), running.Workers(jobs, scheduler, limit)
    if dry_run:
        running.plan(study, changes, out, workers, version)
        return
    raise typer.Exit(running.run(study, changes, out, workers, version))


@app.command()
def new(name: Annotated[str, typer.Argument(help="Name or path of the new study.")]) -> None:
    """Write a study to begin with: it runs as it stands, and comments say what can be changed."""
    from dva_sim.experiments.starting import told, write_study

    typer.echo(told(write_study(name)))


@app.command()
def register(
    study: Annotated[str, typer.Argument(help="A study by name or path.")],
    full: Annotated[bool, typer.Option("--full", help="Its larger version.")] = False,
    again: Annotated[
        bool, typer.Option("--again", help="In place of an earlier registration; it will be told.")
    ] = False,
) -> None:
    """Fix a study's hypotheses and size before it is run; the run then confirms or refutes them."""
    from dva_sim.experiments.registration import register as write_down
    from dva_sim.experiments.study import load_study

    typer.echo(write_down(load_study(study, full=full), again))


@app.command()
def tune(
    study: Annotated[str, typer.Argument(help="A study by name or path.")],
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Folder of the trials.")] = None,
    jobs: Annotated[int | None, typer.Option(help="Processes; default: all cores.")] = None,
) -> None:
    """Choose what a study has tuned, on persons who take no part in it, and keep it beside it."""
    from dva_sim.experiments import running

    raise typer.Exit(running.tune(study, out, jobs))


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(help="A results folder.")],
    pdf: Annotated[bool, typer.Option("--pdf", help="As PDF too, for print.")] = False,
) -> None:
    """Make the report of a results folder again: a page, its figures, and the numbers in them."""
    from dva_sim.experiments.report import write_report

    page = write_report(folder, pdf)
    typer.echo(f"Report: {page}{' and report.pdf' if pdf else ''}")


@app.command()
def show(
    folder: Annotated[Path, typer.Argument(help="A results folder.")],
    table: Annotated[
        str | None, typer.Option(metavar="NAME", help="Show the rows of a table.")
    ] = None,
    rows: Annotated[int, typer.Option(min=1, help="How many of them.")] = 20,
    columns: Annotated[
        bool, typer.Option("--columns", help="Say what the columns mean, of one table or all.")
    ] = False,
) -> None:
    """Show what a results folder holds: the answer, every cell, a table, or what columns mean."""
    from dva_sim.experiments import showing_console
    from dva_sim.experiments.results import Results

    showing_console.show(Results.load(folder), table, columns, rows)


@app.command()
def export(
    folder: Annotated[Path, typer.Argument(help="A results folder.")],
    out: Annotated[
        Path, typer.Option("-o", "--out", help="X.csv or X.parquet for one table, or a folder.")
    ],
    table: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Only this one; may be given again."),
    ] = None,
    form: Annotated[
        str | None, typer.Option("--format", metavar="csv|parquet", help="In a folder.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace what is there.")] = False,
) -> None:
    """Write tables of results for other programs, with what their columns mean."""
    from dva_sim.experiments import showing_console

    showing_console.export(folder, out, table or [], form, overwrite)


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(metavar="A", help="A results folder.")],
    second: Annotated[Path, typer.Argument(metavar="B", help="What is compared with it.")],
    measure: Annotated[
        list[str] | None,
        typer.Option(help="NAME or TABLE.NAME; default: the answer's. May be given again."),
    ] = None,
    by: Annotated[
        list[str] | None,
        typer.Option(metavar="FACTOR", help="Its levels in place of cells; may be given again."),
    ] = None,
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CONDITION",
            help="Exit with 1 if it holds: 'p95(drive_time_s) > 1.05x' (of A), "
            "'mean(events.response_s) per cell > +0.5 s', 'share(confirmed) < 95 %'. "
            "May be given again.",
        ),
    ] = None,
) -> None:
    """Compare two results folders, in pairs of runs wherever both had the same luck."""
    from dva_sim.experiments import showing_console

    raise typer.Exit(showing_console.compare(first, second, measure or [], by or [], fail_if or []))


@app.command()
def validate(
    what: Annotated[str, typer.Argument(help="dispatch, operators or network.")] = "dispatch",
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Results folder.")] = None,
    cases: Annotated[
        str | None, typer.Option(help="A file of cases, by name or path; not for operators.")
    ] = None,
    strategy: Annotated[
        str | None, typer.Option(help="How operators drive, by name; operators only.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer runs, wider errors.")] = False,
    jobs: Annotated[int | None, typer.Option(help="Processes; default: all cores.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of all luck.")] = 1,
    ablate: Annotated[
        bool, typer.Option("--ablate", help="Leave mechanisms out one by one; network only.")
    ] = False,
    live: Annotated[
        bool, typer.Option("--live", help="Measure real sockets now; network only.")
    ] = False,
    measure: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Measure the whole design, or go on with it; network only."
        ),
    ] = None,
) -> None:
    """Play what the answer is known of, by theory, from people or from sockets, and compare."""
    from dva_sim.experiments.validation import console

    sockets = console.Sockets(ablate, live, measure)
    raise typer.Exit(console.validate(what, out, cases, quick, jobs, seed, strategy, sockets))


@app.command()
def episode(
    scenario: Annotated[str, typer.Argument(help="A scenario by name or path.")],
    seed: Annotated[int, typer.Option(help="Seed of the run.")] = 1,
    set_: Sets = None,
    video: Annotated[Path | None, typer.Option(help="Write a film: .gif or .mp4.")] = None,
    still: Annotated[
        Path | None, typer.Option(help="Write one moment: .png, .pdf or .svg.")
    ] = None,
    strip: Annotated[
        Path | None, typer.Option(help="Write several moments in one figure, likewise.")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(metavar="SECONDS", help="Moment of --still, or moments of --strip: 10,20,30."),
    ] = None,
    panels: Annotated[int, typer.Option(help="Moments in a strip.")] = 6,
    camera: Annotated[
        str | None,
        typer.Option(metavar="ROBOT", help="--still shows what this robot's camera sees."),
    ] = None,
    inset: Annotated[
        bool, typer.Option("--inset", help="Show in --video what a robot's camera sees.")
    ] = False,
    side_by_side: Annotated[
        str | None,
        typer.Option(metavar="PATTERN,PATTERN", help="Run the same seed under two patterns."),
    ] = None,
    record: Annotated[
        Path | None, typer.Option(help="Keep the run as a file: .mcap, for replay and viewers.")
    ] = None,
) -> None:
    """Run one scenario and tell its story."""
    from dva_sim.experiments import console
    from dva_sim.experiments.pictures import Wanted

    pictures = Wanted(video, still, strip, at, panels, camera, inset)
    console.episode(scenario, seed, set_ or [], side_by_side, pictures, record)


@app.command()
def replay(
    file: Annotated[Path, typer.Argument(help="A recording: .mcap.")],
    video: Annotated[Path | None, typer.Option(help="Write a film: .gif or .mp4.")] = None,
    still: Annotated[
        Path | None, typer.Option(help="Write one moment: .png, .pdf or .svg.")
    ] = None,
    strip: Annotated[
        Path | None, typer.Option(help="Write several moments in one figure, likewise.")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(metavar="SECONDS", help="Moment of --still, or moments of --strip: 10,20,30."),
    ] = None,
    panels: Annotated[int, typer.Option(help="Moments in a strip.")] = 6,
    camera: Annotated[
        str | None,
        typer.Option(metavar="ROBOT", help="--still shows what this robot's camera sees."),
    ] = None,
    inset: Annotated[
        bool, typer.Option("--inset", help="Show in --video what a robot's camera sees.")
    ] = False,
    ros2: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Write a ROS 2 bag; the folder is new.")
    ] = None,
) -> None:
    """Tell and draw a recorded run from its file alone."""
    from dva_sim.experiments import replaying
    from dva_sim.experiments.pictures import Wanted

    replaying.replay(file, Wanted(video, still, strip, at, panels, camera, inset), ros2)


@app.command()
def live(
    scenario: Annotated[str, typer.Argument(help="A scenario by name or path.")],
    only: Annotated[
        str | None, typer.Option(metavar="dva|world|operator", help="Run one part alone.")
    ] = None,
    number: Annotated[int, typer.Option(help="Which operator, with --only operator.")] = 1,
    operators: Annotated[str, typer.Option(metavar="simulated|scripted")] = "simulated",
    dva: Annotated[
        str | None,
        typer.Option(
            metavar="HOST:PORT", help="Where the DVA listens; 127.0.0.1:5600 with --only."
        ),
    ] = None,
    host: Annotated[str, typer.Option(help="Address of this machine to listen on.")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(help="First port, two for each device; default: free ones.")
    ] = 0,
    keys: Annotated[Path | None, typer.Option(help="Folder of keys: CURVE is on.")] = None,
    record: Annotated[Path | None, typer.Option(help="Folder for the robots' traces.")] = None,
    state: Annotated[
        Path | None, typer.Option(help="File that lets a killed DVA go on where it was.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option("--for", metavar="SECONDS", help="Default: the horizon.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of all luck but the network's.")] = 1,
    set_: Sets = None,
) -> None:
    """Run a scenario in real time: DVA, world and operators as processes that talk by sockets."""
    from dva_sim.live import console
    from dva_sim.live.options import Options

    changes = tuple(set_ or ())
    options = Options(
        scenario, changes, seed, operators, host, dva, port, keys, record, state, seconds
    )
    if only is None:
        console.run_all(options)
    else:
        console.run_one(only, options, number)


@app.command()
def keys(
    folder: Annotated[Path, typer.Argument(help="Where to put them.")],
    names: Annotated[
        list[str], typer.Argument(metavar="NAME...", help="Devices (robot-1, an id), or scenarios.")
    ],
) -> None:
    """Make keys for devices that have none, one pair each; existing ones are kept."""
    from dva_sim.live.keys import make_keys

    typer.echo(make_keys(folder, names))


@app.command(name="list")
def list_() -> None:
    """Name the studies, scenarios, sites, agents, policies and operators there are."""
    from dva_sim.experiments import console

    console.list_all()


site = typer.Typer(help="Draw a site, or write it as files to edit.", no_args_is_help=True)
app.add_typer(site, name="site")
SiteName = Annotated[str, typer.Argument(help="A site by name or path, or a ROS map by path.")]
Options_ = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="An option of a generated site."),
]


@site.command(name="show")
def site_show(
    name: SiteName,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Default: NAME.png.")] = None,
    set_: Options_ = None,
    coverage: Annotated[
        bool, typer.Option("--coverage", help="Show where Wi-Fi is not good.")
    ] = False,
    width: Annotated[int, typer.Option(metavar="PIXELS", min=200, max=8000)] = 1650,
) -> None:
    """Draw a site and say in a line what it is."""
    from dva_sim.worlds import console

    console.show(name, out, set_ or [], coverage, width)


@site.command(name="export")
def site_export(
    name: SiteName,
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder.")] = Path(),
    set_: Options_ = None,
) -> None:
    """Write a site as YAML and GeoJSON, to go on drawing."""
    from dva_sim.worlds import console

    console.export(name, out, set_ or [])


@app.command()
def check(
    files: Annotated[
        list[str],
        typer.Argument(
            help="Messages, studies, scenarios, sites, plans, maps, agents; - reads a message. "
            "Or policy, robot, operator, filter or mapping, and names of such or mine.py:Mine. "
            "Or link: the emulated one."
        ),
    ],
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="An option of what is tried."),
    ] = None,
) -> None:
    """Tell of each file whether it is valid, and if not where and why; of a policy, a robot,
    an operator, a filter or a mapping, whether it keeps its promises; of the emulated link,
    whether real packets cross it as it is told."""
    from dva_sim.checking import console

    raise typer.Exit(console.check(files, set_ or []))


@app.command()
def schema(
    kind: Annotated[str, typer.Argument(help="message, study, scenario, cases, site or agent.")],
) -> None:
    """Print the schema of a kind of file: XSD for messages, else JSON Schema."""
    from dva_sim.checking import console

    console.print_schema(kind)


@app.command(hidden=True)
def version() -> None:
    """Print the version."""
    from dva_sim import __version__

    typer.echo(__version__)


def main() -> None:
    """Entry point: user mistakes end in one line and exit code 2, Ctrl-C in 130."""
    try:
        app(standalone_mode=True)
    except DvaSimError as error:
        print(f"dva-sim: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
