"""Mistakes in the words of a command: each ends in one line and exit code 2."""

from operator import call
from pathlib import Path

from helpers.mistakes import (
    Refused,
    check_mistake,
    command,
    each_mistake,
    mistakes,
    of_file,
)
from helpers.paths import ROOT

from dva_sim.cli.demo import demo
from dva_sim.experiments.report.episode import EpisodeRequest
from dva_sim.kernel.errors import DvaSimError
from dva_sim.options.runs import EpisodeOptions

EVIDENCE = ROOT / "experiments/validation"
FILES = {
    "bad.yaml": "up:\n  delay: 0.1\n",
    "hall.yaml": "name: hall\nplan: hall.geojson\n",
    "hall.geojson": "{}",
    "kept.csv": "kept",
    "mine.yaml": "question: what?\n",
    "plan.geojson": "{}",
}


def story(**wanted):
    EpisodeRequest(EpisodeOptions("tasks/corner", **wanted)).scenarios()


def demo_in(name):
    demo(Path(name), jobs=1)


WORDS = mistakes(
    command,
    ("exprt", "dva-sim: 'exprt' 'export'"),
    ("rnu fire-drill", "'rnu' 'run'?"),
    ("help", "'dva-sim --help'?"),
    ("help run", "'dva-sim run --help'?"),
    ("run", "dva-sim run STUDY: --help"),
    ("run x --jbos 2", "dva-sim run '--jbos' '--jobs'"),
    ("run x --xyz", "dva-sim run '--xyz' --help"),
    ("run x -j", "-j value"),
    ("run x --full=3", "--full no value"),
    ("run x y", "dva-sim run 'y' --help"),
    ("run x --seed -1", "--seed '-1' whole least 0"),
    ("run x -j 0", "--jobs '0' whole 1 1024"),
    ("run x -j ²", "--jobs '²' whole 1 1024"),
    ("run x --limit nan", "--limit 'nan' above 0"),
    ("run x --limit 5%", "--limit '5%' above 0"),
    ("run req-rep-vs-pub-sub --persons 4", "--set persons=VALUE"),
    ("run keep-alive --quick", "'quick' req-rep-vs-pub-sub"),
    ("run mine.yml", "file 'mine.yml' 'mine.yaml'"),
    ("episode mine.yml", "file 'mine.yml' 'mine.yaml'"),
    (f"episode x --seed {'9' * 30}", f"--seed '{'9' * 30}' whole least 0"),
    ("episode drive-to-event --delay 1", "--set link.delay_s=VALUE"),
    ("episode drive-to-event --still x.jpg2", "--still 'x.jpg2' .png"),
    ("episode drive-to-event --record x.txt", "--record 'x.txt' .mcap"),
    ("console --audit x.txt", "--audit 'x.txt' .sqlite"),
    ("phone-log x.csv --rate 1000", "--rate 100"),
    ("show .", "manifest.json 'dva-sim run'"),
    ("site shwo", "dva-sim site: 'shwo' 'show'"),
    ("site show plan.geojson", "plan.geojson 'plan: plan.geojson'"),
    ("site show hall.geojson", "hall.geojson hall.yaml"),
    ("list scenario", "'scenario' 'scenarios'"),
    (f"run {EVIDENCE}/dispatch.yaml", "dispatch.yaml dva-sim validate dispatch"),
    (f"run {EVIDENCE}/network.yaml", "network.yaml dva-sim validate network"),
    (f"run {EVIDENCE}/operators.yaml", "operators.yaml dva-sim validate operators"),
    ("link --near true", "--far"),
    ("link --near true --far ' '", "--far"),
    ("link --near a --far b --set delay=1", "delay_s --set delay=1"),
    ("link --near a --far b --set up.loss=2", "up.loss 0.9"),
    ("link --near a --far b --set trace_up=none.trace", "none.trace"),
    ("link none.yaml --near a --far b", "none.yaml"),
    ("link bad.yaml --near a --far b", "bad.yaml:2:3 up.delay delay_s"),
    ("link --near a --far b --publish 0", "--publish 65535"),
    ("link --near a --far b -o counts.txt", "counts.txt .csv"),
    ("link --near a --far b -o kept.csv", "kept.csv --overwrite"),
    ("link --near a --far b -o kept.csv/x.csv", "kept.csv"),
    ("load --dva nowhere", "--dva nowhere"),
    ("load --pid 1", "--pid --dva"),
    ("load --devices 10 --sessions 5", "--devices 10: 11 5 sessions 1 processes"),
    ("load -o figures.txt", "figures.txt .csv"),
    error=Refused,
)
CALLS = [
    *mistakes(
        call,
        (lambda: story(video=Path("x.gif")), "--still"),
        (lambda: story(still=Path("x.png"), at=3.0), "--still"),
    ),
    *mistakes(of_file(demo_in, "file"), ("", "file cannot written"), error=DvaSimError),
]


@each_mistake([*WORDS, *CALLS])
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    check_mistake(tmp_path, act, error, names)
