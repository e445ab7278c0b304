"""`dva-sim episode --record` and `dva-sim replay`, as a user meets them."""

import pytest
from helpers.processes.command_line import call, ended
from helpers.wording import unnamed
from PIL import Image

from dva_sim.simulation.full.run import Run


def story(text):
    """The lines that tell of moments and of what came of it, but for the last."""
    return [line for line in text.splitlines() if " s  " in line or line.startswith("fire")]


def test_an_episode_is_kept_and_told_again_word_for_word(tmp_path):
    path = tmp_path / "run.mcap"
    one = ["episode", "drive-to-event", "--seed", 2, "--set", "horizon_s=30"]
    done = call(*one, "--record", path).stdout
    again = call("replay", path).stdout
    assert f"Recording: {path}" in done.replace("\n", "")
    assert story(again) == story(done)
    assert len(story(again)) > 4
    assert "30 s simulated" in again


@pytest.mark.system
def test_pictures_come_from_the_file_alone(folder, tmp_path, monkeypatch):
    def never(*_):
        raise AssertionError("simulated again")

    monkeypatch.setattr(Run, "__init__", never)
    monkeypatch.chdir(tmp_path)
    wanted = ["--camera", "robot-1", "--still", "eye.png", "--at", "20"]
    assert "Still: eye.png" in call("replay", folder / "drive.mcap", *wanted).stdout
    with Image.open("eye.png") as eye:
        assert eye.size == (640, 480)


def test_a_file_cut_short_is_told_and_so_is_what_is_missing(folder, tmp_path):
    whole = (folder / "evacuation.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) * 6 // 10])
    out = call("replay", tmp_path / "cut.mcap").stdout
    assert unnamed(out, " of 60 s", "60 s simulated by") == []  # what came of it stands first


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        ("replay {drive} --still a.png --at 31", "--at 31 "),
        ("replay {drive} --ros2 .", "already exists"),
        ("episode fire-drill --record {drive}", "drive.mcap would be replaced"),
    ],
)
def test_a_file_that_is_there_is_kept_whatever_is_wrong(words, problem, folder, tmp_path):
    code, _, err = ended(*words.format(drive=folder / "drive.mcap").split(), cwd=tmp_path)
    assert (code, err.count("\n")) == (2, 1)
    assert problem in err
    assert list(tmp_path.iterdir()) == []
