"""The registry of messaging patterns: one place that names, lists and hints derive from."""

import subprocess
import sys
from importlib.metadata import EntryPoint

import pytest
from helpers.paths import ROOT

from dva_sim.cli import names
from dva_sim.experiments.report.blocks import TERMS
from dva_sim.experiments.report.figures.palette import look_of
from dva_sim.kernel import plugins
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.patterns import PATTERNS, PubSub, load_pattern, meaning_of
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.labels import level_name
from dva_sim.simulation.scenario import Scenario

EXAMPLE = "acknowledged_pub_sub.py:AcknowledgedPubSub"

GREEDY = """
from dva_sim.network.patterns import Pattern


class Greedy(Pattern):
    def __init__(self, parts):
        parts.pop(0)
        self.left = parts

    def offer(self, command):
        pass
"""


def test_every_pattern_says_all_that_reports_and_pages_tell_of_it():
    page = (ROOT / "protocol" / "README.md").read_text(encoding="utf-8").splitlines()
    for name, kind in PATTERNS.items():
        row = next(line for line in page if line.startswith(f"| `{name}`"))
        assert kind.sockets in row
        assert kind.when_slow in row
        assert level_name("pattern", name) == kind.title
        assert level_name("pattern", name, short=True) == kind.label
        assert meaning_of(kind) in {term.means for term in TERMS if term.name == kind.title}
    assert len({look_of(name) for name in PATTERNS}) == len(PATTERNS)
    assert set(PATTERNS) <= {entry.name for entry in names.everything("patterns")["patterns"]}


def test_a_package_offers_patterns_by_name(monkeypatch):
    offered = EntryPoint("plain", "dva_sim.network.patterns:PubSub", "dva_sim.patterns")
    monkeypatch.setattr(plugins, "entry_points", lambda group: [offered])
    assert isinstance(load_pattern("plain")(), PubSub)


def test_options_of_a_pattern_are_written_only_where_there_are_any():
    """The hash of a configuration that has none is what it was before there could be any."""
    assert "pattern_options" not in Scenario().model_dump()
    named = Scenario(pattern=EXAMPLE, pattern_options={"every": 3})
    assert Scenario.model_validate(named.model_dump()) == named


def test_a_scenario_that_is_only_read_runs_no_file(tmp_path):
    """Scenarios in recordings or results folders may come from anybody."""
    (tmp_path / "mine.py").write_text("raise SystemExit('was run')")
    named = {"pattern": f"{tmp_path}/mine.py:Mine"}
    assert Scenario.model_validate(named).pattern == named["pattern"]
    with pytest.raises(ConfigError, match="was run"):
        scenarios.build(named)


def test_a_pattern_beside_the_scenario_that_names_it_is_found(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from dva_sim.network.patterns import PubSub\n\n"
        "class Mine(PubSub):\n    newest_wins = True\n"
    )
    (tmp_path / "one.yaml").write_text("pattern: mine.py:Mine\nhorizon_s: 60\n")
    scenario = scenarios.build(scenarios.load(str(tmp_path / "one.yaml")))
    assert scenario.pattern == f"{tmp_path}/mine.py:Mine"


def test_knowing_the_patterns_needs_neither_sockets_nor_arrays():
    """Labels, lists and completion look there before anything runs."""
    heavy = "{'zmq', 'numpy', 'matplotlib', 'lxml', 'pydantic'}"
    code = f"import sys, dva_sim.network.patterns; print(sorted({heavy} & sys.modules.keys()))"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout == "[]\n"


def test_what_a_pattern_does_to_its_options_stays_with_it(tmp_path):
    (tmp_path / "greedy.py").write_text(GREEDY)
    make = load_pattern("greedy.py:Greedy", {"parts": [1, 2]}, tmp_path)
    assert [make().left, make().left] == [[2], [2]]
