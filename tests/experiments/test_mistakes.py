"""Mistakes in studies and settings, and results folders that cannot be read or compared."""

import json
import sqlite3
from contextlib import closing
from functools import partial, reduce
from operator import call, getitem
from pathlib import Path
from typing import Any

from helpers.mistakes import check_mistake, each_mistake, mistakes, of_file
from helpers.paths import TESTS
from helpers.studies import small_study as kit
from helpers.studies.small_study import COMPARED, FULL, PREDICTED, REPEATED, STUDY, TREATED

from dva_sim.experiments.analysis.compare import Comparison
from dva_sim.experiments.analysis.fail_conditions import parse
from dva_sim.experiments.analysis.sample_size import law_of
from dva_sim.experiments.execution.checkpoint import Checkpoint, load_so_far
from dva_sim.experiments.execution.dry_run import dry_run
from dva_sim.experiments.report import kept_answers
from dva_sim.experiments.report.episode import EpisodeRequest
from dva_sim.experiments.report.report import write_report
from dva_sim.experiments.results.export import export
from dva_sim.experiments.results.folder_lock import FolderLock
from dva_sim.experiments.results.results import JOURNAL, Results
from dva_sim.experiments.study import loading
from dva_sim.experiments.study.factor_levels import parameter_sets
from dva_sim.experiments.study.file_kinds import open_study
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.plan import checked_plan
from dva_sim.experiments.study.registration import register
from dva_sim.experiments.study.scenario_mistakes import mistakes_of
from dva_sim.experiments.study.screening import screening_study
from dva_sim.experiments.study.tuning import tuning_study
from dva_sim.kernel.errors import DvaSimError
from dva_sim.options.runs import EpisodeOptions

PLAIN = STUDY.partition("answer:")[0]
DELAYS = "  link.delay_s: [0, 0.25]\n"
ONLY_PATTERN = PLAIN.replace(DELAYS, "")
ROWS = "design: {rows: [{link.delay_s: 0, link.loss: 0.1}, {link.delay_s: 0.5, link.loss: 0}]}\n"
SOBOL = "design: {sobol: 2, ranges: {link.delay_s: [0, 0.5]}}\n"
QUICK = COMPARED + "quick: {persons: 2, link.delay_s: [0, 0.5]}\n"
GUARDED = STUDY.replace("{operator.strategy: oracle}", "{robot.count: 0, guard.count: 1}")
GUARDED = GUARDED.replace("reference:", "changes:")
MEASURED = STUDY + "measures: [caution_off, way_off_m]\n"
MANY_LOSSES = PLAIN.replace(DELAYS, f"  link.loss: {[i / 1000 for i in range(100)]}\n{DELAYS}")


def study(text, *settings, version=None):
    checked_plan(load_study(kit.write_study(Path(), text), settings, version=version))


def changed(text, old, new, version=None):
    assert old in text
    study(text.replace(old, new, 1), version=version)


def setting(*settings):
    study(STUDY, *settings)


