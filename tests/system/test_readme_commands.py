"""Every command on the first page works, and one sees what the page says one sees."""

import ast
import inspect
import re
import shlex
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import typer
from helpers.paths import ROOT
from helpers.studies.small_study import cheap, study_in
from helpers.wording import unnamed
from PIL import Image
from typer.testing import CliRunner

import dva_sim
from dva_sim.cli import app
from dva_sim.experiments.execution import dry_run
from dva_sim.experiments.execution.runner import run_study
from dva_sim.experiments.report.printing import browser
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.simulation.models import Tables

pytestmark = pytest.mark.system

HOME = ROOT
PAGE = (HOME / "README.md").read_text(encoding="utf-8")


# --- what stands on the page ---------------------------------------------------------------


FENCED = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(language: str = "") -> list[str]:
    """The texts between fences."""
    return [text for written_in, text in FENCED.findall(PAGE) if written_in == language]


def commands() -> list[str]:
    """The lines to type, each once, without comments; and commands with options in sentences."""
    lines = "\n".join(blocks()).replace("\\\n", " ").splitlines()
    typed = [re.sub(r"\s+#\s.*", "", line) for line in lines]
    quoted = re.findall(r"`(dva-sim [^`]+ --[^`]+)`", FENCED.sub("", PAGE))
    found = [" ".join(text.split()) for text in (*typed, *quoted)]
    return list(dict.fromkeys(text for text in found if text.startswith(("dva-sim ", "make "))))


def words_of(command: str) -> list[str]:
    """Arguments of a command, without redirections and with `*` expanded."""
    words = shlex.split(command)[1:]
    words = words[:-2] if words[-2:-1] in (["<"], [">"]) else words
    spread = [sorted(map(str, Path().glob(word))) if "*" in word else [word] for word in words]
    return [word for several in spread for word in several]


# --- what one should see -------------------------------------------------------------------


class Seen(NamedTuple):
    """Output of a command on the terminal; its files are in the working folder."""

    text: str
    code: int

    def time_of(self, what: str) -> float:
        """Time of a line in the story [s]."""
        (time,) = re.findall(rf"([\d.]+) s  .*{what}", self.text)
        return float(time)


Look = Callable[[Seen], object]


def told(*texts: str) -> Look:
    """All of this is said."""

    def look(seen: Seen) -> None:
        assert seen.code == 0
        for text in texts:
            assert text in seen.text

    return look


def planned(question: str) -> Look:
    """Expect the planned runs and their duration."""
    return told(question, " runs in ", " to go with ")


def written(*names: str) -> Look:
    """These files are there, and not empty."""

    def look(seen: Seen) -> None:
        assert seen.code == 0
        for name in names:
            assert Path(name).stat().st_size > 100, name

    return look


def both(*looks: Look) -> Look:
    return lambda seen: [look(seen) for look in looks]


def drawn(name: str, width: int = 1680) -> Look:
    """A picture with something on it."""

    def look(seen: Seen) -> None:
        assert seen.code == 0
        with Image.open(name) as picture:
            assert picture.width == width
            colours = picture.convert("RGB").getcolors(1 << 24)
        assert len(colours) > 100

    return look


def a_film(seen: Seen) -> None:
    with Image.open("drill.gif") as film:
        assert film.width == 840
        assert film.n_frames > 15  # type: ignore[attr-defined]


def both_robots_at_the_fire(seen: Seen) -> None:
    """The film: the side that was first waits for the other, and says by how much it was ahead."""
    (ahead,) = re.findall(r"latest-wins PUB/SUB +confirmed at [\d.]+ s, (\d+) s ahead", seen.text)
    assert int(ahead) > 15
    with Image.open("one-second-away.gif") as film:
        assert film.width == 840
        film.seek(film.n_frames - 1)  # type: ignore[attr-defined]
        last = np.asarray(film.convert("RGB")).astype(int)
    half = last.shape[1] // 2
    violet, green = np.array([125, 47, 184]), np.array([27, 122, 61])
    for side in (last[:, :half], last[:, half:]):
        assert (np.abs(side - violet).max(axis=2) < 12).sum() > 40
    assert (np.abs(last[:, half:] - green).max(axis=2) < 12).sum() > 2000
    assert Path("one-second-away.gif").stat().st_size < 1_000_000


