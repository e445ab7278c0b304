"""The commands that play or replay one scenario, or one robot: episode, replay, live, robot."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import typer

from dva_sim import api
from dva_sim.cli.options import (
    PAGE,
    REQUIRED,
    ROBOTS,
    RUN,
    SCENARIOS,
    Overwrite,
    Quiet,
    ScenarioName,
    Verbose,
    argument,
    asks,
    choice,
    count,
    file,
    flag,
    folder,
    seconds,
    takes,
    text,
)
from dva_sim.cli.verbosity import loudness
from dva_sim.kernel.errors import ConfigError

_PORT: Any = {"metavar": "PORT", "most": 64_999}  # of the first of two
LINKS = "modelled", "real"
_ADDRESS = "HOST:PORT"
_LISTEN = "Address to listen on."
_FOR = "How long to run; default: until the scenario's horizon, or until stopped with --only dva."
_PICTURES = (
    "Port of the robots' camera pictures (HTTP); default: 8764, or none with --keys. 0: any free "
    "port."
)
_SCENARIO = "A scenario by name or path; default: hands-on."
_LINK = (
    "Emulate a link to the robots, given by keys or a file of keys; may be given again. 'scenario' "
    "uses the scenario's link."
)
_TRANSPORT: Any = (
    text(
        "Transport of the messages, and options of MQTT: broker=near|far, qos=0|1.",
        metavar="zeromq|mqtt|KEY=VALUE",
        of=list[str] | None,
    ),
    None,
)
_ROSBRIDGE: Any = (
    count(
        "Port for clients of ROS (rosbridge); 0: any.", metavar="PORT", most=65_535, of=int | None
    ),
    None,
)
_FOXGLOVE: Any = (
    count("Port for Foxglove, on 127.0.0.1; 0: any.", metavar="PORT", most=65_535, of=int | None),
    None,
)
_TO_ROBOTS = "to the robots", "from the robots"
_CLOSED = "--keys FOLDER closes it"


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
@asks(console=(flag("--console", "Play it on a page in the browser."), False), **PAGE)
def replay(
    file: str,
    ros2: str | None,
    mcap: str | None,
    console: bool,
    host: str,
    port: int,
    no_open: bool,
    no_token: bool,
    quiet: Quiet = False,
    verbose: Verbose = False,
    **pictures: Any,
) -> None:
    """Tell and draw a recorded run from its file.

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


@asks(
    scenario=(ScenarioName, REQUIRED),
    only=(choice("dva", "world", "operator", help="Run only this part.", of=str | None), None),
    number=(count("Number of the operator, with --only operator.", "--number", least=1), 1),
    operators=(choice("simulated", "scripted", help="Who drives."), "simulated"),
    dva=(
        text("Address of the DVA; with --only: 127.0.0.1:5600 by default.", metavar=_ADDRESS),
        None,
    ),
    host=(PAGE["host"][0], "127.0.0.1"),
    port=(count("First of two ports per device; default: free ports.", **_PORT), 0),
    keys=(folder("Folder of keys; turns on CURVE encryption."), None),
    camera_port=(count(_PICTURES, metavar="PORT", most=65_535, of=int | None), None),
    record=(
        file("Record to a file (.mcap), or write traces to a folder.", metavar="FILE|FOLDER"),
        None,
    ),
    overwrite=(Overwrite, False),
    state=(file("File from which a DVA that was killed resumes."), None),
    duration=(seconds(_FOR, "--for"), None),
    link=(text(_LINK, metavar="KEY=VALUE|FILE", of=list[str] | None), None),
    transport=_TRANSPORT,
    rosbridge=_ROSBRIDGE,
    foxglove=_FOXGLOVE,
    no_token=(
        flag("--no-token", "Let any client use --rosbridge and --foxglove without a token."),
        False,
    ),
    **RUN,
)
def live(
    only: str | None,
    number: int,
    link: list[str] | None,
    transport: list[str] | None,
    set_: list[str] | None,
    no_token: bool,
    quiet: Quiet = False,
    verbose: Verbose = False,
    **asked: Any,
) -> None:
    """Run a scenario in real time, over sockets.

    The DVA, the world and each operator are separate processes that communicate over ZeroMQ or
    MQTT.

    Examples:
        dva-sim live drive-to-event  # a simulated person drives
        dva-sim live drive-to-event --operators scripted  # fixed commands, an emergency
        dva-sim live drive-to-event --record run.mcap  # for `dva-sim replay` and `check`
        dva-sim live drive-to-event --link delay_s=0.2 --link loss=0.02  # over a bad link
        dva-sim live drive-to-event --transport mqtt  # through a mosquitto broker on this machine
        dva-sim live drive-to-event --only dva --dva 192.168.1.10:5600  # one part here
    """
    from dva_sim.cli import exposure, live_screen  # late: start-up
    from dva_sim.live.options import LiveOptions, changes_by_link  # late: start-up
    from dva_sim.network.addresses import problem_of  # late: start-up

    changes = (*(set_ or ()), *changes_by_link(link or ()))
    options = LiveOptions(
        changes=changes,
        emulated=bool(link),
        transport=tuple(transport or ()),
        token=not no_token,
        **asked,
    )
    dva, has_keys = options.dva, options.keys is not None
    at = dva if dva is not None and not problem_of(dva) and only in (None, "dva") else None
    listens = [] if at is None else [at.rpartition(":")[0]]
    if only != "dva" or (dva is None and options.port):
        listens.append(options.host)
    exposure.warn_of_devices(listens, has_keys=has_keys, close_by=_CLOSED)
    if has_keys and options.camera_port is not None and only in (None, "world"):
        exposure.warn_of_pictures([options.host])
    if options.rosbridge is not None:
        exposure.warn_of_clients([options.host], has_token=options.token)
    with loudness(quiet, verbose):
        if only is None:
            live_screen.run_all(options)
        else:
            live_screen.run_one(only, options, number)