STUDIES = [
    *mistakes(
        partial(changed, STUDY),
        ("persons", "person", ".yaml:3:1: 'person' 'persons'"),
        ("link.delay_s: [", "link.dely_s: [0, 1]\n  link.delay_s: [", ".yaml:7:3: 'delay_s'"),
        ("0.25]", "-0.25]", ".yaml:7:3: link.delay_s: -0.25"),
        ("strategy: oracle", "strategy: oracel", ".yaml:11:17: 'oracel'"),
        ("part: drive", "part: drove", ".yaml:16:3:"),
        ("factor: pattern", "factor: patern", ".yaml:18:3:"),
        ("contrast: [req-rep", "contrast: [req-req", ".yaml:19:3:"),
        ("contrast: [req-rep", "contrast: [latest-wins", ".yaml:19:3: "),
        ("over: link.delay_s", "over: link.loss", ".yaml:20:3:"),
        ("smallest", "within: {profile: default}\n  smallest", ".yaml:21:12:"),
        ("pattern: [req-rep,", "pattern: [latest-wins, req-rep,", ".yaml:6:3:"),
        ("pattern: [", "operator.person: [", ".yaml:5:1:"),
        ("replications: 1", "replications: 0", ".yaml:14:5:"),
        ("persons: 3", "persons: true", ".yaml:3:1: persons: whole"),
        ("persons: 3", 'persons: "3"', ".yaml:3:1: persons: whole number"),
        ("persons: 3", "persons: 3.0", ".yaml:3:1: persons: whole number point"),
        ("fect_s: 2.0", 'fect_s: "2"', ".yaml:21:3: answer.smallest_effect_s:"),
        ("0.25]", ".nan]", ".yaml:7:21: factors.link.delay_s.1: finite"),
        ("0.25]", "[1]]", ".yaml:7:21: factors.link.delay_s.1: number, text"),
        ("[0, 0.25]", "[]", ".yaml:7:3: factors.link.delay_s: 1 item"),
        ("[0, 0.25]", "0.25", ".yaml:7:3: factors.link.delay_s: list 0.25"),
        ("-rep, latest-wins]\n  over", "-rep]\n  over", ".yaml:19:3: answer.contrast:"),
        ("scenario: one.yaml", "scenario: on.yaml", ".yaml:10:5: 'on.yaml'"),
    ),
    *mistakes(
        partial(changed, TREATED),
        ("[none, both]", "[none, all]", ".yaml:6:3: 'all' none, both"),
        ("pattern: latest", "link.delay_s: 1, pattern: latest", ".yaml:7:3: 'link.delay_s' two"),
        ("pattern: latest", "operator.person: 1, pattern: latest", ".yaml:25:5: study"),
        ("pattern: latest-wins", "pattern: latest-winz", ".yaml:24:12: 'latest-winz'"),
    ),
    *mistakes(
        study,
        *(
            (TREATED.replace("remedy", column), f".yaml:23:3: '{column}' {whose}")
            for column, whose in {
                "person": "design",
                "config": "design",
                "drive_time_s": "what",
                "tuning": "the tuning",
            }.items()
        ),
        (TREATED.replace("robot.processing_s: 0.01", "link: {loss: 0.02}"), "'link' undo"),
        (MANY_LOSSES.replace("0, 0.25", str([i / 1000 for i in range(51)])[1:-1]), "10,200 10,000"),
        (STUDY.replace(DELAYS, "") + SOBOL + "robustness: {sets: 2}\n", "robustness levels"),
        (PLAIN + "measures: [caution_off]\ncovariates: [caution_off]\n", "covariates"),
        (STUDY + "covariates: [caution_off]\n", "'caution_off' 'measures'"),
        (MEASURED + "covariates: [caution_of]\n", "'caution_of' 'caution_off'"),
        (MEASURED + "covariates: [caution_off * way]\n", "'way' 'way_off_m'"),
        *(
            (GUARDED.replace("drive_time_s", measure), f"'drive' '{measure}'")
            for measure in ("path_m", "confirmed", "commands_sent")
        ),
    ),
    *mistakes(
        partial(changed, PREDICTED),
        ("at: {link.delay_s: 0.25}", "at: {link.delay_s: 9}", ".yaml:26:10: 9"),
        ("direction: above", "direction: up", ".yaml:24:5: predictions.0.direction"),
        ("    direction: above\n", "", ".yaml:23:5: direction"),
        ("[3, 9]", "[9, 3]", ".yaml:25:5: ascend"),
        ("direction: above", "direction: above\n    factor: pattern", ".yaml:23:5: contrast"),
    ),
    *mistakes(
        partial(changed, COMPARED),
        ("measure: contacts", "measure: contact", ".yaml:23:22: measure 'contact'"),
        ("  far: {part: drive", "  far: {part: drove", ":23:9: comparisons.far.part 'drove'"),
        ("within: {link.delay_s: 0.25}, ", "", ".yaml:23:3: 'link.delay_s'"),
        ("  far:", "  answer:", ".yaml:22:1: comparisons: 'answer'"),
        ("comparison: far", "comparison: near", ".yaml:27:20: 'near' far"),
        ("direction: same, margin: 0.5", "direction: same", ".yaml:27:3: 'same' margin"),
        ("at: {link.delay_s: 0.25}}", "at: {link.delay_s: 9}}", ".yaml:26:55: 9"),
        ("at: {link.delay_s: 0.25}}", "at: {pattern: req-rep}}", ".yaml:26:55: 'pattern'"),
        ("margin: 1.5", "margin: -1.5", ".yaml:26:37: hypotheses.waiting-costs.margin"),
        ("margin: 1.5", "margins: 1.5", ".yaml:26:37: 'hypotheses.waiting-costs.margins'"),
    ),
    *mistakes(
        partial(changed, FULL, version="full"),
        ("persons: 6", "persons: none", ".yaml:22:8: larger version: persons:"),
        ("persons: 6", "person: 6", ".yaml:22:8: larger version: 'person'"),
        ("persons: 6", "parts.drve.replications: 2", ".yaml:22:8: larger version: 'drve'"),
        ("persons: 6", "pattern: [pub-sub]", ".yaml:22:8: larger version: 'req-rep'"),
    ),
    *mistakes(
        partial(changed, QUICK),
        ("quick: {persons: 2", "quick: {pattern: [pub-sub]", ".yaml:28:9: small 'req-rep'"),
    ),
    *mistakes(partial(study, version="full"), (STUDY, ".yaml:1:1: 'full'")),
    *mistakes(
        partial(changed, REPEATED),
        ("sets: 3", "at: [0.5]", "0.5 'link.delay_s' 0, 0.25"),
        ("bands: bands", "bands: no-bands", "'no-bands.yaml'"),
        ("sets: 3", "set: 3", "'robustness.set' 'sets'"),
        ("persons: 2\n", "persons: 1\n", "robustness.persons: least"),
    ),
    *mistakes(
        setting,
        *(
            ("persons=2", each, "replications=1", f"--set {each}: {names}")
            for each, names in {
                "person=4": "'persons'",
                "robots=3": "'robot.count'",
                "robot.procesing_s=1": "'processing_s'",
                "operator.person=3": "'operator.person'",
                "parts.drve.replications=2": "'drve'",
                "persons.a=3": "'persons'",
                "seed=-1": "0, -1",
                "persons=5%": "'5%'",
                "link.delay_s=500ms": "0.5",
                "link.delay_s=-1": "0",
                "link.delay_s=[0, fast]": "'fast'",
                "factors.pattern=[req-rep, pubsub]": "'pub-sub'",
                "link.jitter_s=9": "jitter_s 9 delay_s 0",
                "answer.measure=time_s": "'time_s' confirmed",
                "answer.contrast=[req-rep, pubsub]": "'pubsub'",
                "parts.drive.scenario=fire-dril": "'fire-dril'",
                "events=[{kind: fire, room: Archives}]": "'Archive'?",
                "parts=3": "3",
            }.items()
        ),
        ("persons", "'persons' key=value"),
        ("persons=2", "seed=-1", "replications=none", "seed=-1: 0, -1"),
        ("stop.half_width=1", "stop.comparison=answer", "stop.half_width=1: 'stop.batch_persons'"),
        ("link.delay_s=[0.2, 0.3, 0.30000000000000004]", "link.delay_s 0.30000000000000004"),
        ("link.delay_s=[0, 1e-300, 0.1, 0.1000000000001]", "link.delay_s 0.1000000000001"),
        ("persons=100000000", "persons=100000000: 1,000,000; fewer"),
        ("replications=100000000", "replications=100000000: 1,000,000; fewer"),
    ),
    *mistakes(
        partial(study, ONLY_PATTERN + ROWS),
        ("link.loss=0.2", "link.loss=0.2: 'link.loss' 'design'"),
    ),
    *mistakes(
        partial(study, STUDY.replace("persons: 3", "persons: none")),
        ("replications=1", ".yaml:3:1: persons:"),
    ),
]


