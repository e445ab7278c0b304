"""Options of the commands that run one scenario or one robot: episode, replay, live, ..."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from dva_sim.options.forms import (
    SCENARIO,
    SCENARIOS,
    AnyPath,
    Changes,
    OptionForm,
    Overwrite,
    RunSeed,
    ScenarioName,
    Scheduler,
    Settings,
    argument,
    out_form,
    port_form,
)

SUFFIX = ".mcap"  # of a recording
LINKS = "modelled", "real"
OPERATORS = "simulated", "scripted"
PARTS = "dva", "world", "operator"
LOCALHOST = "127.0.0.1"
_FIRST = 64_999  # the greatest first one of two ports
_LINK = (
    "Emulate a link to the robots, given by keys or a file of keys; may be given again. 'scenario' "
    "uses the scenario's link."
)
Host = Annotated[str, OptionForm("Address to listen on.", metavar="HOST")]
Rosbridge = Annotated[int | None, port_form("Port for clients of ROS (rosbridge); 0: any.")]
Foxglove = Annotated[int | None, port_form("Port for Foxglove, on 127.0.0.1; 0: any.")]


@dataclass(frozen=True, kw_only=True, eq=False, match_args=False)
class PictureOptions:
    """Options of commands that draw pictures of a run."""

    video: Annotated[AnyPath, OptionForm("Write a film: .gif or .mp4.", metavar="FILE")] = None
    still: Annotated[
        AnyPath, OptionForm("Draw one moment: .png, .pdf or .svg.", metavar="FILE")
    ] = None
    at: Annotated[str | float | None, OptionForm("Time of the still.", metavar="SECONDS")] = None
    camera: Annotated[
        str | None, OptionForm("The still shows what this robot's camera sees.", metavar="ROBOT")
    ] = None
    inset: Annotated[bool, OptionForm("Show in the film what a robot's camera sees.")] = False


@dataclass(frozen=True, eq=False, match_args=False)
class EpisodeOptions(PictureOptions):
    """Options of `episode`: the scenario, its changes, and what is drawn and recorded."""

    scenario: Annotated[str | Path, SCENARIO]
    seed: RunSeed = 1
    _: KW_ONLY
    set: Settings = ()
    side_by_side: Annotated[
        str | Sequence[str] | None,
        OptionForm(
            "Run the same seed under two patterns.",
            "The episode is that of the first.",
            metavar="PATTERN,PATTERN",
        ),
    ] = None
    record: Annotated[
        AnyPath,
        OptionForm("Record the run in a file: .mcap, for replay and viewers.", metavar="FILE"),
    ] = None
    overwrite: Overwrite = False


@dataclass(frozen=True, eq=False, match_args=False)
class ReplayOptions(PictureOptions):
    """Options of `replay`: the recording, and what is drawn or written of it."""

    file: Annotated[
        str | Path,
        argument("A recording: .mcap, or the .mcap.part that a killed run left.", "FILE"),
    ]
    _: KW_ONLY
    ros2: Annotated[AnyPath, OptionForm("Write a ROS 2 bag to a new folder.", metavar="FOLDER")] = (
        None
    )
    mcap: Annotated[
        AnyPath,
        OptionForm("Turn an .mcap.part into a complete recording in a new file.", metavar="FILE"),
    ] = None


Users = Annotated[
    Path | None,
    OptionForm("File of the users who may log in; see dva-sim users.", metavar="USERS.json"),
]


@dataclass(frozen=True, kw_only=True, eq=False, match_args=False)
class PageOptions:
    """Options of commands that serve a page: its address, and whether it needs a token."""

    host: Host = LOCALHOST
    port: Annotated[int, port_form("Port of the page; 0: any free port.")] = 8765
    no_open: Annotated[bool, OptionForm("Do not open a browser.")] = False
    no_token: Annotated[
        bool, OptionForm("Disable the access token: anyone who can reach the page gets in.")
    ] = False
    users: Users = None


@dataclass(frozen=True, eq=False, match_args=False)
class LiveOptions:
    """Options of `live`: a run in real time, or one part of it."""

    scenario: ScenarioName
    _: KW_ONLY
    only: Annotated[
        str | None, OptionForm("Run only this part.", metavar="dva|world|operator", words=PARTS)
    ] = None
    number: Annotated[
        int, OptionForm("Number of the operator or the DVA, with --only.", least=1)
    ] = 1
    operators: Annotated[
        str, OptionForm("Who drives.", metavar="simulated|scripted", words=OPERATORS)
    ] = "simulated"
    dva: Annotated[
        str | None,
        OptionForm(
            "Address of the DVA, or of each region's with commas between; with --only: "
            "127.0.0.1:5600 by default, and every second port from there.",
            metavar="HOST:PORT",
        ),
    ] = None
    host: Host = LOCALHOST
    port: Annotated[
        int, port_form("First of two ports per device; default: free ports.", most=_FIRST)
    ] = 0
    keys: Annotated[
        Path | None, OptionForm("Folder of keys; turns on CURVE encryption.", metavar="FOLDER")
    ] = None
    camera_port: Annotated[
        int | None,
        port_form(
            "Port of the robots' camera pictures (HTTP); default: 8764, or none with --keys. 0: "
            "any free port."
        ),
    ] = None
    record: Annotated[
        Path | None,
        OptionForm("Record to a file (.mcap), or write traces to a folder.", metavar="FILE|FOLDER"),
    ] = None
    overwrite: Overwrite = False
    state: Annotated[Path | None, OptionForm("File from which a DVA that was killed resumes.")] = (
        None
    )
    duration: Annotated[
        float | None,
        OptionForm(
            "How long to run; default: until the scenario's horizon, or until stopped with --only "
            "dva.",
            names=("--for",),
        ),
    ] = None
    link: Annotated[
        tuple[str, ...], OptionForm(_LINK, metavar="KEY=VALUE|FILE", is_repeated=True)
    ] = ()
    page: Annotated[
        int | None,
        port_form("With --only dva: port of its page; default: 8765, or any that is free. 0: any."),
    ] = None
    no_page: Annotated[bool, OptionForm("With --only dva: serve no page.")] = False
    users: Users = None
    rosbridge: Rosbridge = None
    foxglove: Foxglove = None
    no_token: Annotated[
        bool, OptionForm("Disable the access token of the page, --rosbridge and --foxglove.")
    ] = False
    seed: RunSeed = 1
    set: Changes = ()
    shows_run: Annotated[
        bool,
        OptionForm(also="True if parts write all lines even without a recording, for viewers."),
    ] = False

    @property
    def serves_page(self) -> bool:
        """True if a page is served: beside a DVA that runs alone."""
        return self.only == "dva" and not self.no_page

    @property
    def shows_pictures(self) -> bool:
        """True if robots' pictures are served: with keys only on request, since HTTP has none."""
        return self.keys is None or self.camera_port is not None

    @property
    def records_run(self) -> bool:
        """True if a recording is wanted, and not only traces."""
        return self.record is not None and self.record.suffix.lower() == SUFFIX


