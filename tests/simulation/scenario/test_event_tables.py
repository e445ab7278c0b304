"""Events from a table: what is read, what is left out, and what is refused with its place."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.wording import unnamed

from dva_sim.console import options as console
from dva_sim.experiments.report.episode import EpisodeRequest
from dva_sim.experiments.study.cell_grid import cells
from dva_sim.experiments.study.hashing import stable_hash
from dva_sim.experiments.study.loading import load_study
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.live import options as live
from dva_sim.options.runs import ConsoleOptions, EpisodeOptions, LiveOptions
from dva_sim.simulation.models import model_of
from dva_sim.testing.files import check_file

FULL = "model: full\nhorizon_s: 600\n"
TIMED = """
model: timed
site: {name: caparica}
responders: [{name: guard, count: 2, speed_mps: 1.3}]
horizon_s: 600
"""
MODELS = {"full": FULL, "timed": TIMED}
HEAD = "time,kind,room\n"
TWO = "2026-03-01T08:00:00Z,fire,Workshop\n2026-03-01T08:01:00Z,flood,Kitchen\n"


def made(folder: Path, model: str, table: str | bytes, keys: str = "") -> Path:
    """A scenario beside its table."""
    data = table if isinstance(table, bytes) else table.encode()
    (folder / "alarms.csv").write_bytes(data)
    file = folder / "desk.yaml"
    file.write_text(f"{MODELS[model]}events: {{table: alarms.csv{keys}}}\n")
    return file


def built(file: Path, changes: dict[str, Any] | None = None) -> Any:
    document = load_yaml(file)
    return model_of(document).build(document, changes or {})


def events_of(scenario: Any) -> list[tuple[float, str, str | None]]:
    """Time, kind and room of each event, in order of time."""
    if scenario.model == "full":
        return [(e.at_s, e.kind, e.room) for e in scenario.events]
    found = [(e.at_s, s.kind, e.zone) for s in scenario.demand for e in s.listed]
    return sorted(found)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    ("table", "keys"),
    [
        (HEAD + TWO, ""),
        ("\ufeff" + HEAD + TWO, ""),
        (HEAD.upper() + TWO, ""),
        (HEAD + "\n" + TWO.replace("\n", "\n\n,,\n"), ""),
        ((HEAD + TWO).replace("\n", "\r\n"), ""),
        ((HEAD + TWO).replace(",", ";"), ""),
        ((HEAD + TWO).replace(",", "\t"), ""),
        (HEAD + "".join(reversed(TWO.splitlines(keepends=True))), ""),
        (HEAD + TWO.replace("Z", "").replace("T", " "), ", time_zone: UTC"),
        (HEAD + TWO.replace("Z", "").replace("T08", "T09"), ", time_zone: Europe/Berlin"),
        (HEAD + TWO.replace("T08", "T09").replace("Z", "+01:00"), ""),
        (HEAD + TWO, ", start: 2026-03-01T08:00:00Z"),
        (HEAD + TWO, ", start: 2026-03-01T09:00:00+01:00"),
        (HEAD + TWO.replace("Z", ""), ', time_zone: UTC, start: "2026-03-01 08:00"'),
        (HEAD + "0,fire,Workshop\n60,flood,Kitchen\n", ""),
        ("time;kind;room\n1000,0;fire;Workshop\n1060,0;flood;Kitchen\n", ", start: 1000"),
        (HEAD + TWO.replace("fire", "Brand"), ", kinds: {Brand: fire}"),
        (HEAD + TWO + "2026-03-01T08:02:00Z,test,Kitchen\n", ", kinds: {Test: null}"),
        (
            "time,kind,x,y\n0,fire,5,5\n60,flood,20.0,12.0\n".replace("0,fire,5,5", "0,fire,20,12"),
            "",
        ),
    ],
)
def test_tables_of_all_forms_are_the_same_events(
    tmp_path: Path, model: str, table: str, keys: str
) -> None:
    events = events_of(built(made(tmp_path, model, table, keys)))
    rooms = ["Main corridor"] * 2 if ",x,y" in table else ["Workshop", "Kitchen"]
    assert events == [(0.0, "fire", rooms[0]), (60.0, "flood", rooms[1])]


@pytest.mark.parametrize("model", MODELS)
def test_check_says_what_is_taken_and_what_is_left_out(tmp_path: Path, model: str) -> None:
    early = "2026-03-01T07:00:00Z,fire,Kitchen\n"
    late = "2026-03-01T09:00:00Z,fire,Kitchen\n"
    table = f"{HEAD}{early}{TWO}{late}".replace("room\n", "room,severity,note\n")
    table = table.replace("Kitchen\n", "Kitchen,0.5,x\n").replace("Workshop\n", "Workshop,,\n")
    verdict = check_file(made(tmp_path, model, table, ", start: 2026-03-01T08:00:00Z"))
    unused = "'severity', 'note'" if model == "full" else "'note'"
    assert verdict.problems == []
    named = "alarms.csv", "1 fire", "1 flood", " 0 s", " 60 s", "2026-03-01T08:00:00+00:00"
    assert unnamed(verdict.note, *named, f": {unused}") == []
    (doubt,) = verdict.doubts
    assert unnamed(doubt, "events: 2", "alarms.csv", "events.start", "horizon_s 600") == []


@pytest.mark.parametrize("model", MODELS)
def test_a_row_that_repeats_another_counts_again_and_is_named(tmp_path: Path, model: str) -> None:
    verdict = check_file(made(tmp_path, model, HEAD + TWO + TWO.splitlines()[0]))
    assert unnamed(verdict.note, "3 events", "alarms.csv") == []
    (doubt,) = verdict.doubts
    assert unnamed(doubt, "events: 1 row", "alarms.csv", "line 4;") == []


@pytest.mark.parametrize(
    "scenario_at",
    [
        lambda file: EpisodeRequest(EpisodeOptions(file)).scenarios()[0],
        lambda file: live.scenario_of(LiveOptions(scenario=file)),
        lambda file: console.scenario_of(ConsoleOptions(scenario=file)),
    ],
    ids=["episode", "live", "console"],
)
def test_every_door_opens_the_same_events(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scenario_at: Callable[[str], Any]
) -> None:
    file = made(tmp_path, "full", HEAD + TWO)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    events = [(0.0, "fire", "Workshop"), (60.0, "flood", "Kitchen")]
    assert events_of(scenario_at(str(file))) == events


STUDY = """
question: Which morning is slower?
seed: 5
persons: 2
factors: {events.table: [alarms.csv, other.csv], horizon_s: [600]}
parts: {shift: {scenario: desk.yaml}}
answer:
  part: shift
  measure: response_mean_s
  factor: events.table
  contrast: [other.csv, alarms.csv]
  over: horizon_s
  smallest_effect_s: 1.0
