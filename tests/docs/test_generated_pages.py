"""Generated pages of the reference name everything that the program has."""

import csv
import json
import re
from collections import Counter

import generators
import pytest
from generators import correspondences, messages, plugins, python_api, recordings, results
from helpers.messages.message_oracle import BODY_ELEMENTS
from helpers.paths import ROOT
from mcap.reader import make_reader
from typer import Context
from typer.main import get_command

import dva_sim
from dva_sim.cli import names
from dva_sim.cli.commands import name_of
from dva_sim.cli.program import app, call
from dva_sim.console.wire.actions import ACTIONS
from dva_sim.experiments.report.blocks import GLOSSARY
from dva_sim.experiments.report.kept_answers import HISTORY, all_kept
from dva_sim.kernel.errors import ExitCode
from dva_sim.network.patterns import PATTERNS
from dva_sim.simulation.models import MODELS
from dva_sim.simulation.run_measures import PLUGINS as COVARIATES
from dva_sim.simulation.scenario.assumptions import all_assumptions
from dva_sim.testing.files import schema_text
from dva_sim.testing.promises import TRIALS
from dva_sim.worlds.geojson import KINDS
from dva_sim.worlds.site_parts import QUALITIES


def page(name):
    return generators.PAGES[f"reference/{name}.md"]()


def first_cells(text):
    """The code in the first cell of each row of each table, counted."""
    return Counter(re.findall(r"^\| `([^`]+)`", text, re.MULTILINE))


def every_command(command, path=()):
    """All commands with their paths, groups among them."""
    context = Context(command)
    for name in command.list_commands(context):
        found = command.get_command(context, name)
        yield (*path, name), found
        if hasattr(found, "list_commands"):
            yield from every_command(found, (*path, name))


def test_every_command_is_there_with_every_option_and_example():
    text = page("command-line")
    parts = re.split(r"^##+ (.*)$", text, flags=re.MULTILINE)
    sections = dict(zip(parts[1::2], parts[2::2], strict=True))
    commands = list(every_command(get_command(app)))
    assert len(commands) > 20
    for path, command in commands:
        section = sections[f"dva-sim {' '.join(path)}"]
        if not hasattr(command, "list_commands"):
            wanted = [name_of(param) for param in command.params]
            wanted += [example for example, _ in command.examples]
            assert [word for word in wanted if word not in section] == [], path


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("scenario", "scenario-keys"),
        ("study", "study-keys"),
        ("agent", "profile-keys"),
        ("site", "profile-keys"),
    ],
)
def test_every_key_is_there_once_for_each_part_that_has_it(kind, name):
    schema = json.loads(schema_text(kind))
    parts = [schema, *schema["$defs"].values()]
    keys = Counter(key for part in parts for key in part.get("properties", ()))
    assert len(keys) > 5
    assert keys - first_cells(page(name)) == Counter()


def test_every_key_has_a_meaning():
    pages = "".join(map(page, ("scenario-keys", "study-keys", "profile-keys")))
    assert re.findall(r"^\| `.*\|  \|$", pages, re.MULTILINE) == []


def test_every_kind_and_property_of_a_feature_on_a_plan_is_there():
    text = page("plan-features")
    found = first_cells(text)
    assert {*KINDS, *QUALITIES} - set(found) == set()
    named = {name for kind in KINDS.values() for name in kind.model.model_fields}
    assert [name for name in named if f"`{name}`: " not in text] == []


def test_every_measure_is_there():
    found = first_cells(page("measures"))
    tables = [columns for model in MODELS.values() for columns in model.columns.values()]
    wanted = Counter(column.name for columns in tables for column in columns)
    wanted.update(kind.about.name for kind in COVARIATES.shipped.values())
    assert wanted - found == Counter()


def test_every_kind_of_plug_in_is_there_with_all_that_one_needs_to_know():
    text = page("plugins")
    for word, trial in TRIALS.items():
        kind = trial.load_plugins()
        facts = (kind.key, kind.group, kind.public, kind.needs, kind.folder)
        assert [fact for fact in facts if f"`{fact}`" not in text] == []
        assert f"dva-sim check {word} mine.py:Mine" in text
        assert len(plugins.broken_promises(trial)) > 3, word


def test_promises_are_those_of_the_kind_alone():
    """Filters and mappings are checked in one module."""
    of_filters, of_mappings = (plugins.broken_promises(TRIALS[k]) for k in ("filter", "mapping"))
    assert "turns left and right differently" in of_mappings
    assert "turns left and right differently" not in of_filters


def test_every_name_is_in_the_catalogue():
    found = first_cells(page("catalogue"))
    wanted = Counter(each.name for entries in names.everything().values() for each in entries)
    assert wanted - found == Counter()


def test_every_exit_code_and_assumption_is_there():
    assert [c for c in ExitCode if f"| `{int(c)}` |" not in page("exit-codes")] == []
    found = first_cells(page("assumptions"))
    assert set(found) == {each.key for each in all_assumptions()}


