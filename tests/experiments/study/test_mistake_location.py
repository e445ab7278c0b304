"""Location of mistakes: the `--set` that makes them, their key, or their file."""

import pytest
from helpers.studies.small_study import STUDY, write_study
from helpers.wording import unnamed

from dva_sim.experiments.report.episode import EpisodeRequest
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.plan import checked_plan
from dva_sim.experiments.study.scenario_mistakes import mistakes_of
from dva_sim.kernel.config_overrides import build, parse_changes, set_by
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.options.runs import EpisodeOptions
from dva_sim.simulation.scenario import Scenario


def played(request):
    return [request.play(scenario) for scenario in request.scenarios()]


def complaint_of_study(folder, *settings):
    with pytest.raises(ConfigError) as caught:
        checked_plan(load_study(write_study(folder, STUDY), settings))
    return str(caught.value)


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("person=4", "'persons'"),
        ("robots=3", "'robot.count'"),
        ("robot.procesing_s=1", "'processing_s'"),
        ("operator.person=3", "'operator.person'"),
        ("parts.drve.replications=2", "no 'drve'"),
        ("persons.a=3", "'persons' has no keys"),
        ("seed=-1", "at least 0, not -1"),
        ("persons=5%", "not '5%'"),
        ("link.delay_s=500ms", "write 0.5"),
        ("link.delay_s=-1", "at least 0"),
        ("link.delay_s=[0, fast]", "not 'fast'"),
        ("factors.pattern=[req-rep, pubsub]", "'pub-sub'"),
        ("link.jitter_s=9", "jitter_s 9 is above delay_s 0"),
        ("answer.measure=time_s", "'time_s' is unknown; known: confirmed"),
        ("answer.contrast=[req-rep, pubsub]", "'pubsub' is not a level"),
        ("parts.drive.scenario=fire-dril", "'fire-dril' not found"),
        ("events=[{kind: fire, room: Archives}]", "'Archive'?"),
        ("parts=3", "not 3"),
    ],
)
def test_a_mistake_in_a_setting_of_a_study_is_told_at_that_setting(tmp_path, setting, expected):
    line = complaint_of_study(tmp_path, "persons=2", setting, "replications=1")
    assert line.startswith(f"--set {setting}: ")
    assert expected in line
    assert "\n" not in line


def test_a_setting_without_a_value_is_refused(tmp_path):
    assert unnamed(complaint_of_study(tmp_path, "persons"), "--set 'persons'", "key=value") == []


def test_of_several_mistakes_in_settings_the_first_is_told(tmp_path):
    line = complaint_of_study(tmp_path, "persons=2", "seed=-1", "replications=none")
    assert unnamed(line, "--set seed=-1: ", "0, not -1") == []


def test_settings_that_exclude_each_other_are_told_together(tmp_path):
    (tmp_path / "one.yaml").write_text("horizon_s: 60\n")
    document = load_yaml(tmp_path / "one.yaml")
    pairs = ["robot.count=0", "horizon_s=50", "guard.count=0"]
    with pytest.raises(ConfigError) as caught:
        build(Scenario, document, parse_changes(pairs), lambda s, _: s, lambda *_: None)
    # Without the first of them somebody can act; without the last nobody can either.
    assert caught.value.keys == ("robot.count",)
    assert str(set_by(pairs, caught.value)).startswith("--set robot.count=0: ")


@pytest.mark.parametrize("turn", [1, -1])
def test_settings_that_depend_on_each_other_are_reported_together(tmp_path, turn):
    settings = ["pattern=measured.py:Measured", "pattern_options={file: nowhere.csv}"][::turn]
    path = tmp_path / "one.yaml"
    path.write_text("horizon_s: 60\n")
    with pytest.raises(ConfigError) as caught, mistakes_of(str(path), settings, 1):
        played(EpisodeRequest(EpisodeOptions(path, set=["robot.count=1", *settings])))
    told = *(f"--set {each}" for each in settings), "nowhere.csv' not found"
    assert unnamed(str(caught.value), *told) == []
    assert "robot.count" not in str(caught.value)


def test_a_mistake_of_the_file_itself_stays_there_whatever_is_set(tmp_path):
    text = STUDY.replace("persons: 3", "persons: none")
    with pytest.raises(ConfigError, match=r"study\.yaml:3:1: persons: "):
        load_study(write_study(tmp_path, text), ["replications=1"])


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("robots=2", "'robot.count'"),
        ("link.delay_s=-1", "at least 0 seconds, not -1"),
        ("robot.count=0", "robot.count and guard.count"),
        ("dva.supervisors=[operator-7]", "'operator-7' is unknown; known: operator-1"),
    ],
)
def test_a_mistake_in_a_setting_of_an_episode_is_told_at_that_setting(tmp_path, setting, expected):
    path = tmp_path / "one.yaml"
    path.write_text("description: one robot\nhorizon_s: 60\n")
    with pytest.raises(ConfigError) as caught, mistakes_of(str(path), ["horizon_s=5", setting], 1):
        played(EpisodeRequest(EpisodeOptions(path, set=["horizon_s=5", setting])))
    assert str(caught.value).startswith(f"--set {setting}: ")
    assert expected in str(caught.value)
