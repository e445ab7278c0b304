"""The commands that play or replay one scenario, or one robot: episode, replay, live, robot."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from dva_sim.cli.options import Quiet, Verbose
from dva_sim.cli.verbosity import loudness
from dva_sim.kernel.errors import ConfigError
from dva_sim.options.forms import OptionForm, argument
from dva_sim.options.runs import (
    ConsoleOptions,
    EpisodeOptions,
    LiveOptions,
    PageOptions,
    ReplayOptions,
    RobotOptions,
)

_TO_ROBOTS = "to the robots", "from the robots"
_CLOSED = "--keys FOLDER closes it"


def episode(options: EpisodeOptions, quiet: Quiet = False, verbose: Verbose = False) -> None:
    """Run one scenario and tell its story.

    Examples:
        dva-sim episode fire-drill --seed 3  # the story, line by line
        dva-sim episode drive-to-event --set link.delay_s=1  # over a slower link
        dva-sim episode evacuation --still fire.png --at 60  # one moment on the map
        dva-sim episode fire-drill --record drill.mcap  # for `dva-sim replay` and viewers
    """
    from dva_sim.cli import stories  # late: start-up
    from dva_sim.experiments.report.episode import EpisodeRequest  # late: start-up
    from dva_sim.experiments.study.scenario_mistakes import mistakes_of  # late: start-up

    request = EpisodeRequest(options)
    with loudness(quiet, verbose), mistakes_of(request.scenario, request.changes, request.seed):
        stories.episode(request)


def replay(
    options: ReplayOptions,
    *,
    console: Annotated[bool, OptionForm("Play it on a page in the browser.")] = False,
    page: PageOptions,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Tell and draw a recorded run from its file.

    Examples:
        dva-sim replay drill.mcap --console  # play, pause, jump, on a page in the browser
        dva-sim replay drill.mcap --still drill.png  # its end on the map
        dva-sim replay drill.mcap --ros2 bag  # for the tools of ROS 2
        dva-sim replay drill.mcap.part --mcap cut.mcap  # of a run that was killed
    """
    if console:
        with loudness(quiet, verbose):
            _show_replay(page, file=Path(options.file))
        return
    from dva_sim.cli import stories  # late: start-up
    from dva_sim.recordings.pictures import Wanted  # late: start-up

    with loudness(quiet, verbose):
        bag, recording_copy = (
            None if to is None else Path(to) for to in (options.ros2, options.mcap)
        )
        stories.replay(Path(options.file), Wanted.of(options), bag, recording_copy)


def _show_replay(page: PageOptions, **recordings: Path) -> None:
    """Play recordings on a page in the browser, until Ctrl-C."""
    from dva_sim.cli import exposure  # late: start-up

    exposure.warn_of_pages([page.host], has_token=not page.no_token, can=exposure.WATCHERS)
    from dva_sim.console.replay.console import show_replay  # late: start-up

    show_replay(page, _say_at_once, **recordings)


def live(options: LiveOptions, quiet: Quiet = False, verbose: Verbose = False) -> None:
    """Run a scenario in real time, over sockets.

    The DVA, the world and each operator are separate processes that communicate over ZeroMQ.

    Examples:
        dva-sim live drive-to-event  # a simulated person drives
        dva-sim live drive-to-event --operators scripted  # fixed commands, an emergency
        dva-sim live drive-to-event --record run.mcap  # for `dva-sim replay` and `check`
        dva-sim live drive-to-event --link delay_s=0.2 --link loss=0.02  # over a bad link
        dva-sim live drive-to-event --only dva --dva 192.168.1.10:5600  # a DVA and its page
    """
    from dva_sim.cli import exposure, live_screen  # late: start-up
    from dva_sim.network.addresses import problem_of  # late: start-up

    only = options.only
    dva = options.dva
    has_keys = options.keys is not None
    here = dva.split(",") if dva is not None and only in (None, "dva") else []
    listens = [at.strip().rpartition(":")[0] for at in here if not problem_of(at.strip())]
    if only != "dva" or (dva is None and options.port):
        listens.append(options.host)
    exposure.warn_of_devices(listens, has_keys=has_keys, close_by=_CLOSED)
    if has_keys and options.camera_port is not None and only in (None, "world"):
        exposure.warn_of_pictures([options.host])
    if options.rosbridge is not None:
        exposure.warn_of_clients([options.host], has_token=not options.no_token)
    if options.serves_page:
        exposure.warn_of_pages([options.host], has_token=not options.no_token)
    with loudness(quiet, verbose):
        if only is None:
            live_screen.run_all(options)
        else:
            live_screen.run_one(only, options)


