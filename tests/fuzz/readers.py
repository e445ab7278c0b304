"""Readers of the program, each with samples that it made itself and the uses of what is valid."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import partial
from io import StringIO
from pathlib import Path
from random import Random

from fuzz import mutations as m
from helpers.messages.damaged_messages import mutated
from helpers.paths import ROOT, TESTS

Samples = Callable[[Path], Sequence[Path]]


@dataclass(frozen=True)
class Reader:
    """One kind of input.

    Attributes:
        name: Name of the kind.
        samples: Makes files in a folder, and returns those of this kind.
        mutate: Damage that knows the form.
        uses: Words of commands in which `{}` is the file and `{folder}` its folder, each followed
            only while the one before says that the file is valid.
        read: Function of bytes, for what comes over a wire; its files have no uses.
        refuses: Errors by which that function refuses.
        weight: Share of all mutants.
    """

    name: str
    samples: Samples
    mutate: m.Mutation
    uses: tuple[str, ...] = ()
    read: Callable[[bytes], object] | None = None
    refuses: tuple[type[Exception], ...] = ()
    weight: int = 10


def copies(pattern: str, folder: Path) -> list[Path]:
    """Copy files of the repository, each into a folder of its own."""
    found = []
    for number, path in enumerate(sorted(ROOT.glob(pattern))):
        place = folder / f"{path.stem}-{number}"
        place.mkdir(parents=True)
        found.append(Path(shutil.copy(path, place)))
    return found


def made(name: str, words: str, folder: Path) -> list[Path]:
    """Let the program make a file."""
    from dva_sim.cli.program import call

    file = folder / "made" / name
    file.parent.mkdir(parents=True)
    with redirect_stdout(StringIO()):
        code = call(words.format(file).split())
    assert not code, (words, code)
    return [file]


def texts(contents: dict[str, str], folder: Path) -> list[Path]:
    """Write files, each into a folder of its own."""
    found = []
    for name, text in contents.items():
        file = folder / Path(name).stem / name
        file.parent.mkdir(parents=True)
        file.write_text(text)
        found.append(file)
    return found


def beside(main: str, others: str, folder: Path) -> list[Path]:
    """Copy a file together with what it names."""
    folder.mkdir(parents=True)
    for path in [*ROOT.glob(others), ROOT / main]:
        shutil.copy(path, folder)
    return [folder / Path(main).name]


def results(name: str, folder: Path) -> list[Path]:
    """Copy a results folder; the file of that name in it is damaged."""
    shutil.copytree(TESTS / "data/results-0.7.0", folder / "results")
    if name != "journal.sqlite":
        (folder / "results/journal.sqlite").unlink()
    else:
        (folder / "results/manifest.json").unlink()
    if name.endswith(".parquet"):  # a manifest that does not tell which tables are its own
        path = folder / "results/manifest.json"
        manifest = json.loads(path.read_text())
        path.write_text(json.dumps(manifest | {"tables": {}}))
    return [folder / "results" / name]


def a_log(head: str, row: Callable[[int], str]) -> str:
    return "\n".join([head, *(row(number) for number in range(200))]) + "\n"


MOTION = """# dva-sim phone motion 1
t_s,came_s,at_s,x_mps2,y_mps2,z_mps2,orientation_deg
"""
LOGS = {
    "motion-1.csv": MOTION + a_log("# ", lambda n: f"{n / 60},{n / 60},{n / 60},0,0.{n},9.8,0"),
    "sensor.csv": a_log("time,x,y,z", lambda n: f"{n / 100},0,0.0{n},9.8"),
}
DELAYS = {
    "delays.csv": a_log("time_s,delay_ms", lambda n: f"{n / 10},{20 + n % 7}"),
    "ping.log": a_log(
        "PING 10.0.0.1 (10.0.0.1) 56(84) bytes of data.",
        lambda n: (
            f"[{1700000000 + n}.5] 64 bytes from 10.0.0.1: icmp_seq={n + 1} ttl=64 "
            f"time={20 + n % 7}.0 ms"
        ),
    ),
}
SMALL_SCENARIO = {"small.yaml": "description: one robot\nhorizon_s: 20\nevents: []\n"}


PLUG_IN = """\
import os, sys, time
class Mine:
    def advise(self, situation, rng):
        {}
