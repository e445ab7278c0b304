"""A person's motion is kept if both agree, and replays to the commands that were sent."""

import json
from functools import partial

import numpy as np
import pytest
from helpers.console.simulated_phone import HeldPhone, PhonePage
from helpers.processes.command_line import call

from dva_sim.agents.tilt import Accelerometer, load_part
from dva_sim.agents.tilt.accelerometer import GRAVITY
from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.motion import MotionSample, MotionWriter, read_motion, replayed
from dva_sim.recordings.motion_figures import figures_of


@pytest.fixture
def drive(monkeypatch):
    """Drives with a phone whose motion may be kept; files are closed after the test."""
    pages = []
    yield partial(_drive, monkeypatch, pages)
    for page in pages:
        page.world.phones.close()


def _drive(monkeypatch, pages, folder, agreed=True, **calibration):
    page = PhonePage(monkeypatch)
    pages.append(page)
    page.world.phones.motion_folder = folder
    assert page.register()["ok"]
    assert page.permit()["ok"]
    answer = page.calibrate(keep=agreed, **calibration)
    held = HeldPhone(page, part="mpu6050")
    for pitch in (10.0, 14.0, 4.0):
        held.tilt(pitch, pitch - 8.0)
        page.let(1.0)
        if pitch == 10.0:
            assert page.do("start")[0]
    page.let(1.0)
    assert page.do("stop")[0]
    return page, answer


@pytest.mark.parametrize("pipeline", ["default", "dissertation"])
@pytest.mark.parametrize("mapping", ["absolute", "differential", "leaky", "slew"])
def test_what_was_kept_replays_to_the_commands_that_were_sent_byte_for_byte(
    drive, tmp_path, pipeline, mapping
):
    page, answer = drive(tmp_path, pipeline=pipeline, mapping=mapping)
    assert "motion-1.csv" in answer["text"]
    motion = read_motion(tmp_path / "motion-1.csv")
    sent = page.world.recorder.drives[-1].commands
    assert len(sent) >= 5
    motion.apps = motion.apps[-1:]
    looks = iter(time for time, *_ in sent)
    motion.samples = [s for s in motion.samples if s.came < sent[-1][0] + 0.1]
    found = {t: (c.speed, c.turn_rate) for t, c in replayed(motion, looks)}
    assert [found.get(time) for time, *_ in sent] == [(v, w) for _, v, w in sent]


@pytest.mark.parametrize(("folder", "agreed"), [(True, False), (False, True), (False, False)])
def test_without_both_agreeing_nothing_is_written(drive, tmp_path, folder, agreed):
    _, answer = drive(tmp_path if folder else None, agreed)
    assert list(tmp_path.iterdir()) == []
    assert ("keeps no motion" in answer["text"]) == agreed


def test_nobody_is_named_in_a_file_and_its_times_begin_at_zero(drive, tmp_path):
    drive(tmp_path)
    text = (tmp_path / "motion-1.csv").read_text()
    assert "BQ Curie" not in text
    assert read_motion(tmp_path / "motion-1.csv").samples[0].stamp == 0.0


def test_who_agrees_no_longer_is_not_written_down_any_more(drive, tmp_path):
    page, _ = drive(tmp_path)
    assert page.calibrate(keep=False)["ok"]
    size = (tmp_path / "motion-1.csv").stat().st_size
    HeldPhone(page).tilt(5.0)
    page.let(1.0)
    assert (tmp_path / "motion-1.csv").stat().st_size == size


def test_a_folder_that_is_none_is_told_in_a_line(monkeypatch, tmp_path):
    page = PhonePage(monkeypatch)
    page.world.phones.motion_folder = tmp_path / "missing"
    answer = page.calibrate(keep=True)
    assert not answer["ok"]
    assert "No such file" in answer["text"]


@pytest.fixture
def at_rest(tmp_path):
    """A minute of an MPU-6050 on a table, 50 samples a second, of which a second is missing."""
    part = Accelerometer(load_part("mpu6050"), np.random.default_rng(1), rate_hz=50, jitter=0.05)
    path, at = tmp_path / "rest.csv", 3.0
    writer = MotionWriter(path)
    for n in range(3000):
        at += part.interval()
        if not 1000 <= n < 1050:
            writer.sample(MotionSample(at, at + 0.01, at, part.sample(0.0, 0.0), 0))
    writer.close()
    return path


def test_figures_are_those_of_the_part(at_rest):
    found = figures_of(read_motion(at_rest), at_rest)
    part = load_part("mpu6050")
    assert found.samples == 2950
    assert found.rate_hz == pytest.approx(50.0, rel=0.01)
    assert found.jitter == pytest.approx(0.05 * 2**0.5, rel=0.1)
    assert found.gaps == 1
    assert found.longest_gap_s == pytest.approx(1.02, abs=0.01)
    assert found.noise_mg == pytest.approx(1000 * part.noise / GRAVITY, rel=0.15)
    assert found.resolution_mg == pytest.approx(0.061, rel=0.01)


def test_the_command_tells_figures_and_writes_a_part_that_can_be_named(at_rest, tmp_path):
    assert "2950 samples in 6" in call("phone-log", at_rest).stdout
    assert json.loads(call("phone-log", at_rest, "--json").stdout)["gaps"] == 1
    words = ("phone-log", at_rest, "--part", tmp_path / "mine.yaml")
    assert call(*words).returncode == 0
    made, named = load_part(str(tmp_path / "mine.yaml")), load_part("mpu6050")
    assert made.noise == pytest.approx(named.noise, rel=0.15)
    assert call(*words).returncode != 0


def test_the_command_prints_commands(drive, tmp_path):
    drive(tmp_path)
    ended = call("phone-log", tmp_path / "motion-1.csv", "--commands", "--rate", "20")
    first, *rows = ended.stdout.splitlines()
    assert first.startswith("t_s,speed_mps")
    assert len(rows) > 20


@pytest.mark.parametrize(
    "text",
    [
        "",
        "hello\n",
        "# dva-sim phone motion 1\n1,2,3\n",
        "# dva-sim phone motion 1\n0,0,0,1,2,3,45\n",
        "# dva-sim phone motion 1\n# app {}\n",
    ],
)
def test_a_file_that_is_none_is_told_with_its_line(tmp_path, text):
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"x\.csv"):
        figures_of(read_motion(path), path)