@asks(
    scenario=(argument(_SCENARIO, "SCENARIO", SCENARIOS, str | None), None),
    port=PAGE["port"],
    host=PAGE["host"],
    links=(
        choice(
            *LINKS, help="Use simulated links, or real sockets that external programs can join."
        ),
        "modelled",
    ),
    dva_port=(
        count(
            "With --links real: first of the two ports of the DVA; 0: any two free ports.",
            **_PORT,
        ),
        0,
    ),
    transport=_TRANSPORT,
    link=(text("With --links real: " + _LINK, metavar="KEY=VALUE|FILE", of=list[str] | None), None),
    dva=(text("Show the system of this DVA; SCENARIO provides the map.", metavar=_ADDRESS), None),
    keys=(
        folder("With --dva: folder of keys, including one of a control room; see `dva-sim keys`."),
        None,
    ),
    phones=(flag("--phones", "Serve phones over HTTPS, and print a QR code."), False),
    phones_host=(
        text("Address to listen on for phones.", metavar="HOST", of=str),
        "0.0.0.0",
    ),
    phones_port=(
        count("Port for phones; 0: any free port.", metavar="PORT", most=65_535),
        8766,
    ),
    no_open=PAGE["no_open"],
    no_token=PAGE["no_token"],
    results=(folder("Show the recordings of a study, worst first, with its report."), None),
    record=(file("Record the run in a file: .mcap, for replay."), None),
    audit=(
        file("Keep an audit log of all actions: .sqlite; an existing log is appended to."),
        None,
    ),
    out=(folder("Save tables of what people did in this folder.", "-o", "--out"), None),
    keep_motion=(folder("Save motion data of phones whose users agree in this folder."), None),
    overwrite=(Overwrite, False),
    rosbridge=_ROSBRIDGE,
    foxglove=_FOXGLOVE,
    **RUN,
)
def console(
    scenario: str | None,
    dva: str | None,
    keys: Path | None,
    no_open: bool,
    no_token: bool,
    results: Path | None,
    out: Path | None,
    transport: list[str] | None,
    link: list[str] | None,
    set_: list[str] | None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    **asked: Any,
) -> None:
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
    host, carried_by = asked["host"], tuple(transport or ())
    page = {"host": host, "port": asked["port"], "open": not no_open, "token": not no_token}
    if results is not None:
        with loudness(quiet, verbose):
            _show_replay(results=results, **page)
        return
    from dva_sim.cli import exposure  # late: start-up
    from dva_sim.cli.link_counts import in_words  # late: start-up
    from dva_sim.console.attached.options import AttachOptions, refuse_with_dva  # late: start-up
    from dva_sim.console.attached.supervisor import attach  # late: start-up
    from dva_sim.console.options import DEFAULT, ConsoleOptions  # late: start-up
    from dva_sim.console.supervisor import ConsoleSupervisor  # late: start-up
    from dva_sim.experiments.study.scenario_mistakes import mistakes_of  # late: start-up
    from dva_sim.live.options import changes_by_link  # late: start-up

    changes = (*(set_ or ()), *changes_by_link(link or ()))
    if dva is not None:
        own = {"--links": asked["links"] != "modelled", "--link": link, "--phones": asked["phones"]}
        own |= {"--record": asked["record"], "-o": out}
        own |= {"--rosbridge": asked["rosbridge"] is not None}
        own |= {"--foxglove": asked["foxglove"] is not None}
        refuse_with_dva([name for name, given in own.items() if given])
        about = {"scenario": scenario, "changes": changes, "audit": asked["audit"]}
        where = AttachOptions(dva=dva, keys=keys, transport=carried_by, **about, **page)
        where.check()
        exposure.warn_of_pages([host], has_token=where.token)
        exposure.warn_of_devices([where.listen], has_keys=keys is not None, close_by=_CLOSED)
        attach(where, _say_at_once)
        return
    if keys is not None:
        raise ConfigError("--keys needs --dva: a console's own devices do not encrypt")
    options = ConsoleOptions(
        scenario=scenario or DEFAULT,
        changes=changes,
        results=out,
        transport=carried_by,
        emulated=bool(link),
        **asked | page,
    )
    pages = [host, *([options.phones_host] if options.phones else [])]
    exposure.warn_of_pages(pages, has_token=options.token)
    if options.rosbridge is not None:
        exposure.warn_of_clients([host], has_token=options.token)
    exposure.warn_of_devices(
        [host] if options.links == "real" else [],
        has_keys=False,
        close_by="--host 127.0.0.1 closes it",
    )
    with loudness(quiet, verbose), mistakes_of(options.scenario, list(changes), options.seed):
        console = ConsoleSupervisor(options, _say_at_once)
        try:
            console.run()
        finally:
            for line in in_words(console.packets, _TO_ROBOTS) if console.packets else ():
                _say_at_once(line)