def rows_of_file(csv):
    Path("rows.csv").write_bytes(csv.encode("latin-1"))
    study(ONLY_PATTERN + "design: {csv: rows.csv}\n")


def design(keys):
    study(f"{ONLY_PATTERN}design: {keys}\n")


def crossed(keys):
    study(f"{PLAIN.replace('0.25]', '0.25, 0.5]')}design: {keys}\n")


def stop(keys):
    study(f"{STUDY}stop: {{{keys}, batch_persons: 2, most_persons: 9}}\n")


def bands(ranges):
    asked = kit.study_in(Path(), text=REPEATED)
    Path("bands.yaml").write_text(f"bands: {ranges}\n")
    parameter_sets(asked)


STOP = "half_width: 1.0, comparison: answer"
ON_DRIVES = "half_width: 1.0, part: drive, measure: drive_time_s"
MAPPED = """\
question: Which?
factors:
  pattern: [req-rep, latest-wins]
  link.delay_s: [0, 0.5]
  operator.strategy: [pursuit, move_and_wait]
parts: {drive: {scenario: drive-to-event}}
answer:
  part: drive
  measure: drive_time_s
  factor: pattern
  contrast: [req-rep, latest-wins]
  over: link.delay_s
  within: {operator.strategy: pursuit}
map: {models: operator.strategy}
"""
CROWDED = MAPPED.replace("strategy: pursuit}", "strategy: pursuit, robot.count: 1}")
CROWDED = CROWDED.replace("parts:", "  robot.count: [1, 2]\nparts:")
WITHIN = "  within: {operator.strategy"
OVER = f"  over: link.delay_s\n{WITHIN}"
SCREENED = """\
screening: {over: [phone.tremor_deg], trajectories: 2, persons: 2, seed: 5}
"""
TUNED = PLAIN.replace(DELAYS, f"{DELAYS}  tuning: [untuned, tuned]\n")
TUNED += """\
tuning:
  {key: command.rate_hz, levels: [1, 2], by: [pattern], at: {link.delay_s: 0.25},
   part: drive, measure: drive_time_s, persons: 2, seed: 7001}
"""
MEASURE = """\
from dva_sim.kernel.measure import Measure
from dva_sim.simulation.run_measures import RunMeasure
class Mine(RunMeasure):
    models = ("full",)
    about = Measure("standing_s", "time that robots stood")
    def of(self, recording): return 1.0
"""


