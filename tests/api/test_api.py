"""The Python API: the results of the command line, in scripts and notebooks, without a word."""

import asyncio
import inspect
import json
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.processes import patience

import dva_sim
from dva_sim.experiments.study.loading import pairs_of
from dva_sim.kernel.config_overrides import parse_changes
from dva_sim.kernel.errors import ConfigError

STUDY = """\
question: Does a second of delay cost time?
seed: 4
persons: 2
replications: 1
factors:
  link.delay_s: [0, 0.3]
parts:
  drive:
    scenario: drive-to-event
    changes: {horizon_s: 40}
"""

REGISTERED = (
    STUDY
    + """\
answer:
  part: drive
  measure: drive_time_s
  factor: link.delay_s
  contrast: [0.3, 0]
  smallest_effect: 1
hypotheses:
  late: {direction: above, margin: 1}
"""
)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "late.yaml"
    path.write_text(STUDY)
    return path


@pytest.fixture(scope="module")
def results(study):
    return dva_sim.run(study, study.parent / "api", set={"persons": 1}, jobs=1, report=False)


def files(folder):
    """All that must be the same bytes."""
    folder = Path(folder)
    paths = [*folder.glob("tables/*"), *folder.glob("figures/*")]
    paths += [folder / "manifest.json", folder / "report.html"]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def python(*words, folder):
    """Output of a separate Python process, without errors or warnings."""
    done = patience.run([sys.executable, *words], capture_output=True, text=True, cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.mark.system  # and two reports
def test_a_run_gives_the_bytes_of_the_same_command(study, results):
    results.report()
    out = str(study.parent / "cli")
    command = ["run", str(study), "--set", "persons=1", "-o", out, "--jobs", "2"]
    python("-m", "dva_sim.cli", *command, folder=study.parent)
    assert files(out) == files(results.folder)


def test_the_runs_are_columns(results):
    assert results.runs["link.delay_s"].tolist() == [0.0, 0.3]
    assert results.runs["drive_time_s"].dtype == np.float64
    assert results.failures == []


def test_a_finished_study_is_only_opened_again(study, results):
    reports = []
    again = dva_sim.run(
        study,
        results.folder,
        set=["persons=1"],
        progress=lambda done, total: reports.append((done, total)),
        report=False,
    )
    assert reports[0] == (2, 2)
    assert again.manifest == results.manifest


def test_a_folder_can_be_loaded_and_compared_with_itself(results):
    comparison = dva_sim.compare(results, dva_sim.load(results.folder))
    assert comparison.paired == (2, 2)
    assert comparison.changed()[0] == []
    assert [verdict.holds for verdict in comparison.judge("mean(drive_time_s) > 1x")] == [False]


def test_one_run_can_be_had_without_a_study():
    once = dva_sim.episode("drive-to-event", seed=2, set={"horizon_s": 40, "link.delay_s": 0.1})
    assert once.scenario.link.delay_s == 0.1
    assert once.measures["simulated_s"] <= 40
    assert set(once.tables) >= {"runs", "events", "tracks"}
    assert once.tables["tracks"]["t_s"][0] == 0.0
    assert "<td>drive_time_s</td>" in once._repr_html_()


def test_an_episode_is_the_run_of_a_study_with_that_seed(results):
    first = results.runs.where(results.runs["link.delay_s"] == 0.0)
    fixed = {"horizon_s": 40, "link.delay_s": 0.0, "operator.population_seed": 4}
    once = dva_sim.episode("drive-to-event", int(first["seed"][0]), set=fixed)
    for name in ("drive_time_s", "path_m", "traffic_bytes"):
        assert once.measures[name] == first[name][0]


@pytest.mark.system
def test_a_script_needs_no_guard(study):
    """Worker processes would run it again, and start the study within the study.

    Only they do not know of it: while the study runs, the script still has its own name.
    """
    script = study.parent / "script.py"
    script.write_text(
        "import dva_sim\n"
        "def progress(done, total): names.append(__file__)\n"
        "names = []\n"
        "results = dva_sim.run('late.yaml', 'out', set={'persons': 1}, jobs=2, report=False,"
        " progress=progress)\n"
        "print(results.runs.rows, len(set(names)))\n"
    )
    assert python(str(script), folder=study.parent) == "2 1\n"


def test_a_dry_run_asks_as_a_run_does():
    asked = inspect.signature(dva_sim.dry_run).parameters
    there = inspect.signature(dva_sim.run).parameters
    assert dict(asked) == dict(there)


def test_a_dry_run_tells_what_is_left(study, results):
    plan = dva_sim.dry_run(study, results.folder, set={"persons": 1}, jobs=1)
    assert (plan.runs, plan.done, plan.estimate_s) == (2, 2, 0.0)


def test_results_are_told_shown_and_exported(results, tmp_path, capsys):
    (runs,) = dva_sim.export(results, tmp_path / "runs.csv")
    assert len(runs.read_text().splitlines()) == 3
    files = dva_sim.export(results.folder, tmp_path, table="events", format="parquet")
    assert [path.name for path in files] == ["events.parquet", "columns.csv"]
    assert dva_sim.show(results, table="runs", rows=1) is results
    assert "1 more" in capsys.readouterr().out


def test_a_new_study_is_written_and_registered(tmp_path):
    path = dva_sim.new(tmp_path / "mine")
    assert path == tmp_path / "mine.yaml"
    with pytest.raises(ConfigError, match="already exists"):
        dva_sim.new(path)
    path.write_text(REGISTERED)
    made = dva_sim.register(path)
    assert made.study == "mine"
    assert made.hash in (tmp_path / "mine.registration.yaml").read_text()
    with pytest.raises(ConfigError, match="already exists"):
        dva_sim.register(path)
    assert dva_sim.register(path, again=True).earlier == (made.hash,)


@pytest.mark.system
def test_an_episode_is_kept_drawn_and_played_again(tmp_path, capfd):
    kept, still = tmp_path / "a.mcap", tmp_path / "a.png"
    short = {"horizon_s": 15}
    once = dva_sim.episode("drive-to-event", seed=2, set=short, record=kept, still=still, at=10)
    assert still.read_bytes().startswith(b"\x89PNG")
    again = dva_sim.replay(kept, still=tmp_path / "b.svg", at=5)
    assert (tmp_path / "b.svg").exists()
    assert again.seed == once.seed == 2
    assert again.measures["path_m"] == once.measures["path_m"] > 0
    assert once.tables["tracks"].rows > 0
    assert capfd.readouterr() == ("", "")


def test_it_works_where_an_event_loop_runs_and_prints_nothing(study, capfd):
    """Runs inside an event loop, like a notebook."""

    async def cell():
        quiet = study.parent / "quiet"
        return dva_sim.run(study, quiet, set={"persons": 1}, jobs=1, report=False)

    assert asyncio.run(cell()).runs.rows == 2
    assert capfd.readouterr() == ("", "")


HEAVY = ["numpy", "pydantic", "duckdb", "scipy", "matplotlib", "rich", "dva_sim.experiments"]


@pytest.mark.parametrize(("module", "absent"), [("dva_sim", "dva_sim.api"), ("dva_sim.cli", "zmq")])
def test_importing_the_package_or_the_commands_loads_nothing_heavy(module, absent):
    code = f"import sys, {module}; print({{*{HEAVY}, {absent!r}}} & {{*sys.modules}})"
    assert python("-c", code, folder=".") == "set()\n"


def test_what_functions_return_can_be_kept_and_is_known_by_its_class(results):
    once = dva_sim.episode("drive-to-event", set={"horizon_s": 2})
    again = pickle.loads(pickle.dumps(once))
    assert isinstance(again, dva_sim.Episode)
    assert again.measures == pytest.approx(once.measures, nan_ok=True)
    assert isinstance(results, dva_sim.Results)
    assert pickle.loads(pickle.dumps(results)).manifest == results.manifest
    earlier = [pickle.loads(f"cdva_sim.api\n{name}\n.".encode()) for name in ("Episode", "Results")]
    assert earlier == [dva_sim.Episode, dva_sim.Results]
    with pytest.raises(AttributeError, match="no attribute 'Fly'"):
        _ = dva_sim.api.Fly


def test_what_is_there_is_told_and_nothing_else_is_found():
    assert {"run", "load", "compare", "episode"} <= set(dir(dva_sim))
    with pytest.raises(AttributeError, match="no attribute 'fly'"):
        _ = dva_sim.fly


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("persons", 4, "persons=4"),
        ("pattern", "req-rep", "pattern=req-rep"),
        ("answer", None, "answer=null"),
        ("link.delay_s", 0.1, "link.delay_s=0.1"),
        ("label", "4", 'label="4"'),
        ("factors.link.delay_s", (0, np.float64(0.5)), "factors.link.delay_s=[0, 0.5]"),
        ("site.map", Path("plans/a.yaml"), "site.map=plans/a.yaml"),
    ],
)
def test_settings_are_written_as_on_the_command_line(key, value, text):
    assert pairs_of({key: value}) == [text]
    again = parse_changes([text])[key]
    assert json.dumps(again) == json.dumps(
        value, default=lambda x: x.item() if hasattr(x, "item") else str(x)
    )


def test_a_value_that_no_file_could_hold_is_refused():
    with pytest.raises(ConfigError, match="persons cannot be"):
        pairs_of({"persons": object()})
