"""The printed schemas accept what is shipped, and refuse what the program refuses."""

import functools
import json

import pytest
from helpers.paths import ROOT
from helpers.wording import unnamed
from jsonschema import Draft202012Validator
from lxml import etree

from dva_sim.experiments.study.loading import load_study
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.testing.files import schema_text

SHIPPED = {
    "study": sorted(set(ROOT.glob("experiments/*.yaml")) - set(ROOT.rglob("*.registration.yaml"))),
    # The keys of a user's model are known to its file alone.
    "scenario": sorted(
        file
        for file in ROOT.glob("experiments/scenarios/*.yaml")
        if ".py:" not in file.read_text(encoding="utf-8")
    ),
    "cases": [ROOT / "experiments/validation/dispatch.yaml"],
    "site": sorted(ROOT.glob("worlds/*.yaml")),
    "agent": sorted(ROOT.glob("agents/*/*.yaml")),
}


@functools.cache
def validator(kind):
    schema = json.loads(schema_text(kind))
    assert schema["$schema"] == Draft202012Validator.META_SCHEMA["$schema"]
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.mark.parametrize("kind", SHIPPED)
def test_shipped_files_follow_the_printed_schema_and_with_an_unknown_key_they_do_not(kind):
    assert SHIPPED[kind]
    for path in SHIPPED[kind]:
        data = load_yaml(path).data
        assert validator(kind).is_valid(data), path
        assert not validator(kind).is_valid(data | {"colour": "blue"}), path


def test_ranges_and_choices_are_in_the_schema():
    scenario = validator("scenario")
    assert scenario.is_valid({"pattern": "pub-sub", "link": {"loss": 0.1}})
    assert not scenario.is_valid({"pattern": 5})
    assert not scenario.is_valid({"transport": "post"})
    assert not scenario.is_valid({"link": {"loss": 1}})
    assert not scenario.is_valid({"robot": {"count": 0.5}})
    assert not validator("study").is_valid({"question": "what?"})


NEW_KEYS = """\
question: what?
persons: 4
parts: {it: {scenario: drive-to-event}}
factors: {pattern: [req-rep, latest-wins]}
design:
  sobol: 8
  ranges: {link.delay_s: [0, 1], link.loss: {low: 0.001, high: 0.1, scale: log}}
comparisons:
  far: {part: it, measure: contacts, factor: pattern, contrast: [req-rep, latest-wins]}
hypotheses:
  costs: {comparison: far, direction: above, margin: 0.5}
stop: {half_width: 1, comparison: far, batch_persons: 2, most_persons: 9}
budget_s: 60
record: worst
full: {persons: 8}
"""


def accepts_study(tmp_path, text):
    path = tmp_path / "study.yaml"
    path.write_text(text)
    return validator("study").is_valid(load_yaml(path).data)


def test_what_a_study_may_say_follows_the_schema_and_is_taken_by_the_program(tmp_path):
    assert accepts_study(tmp_path, NEW_KEYS)
    assert load_study(tmp_path / "study.yaml").design.sobol == 8


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("sobol: 8", "sobol: eight"),
        ("[0, 1]", "[0, 1, 2]"),
        ("scale: log", "scale: square"),
        ("direction: above", "direction: up"),
        ("batch_persons: 2", "batch: 2"),
        ("batch_persons: 2", "batch_persons: double"),
        ("record: worst", "record: best"),
        ("budget_s: 60", "budget_s: 0"),
        ("measure: contacts, ", ""),
        ("sobol: 8", "sobol: 6"),
        ("sobol: 8", "sobol: true"),
        ("sobol: 8", 'sobol: "8"'),
        ("sobol: 8\n", "rows: [{link.loss: 0}]\n"),
        ("sobol: 8\n", "sobol: 8\n  latin_hypercube: 8\n"),
        ("  sobol: 8\n", ""),
        ("latest-wins]}\nhyp", "latest-wins], within: 3}\nhyp"),
        ("pattern: [req-rep, latest-wins]", "pattern: [req-rep, req-rep]"),
        ("direction: above, margin: 0.5", "direction: same"),
        ("direction: above, margin: 0.5", "direction: same, margin: 0"),
        ("comparison: far, batch", "batch"),
        ("comparison: far, batch", "comparison: null, batch"),
        ("comparison: far, batch", "measure: contacts, batch"),
        ("comparison: far, batch", "comparison: far, measure: contacts, part: it, batch"),
    ],
)
def test_a_mistake_there_follows_neither_the_schema_nor_the_program(tmp_path, old, new):
    assert old in NEW_KEYS
    text = NEW_KEYS.replace(old, new)
    assert not accepts_study(tmp_path, text)
    with pytest.raises(ConfigError):
        load_study(tmp_path / "study.yaml")


def test_the_schema_tells_what_each_key_of_a_study_means():
    schema = json.loads(schema_text("study"))
    expected = "Contrast", "Design", "Hypothesis", "StudyPart", "ValueRange", "StopRule", "Tuning"
    for name in expected:
        model = schema["$defs"][name]
        assert "Attributes" not in model["description"]
        assert all(key.get("description") for key in model["properties"].values()), name
    assert all(key.get("description") for key in schema["properties"].values())
    scale = schema["$defs"]["ValueRange"]["properties"]["scale"]
    assert not unnamed(scale["description"], *scale["enum"])


def test_every_kind_of_agent_is_named():
    schema = json.loads(schema_text("agent"))
    named = {inner["$ref"].rpartition("/")[2] for inner in schema["anyOf"]}
    people = {"GuardProfile", "BystanderProfile", "Population", "Bands"}
    assert named == {"RobotProfile", "PhoneProfile", "AccelerometerPart", "RosProfile"} | people
    assert all(schema["$defs"][name]["title"] == name for name in named)


def test_the_printed_xsd_is_the_schema_and_accepts_the_samples():
    text = schema_text("message")
    assert text == (ROOT / "protocol" / "dva.xsd").read_text(encoding="utf-8")
    schema = etree.XMLSchema(etree.fromstring(text.encode()))
    samples = sorted(ROOT.glob("protocol/samples/valid/*.xml"))
    assert samples
    for path in samples:
        schema.assertValid(etree.parse(path))
