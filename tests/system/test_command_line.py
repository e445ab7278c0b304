"""The program as users call it: its words, its files, its exit codes; once as a real process."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.paths import ROOT, TESTS
from helpers.processes.command_line import call
from helpers.studies.report_text import blank_pictures
from helpers.wording import unnamed

pytestmark = pytest.mark.system

MAPS = TESTS / "data"
TRACES = ROOT / "experiments" / "traces"
STUDY = """\
question: Which is quicker?
persons: 3
replications: 1
factors:
  pattern: [req-rep, latest-wins]
  link.delay_s: [0, 0.5]
parts:
  drive: {scenario: drive-to-event, changes: {horizon_s: 25}}
  story: {scenario: fire-drill, changes: {horizon_s: 12}}
answer:
  part: drive
  measure: drive_time_s
  factor: pattern
  contrast: [req-rep, latest-wins]
  over: link.delay_s
"""


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small study, and in it its results, made by one process."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "quicker.yaml").write_text(STUDY)
    ran = run(folder, jobs="1")
    assert ran.returncode == 0, ran.stderr
    assert "report.html" in ran.stdout.replace("\n", "")
    return folder


def run(folder: Path, jobs: str, *more: str) -> subprocess.CompletedProcess[str]:
    """Results go into a folder named after the number of processes."""
    few = ("--set", "persons=2", *more)
    with blank_pictures():
        return call("run", "quicker.yaml", *few, "--jobs", jobs, "-o", jobs, cwd=folder)


def bytes_of(folder: Path) -> dict[str, bytes]:
    """Everything that must not depend on how a study was run."""
    names = [*folder.glob("tables/*.parquet"), folder / "manifest.json", folder / "report.html"]
    return {path.name: path.read_bytes() for path in names}


HEAVY = {"matplotlib", "scipy", "numpy", "pymunk", "duckdb", "lxml", "shapely", "PIL", "pandas"}
HEAVY |= {
    "rich",
    "distributed",
    "dask",
    "multiprocessing",
    "dva_sim.kernel.config",
}  # Typer: pydantic
HEAVY |= {"dva_sim.simulation", "dva_sim.experiments", "dva_sim.core"}


def test_help_and_lists_of_files_import_nothing_heavy():
    program = (
        "import sys\n"
        "from dva_sim.cli import app\n"
        "for words in (['--help'], ['run', '--help'], ['list', 'studies'], ['nonsense']):\n"
        "    try: app(words)\n"
        "    except SystemExit: pass\n"
        "print('\\nmodules:', *sys.modules)\n"
    )
    found = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    modules = set(found.stdout.rpartition("modules: ")[2].split())
    assert {"dva_sim.cli", "typer"} <= modules
    assert modules & HEAVY == set()


def test_the_list_of_all_is_made_without_what_simulates_and_analyses():
    program = (
        "import sys\nfrom dva_sim.cli.names import everything\neverything()\nprint(*sys.modules)"
    )
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    rooms = {".".join(name.split(".")[:3]) for name in loaded.stdout.split()}
    assert "dva_sim.cli.names" in rooms
    heavy = {
        "worlds.hazards",
        "simulation.full",
        "simulation.models",
        "experiments.analysis",
        "protocol.messages",
    }
    assert rooms & {f"dva_sim.{name}" for name in heavy} == set()


def test_a_study_gives_the_same_bytes_with_any_number_of_processes(ran):
    assert run(ran, jobs="2").returncode == 0
    one, two = bytes_of(ran / "1"), bytes_of(ran / "2")
    tables = {"runs", "events", "operators", "people", "tracks"}
    assert set(one) == {f"{name}.parquet" for name in tables} | {"manifest.json", "report.html"}
    assert one == two


def test_a_study_that_was_changed_on_the_command_line_is_called_exploratory(ran):
    files = bytes_of(ran / "1")
    assert json.loads(files["manifest.json"])["set"] == ["persons=2"]
    assert b"exploratory" in files["report.html"]
    assert b"<script src" not in files["report.html"]


def test_the_report_made_again_by_its_command_has_the_same_bytes(ran):
    before = bytes_of(ran / "1")
    with blank_pictures():
        assert call("report", "1", cwd=ran).returncode == 0
    assert bytes_of(ran / "1") == before


def test_another_study_is_not_written_into_the_same_folder(ran):
    other = run(ran, "1", "--seed", "5")
    assert other.returncode == 2
    assert "holds another study" in other.stderr


def test_the_program_itself_ends_a_mistake_with_one_line_and_exit_code_2(tmp_path):
    """All others call it within this process: see `command_line`."""
    words = [sys.executable, "-m", "dva_sim.cli", "run", "req-rep-vs-pubsub"]
    ended = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.startswith("error: ")
    assert len(ended.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["run", "req-rep-vs-pubsub"], "did you mean 'req-rep-vs-pub-sub'?"),
        (["run", "bad.yaml"], "bad.yaml:5:5: unknown key 'parts.drive.refrence'"),
        (["run", "quicker.yaml", "--set", "link.delay_ms=1"], "did you mean 'delay_s'?"),
        (["run", "quicker.yaml", "--set", "link.trace_up=no.up"], "no.up: trace cannot be"),
        (["run", "quicker.yaml", "--set", "link.trace_up=bad.up"], "bad.up:2:1: should be"),
        (["report", "."], "holds no finished results"),
        (["episode", "drive-to-event", "--video", "film.avi"], ".gif or .mp4"),
        (["episode", "drive-to-event", "--side-by-side", "a,b"], "should name two of"),
        (["episode", "fire"], "scenario 'fire' not found"),
        (["episode", "inside.yaml"], "inside.yaml:2:1: unknown key 'robots'"),
    ],
)
def test_a_mistake_ends_in_one_line_and_exit_code_2(tmp_path, words, expected):
    (tmp_path / "bad.yaml").write_text(
        "question: what?\nparts:\n  drive:\n    scenario: drive-to-event\n    refrence: {}\n"
    )
    (tmp_path / "quicker.yaml").write_text(STUDY)
    (tmp_path / "bad.up").write_text("1\nsoon\n")
    (tmp_path / "inside.yaml").write_text("horizon_s: 5\nrobots: {}\n")
    ended = call(*words, cwd=tmp_path)
    assert ended.returncode == 2
    assert expected in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1
    assert "Traceback" not in ended.stderr + ended.stdout


def test_an_episode_tells_its_story_and_shows_it(tmp_path):
    from PIL import Image

    ended = call(
        *("episode", "drive-to-event", "--seed", "8", "--set", "horizon_s=6"),
        *("--still", "both.png", "--side-by-side", "req-rep,latest-wins"),
        cwd=tmp_path,
    )
    assert ended.returncode == 0, ended.stderr
    story = ("breaks out", "assigned to operator-1", "Teleoperation", "safety rules")
    assert unnamed(ended.stdout, *story) == []
    with Image.open(tmp_path / "both.png") as picture:
        assert len(picture.convert("RGB").getcolors(1 << 24) or []) > 100


def test_a_map_and_a_cellular_trace_of_ones_own_carry_a_whole_study(tmp_path):
    (tmp_path / "quicker.yaml").write_text(STUDY)
    ways = [f"link.trace_{way}={TRACES / 'cellular'}.{way}" for way in ("up", "down")]
    settings = (f"site.map={MAPS / 'hall.yaml'}", "factors.link.delay_s=[0]", "horizon_s=12", *ways)
    ended = run(tmp_path, "1", *(word for s in settings for word in ("--set", s)))
    assert ended.returncode == 0, ended.stderr + ended.stdout
    written = bytes_of(tmp_path / "1")
    assert {"runs.parquet", "tracks.parquet"} <= set(written)
    assert b"hall.yaml" in written["report.html"]
