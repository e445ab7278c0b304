"""The program as users call it: real processes, real files, real exit codes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

DATA = Path(__file__).parents[2].parent / "shared"
SETTINGS = ("persons=2", "replications=1", "phone.profile=default", "link.delay_s=[0, 0.5]")
SMALL = [word for setting in SETTINGS for word in ("--set", setting)]


def call(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "dva_sim.cli", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False)


def bytes_of(folder: Path) -> dict[str, bytes]:
    """Everything that must not depend on how a study was run."""
    names = [*folder.glob("tables/*.parquet"), folder / "manifest.json", folder / "report.html"]
    return {path.name: path.read_bytes() for path in names}


HEAVY = {"matplotlib", "scipy", "numpy", "pymunk", "duckdb", "lxml", "shapely", "PIL", "pandas"}
HEAVY |= {"rich", "distributed", "dask", "multiprocessing", "dva_sim.config"}  # of the models


@pytest.mark.parametrize(
    ("words", "heavy"),
    [
        (["--help"], HEAVY | {"pydantic"}),
        (["run", "--help"], HEAVY),  # here typer itself imports pydantic to read its words
        (["nonsense"], HEAVY),
    ],
)
def test_help_imports_nothing_heavy(words: list[str], heavy: set[str]) -> None:
    program = (
        "import sys\n"
        "from dva_sim.cli import app\n"
        "try: app(sys.argv[1:])\n"
        "except SystemExit: pass\n"
        "print('\\nmodules:', *sys.modules)\n"
    )
    found = subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, check=True
    )
    modules = set(found.stdout.rpartition("modules: ")[2].split())
    assert {"dva_sim.cli", "typer"} <= modules
    assert modules & heavy == set()


def test_a_study_gives_the_same_bytes_with_any_number_of_processes(tmp_path: Path) -> None:
    for jobs in ("1", "2"):
        ran = call("run", "req-rep-vs-pub-sub", *SMALL, "--jobs", jobs, "-o", jobs, cwd=tmp_path)
        assert ran.returncode == 0, ran.stderr
        assert "report.html" in ran.stdout.replace("\n", "")
    one, two = bytes_of(tmp_path / "1"), bytes_of(tmp_path / "2")
    assert set(one) == {
        *(
            "runs.parquet",
            "events.parquet",
            "operators.parquet",
            "people.parquet",
            "tracks.parquet",
        ),
        *("manifest.json", "report.html"),
    }
    assert one == two
    assert json.loads(one["manifest.json"])["set"]
    assert b"exploratory" in one["report.html"]
    assert b"<script src" not in one["report.html"]

    again = call("report", "1", cwd=tmp_path)
    assert again.returncode == 0
    assert bytes_of(tmp_path / "1") == one


def test_another_study_is_not_written_into_the_same_folder(tmp_path: Path) -> None:
    assert call("run", "req-rep-vs-pub-sub", *SMALL, "-o", "a", cwd=tmp_path).returncode == 0
    other = call("run", "req-rep-vs-pub-sub", *SMALL, "--seed", "5", "-o", "a", cwd=tmp_path)
    assert other.returncode == 2
    assert "holds another study" in other.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["run", "req-rep-vs-pubsub"], "did you mean 'req-rep-vs-pub-sub'?"),
        (["run", "bad.yaml"], "bad.yaml:5:5: unknown key 'parts.drive.refrence'"),
        (["run", "req-rep-vs-pub-sub", "--set", "link.delay_s=-1"], "at least 0"),
        (["run", "req-rep-vs-pub-sub", "--set", "link.delay_ms=1"], "did you mean 'delay_s'?"),
        (["run", "req-rep-vs-pub-sub", "--set", "link.trace_up=no.up"], "no.up: trace cannot be"),
        (["run", "req-rep-vs-pub-sub", "--set", "link.trace_up=bad.up"], "bad.up:2:1: should be"),
        (["run", "req-rep-vs-pub-sub", "--set", "site.map=no.yaml"], "'no.yaml' not found"),
        (["run", "req-rep-vs-pub-sub", "--set", "robot.count=9"], "has 3 robot bases"),
        (["run", "req-rep-vs-pub-sub", "--set", "watchdog"], "should be key=value"),
        (["report", "."], "holds no finished results"),
        (["episode", "drive-to-event", "--video", "film.avi"], "should end in .gif or .mp4"),
        (["episode", "drive-to-event", "--side-by-side", "a,b"], "should name two of"),
        (["episode", "fire"], "scenario 'fire' not found"),
        (["episode", "drive-to-event", "--set", "events=[{kind: fire, room: Attic}]"], "no room"),
        (["episode", "inside.yaml"], "inside.yaml:2:1: unknown key 'robots'"),
    ],
)
def test_a_mistake_ends_in_one_line_and_exit_code_2(
    tmp_path: Path, words: list[str], said: str
) -> None:
    (tmp_path / "bad.yaml").write_text(
        "question: what?\nparts:\n  drive:\n    scenario: drive-to-event\n    refrence: {}\n"
    )
    (tmp_path / "bad.up").write_text("1\nsoon\n")
    (tmp_path / "inside.yaml").write_text("horizon_s: 5\nrobots: {}\n")
    ended = call(*words, cwd=tmp_path)
    assert ended.returncode == 2
    assert said in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1
    assert "Traceback" not in ended.stderr + ended.stdout


def test_an_episode_tells_its_story_and_films_it(tmp_path: Path) -> None:
    from PIL import Image

    told = call(
        *("episode", "drive-to-event", "--seed", "8", "--set", "horizon_s=20"),
        *("--video", "film.gif", "--side-by-side", "req-rep,latest-wins"),
        cwd=tmp_path,
    )
    assert told.returncode == 0, told.stderr
    for word in ("breaks out", "is assigned to operator-1", "Teleoperation", "safety rules broken"):
        assert word in told.stdout
    with Image.open(tmp_path / "film.gif") as film:
        assert film.n_frames > 20  # type: ignore[attr-defined]
        first = film.convert("RGB").tobytes()
        film.seek(100)
        assert film.convert("RGB").tobytes() != first


def test_everything_that_can_be_named_is_listed(tmp_path: Path) -> None:
    listed = call("list", cwd=tmp_path).stdout
    for name in ("req-rep-vs-pub-sub", "fire-drill", "caparica", "dissertation", "servrobot"):
        assert name in listed
    for name in ("min_eta", "pursuit", "oracle", "median20-copy", "latest-wins"):
        assert name in listed


@pytest.mark.slow
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no real maps and traces at {DATA}")
def test_a_real_map_and_a_real_cellular_trace_carry_a_whole_study(tmp_path: Path) -> None:
    trace = DATA / "traces" / "ATT-LTE-driving-2016"
    ran = call(
        *("run", "req-rep-vs-pub-sub", *SMALL, "-o", "real"),
        *("--set", f"site.map={DATA / 'maps' / 'depot.yaml'}"),
        *("--set", f"link.trace_up={trace}.up", "--set", f"link.trace_down={trace}.down"),
        cwd=tmp_path,
    )
    assert ran.returncode == 0, ran.stderr + ran.stdout
    assert b"Ways taken" in bytes_of(tmp_path / "real")["report.html"]