def screening(old, new):
    of_file(open_study, "mine.yaml")((STUDY + SCREENED).replace(old, new, 1))
    screening_study(open_study("mine.yaml"))


def tuning(old, new):
    assert old in TUNED
    tuning_study(kit.study_in(Path(), text=TUNED.replace(old, new)))


def own_measure(name, old="", new=""):
    Path("mine.py").write_text(MEASURE.replace(old, new))
    study(STUDY.replace("drive_time_s", "standing_s") + f"measures: [{name}]\n")


KEYS = [
    *mistakes(
        rows_of_file,
        ("link.delay_s,link.loss\n0,0.1\n0.5\n", "rows.csv:3:1: 2 cells"),
        ("link.delay_s,link.loss\n0,\n", "rows.csv:2:3: 'link.loss' null"),
        ("link.delay_s,link.delay_s\n0,1\n", "rows.csv:1:14: 'link.delay_s' twice"),
        ("link.delay_s,\n0,1\n", "rows.csv:1:14: without name"),
        ("link.delay_s;link.loss\n0;1\n", "rows.csv:1:1: commas"),
        ("link.delay_s\n0\n-1\n", "rows.csv:3:1: link.delay_s: least"),
        ("link.loss,link.dely_s\n0,1\n", "rows.csv:2:3: 'link.dely_s'"),
        ("link.delay_s\n0\n1\n0\n", "rows.csv:4:1: 3 1"),
        ('link.delay_s\n"0\n', "rows.csv:2:1: CSV end"),
        ("link.delay_s\n[1]\n", "rows.csv:2:1: '[1]' 'link.delay_s'"),
        ("operator.person\n1\n", "rows.csv:1:1: 'operator.person'"),
        ("link.delay_s\n", "rows.csv:1:1: header rows"),
        ("link.delay_s\n.nan\n", "rows.csv:2:1: 'link.delay_s' finite"),
        ("link.delay_s\n0.5\nzw\u00f6lf\n", "rows.csv:3:3: UTF-8"),
        ("pattern\npub-sub\n", "study.yaml:6:3: 'pattern'"),
    ),
    *mistakes(
        design,
        ("{}", ":14:1: zip, rows, csv, latin_hypercube"),
        ("{sobol: 8, latin_hypercube: 8}", ":14:1: one zip"),
        ("{sobol: 8}", ":14:1: sobol ranges"),
        ("{csv: no.csv}", ":14:10: 'no.csv'"),
        ("{zip: [pattern, link.loss]}", ":14:25: 'link.loss'"),
        ("{zip: [pattern, pattern]}", ":14:25: 'pattern' twice"),
        ("{rows: [{link.loss: 0}, {link.los: 1}]}", ":14:33: same"),
        ("{rows: [{link.loss: 0}, {link.loss: 0}]}", ":14:33: 2 1"),
        ("{rows: [{link.loss: 7}]}", ":14:18: link.loss: most"),
        ("{sobl: 8}", ":14:10: 'design.sobl' 'sobol'"),
        ("{sobol: 12, ranges: {link.loss: [0, 0.1]}}", ":14:10: power 8 16"),
        ("{sobol: 8, ranges: {link.loss: [0.1, 0]}}", ":14:29: design.ranges.link.loss"),
        ("{sobol: 8, ranges: {link.loss: [0, 2]}}", ":14:29: link.loss:"),
        ("{sobol: 8, ranges: {link.los: [0, 1]}}", ":14:29: 'link.los'"),
        ("{sobol: 8, ranges: {pattern: [0, 1]}}", ":6:3: 'pattern'"),
        ("{sobol: 8, ranges: {link.loss: {low: 0, high: 1, scale: log}}}", ":14:29: zero"),
        # Two points with seed 3 lie below 0.9, as the scenario wants it; others might not.
        ("{sobol: 2, ranges: {link.loss: [0, 0.95]}}", ":14:29: link.loss:"),
    ),
    *mistakes(
        crossed,
        ("{zip: [pattern, link.delay_s]}", "'link.delay_s' 2 3"),
        ("{sobol: 65536, ranges: {link.loss: [0, 0.1]}}", ":15:1: 393,216 65,536"),
    ),
    *mistakes(
        stop,
        ("half_width: 1", ":22:1: comparison measure part"),
        ("half_width: 1, comparison: answer, part: drive", ":22:1: comparison part"),
        ("half_width: 1, comparison: other", ":22:23: 'other' answer"),
        ("half_width: 1, part: drove, measure: contacts", ":22:23: 'drove' 'drive'"),
        ("half_width: 1, part: drive, measure: time_s", ":22:36: 'time_s'"),
        ("half_width: 0, comparison: answer", ":22:8: stop.half_width"),
    ),
    *mistakes(
        partial(changed, f"{STUDY}stop: {{{STOP}, batch_persons: 2, most_persons: 9}}\n"),
        ("most_persons: 9", "most_persons: 2", ":22:63: most_persons persons: 3"),
        ("most_persons: 9", "most_persons: 999999", ":22:63: 1,000,000;"),
        (f"{STOP}, batch_persons: 2", f"{ON_DRIVES}, batch_persons: double", "double 'answer'"),
    ),
    *mistakes(
        bands,
        ("{patience: [1, 2]}", "'patience' perceptual_delay_s,"),
        ("{hand_lag_s: [0, 0.2]}", "zero"),
    ),
    *mistakes(
        partial(changed, MAPPED),
        ("models: operator.strategy", "models: operator.strategi", ":14:7: 'operator.strategi'"),
        ("models: operator.strategy", "models: pattern", ":14:7: 'pattern' compares"),
        (f"{OVER}: pursuit", f"{WITHIN}: pursuit, link.delay_s: 0", "runs over factor"),
        ("strategy}\n", "strategy, notes: {far: guessed}}\n", "'far'"),
        ("strategy}\n", "strategy, choosing: adaptive}\n", "'adaptive'"),
    ),
    *mistakes(study, (CROWDED, "room 'robot.count'")),
    *mistakes(
        screening,
        ("phone.tremor_deg", "phone.trembling", "phone.trembling assumed"),
        ("screening:", "tuning_:", "tuning_"),
        ("trajectories: 2", "trajectories: 1", "trajectories 2"),
        (SCREENED, "", "'screening' mine.yaml"),
    ),
    *mistakes(
        tuning,
        ("seed: 7001", "seed: 3", "seed own"),
        ("by: [pattern]", "by: [profile]", "'profile'"),
        ("at: {link.delay_s: 0.25}", "at: {link.delay_s: 1}", "1 'link.delay_s'"),
        ("[untuned, tuned]", "[untuned, better]", "'better' 'tuning'"),
        ("levels: [1, 2]", "levels: [0, 1]", "tuning.levels.0: 0"),
        ("levels: [1, 2]", "levels: [2, 2]", "twice"),
        ("part: drive,", "part: drove,", "tuning.part 'drove'"),
        ("persons: 2", "persons: 99999999", "tuning:"),
    ),
    *mistakes(
        partial(changed, TUNED),
        ("measure: drive_time_s", "measure: time_s", "study.yaml:18:17: 'time_s'"),
    ),
    *mistakes(
        own_measure,
        ("none.py:Mine", "study.yaml:22:12: 'none.py:Mine':"),
        ("mine.py:Yours", "study.yaml:22:12: 'Yours'"),
        ("mine.py:Mine", "standing_s", "path_m", "study.yaml:22:12: 'path_m'"),
        ("mine.py:Mine", "standing_s", "seed", "study.yaml:22:12: 'seed'"),
        ("mine.py:Mine", '"full"', '"timed"', "'standing_s' unknown"),
    ),
]