@asks(
    profile=(argument("A robot by name or path; with --ros: agents/ros.", "PROFILE", ROBOTS), ""),
    dva=(
        text(
            "Register with this DVA and listen at once, rather than from the page.",
            metavar=_ADDRESS,
        ),
        None,
    ),
    number=(count("Number of the robot, which gives its id and label.", least=1, most=1000), 1),
    ros=(text("Control a ROS robot through its rosbridge server.", metavar="ws://HOST:PORT"), None),
    namespace=(text("With --ros: namespace of its topics.", metavar="NAME", of=str), "robot_1"),
    listen=(
        count("Port for requests; publications take the next one. 0: any two free ports.", **_PORT),
        0,
    ),
    port=PAGE["port"],
    host=PAGE["host"],
    keys=(folder("Folder of keys; see `dva-sim keys`."), None),
    no_open=PAGE["no_open"],
    no_token=PAGE["no_token"],
    **RUN,
)
def robot(
    profile: str,
    ros: str | None,
    namespace: str,
    port: int,
    no_open: bool,
    no_token: bool,
    set_: list[str] | None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    **asked: Any,
) -> None:
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

    changes, dva = tuple(set_ or ()), asked.pop("dva")
    if ros is not None:
        from dva_sim.live.ros_robot import RosRobotOptions, run_ros_robot  # late: start-up
        from dva_sim.ros.profile import DEFAULT  # late: start-up

        bridged = RosRobotOptions(
            ros=ros,
            namespace=namespace,
            profile=profile or DEFAULT,
            dva=dva or "",
            changes=changes,
            **asked,
        )
        exposure.warn_of_devices(
            [bridged.host], has_keys=bridged.keys is not None, close_by=_CLOSED
        )
        with loudness(quiet, verbose):
            run_ros_robot(bridged, _say_at_once)
        return
    from dva_sim.console.simulator.robot_simulator import (  # late: start-up
        RobotOptions,
        RobotSimulator,
    )

    options = RobotOptions(
        profile=profile or "servrobot",
        port=port,
        dva=dva,
        open=not no_open,
        token=not no_token,
        changes=changes,
        **asked,
    )
    exposure.warn_of_pages([options.host], has_token=options.token)
    exposure.warn_of_devices([options.host], has_keys=options.keys is not None, close_by=_CLOSED)
    with loudness(quiet, verbose):
        RobotSimulator(options, _say_at_once).run()


def _say_at_once(line: str) -> None:
    """Print a line at once, also through a pipe."""
    typer.echo(line)
    sys.stdout.flush()


@asks(
    folder=(argument("Folder for the keys.", "FOLDER", of=Path), REQUIRED),
    names=(argument("Devices (robot-1, an id), or scenarios.", "NAME...", of=list[str]), REQUIRED),
)
def keys(folder: Path, names: list[str]) -> None:
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