def a_corridor_with_smoke_and_people(seen: Seen) -> None:
    """Floor below, smoke above, and no colour that is nearly everywhere."""
    with Image.open("eye.png") as picture:
        pixels = np.asarray(picture.convert("RGB")).reshape(480, 640, 3)
    counts = np.unique(pixels.reshape(-1, 3), axis=0, return_counts=True)[1]
    assert counts.max() < 0.5 * counts.sum()
    smoke = (np.ptp(pixels, axis=2) < 6) & (np.abs(pixels.mean(axis=2) - 110) < 6)
    assert 0.1 < smoke[:240].mean() < 0.9
    assert smoke[400:].mean() < 0.2  # there is the floor
    assert pixels[400:].mean() > 120
    guard = np.abs(pixels.astype(int) - (24, 32, 74)).max(axis=2) < 30  # the uniform
    person = (pixels[:, :, 2].astype(int) - pixels[:, :, 0]) > 60  # a blue shirt
    assert guard.sum() > 200
    assert person.sum() > 200


def a_robot_that_drives_alone(seen: Seen) -> None:
    said = ("mode Mission", "Teleoperation", "confirmed by robot-2", "given up")
    assert unnamed(seen.text, *said) == ["Teleoperation", "given up"]
    assert "operator-1  confirmed" in re.sub(r" {2,}", "  ", seen.text)


def a_slow_car_that_arrives(seen: Seen) -> None:
    (age, rate) = re.findall(r"median age ([\d.]+) s, ([\d.]+) per s", seen.text)[0]
    assert 0.7 < float(age) < 1.5
    assert 0.7 < float(rate) < 1.5
    assert "fire: confirmed by robot-1" in seen.text
    assert "link" not in seen.text


def robots_on_their_rounds_and_one_on_its_way(seen: Seen) -> None:
    drawn("night.png")(seen)
    assert seen.time_of("robot-2 .*mode Mission") < 215
    assert seen.time_of("robot-3 to event 2") < 215
    assert "(fire) is on scene" not in seen.text  # the run was ended at that moment


def four_things_done(seen: Seen) -> None:
    told(
        "200 of 200 commands obeyed",
        "sends robot-1 an emergency: obeyed",
        "sends robot-1 one more command: refused (wrong mode)",
        "starts robot-1 and sends 10 commands",
        "The run ended (the script is done)",
    )(seen)


def keys_for_all(seen: Seen) -> None:
    told("made 4 pairs of keys")(seen)
    assert len(list(Path("keys/secret").iterdir())) == 4


def slower_or_not(seen: Seen) -> None:
    """It compares the two, and judges by the condition."""
    assert seen.code in (0, 1)
    assert "p95(drive_time_s) > 1.05x" in seen.text


# --- what must be there before -------------------------------------------------------------


def a_study() -> None:
    dva_sim.new("mine")


def short(job: StudyJob) -> Tables:
    """A run that leaves its measures and no track."""
    return {"runs": cheap(job)["runs"]}


def two_results() -> None:
    for name in ("small", "other"):
        Path(f"of-{name}").mkdir()
        run_study(study_in(Path(f"of-{name}")), Path(name), jobs=1, episode=short)


def results_and_a_browser() -> None:
    if browser() is None:
        pytest.skip("no Chromium")
    two_results()


def a_recording() -> None:
    dva_sim.episode("fire-drill", seed=3, set={"horizon_s": 20}, record="drill.mcap")


