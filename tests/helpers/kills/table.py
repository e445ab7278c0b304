"""The table of kills: programs, moments of their progress, and what is done to them there."""

from collections.abc import Iterator
from itertools import product

from helpers.kills.kill import SAYS, Kill, Moment

MAIN = "dva_sim.cli"
WORKER = "worker_program"
RUN = "/dev/null"  # a run opens it when it begins
FIRST_RUN = Moment(MAIN, "open", RUN)
FOURTH_RUN = Moment(MAIN, "open", RUN, 4, done=3)
OF_STUDY = (
    Moment(MAIN, "sqlite3.connect", "journal.sqlite"),
    FIRST_RUN,
    FOURTH_RUN,
    Moment(MAIN, "tempfile.mkdtemp", ".tables-", done=6),
    Moment(MAIN, "os.rename", "runs.parquet", done=6),
    Moment(MAIN, "os.rename", "/manifest.json", done=6),
    Moment(MAIN, "os.rename", "/machine.json", done=6),
    Moment(MAIN, "os.rename", "figures", 2, done=6),
    Moment(MAIN, "os.rename", "/report.html", done=6),
)
OF_REPORT = Moment(MAIN, "os.rename", "figures", 3), Moment(MAIN, "os.rename", "/report.html")
OF_WORKER = (
    Moment(WORKER, "import", "dva_sim.experiments.execution.scheduling"),
    Moment(WORKER, "open", RUN),
    Moment(WORKER, "open", RUN, 2),
)
OF_STORMS = Moment(MAIN, "open", "storms.jsonl"), Moment(MAIN, "open", "storms.jsonl", 2)
STORM = Moment(WORKER, "tempfile.mkdtemp", "dva-storm-")
FILM = Moment(WORKER, "open", "one-drive.")
DRIVES = "mode Teleoperation"
PARTS = '"part": "world"', '"part": "dva"', '"part": "operator"'
OF_LIVE = Moment(MAIN, SAYS, DRIVES), Moment(MAIN, "os.rename", "run.mcap")
OF_CONSOLE = Moment(MAIN, "sqlite3.connect", "audit.sqlite"), Moment(MAIN, SAYS, "Console: ")
ENDS = "TERM", "KILL"
DISKS = "full disk", "read-only"
CLOCKS = "clock back", "clock forth"

QUICK = {
    *((FIRST_RUN, deed) for deed in ("TERM", "STOP")),
    *((FOURTH_RUN, deed) for deed in ("KILL", "full disk", "clock back", "no memory")),
    (OF_STUDY[4], "KILL"),
    (OF_STUDY[5], "read-only"),
    (OF_STUDY[8], "TERM"),
    (OF_REPORT[0], "KILL"),
    *((OF_WORKER[1], deed) for deed in ("KILL", "STOP", "KILL of main", "TERM of main")),
    (STORM, "KILL"),
    *((OF_LIVE[0], deed) for deed in ("KILL", "full disk")),
    (Moment(PARTS[0], SAYS, DRIVES), "KILL"),
    *((OF_CONSOLE[1], deed) for deed in ("KILL", "full disk")),
}


def rows() -> Iterator[tuple[str, Moment, str]]:
    """Yield who, when and what."""
    for moment, deed in product(OF_STUDY, (*ENDS, *DISKS)):
        yield "study", moment, deed
    for moment in (FIRST_RUN, FOURTH_RUN, OF_STUDY[8]):
        for deed in ("INT", "STOP", "no memory", *CLOCKS):
            yield "study", moment, deed
    yield "study", FIRST_RUN, "disk of 1 MB"
    for moment in OF_WORKER:
        for deed in (*ENDS, "STOP", "no memory", "KILL of main", "TERM of main", "INT of main"):
            yield "study of workers", moment, deed
    for moment, deed in product(OF_REPORT, (*ENDS, *DISKS, "no memory")):
        yield "report", moment, deed
    for moment, deed in product(OF_STORMS, (*ENDS, *DISKS)):
        yield "storms", moment, deed
    for deed in (*ENDS, "STOP", "no memory", "KILL of main", "TERM of main"):
        yield "storms of workers", STORM, deed
    for deed in (*ENDS, *DISKS, *CLOCKS, "STOP", "no memory"):
        yield "live", OF_LIVE[0], deed
        yield "console", OF_CONSOLE[1], deed
    for deed in (*ENDS, *DISKS):
        yield "live", OF_LIVE[1], deed
        yield "console", OF_CONSOLE[0], deed
    for part, deed in product(PARTS, ("KILL", "STOP", "no memory")):
        yield "live", Moment(part, SAYS, DRIVES), deed
        yield "live", Moment(part, "import", "dva_sim.simulation.full.stage"), deed
    for part, deed in (("console.web", "KILL"), ("pages.pictures", "KILL, replaced")):
        yield "console", Moment(part, SAYS, "Console: "), deed
        yield "console", Moment(part, SAYS, "Console: "), "STOP"
    for deed in ("KILL of main", "TERM of main", "KILL", "full disk"):
        yield "demo", FILM, deed
    yield "demo", Moment(MAIN, "os.rename", "runs.parquet", done=0), "KILL"
    for deed in ("KILL of main", "TERM of main", "KILL"):
        yield "answers", Moment(WORKER, "import", "sampled_runs"), deed


KILLS = [Kill(*row, is_quick=row[1:] in QUICK) for row in rows()]