def console(options: ConsoleOptions, quiet: Quiet = False, verbose: Verbose = False) -> None:
    """Drive a scenario's robots in real time, on a page in the browser.

    Examples:
        dva-sim console  # two robots, two guards, a fire and a leak
        dva-sim console fire-drill --set link.delay_s=0.5  # another scenario, over a slower link
        dva-sim console --record run.mcap  # for `dva-sim replay` and `check`
        dva-sim console --audit audit.sqlite  # who decided what, verifiable with `check`
        dva-sim console -o results/mine  # tables of the drives, for `show` and `report`
        dva-sim console --links real  # over sockets that other devices can join
        dva-sim console --links real --link delay_s=0.3  # robots behind an emulated link
        dva-sim console --dva 127.0.0.1:5600  # show a running `dva-sim live`
        dva-sim console --phones  # print an address for a phone to scan
        dva-sim console --results results/mine  # recordings of a study, the worst first
    """
    if options.results is not None:
        with loudness(quiet, verbose):
            _show_replay(options, results=options.results)
        return
    from dva_sim.cli import exposure  # late: start-up

    has_token = not options.no_token
    has_keys = options.keys is not None
    if options.dva is not None:
        from dva_sim.console.remote.options import check  # late: start-up
        from dva_sim.console.remote.supervisor import attach  # late: start-up
        from dva_sim.network.addresses import address_towards  # late: start-up

        check(options)
        exposure.warn_of_pages([options.host], has_token=has_token)
        listens = [address_towards(options.dva)]
        exposure.warn_of_devices(listens, has_keys=has_keys, close_by=_CLOSED)
        attach(options, _say_at_once)
        return
    if has_keys:
        raise ConfigError("--keys needs --dva: a console's own devices do not encrypt")
    from dva_sim.cli.link_counts import in_words  # late: start-up
    from dva_sim.console.supervisor import ConsoleSupervisor  # late: start-up
    from dva_sim.experiments.study.scenario_mistakes import mistakes_of  # late: start-up
    from dva_sim.live.options import changes_of  # late: start-up

    changes = list(changes_of(options))
    pages = [options.host, *([options.phones_host] if options.phones else [])]
    exposure.warn_of_pages(pages, has_token=has_token)
    if options.rosbridge is not None:
        exposure.warn_of_clients([options.host], has_token=has_token)
    exposure.warn_of_devices(
        [options.host] if options.links == "real" else [],
        has_keys=False,
        close_by="--host 127.0.0.1 closes it",
    )
    with loudness(quiet, verbose), mistakes_of(options.played, changes, options.seed):
        supervisor = ConsoleSupervisor(options, _say_at_once)
        try:
            supervisor.run()
        finally:
            for line in in_words(supervisor.packets, _TO_ROBOTS) if supervisor.packets else ():
                _say_at_once(line)


def robot(options: RobotOptions, quiet: Quiet = False, verbose: Verbose = False) -> None:
    """Run one simulated robot over sockets, or connect a ROS robot.

    A simulated robot starts switched off: register it with a DVA and open its port from its page.
    A ROS robot has no page. It registers once its odometry matches its profile.

    Examples:
        dva-sim robot  # the service robot; register it and open its port on the page
        dva-sim robot pibot --dva 192.168.1.10:5600  # the model car, at a DVA elsewhere
        dva-sim robot --number 2 --port 0  # another one beside it: robot-2
        dva-sim robot --ros ws://192.168.1.20:9090 --dva 192.168.1.10:5600  # a robot of ROS
    """
    from dva_sim.cli import exposure  # late: start-up

    listens = [options.host]
    has_keys = options.keys is not None
    if options.ros is not None:
        from dva_sim.live.ros_robot import run_ros_robot  # late: start-up

        exposure.warn_of_devices(listens, has_keys=has_keys, close_by=_CLOSED)
        with loudness(quiet, verbose):
            run_ros_robot(options, _say_at_once)
        return
    from dva_sim.console.simulator.robot_simulator import RobotSimulator  # late: start-up

    exposure.warn_of_pages(listens, has_token=not options.no_token)
    exposure.warn_of_devices(listens, has_keys=has_keys, close_by=_CLOSED)
    with loudness(quiet, verbose):
        RobotSimulator(options, _say_at_once).run()


def _say_at_once(line: str) -> None:
    """Print a line at once, also through a pipe."""
    typer.echo(line)
    sys.stdout.flush()


def keys(
    folder: Annotated[Path, argument("Folder for the keys.", "FOLDER")],
    names: Annotated[
        tuple[str, ...],
        argument("Devices (robot-1, an id), or scenarios.", "NAME...", is_repeated=True),
    ],
) -> None:
    """Create a key pair for each device that has none.

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