"""


@pytest.mark.parametrize("model", MODELS)
def test_a_study_varies_the_tables_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, model: str
) -> None:
    made(tmp_path, model, HEAD + TWO)
    (tmp_path / "other.csv").write_text(HEAD + TWO.replace("Kitchen", "Canteen"))
    (tmp_path / "mornings.yaml").write_text(STUDY)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    made_of = cells(load_study(tmp_path / "mornings.yaml"))
    rooms = [[room for _, _, room in events_of(cell.scenario)] for cell in made_of]
    assert rooms == [["Workshop", "Kitchen"], ["Workshop", "Canteen"]]
    assert len({cell.config for cell in made_of}) == 2


@pytest.mark.parametrize("model", MODELS)
def test_the_content_of_the_table_is_what_a_scenario_is(tmp_path: Path, model: str) -> None:
    file = made(tmp_path, model, HEAD + TWO)
    first = built(file)
    again = pickle.loads(pickle.dumps(first))
    assert again == first
    dump = first.model_dump(mode="json")
    assert type(first).model_validate(dump).model_dump(mode="json") == dump
    made(tmp_path, model, HEAD + TWO.replace("Kitchen", "Canteen"))
    other = built(file)
    assert stable_hash(dump) != stable_hash(other.model_dump(mode="json"))


@pytest.mark.parametrize("model", MODELS)
def test_a_run_has_the_events_of_the_table(tmp_path: Path, model: str) -> None:
    file = made(tmp_path, model, HEAD + TWO)
    document = load_yaml(file)
    found = model_of(document)
    tables = found.tables(built(file, {"horizon_s": 661}), 1, False)
    kinds = [row["kind"] for row in tables["events"]]
    assert kinds == ["fire", "flood"]


@pytest.mark.parametrize("model", MODELS)
def test_the_name_of_a_file_alone_is_a_table(tmp_path: Path, model: str) -> None:
    file = made(tmp_path, model, HEAD + TWO)
    file.write_text(MODELS[model] + "events: alarms.csv\n")
    assert len(events_of(built(file))) == 2


def test_twenty_thousand_rows_are_read(tmp_path: Path) -> None:
    rows = "".join(f"{n},fire,Kitchen\n" for n in range(20_000))
    scenario = built(made(tmp_path, "timed", HEAD + rows), {"horizon_s": 1e6})
    assert len(scenario.demand[0].listed) == 20_000