def episode(*settings):
    path = Path("one.yaml")
    path.write_text("horizon_s: 60\n")
    with mistakes_of(str(path), settings, 1):
        request = EpisodeRequest(EpisodeOptions(path, set=list(settings)))
        assert not [request.play(scenario) for scenario in request.scenarios()]


def clustered(address, **options):
    kit.run_study(kit.study_in(Path()), Path("out"), scheduler=address, **options)


def registered(text):
    register(kit.study_in(Path(), text=text))


MEASURED_SETTINGS = ("pattern=measured.py:Measured", "pattern_options={file: nowhere.csv}")
BOTH_SETTINGS = " ".join(f"--set {each}" for each in MEASURED_SETTINGS) + " nowhere.csv'"
CLAIMED = "hypotheses: {costs: {direction: above, margin: 1, at: {link.delay_s: 0.25}}}\n"
OPEN = "stop: {comparison: answer, half_width: 1, batch_persons: 1, most_persons: 9}\n"
OTHERS = [
    *mistakes(
        episode,
        ("horizon_s=5", "robots=2", "--set robots=2: 'robot.count'"),
        ("horizon_s=5", "link.delay_s=-1", "--set link.delay_s=-1: 0 -1"),
        ("horizon_s=5", "robot.count=0", "--set robot.count=0: guard.count"),
        ("dva.supervisors=[operator-7]", "--set 'operator-7' operator-1"),
        ("robot.count=1", *MEASURED_SETTINGS, BOTH_SETTINGS),
        ("robot.count=1", *MEASURED_SETTINGS[::-1], BOTH_SETTINGS),
    ),
    *mistakes(
        parse,
        ("", "'' column 1: statistic"),
        ("p95", "'p95' column 4: '('"),
        ("p95(response_s)  ", "column 18: '>='"),
        ("p95 response_s > 3", "column 5: '(' 'response_s'"),
        ("p95(response_s > 1.05x", "column 16: ')' '>'"),
        ("p0(response_s) > 3", "column 1: 'p0' mean, median, min"),
        ("average(response_s) > 3", "column 1: 'average'"),
        ("p95(response_s) = 3", "column 17: '='"),
        ("p95(response_s) == 3", "column 17: '>=' '<=' '=='"),
        ("p95(response_s) > fast", "column 19: number 'fast'"),
        ("p95(response_s) > 3 m", "column 21: 'm' s, ms, min, h"),
        ("p95(response_s) > +1.05x", "column 24: 'x'"),
        ("p95(response_s) > 3 s s", "column 23: 's'"),
        ("p95(response_s) per > 3", "column 21: factor '>'"),
        ("__import__('os').system('ls') > 1", "column 1: '__import__'"),
        ("  max(jams) ; 1", "column 13: ';'"),
        ("max(jams) > 1; max(contacts) > 1", "column 14: ';'"),
        ("mean(contact_impulse_n_s) > +1 N", "--fail-if column 32: 'N' N s"),
    ),
    *mistakes(
        clustered,
        *(
            (each, f"'{each}' tcp://")
            for each in ("127.0.0.1", "127.0.0.1:1", "foo://127.0.0.1:1", "tcp://:")
        ),
    ),
    *mistakes(partial(clustered, jobs=2), ("tcp://127.0.0.1:9", "both")),
    *mistakes(
        registered,
        (STUDY, "'hypotheses'"),
        (STUDY + CLAIMED + OPEN, "study.yaml:23:1: leave 'stop'"),
        (STUDY + CLAIMED + "budget_s: 60\n", "study.yaml:23:1: leave 'budget_s'"),
        (
            STUDY + CLAIMED + "design: {sobol: 2, ranges: {link.loss: [0, 0.95]}}\n",
            "link.loss:",
        ),
    ),
    *mistakes(
        loading.write_study, *((name, f"'{name}' name") for name in ("", ".", "..", ".yaml"))
    ),
    *mistakes(loading.write_study, ("nowhere/mine", "such file"), error=DvaSimError),
    *mistakes(
        call,
        (lambda: load_study(kit.write_study(Path()), pilot=1_000_000), "1000000"),
        (lambda: load_study("how-late-at-250-ms", ["pattern=req-rep"]), "'latest-wins' stop=null"),
        (lambda: [loading.write_study("mine") for _ in range(2)], "mine.yaml exists"),
        (lambda: tuning_study(kit.study_in(Path())), "tunes"),
    ),
    *mistakes(law_of([0.0, 2.0, 1.0], [0, 1, 2]).power, (1.0, 1, "2 1"), error=ValueError),
]


