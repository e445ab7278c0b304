"""A scenario whose settings work against each other says so before it runs."""

import io

import pytest
from helpers.wording import unnamed
from rich.console import Console

from dva_sim.cli import live_screen as live
from dva_sim.cli import stories
from dva_sim.cli.checks import check
from dva_sim.experiments.execution.dry_run import contradictions_in
from dva_sim.experiments.report.episode import EpisodeRequest
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.loading import load_study
from dva_sim.kernel.resources import available
from dva_sim.options.runs import EpisodeOptions, LiveOptions
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import simulate
from dva_sim.simulation.scenario import Scenario, contradictions


def built(**changes: object) -> Scenario:
    keys = {key.replace("__", "."): value for key, value in changes.items()}
    return scenarios.build(scenarios.load("drive-to-event"), keys)


def test_time_outs_that_nobody_gave_follow_the_link():
    usual, far = built(link__delay_s=1.0), built(link__delay_s=2.0)
    assert (usual.request.timeout_s, usual.command.timeout_s) == (9.0, 9.0)
    assert far.request.timeout_s == far.command.timeout_s == pytest.approx(1.25 * (16 + 0.05))


def test_each_direction_and_the_robots_computer_count_for_the_time_out():
    far = built(link__up={"delay_s": 3.0}, robot__processing_s=2.0)
    assert far.request.timeout_s == pytest.approx(1.25 * (12 + 2))


def test_time_outs_that_were_given_stay():
    far = built(link__delay_s=2.0, request__timeout_s=5.0, command__timeout_s=4.0)
    assert (far.request.timeout_s, far.command.timeout_s) == (5.0, 4.0)


def test_beyond_nine_seconds_of_round_trips_one_still_drives():
    scenario = built(link__delay_s=1.5)
    assert contradictions(scenario) == []
    recording = simulate(scenario, seed=2)
    assert [event.state for event in recording.events] == ["confirmed"]


@pytest.mark.parametrize(
    ("changes", "key", "names"),
    [
        ({"link__delay_s": 1.2, "request__timeout_s": 9.0}, "request.timeout_s 9", "9.65 s"),
        (
            {"link__delay_s": 0.5, "command__timeout_s": 0.5, "pattern": "req-rep"},
            *("command.timeout_s 0.5", "unanswered"),
        ),
        ({"link__delay_s": 3.0}, "robot.max_age_s 6", "refuses all"),
        ({"link__delay_s": 1.5, "pattern": "req-rep"}, "robot.watchdog_s 3", "stops"),
        ({"robot__watchdog_s": 0.1}, "robot.watchdog_s 0.1", "(command.rate_hz 10)"),
        (
            {"phone__profile": "dissertation", "robot__watchdog_s": 0.5},
            *("robot.watchdog_s 0.5", "phone.max_delay_s 0.5"),
        ),
        ({"link__delay_s": 4.0, "robot__max_age_s": 60.0}, "a robot ends a drive", "30 s"),
        ({"link__rate_bps": 64e3}, "the camera sends 960 kbit/s", "64 kbit/s"),
        (
            {"link__rate_bps": 64e3, "link__trace_down": "cellular.down"},
            *("link.rate_bps", "trace_down"),
        ),
        ({"camera__encode_s": 0.2}, "camera.rate_hz 10", "camera.encode_s 0.2"),
        ({"pattern": "pub-sub", "robot__processing_s": 0.2}, "robot.processing_s 0.2", "queue"),
        ({"site__name": "hall", "events": [{"kind": "gas_leak"}]}, "events.0.reported", "gas leak"),
        ({"horizon_s": 5.0, "events": [{"kind": "fire", "at_s": 5}]}, "events.0.at_s 5", "not"),
        ({"link__outages": [{"from_s": 700, "for_s": 5}]}, "link.outages.0.from_s 700", "not"),
        ({"dispatch__containment": True}, "dispatch.containment", "guard.count"),
        ({"access": [{"holders": ["operator-2"]}]}, "access.0.holders names 'operator-2'", "not"),
        (
            {"transport": "datagrams", "zeromq__high_water_mark": 5, "pattern": "pub-sub"},
            *("zeromq.high_water_mark", "ZeroMQ sockets"),
        ),
    ],
)
def test_what_does_not_go_together_is_told_with_its_key(changes, key, names):
    (one,) = contradictions(built(**changes))
    assert one.startswith(key)
    assert names in one


@pytest.mark.parametrize("name", available("experiments/scenarios"))
def test_shipped_scenarios_do_not_contradict_themselves(name):
    document = scenarios.load(name)
    if document.data.get("model", "full") == "full":
        assert contradictions(scenarios.build(document)) == []


def test_a_study_tells_each_kind_once_with_the_number_of_configurations():
    study = load_study("req-rep-vs-pub-sub", ["link.delay_s=[0, 3, 4]"], version="quick")
    reported = contradictions_in(cell_grid.cells(study))
    assert [one.split()[0] for one in reported].count("robot.max_age_s") == 1
    assert any(not unnamed(one, "4 of 11") for one in reported)


def test_an_episode_begins_with_the_warning():
    out = Console(file=io.StringIO(), width=200)
    pairs = ["link.delay_s=1.2", "request.timeout_s=9", "horizon_s=20"]
    stories.episode(EpisodeRequest(EpisodeOptions("drive-to-event", set=pairs)), out)
    first = out.file.getvalue().splitlines()[0]
    assert first.startswith("warning: request.timeout_s 9 ")


def test_check_tells_it_of_a_file_that_is_valid(tmp_path, capsys):
    path = tmp_path / "late.yaml"
    path.write_text("events: [{kind: fire, at_s: 90}]\nhorizon_s: 60\n")
    assert check([str(path)]) == 0
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert unnamed(first, "warning: events.0.at_s 90 ", "horizon_s 60") == []
    assert second.endswith("scenario: valid")


def test_a_live_run_says_before_anything_starts_that_the_modelled_link_plays_no_part():
    out = Console(file=io.StringIO(), width=200)
    live.warn(out, LiveOptions("drive-to-event", set=("link.delay_s=0.5",)))
    assert out.file.getvalue().startswith("warning: link.delay_s: ")


def test_the_dva_heeds_no_sensor_that_no_robot_carries():
    carried = [{"name": "smoke"}]
    made = built(robot__sensors=carried, dva__sensors=["smoke", "gas"])
    (one,) = contradictions(made)
    assert one.startswith("dva.sensors names 'gas'")


def test_what_the_dva_does_beside_is_written_only_where_it_does_something():
    usual = built()
    assert "dva" not in usual.model_dump()
    assert built(dva__sensors=["gas"]).model_dump()["dva"]["sensors"] == ("gas",)
