"""The commands that play or replay one scenario, or one robot: episode, replay, live, robot."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

from dva_sim import api
from dva_sim.cli.options import (
    ROBOTS,
    SCENARIOS,
    Host,
    NoOpen,
    NoToken,
    Overwrite,
    Port,
    Quiet,
    RunSeed,
    ScenarioName,
    Sets,
    Verbose,
    choice,
    count,
    file,
    folder,
    number,
    takes,
)
from dva_sim.cli.verbosity import loudness
from dva_sim.kernel.errors import ConfigError

_MOST_PORT = 64_999
LINKS = "modelled", "real"


@takes(api.episode)
def episode(quiet: Quiet = False, verbose: Verbose = False, **asked: Any) -> None:
    """Run one scenario and tell its story.

    Examples:
        dva-sim episode fire-drill --seed 3  # the story, line by line
        dva-sim episode drive-to-event --set link.delay_s=1  # over a slower link
        dva-sim episode evacuation --strip fire.png  # several moments in one figure
        dva-sim episode fire-drill --record drill.mcap  # for `dva-sim replay` and viewers
    """
    from dva_sim.cli import stories  # late: start-up
    from dva_sim.experiments.report.episode import EpisodeRequest  # late: start-up
    from dva_sim.experiments.study.scenario_mistakes import mistakes_of  # late: start-up

    request = EpisodeRequest.of(**asked)
    with loudness(quiet, verbose), mistakes_of(request.scenario, request.changes, request.seed):
        stories.episode(request)


@takes(api.replay)
def replay(
    file: str,
    ros2: str | None,
    mcap: str | None,
    console: Annotated[bool, Option("--console", help="Play it on a page in the browser.")] = False,
    host: Host = "127.0.0.1",
    port: Port = 8765,
    no_open: NoOpen = False,
    no_token: NoToken = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    **pictures: Any,
) -> None:
    """Tell and draw a recorded run from its file alone.

    Examples:
        dva-sim replay drill.mcap --console  # play, pause, jump, on a page in the browser
        dva-sim replay drill.mcap --strip drill.png  # several moments in one figure
        dva-sim replay drill.mcap --ros2 bag  # for the tools of ROS 2
        dva-sim replay drill.mcap.part --mcap cut.mcap  # of a run that was killed
    """
    if console:
        page = {"host": host, "port": port, "open": not no_open, "token": not no_token}
        with loudness(quiet, verbose):
            _show_replay(file=Path(file), **page)
        return
    from dva_sim.cli import stories  # late: start-up
    from dva_sim.recordings.pictures import Wanted  # late: start-up

    with loudness(quiet, verbose):
        bag, kept = (None if to is None else Path(to) for to in (ros2, mcap))
        stories.replay(Path(file), Wanted.of(**pictures), bag, kept)


def _show_replay(**asked: Any) -> None:
    """Play recordings on a page in the browser, until Ctrl-C."""
    from dva_sim.cli import exposure  # late: start-up

    exposure.warn_of_pages([asked["host"]], has_token=asked["token"], can=exposure.WATCHERS)
    from dva_sim.console.replay.console import ReplayOptions, show_replay  # late: start-up

    show_replay(ReplayOptions(**asked), _say_at_once)


def live(
    scenario: ScenarioName,
    only: Annotated[
        str | None, choice("dva", "world", "operator", help="Run one part alone.")
    ] = None,
    which: Annotated[int, count("Which operator, with --only operator.", "--number", least=1)] = 1,
    operators: Annotated[str, choice("simulated", "scripted", help="Who drives.")] = "simulated",
    dva: Annotated[
        str | None,
        Option(metavar="HOST:PORT", help="Where the DVA listens; 127.0.0.1:5600 with --only."),
    ] = None,
    host: Annotated[
        str, Option(metavar="HOST", help="Address of this machine to listen on.")
    ] = "127.0.0.1",
    port: Annotated[
        int,
        count(
            "First port, two for each device; default: free ones.", metavar="PORT", most=_MOST_PORT
        ),
    ] = 0,
    keys: Annotated[Path | None, folder("Folder of keys: CURVE is on.")] = None,
    camera_port: Annotated[
        int | None,
        count(
            "Port of the robots' pictures (HTTP); default: 8764, with --keys none. 0: any.",
            metavar="PORT",
            most=65_535,
        ),
    ] = None,
    record: Annotated[
        Path | None,
        Option(metavar="FILE|FOLDER", help="A recording (.mcap); or a folder of traces."),
    ] = None,
    overwrite: Overwrite = False,
    state: Annotated[Path | None, file("File that lets a killed DVA go on where it was.")] = None,
    seconds: Annotated[
        float | None,
        Option(
            "--for",
            metavar="SECONDS",
            parser=number(),
            help="How long; default: to the scenario's horizon, or until stopped with --only dva.",
        ),
    ] = None,
    seed: RunSeed = 1,
    set_: Sets = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run a scenario in real time, over sockets.

    The DVA, the world and each operator are processes that talk by ZeroMQ.

    Examples:
        dva-sim live drive-to-event  # a simulated person drives
        dva-sim live drive-to-event --operators scripted  # fixed commands, an emergency
        dva-sim live drive-to-event --record run.mcap  # for `dva-sim replay` and `check`
        dva-sim live drive-to-event --only dva --dva 192.168.1.10:5600  # one part here
    """
    from dva_sim.cli import exposure, live_screen  # late: start-up
    from dva_sim.live.options import LiveOptions  # late: start-up
    from dva_sim.network.addresses import problem_of  # late: start-up

    changes = tuple(set_ or ())
    options = LiveOptions(
        scenario=scenario,
        changes=changes,
        seed=seed,
        operators=operators,
        host=host,
        dva=dva,
        port=port,
        keys=keys,
        record=record,
        state=state,
        duration=seconds,
        overwrite=overwrite,
        camera_port=camera_port,
    )
    at = dva if dva is not None and not problem_of(dva) and only in (None, "dva") else None
    listens = [] if at is None else [at.rpartition(":")[0]]
    if only != "dva" or (dva is None and port):
        listens.append(host)
    exposure.warn_of_devices(listens, has_keys=keys is not None, close_by="--keys FOLDER closes it")
    if keys is not None and camera_port is not None and only in (None, "world"):
        exposure.warn_of_pictures([host])
    with loudness(quiet, verbose):
        if only is None:
            live_screen.run_all(options)
        else:
            live_screen.run_one(only, options, which)


