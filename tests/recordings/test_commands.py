"""`dva-sim episode --record` and `dva-sim replay`, as a user meets them."""

import sys

import pytest
from PIL import Image

from dva_sim import cli


def said(capsys, *words, code=0):
    """What a command prints."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["dva-sim", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            cli.main()
    assert end.value.code == code
    return capsys.readouterr()


def story(text):
    """The lines that tell of moments and of what came of it, but for the last."""
    return [line for line in text.splitlines() if " s  " in line or line.startswith("fire")]


def test_an_episode_is_kept_and_told_again_word_for_word(tmp_path, capsys):
    path = tmp_path / "run.mcap"
    one = ["episode", "drive-to-event", "--seed", 2, "--set", "horizon_s=30"]
    told = said(capsys, *one, "--record", path).out
    again = said(capsys, "replay", path).out
    assert f"Recording: {path}" in told.replace("\n", "")
    assert story(again) == story(told)
    assert len(story(again)) > 4
    assert "30 s simulated by dva-sim" in again


@pytest.mark.system
def test_pictures_come_from_the_file_alone(folder, tmp_path, capsys, monkeypatch):
    def never(*_):
        raise AssertionError("simulated again")

    monkeypatch.setattr("dva_sim.simulation.full.run.Run.__init__", never)
    monkeypatch.chdir(tmp_path)
    wanted = ["--camera", "robot-1", "--still", "eye.png", "--at", "20"]
    assert "Still: eye.png" in said(capsys, "replay", folder / "drive.mcap", *wanted).out
    with Image.open("eye.png") as eye:
        assert eye.size == (640, 480)


def test_a_file_cut_short_is_told_and_so_is_what_is_missing(folder, tmp_path, capsys):
    whole = (folder / "evacuation.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) * 6 // 10])
    out = said(capsys, "replay", tmp_path / "cut.mcap").out
    assert " of 60 s are there" in out
    assert "60 s simulated by" in out  # what came of it stands at the beginning


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["replay", "none.mcap"], "none.mcap: cannot be read: No such file or directory"),
        (["replay", "{drive}", "--still", "a.png", "--at", "31"], "--at 31 is not within the run"),
        (
            ["replay", "{drive}", "--camera", "robot-9", "--still", "a.png"],
            "'robot-9' is unknown",
        ),
        (["replay", "{drive}", "--ros2", "."], "is there already; give a new folder"),
        (["episode", "fire-drill", "--record", "run.bag"], "recording should end in .mcap"),
        (["episode", "fire-drill", "--record", "no/run.mcap"], "folder 'no' for the recording"),
        (["episode", "fire-drill", "--record", "{drive}"], "drive.mcap would be replaced; give an"),
        (["episode", "fire-drill", "--record", "/proc/a.mcap"], "nothing can be written in folder"),
        (["episode", "tasks/fitts-tilt", "--record", "a.mcap"], "only full ones are recorded"),
        (
            [*("episode", "fire-drill", "--record", "a.mcap"), "--side-by-side", "req-rep,pub-sub"],
            "it does not go with --side-by-side",
        ),
    ],
)
def test_a_mistake_ends_in_one_line(words, problem, folder, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = [word.format(drive=folder / "drive.mcap") for word in words]
    err = said(capsys, *words, code=2).err
    assert problem in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