def test_every_element_of_the_schema_is_there():
    schema = (ROOT / "protocol/dva.xsd").read_text(encoding="utf-8")
    elements = set(re.findall(r'<xs:element name="(\w+)"', schema)) - {"msg"}
    text = page("messages")
    shown = {name for cell in first_cells(text) for name in cell.split(" / ")}
    kinds = set(re.findall(r"^### (\w+)$", text, re.MULTILINE))
    assert elements - shown - kinds == set()


def test_every_message_has_a_row_that_says_who_sends_it_to_whom_and_how():
    bodies = BODY_ELEMENTS - {"reply"}
    with messages.USES.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert Counter(row["message"] for row in rows) == Counter(bodies)
    assert [row for row in rows if not all(row[k] for k in row if k != "obeyed")] == []
    asked = [row for row in rows if not row["sent as"].startswith("published")]
    assert [row["message"] for row in asked if not row["obeyed"]] == []


def test_messages_with_counterparts_elsewhere_are_of_the_schema():
    with correspondences.FILE.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    named = {name for row in rows for name in re.findall(r"`([A-Z]\w+)`", row["ours"])}
    modes = {"Idle", "Mission", "Teleoperation"}
    assert len(named) > 20
    assert named - modes - messages.names() == set()
    assert named - set(re.findall(r"`(\w+)`", page("correspondences"))) == set()


def test_every_sample_is_there():
    files = {path.name for path in (ROOT / "protocol/samples").rglob("*.xml")}
    assert files - set(re.findall(r"`([\w-]+\.xml)`", page("samples"))) == set()


@pytest.mark.parametrize(
    ("element", "since"),
    [
        ("SeenTick", "1.1"),
        ("Takeover", "1.4"),
        ("GetGrant / Level", "1.6"),
        ("Patrol / Laps", "1.3"),
    ],
)
def test_an_element_has_the_version_that_introduced_it(element, since):
    rows = re.findall(rf"^\| `[^`]*{re.escape(element)}` .*\| ([\d.]*) \|$", page("messages"), re.M)
    assert rows
    assert set(rows) == {since}


def test_every_action_and_route_of_the_console_is_there():
    text = page("console")
    assert set(ACTIONS) - set(first_cells(text)) == set()
    source = (ROOT / "dva_sim/console/web/app.py").read_text(encoding="utf-8")
    paths = re.findall(r'Route\("(/[^"]*)"', source)
    assert len(paths) > 15
    fixed = [re.split(r"[{?]", path)[0].rstrip("/") for path in paths]
    assert [path for path in fixed if path not in text] == []
    assert re.findall(r"^\| `(?:GET|POST|WS) .*\|  \|$", text, re.MULTILINE) == []


def test_every_topic_of_a_recording_is_there(tmp_path):
    file = tmp_path / "run.mcap"
    words = ["hands-on", "--set", "horizon_s=40", "--record", str(file), "-q"]
    assert call(["episode", *words]) == 0
    with file.open("rb") as opened:
        summary = make_reader(opened).get_summary()
    schemas = {c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()}
    assert len(schemas) > 20
    patterns = [
        (re.sub(r"NAME|WHAT|FROM|TO\b", r"[^/]+", topic.name), topic.schema)
        for topic in recordings.TOPICS
    ]
    assert [
        (topic, schema)
        for topic, schema in schemas.items()
        if not any(re.fullmatch(p, topic) and schema == s for p, s in patterns)
    ] == []


def test_every_topic_of_the_page_has_a_schema_that_is_there():
    text = page("recordings")
    known = set(first_cells(text)) | {"dva"}
    assert {topic.schema for topic in recordings.TOPICS} - known == set()


def test_every_word_of_the_glossary_is_there_once():
    text = page("glossary")
    assert len({term.name for term in GLOSSARY}) == len(GLOSSARY)
    assert [term.name for term in GLOSSARY if f"| {term.name} |" not in text] == []
    assert [kind.title for kind in PATTERNS.values() if kind.title not in text] == []


def test_every_public_function_and_class_is_there():
    text = python_api.page()
    assert [name for name in dva_sim.__all__ if f"dva_sim.api.{name}" not in text] == []


def test_every_study_has_a_page_and_every_kept_answer_is_on_it():
    pages = dict(results.pages())
    assert set(pages) == set(results.paths())
    summary = pages["results/index.md"]
    for answer in all_kept(results.KEPT):
        result_page = pages[f"results/{answer.study}.md"]
        assert answer.date in result_page
        assert f"{answer.runs} runs" in result_page
        assert f"{answer.version}, {answer.date}" in summary


def test_a_page_offers_the_small_version_of_a_study_that_has_one():
    for path, text in results.pages():
        file = ROOT / "experiments" / f"{path.removeprefix('results/').removesuffix('.md')}.yaml"
        if file.exists():
            has_small = re.search(r"^quick:", file.read_text(encoding="utf-8"), re.MULTILINE)
            assert ("--quick" in text) == bool(has_small), path


def test_every_earlier_answer_is_on_the_page_of_its_study():
    with (results.KEPT / HISTORY).open(encoding="utf-8") as file:
        lines = Counter(line["study"] for line in csv.DictReader(file))
    pages = dict(results.pages())
    assert lines
    for study, count in lines.items():
        table = pages[f"results/{study}.md"].partition("## Earlier answers")[2]
        assert table.count("\n| ") == count + 2