def console(
    scenario: Annotated[
        str | None,
        Argument(
            metavar="SCENARIO",
            autocompletion=SCENARIOS,
            help="A scenario by name or path; hands-on if none is named.",
        ),
    ] = None,
    port: Port = 8765,
    host: Host = "127.0.0.1",
    links: Annotated[
        str, choice(*LINKS, help="As the scenario models them, or sockets that others join.")
    ] = "modelled",
    dva_port: Annotated[
        int, count("With real links: port of the DVA; 0: any.", metavar="PORT", most=_MOST_PORT)
    ] = 0,
    dva: Annotated[
        str | None,
        Option(metavar="HOST:PORT", help="Show what runs at this DVA; SCENARIO gives the plan."),
    ] = None,
    keys: Annotated[
        Path | None, folder("With --dva: keys, one of a control room, from `dva-sim keys`.")
    ] = None,
    phones: Annotated[
        bool, Option("--phones", help="An address for phones, by https, with a QR code.")
    ] = False,
    phones_host: Annotated[
        str, Option(metavar="HOST", help="Address of this machine to listen on for phones.")
    ] = "0.0.0.0",
    phones_port: Annotated[
        int, count("Port for phones; 0: any that is free.", metavar="PORT", most=65_535)
    ] = 8766,
    no_open: NoOpen = False,
    no_token: NoToken = False,
    results: Annotated[
        Path | None, folder("Show the recordings of a study, worst first, and its report.")
    ] = None,
    record: Annotated[Path | None, file("Keep the run as a file: .mcap, for replay.")] = None,
    audit: Annotated[
        Path | None, file("Keep who did what: .sqlite; an existing log is appended to.")
    ] = None,
    out: Annotated[
        Path | None,
        Option("-o", "--out", metavar="FOLDER", help="Keep tables of what people did there."),
    ] = None,
    keep_motion: Annotated[
        Path | None, folder("Keep the motion of phones there whose person agrees.")
    ] = None,
    overwrite: Overwrite = False,
    seed: RunSeed = 1,
    set_: Sets = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Drive a scenario's robots in real time, on a page in the browser.

    Examples:
        dva-sim console  # two robots, two guards, a fire and a leak
        dva-sim console fire-drill --set link.delay_s=0.5  # any scenario, over a slower link
        dva-sim console --record run.mcap  # for `dva-sim replay` and `check`
        dva-sim console --audit audit.sqlite  # who decided what, for `check`
        dva-sim console -o results/mine  # tables of the drives, for `show` and `report`
        dva-sim console --links real  # over sockets, which other devices may join
        dva-sim console --dva 127.0.0.1:5600  # what a `dva-sim live` does, here or elsewhere
        dva-sim console --phones  # prints an address to be scanned by a phone
        dva-sim console --results results/mine  # recordings of a study, the worst first
    """
    if results is not None:
        page = {"host": host, "port": port, "open": not no_open, "token": not no_token}
        with loudness(quiet, verbose):
            _show_replay(results=results, **page)
        return
    from dva_sim.cli import exposure  # late: start-up
    from dva_sim.console.attached.options import AttachOptions, refuse_with_dva  # late: start-up
    from dva_sim.console.attached.supervisor import attach  # late: start-up
    from dva_sim.console.options import DEFAULT, ConsoleOptions  # late: start-up
    from dva_sim.console.supervisor import ConsoleSupervisor  # late: start-up
    from dva_sim.experiments.study.scenario_mistakes import mistakes_of  # late: start-up

    changes = tuple(set_ or ())
    if dva is not None:
        own = {"--links": links != "modelled", "--phones": phones, "--record": record, "-o": out}
        refuse_with_dva([name for name, given in own.items() if given])
        where = AttachOptions(
            dva=dva,
            keys=keys,
            scenario=scenario,
            changes=changes,
            audit=audit,
            host=host,
            port=port,
            token=not no_token,
            open=not no_open,
        )
        where.check()
        exposure.warn_of_pages([host], has_token=where.token)
        exposure.warn_of_devices(
            [where.listen], has_keys=keys is not None, close_by="--keys FOLDER closes it"
        )
        attach(where, _say_at_once)
        return
    if keys is not None:
        raise ConfigError("--keys is for --dva: devices of a console encrypt nothing")
    options = ConsoleOptions(
        scenario=scenario or DEFAULT,
        seed=seed,
        changes=changes,
        host=host,
        port=port,
        token=not no_token,
        phones=phones,
        phones_host=phones_host,
        phones_port=phones_port,
        links=links,
        dva_port=dva_port,
        open=not no_open,
        record=record,
        audit=audit,
        results=out,
        keep_motion=keep_motion,
        overwrite=overwrite,
    )
    pages = [host, *([phones_host] if phones else [])]
    exposure.warn_of_pages(pages, has_token=options.token)
    exposure.warn_of_devices(
        [host] if links == "real" else [], has_keys=False, close_by="--host 127.0.0.1 closes it"
    )
    with loudness(quiet, verbose), mistakes_of(options.scenario, list(changes), seed):
        ConsoleSupervisor(options, _say_at_once).run()


def robot(
    profile: Annotated[
        str, Argument(metavar="PROFILE", autocompletion=ROBOTS, help="A robot by name or path.")
    ] = "servrobot",
    dva: Annotated[
        str | None,
        Option(metavar="HOST:PORT", help="Register there at once, and listen; else from the page."),
    ] = None,
    number: Annotated[
        int, count("Which robot it is, which says its id and label.", least=1, most=1000)
    ] = 1,
    listen: Annotated[
        int, count("Port at which it takes requests; 0: any.", metavar="PORT", most=_MOST_PORT)
    ] = 0,
    port: Annotated[
        int, count("Port of the page; 0: any that is free.", metavar="PORT", most=65_535)
    ] = 8765,
    host: Annotated[
        str, Option(metavar="HOST", help="Address of this machine to listen on.")
    ] = "127.0.0.1",
    keys: Annotated[Path | None, folder("Keys of the devices, as by `dva-sim keys`.")] = None,
    no_open: Annotated[bool, Option("--no-open", help="Open no browser.")] = False,
    no_token: Annotated[
        bool, Option("--no-token", help="Let everybody in who reaches the page.")
    ] = False,
    seed: RunSeed = 1,
    set_: Sets = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run one simulated robot over sockets, with its windows.

    It begins off: it is registered at any DVA, and its port opened, from its page.

    Examples:
        dva-sim robot  # the service robot; register it and open its port on the page
        dva-sim robot pibot --dva 192.168.1.10:5600  # the model car, at a DVA elsewhere
        dva-sim robot --number 2 --port 0  # another one beside it: robot-2
    """
    from dva_sim.cli import exposure  # late: start-up
    from dva_sim.console.alone.robot_simulator import RobotOptions, RobotSimulator  # late: start-up

    options = RobotOptions(
        profile=profile,
        number=number,
        dva=dva,
        listen=listen,
        port=port,
        host=host,
        keys=keys,
        open=not no_open,
        token=not no_token,
        seed=seed,
        changes=tuple(set_ or ()),
    )
    exposure.warn_of_pages([host], has_token=options.token)
    exposure.warn_of_devices([host], has_keys=keys is not None, close_by="--keys FOLDER closes it")
    with loudness(quiet, verbose):
        RobotSimulator(options, _say_at_once).run()


def _say_at_once(line: str) -> None:
    """A line for whoever waits for it, also through a pipe."""
    typer.echo(line)
    sys.stdout.flush()


def keys(
    folder: Annotated[Path, Argument(metavar="FOLDER", help="Where to put them.")],
    names: Annotated[
        list[str], Argument(metavar="NAME...", help="Devices (robot-1, an id), or scenarios.")
    ],
) -> None:
    """Make a pair of keys for each device that has none.

    Existing keys are kept. `dva-sim live --keys FOLDER` uses them.

    FOLDER/public/ID.key goes to every machine, and FOLDER/secret/ID.key_secret to the machine of
    its device alone; the colons of an id are written as hyphens. Both files are text, with a line
    public-key = KEY and, in the secret one, secret-key = KEY. A key is 40 characters in Z85, in
    quotes, as the CURVE sockets of ZeroMQ take it.

    A device of another make is named by its id. It connects with its own pair, and with the public
    key of the device that it connects to as server key; protocol/README.md shows how, under Keys.

    Examples:
        dva-sim keys keys drive-to-event  # for each device of the scenario
        dva-sim keys keys dva robot-1 operator-1  # for these devices
        dva-sim keys keys 56:2B:04:E4:56:D8  # for a device of another make
    """
    from dva_sim.cli.device_keys import make_keys  # late: start-up

    typer.echo(make_keys(folder, names))
