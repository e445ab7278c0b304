"""`dva-sim episode --record` and `dva-sim replay`, as a user meets them."""

import pytest
from helpers.processes.command_line import call, ended
from helpers.wording import unnamed
from PIL import Image


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

    monkeypatch.setattr("dva_sim.simulation.full.run.Run.__init__", never)
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


SIDES = ["--side-by-side", "req-rep,pub-sub"]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["replay", "none.mcap"], "none.mcap: "),
        (["replay", "{drive}", "--still", "a.png", "--at", "31"], "--at 31 "),
        (["replay", "{drive}", "--ros2", "."], "already exists"),
        (["episode", "fire-drill", "--record", "run.bag"], "end in .mcap"),
        (["episode", "fire-drill", "--record", "no/run.mcap"], "folder 'no'"),
        (["episode", "fire-drill", "--record", "{drive}"], "drive.mcap would be replaced"),
        (["episode", "fire-drill", "--record", "/proc/a.mcap"], "/proc"),
        (["episode", "tasks/fitts-tilt", "--record", "a.mcap"], "only full ones"),
        (
            [*["episode", "fire-drill", "--record", "a.mcap", "--side-by-side", "req-rep,pub-sub"]],
            "side-by-",
        ),
    ],
)
def test_a_mistake_ends_in_one_line(words, problem, folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = [word.format(drive=folder / "drive.mcap") for word in words]
    code, _, err = ended(*words)
    assert code == 2
    assert problem in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