def manifest(text):
    Path("manifest.json").write_text(text)
    Results.load(Path())


def changed_manifest(path, value):
    data = json.loads((TESTS / "data/results-0.7.0/manifest.json").read_text())
    *above, last = path
    reduce(getitem, above, data)[last] = value
    manifest(json.dumps(data))


def changed_journal(statement):
    Path(JOURNAL).write_bytes((TESTS / "data/results-0.7.0" / JOURNAL).read_bytes())
    with closing(sqlite3.connect(JOURNAL, isolation_level=None)) as db:
        db.execute(statement)
    load_so_far(Path())


def journal_of_an_older_version():
    with sqlite3.connect(JOURNAL) as db:
        db.execute("CREATE TABLE study (id INTEGER, identity TEXT, wall_s REAL)")
        db.execute("INSERT INTO study VALUES (1, 'abc', 0)")
    db.close()
    load_so_far(Path())


def journal_of_another_study():
    Checkpoint(Path(), "mine").__exit__(None, None, None)
    Checkpoint(Path(), "yours")


def kept_manifest(name, text):
    Path("x.manifest.json").write_text(text)
    kept_answers.read_manifest(name, Path())


def of_empty_file(read, path):
    Path("file").touch()
    read(Path(path))


def small() -> Results:
    return Results.load(Path("out"))