@dataclass(frozen=True, kw_only=True, eq=False, match_args=False)
class ConsoleOptions(PageOptions):
    """Options of `console`: of its own scenario, of a DVA elsewhere, or of a study's recordings."""

    scenario: Annotated[
        str | None,
        argument("A scenario by name or path; default: hands-on.", "SCENARIO", *SCENARIOS),
    ] = None
    links: Annotated[
        str,
        OptionForm(
            "Use simulated links, or real sockets that external programs can join.",
            metavar="modelled|real",
            words=LINKS,
        ),
    ] = "modelled"
    dva_port: Annotated[
        int,
        port_form(
            "With --links real: first of the two ports of the DVA; 0: any two free ports.",
            most=_FIRST,
        ),
    ] = 0
    link: Annotated[
        tuple[str, ...],
        OptionForm("With --links real: " + _LINK, metavar="KEY=VALUE|FILE", is_repeated=True),
    ] = ()
    dva: Annotated[
        str | None,
        OptionForm(
            "Show the system of this DVA, or of the DVAs of all regions, with commas between; "
            "SCENARIO provides the map.",
            metavar="HOST:PORT",
        ),
    ] = None
    keys: Annotated[
        Path | None,
        OptionForm(
            "With --dva: folder of keys, including one of a control room; see `dva-sim keys`.",
            metavar="FOLDER",
        ),
    ] = None
    phones: Annotated[bool, OptionForm("Serve phones over HTTPS, and print a QR code.")] = False
    phones_host: Annotated[str, OptionForm("Address to listen on for phones.", metavar="HOST")] = (
        "0.0.0.0"
    )
    phones_port: Annotated[int, port_form("Port for phones; 0: any free port.")] = 8766
    results: Annotated[
        Path | None,
        OptionForm(
            "Show the recordings of a study, worst first, with its report.", metavar="FOLDER"
        ),
    ] = None
    record: Annotated[Path | None, OptionForm("Record the run in a file: .mcap, for replay.")] = (
        None
    )
    audit: Annotated[
        Path | None,
        OptionForm("Keep an audit log of all actions: .sqlite; an existing log is appended to."),
    ] = None
    out: Annotated[Path | None, out_form("Save tables of what people did in this folder.")] = None
    keep_motion: Annotated[
        Path | None,
        OptionForm(
            "Save motion data of phones whose users agree in this folder.", metavar="FOLDER"
        ),
    ] = None
    overwrite: Overwrite = False
    rosbridge: Rosbridge = None
    foxglove: Foxglove = None
    seed: RunSeed = 1
    set: Changes = ()

    @property
    def played(self) -> str:
        """Name or path of the scenario that the console runs itself."""
        return self.scenario or "hands-on"