def a_map_and_a_trace() -> None:
    floor = np.full((200, 300), 254, np.uint8)
    floor[:, [0, -1]] = floor[[0, -1]] = 0
    Image.fromarray(floor).save("map.png")
    Path("map.yaml").write_text(
        "image: map.png\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    for name in ("drive.up", "drive.down"):
        Path(name).write_text("".join(f"{number}\n" for number in range(1, 1000)))


def a_message() -> None:
    sample = HOME / "protocol/samples/valid/emergency.xml"
    Path("message.xml").write_bytes(sample.read_bytes())


def a_message_and_a_study() -> None:
    a_message()
    dva_sim.new("my-study")


@dataclass(frozen=True)
class Expected:
    """Expected output of a command.

    Attributes:
        look: Looks for the point that the page makes with it.
        more: Words added, so that it takes less time.
        given: Makes what the command needs.
        dear: Whether it takes more than a few seconds.
    """

    look: Look
    more: tuple[str, ...] = ()
    given: Callable[[], object] = lambda: None
    dear: bool = False


# Of make; or of minutes, another machine, or a network of its own: only parsed, tried elsewhere.
ELSEWHERE = (
    *("make ", "dva-sim console", "dva-sim replay drill.mcap --console", "dva-sim robot"),
    *("dva-sim run req-rep-vs-pub-sub --scheduler", "dva-sim validate ", "dva-sim check link"),
    "dva-sim live drive-to-event",
)
MAIN = "REQ/REP or PUB/SUB for driving a robot by tilt"


def until(seconds: float) -> tuple[str, str]:
    return ("--set", f"horizon_s={seconds:g}")


DRY = ("--dry-run", *until(10))  # planned by a few short runs

EXPECTED = {
    "dva-sim episode drive-to-event --seed 11 --set link.delay_s=1 --side-by-side "
    "req-rep,latest-wins --inset --video one-second-away.gif": Expected(
        both_robots_at_the_fire, dear=True
    ),
    # Using it
    "dva-sim list": Expected(
        told("req-rep-vs-pub-sub", "fire-drill", "caparica", "servrobot", "hazard_team")
    ),
    "dva-sim new mine": Expected(both(told("mine.yaml"), written("mine.yaml"))),
    "dva-sim register mine.yaml": Expected(written("mine.registration.yaml"), given=a_study),
    "dva-sim run req-rep-vs-pub-sub --dry-run": Expected(planned(MAIN), until(10)),
    "dva-sim run req-rep-vs-pub-sub --quick": Expected(
        told(MAIN, "264 runs in 13 configurations", " to go with "), DRY
    ),
    "dva-sim run req-rep-vs-pub-sub --set persons=4 --set replications=2 --jobs 2 -o small": (
        Expected(planned(MAIN), DRY, dear=True)
    ),
    "dva-sim report small --pdf": Expected(
        written("small/report.html", "small/report.pdf"), given=results_and_a_browser, dear=True
    ),
    "dva-sim show small": Expected(
        told("Which is quicker?", "latest-wins PUB/SUB", "95 % interval"), given=two_results
    ),
    "dva-sim export small -o small.csv": Expected(written("small.csv"), given=two_results),
    "dva-sim compare small other --fail-if 'p95(drive_time_s) > 1.05x'": Expected(
        slower_or_not, given=two_results
    ),
    "dva-sim episode fire-drill --seed 3": Expected(
        told("fire breaks out", "(fire) is confirmed", "(gas_leak) is confirmed", "by robot-2")
    ),
    "dva-sim episode fire-drill --seed 3 --video drill.gif": Expected(a_film, until(2)),
    "dva-sim episode fire-drill --seed 3 --record drill.mcap": Expected(
        written("drill.mcap"), until(20)
    ),
    "dva-sim replay drill.mcap --strip drill.png": Expected(
        both(told("fire breaks out"), drawn("drill.png")), ("--panels", "2"), a_recording
    ),
    "dva-sim run req-rep-vs-pub-sub --set site.map=map.yaml --set link.trace_up=drive.up "
    "--set link.trace_down=drive.down --set persons=4 --set replications=1 -o mine": Expected(
        planned(MAIN), DRY, a_map_and_a_trace, dear=True
    ),
    # Who should go?
    "dva-sim episode patrol-shift --set dispatch.policy=hazard_team": Expected(
        told("hazard_team", "events measured", "on scene after", "people in danger"), until(900)
    ),
    "dva-sim run dispatch-policies": Expected(
        planned("Who should go?"), ("--dry-run", *until(4300)), dear=True
    ),
    "dva-sim check policy agents/policies/patrol.py:Patrol": Expected(told("1 policy: 1 valid")),
    "dva-sim episode fire-drill --set dispatch.policy=agents/policies/patrol.py:Patrol": Expected(
        told("fire: confirmed by guard-1"), until(120)
    ),
    # Worlds, robots, people
    "dva-sim site show campus --coverage": Expected(
        both(told("campus: 120.0 m x 90.0 m"), drawn("campus.png", 1650))
    ),
    "dva-sim episode campus-patrol --still night.png --at 215": Expected(
        robots_on_their_rounds_and_one_on_its_way, until(215), dear=True
    ),
    "dva-sim episode evacuation --strip fire.png": Expected(
        both(told("30 of 30 bystanders out"), drawn("fire.png")), dear=True
    ),
    "dva-sim episode evacuation --camera robot-2 --at 151 --still eye.png": Expected(
        a_corridor_with_smoke_and_people, until(151), dear=True
    ),
    "dva-sim episode fire-drill --seed 6 --set control=supervisory": Expected(
        a_robot_that_drives_alone
    ),
    "dva-sim episode fire-drill --set site.name=office-block "
    "--set 'site.options={seed: 7, width_m: 90}'": Expected(
        told("Office 325    ", "confirmed by guard"), dear=True
    ),
    "dva-sim episode drive-to-event --seed 3 --set robot.profile=pibot": Expected(
        a_slow_car_that_arrives
    ),
    "dva-sim check robot agents/robots/tracked.py:Tracked": Expected(told("1 robot: 1 valid")),
    # Operators and phones
    "dva-sim episode drive-to-event --set operator.strategy=move_and_wait --set link.delay_s=1": (
        Expected(told("1000 ms each way", "fire: confirmed by robot-1"))
    ),
    "dva-sim episode drive-to-event --set phone.mapping=differential --set phone.filter=one_pole": (
        Expected(told("fire: confirmed by robot-1"))
    ),
    "dva-sim episode tasks/fitts-tilt --still trial.png": Expected(
        both(told("100 % done", "bit/s"), drawn("trial.png", 1260)), ("--set", "trials=1")
    ),
    "dva-sim run absolute-vs-differential": Expected(
        planned("Should tilting set the turn rate"), DRY, dear=True
    ),
    "dva-sim check operator agents/operators/stepwise.py:Stepwise": Expected(
        told("1 operator: 1 valid")
    ),
    # The network
    "dva-sim run what-delays-a-command": Expected(planned("What delays a command"), DRY, dear=True),
    "dva-sim episode drive-to-event --set link.loss=0.05 --set link.delay_s=0.1 "
    "--set pattern=req-rep": Expected(told("req-rep, 100 ms each way", "confirmed by robot-1")),
    # In real time, over sockets
    "dva-sim live drive-to-event --operators scripted": Expected(four_things_done, dear=True),
    "dva-sim keys keys drive-to-event": Expected(keys_for_all),
    # Is this file right?
    "dva-sim check message.xml my-study.yaml worlds/*.yaml": Expected(
        told("message.xml: message: valid", "my-study.yaml: study: valid", "6 files: 6 valid"),
        given=a_message_and_a_study,
    ),
    "dva-sim check - < message.xml": Expected(told("-: message: valid"), given=a_message),
    "dva-sim schema scenario > scenario.schema.json": Expected(told("horizon_s", "$schema")),
}


# --- and whether one does ------------------------------------------------------------------


def test_it_is_said_of_every_command_what_one_should_see_and_of_no_other():
    elsewhere = {command for command in commands() if command.startswith(ELSEWHERE)}
    assert set(commands()) == {*EXPECTED, *elsewhere - set(EXPECTED)}
    assert [words for words in ELSEWHERE if not any(c.startswith(words) for c in elsewhere)] == []


@pytest.mark.parametrize("command", [c for c in commands() if c.startswith("dva-sim ")])
def test_every_command_is_one_that_the_program_knows(command):
    group, rest = typer.main.get_command(app), words_of(command)
    while hasattr(group, "resolve_command"):
        context = group.context_class(group)
        name, group, rest = group.resolve_command(context, rest)
    group.make_context(name, rest)


@pytest.mark.parametrize("target", [c.split()[1] for c in commands() if c.startswith("make ")])
def test_every_target_is_one_that_make_knows(target):
    tried = subprocess.run(["make", "-n", target], cwd=HOME, capture_output=True, check=False)
    assert tried.returncode == 0


RUNNABLE = [
    pytest.param(command, marks=[pytest.mark.system] if expected.dear else [])
    for command, expected in EXPECTED.items()
]


@pytest.mark.parametrize("command", RUNNABLE)
def test_one_sees_what_the_page_says(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(dry_run, "PROBE_S", 0.0)  # a few runs suffice to plan by
    for folder in ("agents", "worlds"):
        Path(folder).symlink_to(HOME / folder)
    expected = EXPECTED[command]
    expected.given()
    piped = Path("message.xml").read_bytes() if " < " in command else None
    ended = CliRunner().invoke(app, [*words_of(command), *expected.more], input=piped)
    assert ended.exception is None or isinstance(ended.exception, SystemExit), ended.exception
    expected.look(Seen(ended.output, ended.exit_code))


def test_what_the_page_writes_in_python_can_be_called_so():
    (code,) = blocks("python")
    calls = [node for node in ast.walk(ast.parse(code)) if isinstance(node, ast.Call)]
    ours = [c for c in calls if isinstance(c.func, ast.Attribute) and _is_ours(c.func.value)]
    assert len(ours) == 3
    for call in ours:
        function = getattr(dva_sim, call.func.attr)  # type: ignore[attr-defined]
        names = [word.arg for word in call.keywords]
        inspect.signature(function).bind(*call.args, **dict.fromkeys(names))


def _is_ours(value: ast.expr) -> bool:
    return isinstance(value, ast.Name) and value.id == "dva_sim"


def test_the_last_line_in_python_says_how_long_the_drive_took():
    (code,) = blocks("python")
    line = code.strip().splitlines()[-1]
    time = eval(line, {"dva_sim": dva_sim})
    assert 50 < time < 120