def table(name, content=None):
    if content is not None:
        small().path_of(name).write_bytes(content)
    small().table(name)


def exported(name, tables=(), form=None):
    before = sorted(Path().iterdir())
    try:
        export(small(), Path(name), tables, form)
    finally:
        assert sorted(Path().iterdir()) == before


def compared(measure, *by):
    Comparison(small(), small()).differences(measure, by)


def other_runs():
    path = small().path_of("runs")
    path.write_bytes(small().path_of("tracks").read_bytes())
    write_report(Path("out"))


def no_runs() -> Any:
    small().path_of("runs").unlink()
    return small().runs


def damaged_journal():
    with Path("out", JOURNAL).open("r+b") as file:
        file.seek(100)
        file.write(b"\xff" * 2900)
    kit.run_study(kit.study_in(Path()), Path("out"), jobs=1, episode=kit.cheap)


FOLDERS = [
    *mistakes(Results.load, (Path(), "finished results"), (Path("nowhere"), "nowhere folder")),
    *mistakes(manifest, ('{"name": "a web page"}', "manifest")),
    *mistakes(manifest, ("[" * 9000, "manifest")),
    *mistakes(
        changed_manifest,
        (("study", "persons"), 1e400, "manifest.json: study.persons"),
        (("study", "answer", "contrast"), 5, "manifest.json: study.answer.contrast"),
        (("study", "factors", "pattern"), [], "manifest.json: study.factors.pattern"),
        (("cells", 0, "levels"), None, "manifest.json: cells.0.levels"),
        (("scenarios", "drive", "link", "delay_s"), [], "manifest.json: delay_s"),
        (("scenarios", "drive", "model"), "full.py", "manifest.json: scenarios.drive.model"),
        (("failures",), {}, "manifest.json: failures"),
    ),
    *mistakes(of_file(lambda _: Results.load(Path()), JOURNAL), ("", "finished")),
    *mistakes(of_file(lambda _: Checkpoint(Path(), "me"), JOURNAL), ("a diary" * 100, "journal")),
    *mistakes(
        call,
        (journal_of_an_older_version, "unfinished"),
        (journal_of_another_study, "mine, yours"),
        (other_runs, "other results"),
        (no_runs, "'runs'; tracks"),
        (damaged_journal, "damaged move"),
        (lambda: dry_run(kit.study_in(Path(), "seed=4"), Path("out")), "out another study"),
    ),
    *mistakes(
        changed_journal,
        ("UPDATE study SET manifest = '{'", "journal.sqlite: damaged"),
        (
            "UPDATE study SET manifest = json_set(manifest, '$.study.answer', 'x')",
            "journal.sqlite: study.answer",
        ),
        ("UPDATE runs SET tables = substr(tables, 1, 99)", "journal.sqlite: damaged"),
        (
            """UPDATE runs SET tables = '{"runs": [{"x": {}}, {"x": 1.0}]}'""",
            "'runs' run",
        ),
    ),
    *mistakes(partial(of_empty_file, load_so_far), ("file", "folder")),
    *mistakes(partial(of_empty_file, FolderLock), ("file", "file"), ("file/below", "file")),
    *mistakes(
        of_file(lambda name: kept_answers.read(Path(name)), "x.json"),
        ("{", "x.json"),
        ("[]", "x.json"),
        ('{"study": "x"}', "x.json"),
    ),
    *mistakes(kept_manifest, ("y", "[1]", "y.manifest.json"), ("x", "[1]", "manifest")),
    *mistakes(table, ("events", "'events'; runs, tracks"), ("runs", b"PAR1", "runs.parquet:")),
    *mistakes(
        exported,
        ("all", ["flights"], "'flights'; runs, tracks"),
        ("all", [], "xls", "'xls' csv parquet"),
        ("one.csv", ["runs", "tracks"], "folder"),
        ("one.csv", [], "parquet", "one csv file"),
        ("x.xlsx", "x.xlsx .csv .parquet; folder"),
        ("x.json", ["runs"], "csv", "x.json .csv .parquet"),
    ),
    *mistakes(
        compared,
        ("speed_mps", "'speed_mps' drive_time_s"),
        ("tracks.speed_mps", "tracks: t_s, x_m"),
        ("outcome", "outcome words"),
        ("drive_time_s", "phone", "'phone' pattern"),
    ),
    *mistakes(
        lambda condition: Comparison(small(), small()).judge(condition),
        ("mean(speed_mps) > 1", "'speed_mps'"),
        ("mean(outcome) > 1", "outcome words"),
        ("mean(drive_time_s) per phone > 1", "'phone'"),
    ),
]


@each_mistake([*STUDIES, *KEYS, *OTHERS])
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)


@each_mistake(FOLDERS)
def test_a_mistake_beside_results_ends_in_one_line_with_its_names(out, act, error, names):
    check_mistake(out.parent, act, error, names)