@dataclass(frozen=True, kw_only=True, eq=False, match_args=False)
class RobotOptions(PageOptions):
    """Options of `robot`: a simulated robot, or one that is controlled through ROS."""

    profile: Annotated[
        str,
        argument("A robot by name or path; with --ros: agents/ros.", "PROFILE", "agents/robots"),
    ] = ""
    dva: Annotated[
        str | None,
        OptionForm(
            "Register with this DVA and listen at once, rather than from the page.",
            metavar="HOST:PORT",
        ),
    ] = None
    number: Annotated[
        int, OptionForm("Number of the robot, which gives its id and label.", least=1, most=1000)
    ] = 1
    ros: Annotated[
        str | None,
        OptionForm("Control a ROS robot through its rosbridge server.", metavar="ws://HOST:PORT"),
    ] = None
    namespace: Annotated[str, OptionForm("With --ros: namespace of its topics.")] = "robot_1"
    listen: Annotated[
        int,
        port_form(
            "Port for requests; publications take the next one. 0: any two free ports.",
            most=_FIRST,
        ),
    ] = 0
    keys: Annotated[
        Path | None, OptionForm("Folder of keys; see `dva-sim keys`.", metavar="FOLDER")
    ] = None
    seed: RunSeed = 1
    set: Changes = ()


@dataclass(frozen=True, kw_only=True, eq=False, match_args=False)
class LoadOptions:
    """Options of `load`: how much of what, at which DVA, and for how long."""

    dva: Annotated[
        str | None,
        OptionForm("Address of a DVA; default: one is started.", metavar="HOST:PORT"),
    ] = None
    pid: Annotated[
        int | None, OptionForm("With --dva: its process here, to measure memory and files.")
    ] = None
    host: Host = LOCALHOST
    devices: Annotated[int, OptionForm("Number of devices.", least=1, most=20_000)] = 100
    sessions: Annotated[int, OptionForm("Number of robots driven.", most=2_000)] = 5
    status_hz: Annotated[float, OptionForm("Status messages of a device.", metavar="HZ")] = 1.0
    command_hz: Annotated[float, OptionForm("Commands in a session.", metavar="HZ")] = 10.0
    reports: Annotated[
        float, OptionForm("Events reported in a minute.", metavar="N", above=-1.0)
    ] = 30.0
    churn: Annotated[
        float, OptionForm("Devices that vanish or return in a minute.", metavar="N", above=-1.0)
    ] = 30.0
    duration: Annotated[
        float, OptionForm("How long to measure.", names=("--for",), metavar="SECONDS")
    ] = 30.0
    until_it_breaks: Annotated[
        bool, OptionForm("Double the devices until requests are lost, refused or late.")
    ] = False
    processes: Annotated[
        int, OptionForm("Number of processes that make the load.", least=1, most=16)
    ] = 1
    scheduler: Scheduler = None
    keys: Annotated[
        Path | None,
        OptionForm("Folder of keys; turns on CURVE. Those missing are made.", metavar="FOLDER"),
    ] = None
    out: Annotated[Path | None, out_form("Save the figures: X.csv.", "FILE")] = None
    overwrite: Overwrite = False
    seed: RunSeed = 1
