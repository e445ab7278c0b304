"""The first minute: a picture and a story first, then a study, and a film beside it."""

import pytest
from helpers.wording import unnamed

from dva_sim.cli import demo as module
from dva_sim.cli.demo import FILM, PICTURE, STUDY, demo
from dva_sim.kernel.errors import ExitCode
from dva_sim.options.studies import RunOptions

pytestmark = pytest.mark.system

SLEEPS = "import time; time.sleep(600)"


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
    monkeypatch.setattr(module, "_command", lambda path: ["touch", str(path)])
    assert demo(tmp_path / "demo", jobs=1) is ExitCode.INTERRUPTED
    assert played == [(STUDY, True)]
    output = capsys.readouterr().out
    assert unnamed(output, "131.4 s", "22 s ahead") == []
    assert output.index("about a minute") < output.index("side by side") < output.index("Film")


def test_a_film_that_is_still_being_made_ends_with_the_demo(tmp_path, monkeypatch):
    makers = []
    real = module.subprocess.Popen

    def started(*args, **kwargs):
        makers.append(real(*args, **kwargs))
        return makers[-1]

    def stop() -> None:
        with module._film_under_way(tmp_path / FILM):
            raise KeyboardInterrupt

    monkeypatch.setattr(module.subprocess, "Popen", started)
    monkeypatch.setattr(module, "_command", lambda path: [module.sys.executable, "-c", SLEEPS])
    with pytest.raises(KeyboardInterrupt):
        stop()
    assert makers[0].returncode is not None
    assert not (tmp_path / FILM).exists()


def test_half_a_film_does_not_pass_for_one(tmp_path, monkeypatch):
    half = "import sys, pathlib; pathlib.Path(sys.argv[1]).write_text('half'); sys.exit(1)"
    monkeypatch.setattr(
        module, "_command", lambda path: [module.sys.executable, "-c", half, str(path)]
    )
    with module._film_under_way(tmp_path / FILM):
        pass
    assert list(tmp_path.iterdir()) == []
