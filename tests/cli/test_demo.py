"""The first minute: a picture and a story first, then a study, and a film beside it."""

import os
import signal
import time

import pytest
from helpers.wording import unnamed

from dva_sim.cli import demo as module
from dva_sim.cli.demo import FILM, PICTURE, STUDY, demo
from dva_sim.experiments.execution.executors import WorkerProcess
from dva_sim.kernel.errors import ExitCode
from dva_sim.options.studies import RunOptions

pytestmark = pytest.mark.system


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, bool]]:
    """Steps of the demo, in order, each with whether the picture existed; nothing is run."""
    done: list[tuple[str, bool]] = []

    def study(options: RunOptions) -> ExitCode:
        done.append((options.study, (options.results_folder / PICTURE).exists()))
        return ExitCode.INTERRUPTED

    monkeypatch.setattr(module.study_runs, "run", study)
    return done


def test_the_picture_and_the_story_come_before_the_study(tmp_path, played, monkeypatch, capsys):
    monkeypatch.setattr(module, "_make_film", touched)
    assert demo(tmp_path / "demo", jobs=1) is ExitCode.INTERRUPTED
    assert played == [(STUDY, True)]
    output = capsys.readouterr().out
    assert unnamed(output, "131.4 s", "22 s ahead") == []
    assert output.index("about a minute") < output.index("side by side") < output.index("Film")


def touched(path):
    path.touch()
    return ""


def test_a_film_that_is_still_being_made_ends_with_the_demo(tmp_path, monkeypatch):
    makers = []

    def started():
        makers.append(WorkerProcess())
        return makers[-1]

    def stop() -> None:
        with module._film_under_way(tmp_path / FILM):
            raise KeyboardInterrupt

    monkeypatch.setattr(module, "WorkerProcess", started)
    monkeypatch.setattr(module, "_make_film", half_of_it)
    with pytest.raises(KeyboardInterrupt):
        stop()
    assert all(maker._process.returncode is not None for maker in makers)
    assert list(tmp_path.iterdir()) == []


def half_of_it(path):
    path.write_text("half")
    time.sleep(600)


def test_a_second_process_makes_the_film_if_the_first_is_killed(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(module, "_make_film", killed_once)
    with module._film_under_way(tmp_path / FILM):
        pass
    assert (tmp_path / FILM).read_text() == "whole"
    assert "No film" not in capsys.readouterr().out


def killed_once(path):
    if not path.exists():
        path.write_text("half")
        os.kill(os.getpid(), signal.SIGKILL)
    path.write_text("whole")
    return ""


def test_a_film_that_nobody_made_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(module, "_make_film", killed)
    with module._film_under_way(tmp_path / FILM):
        pass
    assert list(tmp_path.iterdir()) == []
    assert "No film: its process has ended" in capsys.readouterr().out


def killed(path):
    os.kill(os.getpid(), signal.SIGKILL)


def test_half_a_film_does_not_pass_for_one(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(module, "_make_film", full_disk)
    with module._film_under_way(tmp_path / FILM):
        pass
    assert list(tmp_path.iterdir()) == []
    assert "No film: the disk is full" in capsys.readouterr().out


def full_disk(path):
    path.write_text("half")
    return "the disk is full"