"""
ACTS = (
    *("raise ValueError('no')", "time.sleep(0.01)", "print('x' * 5000)", "sys.exit(3)"),
    *("return None", "return [1, 2]", "return {'a': float('nan')}", "raise KeyboardInterrupt"),
    *("return self", "situation.events = 5", "os.chdir('/')", "raise BaseException('no')"),
    *("return 10**400", "raise RecursionError", "return unknown", "yield 5"),
)


def plug_in(data: bytes, rng: Random) -> bytes:
    """Write a policy that acts as no policy does."""
    return PLUG_IN.format(rng.choice(ACTS)).encode()


def users(folder: Path) -> list[Path]:
    from dva_sim.serving.users import UserFile

    folder.mkdir(parents=True)
    file = UserFile(folder / "users.json")
    file.add("ana", "drive", "a long password")
    return [folder / "users.json"]


def readers() -> list[Reader]:
    """Return the table."""
    from fuzz import doors

    from dva_sim.kernel.errors import DvaSimError

    refuses = (DvaSimError,)
    samples = partial(copies, "protocol/samples/valid/*.xml")
    check = ("check {}",)
    table = ("check {}", "show {folder}", "report {folder}", "export {folder} -o {folder}/x.csv")
    hall = partial(beside, "tests/data/hall.yaml", "tests/data/hall.png")
    image = partial(beside, "tests/data/hall.png", "tests/data/hall.yaml")
    campus = partial(beside, "worlds/campus.yaml", "worlds/*.geojson")
    plan = partial(beside, "worlds/caparica.geojson", "worlds/caparica.yaml")
    record = partial(made, "run.mcap", "episode drive-to-event --record {}")
    policies = partial(texts, {"mine.py": PLUG_IN})
    return [
        Reader("plug-in", policies, plug_in, ("check policy {}:Mine",), weight=2),
        Reader("message", samples, mutated, check, weight=30),
        Reader("message heard", doors.messages, mutated, (), doors.read_message, weight=6),
        Reader("study", partial(copies, "experiments/k*.yaml"), m.of_yaml, check, weight=4),
        Reader(
            "scenario",
            partial(texts, SMALL_SCENARIO),
            m.of_yaml,
            ("check {}", "episode {}"),
            weight=4,
        ),
        Reader("site", campus, m.of_yaml, ("check {}", "site show {}"), weight=4),
        Reader("plan", plan, m.of_json, ("check {}", "site show {folder}/caparica.yaml"), weight=4),
        Reader("map", hall, m.of_yaml, ("site show {}",), weight=6),
        Reader("image", image, m.of_image, ("site show {folder}/hall.yaml",), weight=6),
        Reader("trace", partial(copies, "experiments/traces/*"), m.of_lines, check),
        Reader("delay log", partial(texts, DELAYS), m.of_lines, check, weight=30),
        Reader("phone log", partial(texts, LOGS), m.of_lines, ("phone-log {}",), weight=30),
        Reader("recording", record, m.of_mcap, ("check {}", "replay {}"), weight=10),
        Reader("table", partial(results, "tables/runs.parquet"), m.of_parquet, table[1:], weight=6),
        Reader("manifest", partial(results, "manifest.json"), m.of_json, table[1:], weight=10),
        Reader("journal", partial(results, "journal.sqlite"), m.of_sqlite, table[1:2], weight=6),
        Reader(
            "registration", partial(copies, "experiments/*.registration.yaml"), m.of_yaml, check
        ),
        Reader("audit log", doors.audit, m.of_sqlite, check),
        Reader("audit pages", doors.audit, m.of_sqlite, (), doors.read_audit, refuses),
        Reader("users", users, m.of_json, ("users list --file {}",)),
        Reader("logins", users, m.of_json, (), doors.read_users, refuses, weight=4),
        Reader("state", doors.state, m.of_sqlite, (), doors.open_state, refuses),
        Reader("recalled state", doors.state, m.of_sqlite, (), doors.read_state, refuses),
        Reader("keys", doors.keys, m.of_lines, (), doors.read_key, refuses),
        Reader("rosbridge", doors.rosbridge, m.of_jsonl, (), doors.read_rosbridge, weight=4),
        Reader("bridge", doors.bridged, m.of_jsonl, (), doors.read_bridge),
        Reader("web", doors.web, m.of_jsonl, (), doors.read_web, weight=4),
    ]
