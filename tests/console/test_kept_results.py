"""What people did at a console is a results folder with the tables of any run."""

import json

import pytest
from console_page import Page

from dva_sim.console.kept_results import KeptResults, name_of
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.full.stage import DVA, id_of, kind_of


def driven(monkeypatch, out, seed=1):
    """A folder after two drives of two robots by one person, under two patterns."""
    results = KeptResults(out, "hands-on", ["link.delay_s=0.1"], seed, False)
    scenario = results.scenario.model_dump(mode="json")
    page = Page(monkeypatch, scenario, results.seed, measured=True)
    results.follow(page.world)
    page.let(1.0)
    assert page.do("take", robots=[0, 1])[0]
    for pattern in ("latest-wins", "req-rep"):
        assert page.do("pattern", robot=0, name=pattern)[0]
        assert page.do("start")[0]
        page.want(0.5, 0.2)
        page.let(5.0)
        page.let_go()
        assert page.do("stop")[0]
        page.let(1.0)
    results.write()
    return Results.load(out)


def test_a_drive_of_a_person_is_a_row(monkeypatch, tmp_path):
    results = driven(monkeypatch, tmp_path / "out")
    drives = results.table("drives")
    assert set(results.tables) >= {"runs", "operators", "drives", "commands", "events", "people"}
    assert list(drives["person_label"]) == ["person-1"] * 4
    assert list(drives["robot_name"]) == ["robot-1", "robot-2"] * 2
    assert list(drives["pattern"]) == ["latest-wins", "latest-wins", "req-rep", "latest-wins"]
    assert list(drives["outcome"]) == ["stopped"] * 4
    assert list(drives["driven_s"]) == pytest.approx([5.2] * 4, abs=1.0)
    assert all(age == pytest.approx(0.102, abs=0.03) for age in drives["command_age_p50_s"])
    assert list(results.table("operators")["operator_name"]) == ["console-1"]
    assert results.runs["simulated_s"][0] > 10


def test_each_command_that_took_effect_is_a_row(monkeypatch, tmp_path):
    results = driven(monkeypatch, tmp_path / "out")
    drives, commands = results.table("drives"), results.table("commands")
    for number, count in zip(drives["drive"], drives["commands_applied"], strict=True):
        assert 0 < count <= sum(commands["drive"] == number)
    assert all(commands["t_made_s"] <= commands["t_sent_s"])
    assert all(commands["t_sent_s"] < commands["t_arrived_s"])
    assert all(commands["t_arrived_s"] <= commands["t_applied_s"])


def test_every_column_says_what_it_means(monkeypatch, tmp_path):
    results = driven(monkeypatch, tmp_path / "out")
    for table in ("drives", "commands"):
        assert [c.name for c in results.columns(table) if not c.meaning] == []


def test_the_same_drives_give_the_same_bytes(monkeypatch, tmp_path):
    one, other = (driven(monkeypatch, tmp_path / name) for name in ("one", "other"))
    assert one.path_of("commands").read_bytes() == other.path_of("commands").read_bytes()
    assert one.path_of("drives").read_bytes() == other.path_of("drives").read_bytes()


def test_what_a_person_calls_a_device_is_in_no_table(monkeypatch, tmp_path):
    out = tmp_path / "out"
    results = KeptResults(out, "hands-on", [], 1, False)
    page = Page(monkeypatch, results.scenario.model_dump(mode="json"), measured=True)
    results.follow(page.world)
    device = page.world.person(0).device
    device.label = device.labels[device.id_tag] = "Jane's own"
    assert page.do("take", robots=[0])[0]
    assert page.do("start")[0]
    page.let(3.0)
    results.write()
    for table in Results.load(out).tables:
        rows = Results.load(out).table(table)
        assert not any("Jane" in str(value) for column in rows.values() for value in column)


def test_a_folder_that_holds_something_is_left_as_it_is(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(ConfigError, match="holds something already: give another folder"):
        KeptResults(tmp_path, "hands-on", [], 1, False)
    with pytest.raises(ConfigError, match="holds something already"):
        KeptResults(tmp_path / "mine.txt", "hands-on", [], 1, True)
    KeptResults(tmp_path, "hands-on", [], 1, True)


def test_the_manifest_tells_what_was_changed(monkeypatch, tmp_path):
    driven(monkeypatch, tmp_path / "out", seed=7)
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["study"]["seed"] == 7
    assert manifest["study"]["parts"]["console"]["changes"] == {"link.delay_s": 0.1}


@pytest.mark.parametrize("kind", ["robot", "console", "phone"])
def test_a_device_has_a_kind_and_a_number_by_its_id(kind):
    assert kind_of(id_of(kind, 300)) == (kind, 300)
    assert name_of(id_of(kind, 2)) == f"{kind}-2"
    assert kind_of("AA:BB:CC:DD:EE:FF") == ("", 0xEEFF)
    assert kind_of(DVA)[0] == "dva"
