"""A live run on the terminal: the table of devices, and the story as it happens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from dva_sim.cli.link_counts import in_words
from dva_sim.cli.verbosity import detail, is_verbose
from dva_sim.kernel.errors import DvaSimError
from dva_sim.live import process
from dva_sim.live.options import check, scenario_of
from dva_sim.live.process import Report, run_part
from dva_sim.live.supervisor import Summary, Supervisor
from dva_sim.network.sockets import DEFAULT_PORT
from dva_sim.options.runs import LOCALHOST, PARTS, LiveOptions
from dva_sim.protocol.devices import DETECTOR
from dva_sim.serving.open_port import OpenPort, open_port
from dva_sim.simulation.full.verdicts import Verdict, refuse_unheld
from dva_sim.simulation.scenario import contradictions

if TYPE_CHECKING:
    from dva_sim.live.foxglove_server import FoxgloveServer

STORY_LINES = 12
ALWAYS_SHOWN = "refused", "not sent", "form", "not recorded"  # parts of names of counters
ORDERING_WAIT_S = (
    2.0  # lines of several parts are told in order: so long does one wait for earlier ones [s]
)
DEFAULT_DVA = f"127.0.0.1:{DEFAULT_PORT}"  # default for a part that is run alone
WIDTH = 80  # width without a terminal [characters]
COLUMNS = (
    "heard\ns ago",
    "heart-\nbeats/s",
    "com-\nmands/s",
    "refused\nso far",
    "picture\ns old",
    "round\ntrip ms",
)


class Board:
    """State of all devices, assembled from the reports of all parts.

    Attributes:
        addresses: Lines that say where others connect, to be printed once the DVA listens.
    """

    def __init__(self) -> None:
        self.devices: dict[str, dict[str, Any]] = {}
        self.events: list[dict[str, Any]] = []
        self.story: list[list[Any]] = []
        self.time = 0.0
        self.dvas: set[str] = set()
        self.addresses = list[str]()
        self._registered: dict[int, set[str]] = {}  # labels, by the number of the DVA
        self._events: dict[int, list[dict[str, Any]]] = {}

    def hear(self, report: Report) -> list[list[Any]]:
        """Take a report; the new lines of the story."""
        self.time = max(self.time, report.time)
        for row in report.rows:
            self.devices.setdefault(row["label"], {}).update(row)
        if report.part == "dva":
            self.dvas |= {report.dva} if report.dva else set()
            self._events[report.number] = report.events
            every = {event["number"]: event for of in self._events.values() for event in of}
            self.events = [every[number] for number in sorted(every)]
            before = set().union(*self._registered.values())
            self._registered[report.number] = {row["label"] for row in report.rows}
            for label in before - set().union(*self._registered.values()):
                del self.devices[label]
        self.story = sorted(self.story + report.story)[-1000:]
        return sorted(report.story)

    def table(self) -> Table:
        """Return the devices with their types, activities and links.

        Two lines for each, so that the columns fit 80 characters; a label or an address that is
        longer goes on below.
        """
        title = f"after {self.time:.0f} s"
        table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, padding=0)
        for column in ("device\ntype", "doing\naddress"):
            table.add_column(column, overflow="fold")
        for column in COLUMNS:
            table.add_column(column, justify="right", no_wrap=True)
        for label, row in sorted(self.devices.items()):
            # As it is: a label may look like markup, and comes from whoever registers.
            table.add_row(*(Text(cell) for cell in _cells(label, row)))
        return table


def story_line(line: list[Any]) -> str:
    """Return a line of the timeline."""
    time, who, what, _ = line
    return f"{time:7.1f} s  {who:<14} {what}"


def _cells(label: str, row: dict[str, Any]) -> list[str]:
    listened_to = row.get("type") != DETECTOR  # a detector speaks only when it has something to say
    silent = row.get("silent") and listened_to
    return [
        f"{label}\n{row.get('type', '')}".rstrip(),
        f"{row.get('doing', '')}\n{row.get('address', '')}".rstrip("\n"),
        "silent" if silent else _number(row.get("heard_s"), ".1f"),
        _number(row.get("beats_hz") if listened_to else None, ".1f"),
        _number(row.get("commands_hz"), ".1f"),
        _number(row.get("refused"), "d"),
        _number(row.get("picture_age_s"), ".2f"),
        _number(row.get("round_trip_s"), ".1f", 1000.0),
    ]


def _number(value: float | None, form: str, factor: float = 1) -> str:
    return "" if value is None else f"{value * factor:{form}}"


def run_all(options: LiveOptions) -> None:
    """Run all parts, show them, and say how it ended.

    Raises:
        DvaSimError: the scenario cannot be run, or a part failed.
    """
    console = _console()
    board = Board()
    warn(console, options)
    door = None
    if options.rosbridge is not None:
        door = open_port(options.host, options.rosbridge, "--rosbridge", not options.no_token)
        board.addresses.append(f"rosbridge: {door.url}")
    with ExitStack() as at_end:
        viewer = None
        if options.foxglove is not None:
            from dva_sim.live.foxglove_server import FoxgloveServer  # late: start-up

            port = open_port(LOCALHOST, options.foxglove, "--foxglove", not options.no_token)
            viewer = FoxgloveServer(scenario_of(options), options.seed, port)
            at_end.callback(viewer.close)
            board.addresses.append(viewer.where)
        summary = _watched(console, board, partial(Supervisor, options), door, viewer)
    _conclude(console, board, summary, options)


def _watched(
    console: Console,
    board: Board,
    make: Callable[..., Supervisor],
    door: OpenPort | None,
    viewer: FoxgloveServer | None,
) -> Summary:
    """Run all parts, and show them on a terminal as they run."""
    if not console.is_terminal:
        with closing(InOrder(console, board)) as ordered:
            return make(lambda _, report: ordered.hear(report), door, viewer).run()
    with Live(console=console, refresh_per_second=4, transient=True) as screen:

        def hear(_: str, report: Report) -> None:
            _say_where(screen.console, board, report)
            board.hear(report)
            story = "\n".join(story_line(line) for line in board.story[-STORY_LINES:])
            screen.update(Group(board.table(), Text(story)))

        summary = make(hear, door, viewer).run()
    for line in board.story:
        _print(console, story_line(line))
    return summary


def warn(console: Console, options: LiveOptions) -> None:
    """Say what does not go together, before anything starts."""
    for entry in contradictions(scenario_of(options), live=not options.link):
        _print(console, f"warning: {entry}")


def _say_where(console: Console, board: Board, report: Report) -> None:
    """Print once where the DVA listens, and with it all other addresses: all can be reached."""
    if report.dva is not None and report.dva not in board.dvas:
        for line in (f"DVA: {report.dva}", *board.addresses):
            _print(console, line)
        board.addresses.clear()


def _print(console: Console, line: str) -> None:
    console.print(line, highlight=False, markup=False, soft_wrap=True)


def _console() -> Console:
    console = Console()
    return console if console.is_terminal else Console(width=WIDTH)


def run_one(part: str, options: LiveOptions) -> None:
    """Run one part in this process and show its view of the run.

    Raises:
        DvaSimError: the scenario, the keys or the ports are not as they should be.
    """
    console = _console()
    board = Board()
    warn(console, options)
    if options.dva is None and (part != "dva" or not options.port):
        options = replace(options, dva=_default_dvas(options))
    check(options)
    if part in PARTS and part != "dva":
        _print(console, f"Looking for the DVA at {options.dva} for {process.DVA_WAIT_S:g} s ...")
    with Live(console=console, refresh_per_second=4, transient=True) as screen:

        def say(report: Report) -> None:
            _say_where(screen.console, board, report)
            for line in board.hear(report):
                _print(screen.console, story_line(line))
            if console.is_terminal:
                screen.update(board.table())

        beside = None
        if options.serves_page:
            from dva_sim.console.remote.beside import PageBeside  # late: start-up

            beside = PageBeside(options, partial(_print, screen.console))
        verdicts = run_part(part, options, say, options.number, beside=beside)
    console.print(board.table())
    _print_rules(console, verdicts)
    refuse_unheld(verdicts)


def _default_dvas(options: LiveOptions) -> str:
    """Return where DVAs listen if nobody says so: each at the second port after the last."""
    host, _, port = DEFAULT_DVA.rpartition(":")
    count = max(1, len(scenario_of(options).dva.regions))
    return ",".join(f"{host}:{int(port) + 2 * n}" for n in range(count))


class InOrder:
    """Prints the story in order of time, although each part tells its own lines once a second."""

    def __init__(self, console: Console, board: Board) -> None:
        self._console = console
        self._board = board
        self._waiting: list[list[Any]] = []

    def hear(self, report: Report) -> None:
        """Take a report, and print what nothing earlier can come to any more."""
        _say_where(self._console, self._board, report)
        self._waiting = sorted(self._waiting + self._board.hear(report))
        while self._waiting and self._waiting[0][0] <= self._board.time - ORDERING_WAIT_S:
            _print(self._console, story_line(self._waiting.pop(0)))

    def close(self) -> None:
        """Print what still waits."""
        for line in self._waiting:
            _print(self._console, story_line(line))
        self._waiting = []


def _conclude(console: Console, board: Board, summary: Summary, options: LiveOptions) -> None:
    console.print(board.table())
    events = [f"event {e['number']} ({e['kind']}) is {e['state']}" for e in board.events]
    how = "; ".join(events) or "no event was reported"
    _print(console, f"The run ended ({summary.why}): {how}.")
    counters: dict[str, int] = {}
    for part, report in summary.latest.items():
        detail(f"  {part}: at most {1000 * report.lateness:.1f} ms late")
        for name, count in report.counters.items():
            if is_verbose() or any(word in name for word in ALWAYS_SHOWN):
                counters[name] = counters.get(name, 0) + count
    for name, count in sorted(counters.items()):
        _print(console, f"  {name}: {count}")
    if summary.lost is None and options.records_run:
        _print(console, f"{options.record} written")
    if summary.link is not None:
        for line in in_words(summary.link, ("to the robots", "from the robots")):
            _print(console, line)
    _print_rules(console, summary.verdicts)
    if summary.lost is not None:
        raise DvaSimError(summary.lost)
    refuse_unheld(summary.verdicts)


def _print_rules(console: Console, verdicts: Sequence[Verdict]) -> None:
    for verdict in verdicts:
        _print(console, str(verdict))
