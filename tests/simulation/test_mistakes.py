"""Mistakes in scenarios of all models, in tables of events, and in runs that cannot be."""

from functools import partial
from pathlib import Path
from typing import Any

from helpers.mistakes import check_mistake, each_mistake, mistakes, of_file
from helpers.worlds.small_site import TWO_ROOMS, feature, write_site

from dva_sim.kernel import resources
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation import middleware, task, timed, transports
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.run_journal import compute_recording
from dva_sim.simulation.models import model_of
from dva_sim.simulation.scenario import build, load

GOOD: dict[str, Any] = {
    "model": "timed",
    "responders": [{"name": "guard"}],
    "demand": [{"between": 10}],
}
AREA = {"area": {"width_m": 10, "height_m": 10}}
SITE = {"site": {"name": "caparica"}}
ROBOT = {"name": "robot", "kind": "robot"}
DRIVEN = {"responders": [ROBOT], "operators": {"count": 1}}
REPEATED = {"demand": [{"between": 1, "repeats": {"share": 0.5}}]}
SHIFT = "model: timed\nresponders: [{name: guard}]\n"


def model_of_file(name):
    document = load_yaml(name)
    model_of(document).build(document, {})


def shift(wrong, changes=None):
    timed.build(GOOD | wrong, changes or {})


def law(config):
    shift({"demand": [{"between": config}]})


def rehearsed(wrong):
    timed.rehearse_timed(timed.build(GOOD | wrong), 1)


TIMED = [
    *mistakes(
        shift,
        ({"demand": [{}]}, "between, sources batch"),
        ({"demand": [{"between": 0}]}, "between 0 s"),
        ({"demand": [{"between": 1, "batch": {"count": 1}}]}, "between, sources batch"),
        ({"demand": [{"between": 1, "zones": {"hall": 1}}]}, "zone 'hall' here"),
        ({"demand": [{"between": 1}, {"between": 2}]}, "streams 'fire'"),
        ({"demand": [{"between": 1, "notice": "detectors"}]}, "'detectors' site"),
        ({"demand": [{"between": {"law": "exponential"}}]}, "missing mean_s"),
        ({"responders": [ROBOT]}, "robots operator"),
        (DRIVEN | {"responders": [ROBOT | {"after": "recall"}]}, "driven operator"),
        ({"responders": [{"name": "a"}, {"name": "a"}]}, "responders 'a'"),
        ({"responders": [{"name": "a", "base": "hall"}]}, "place 'hall'"),
        ({"responders": [{"name": "a", "base": "post"}]}, "place 'post'"),
        (AREA | SITE, "site area"),
        ({"zones": {"a": [0, 0, 1, 1]}}, "zones area"),
        (AREA | {"zones": {"a": [2, 0, 1, 1]}}, "xmin, ymin, xmax, ymax"),
        (AREA | {"travel": "path"}, "travel 'path' site"),
        ({"travel": "straight"}, "travel site area"),
        ({"warm_up_s": 9, "horizon_s": 8}, "warm_up_s 9 horizon_s 8"),
        ({"dispatch": {"policy": "min_etta"}}, "policy 'min_etta' 'min_eta'?"),
        ({"dispatch": {"policy": "min_eta", "options": {"a": 1}}}, "'min_eta' 'a'"),
        ({"dispatch": {"preferences": {"here": ["guide"]}}}, "responder 'guide'"),
        ({"dispatch": {"contaiment": True}}, "contaiment' 'containment'"),
        (REPEATED | {"dispatch": {"merge_distance_m": 0}}, "repeats dispatch.merge_distance_m"),
        (DRIVEN | {"dispatch": {"containment": True}}, "containment guards"),
        ({}, {"responders.4.count": 1}, "responders.4"),
        ({}, {"responders.x.count": 1}, "responders.x"),
        ({}, {"demand.0.kind.x": 1}, "demand.0.kind"),
    ),
    *mistakes(
        law,
        ({"law": "exponential", "mean_s": 0}, "mean_s 0"),
        ({"law": "uniform", "low_s": 3, "high_s": 2}, "low_s high_s"),
        ({"law": "lognormal", "spread": 0.4}, "mean_s median_s"),
        ({"law": "lognormal", "mean_s": 3, "median_s": 3, "spread": 0.4}, "mean_s median_s"),
        ({"law": "hyperexponential", "mean_s": 3, "squared_cv": 0.9}, "squared_cv 0.9"),
        ({"law": "zipf", "mean_s": 3}, "'zipf'"),
        ({"mean_s": 3}, "law"),
        (True, "mapping True"),
        (-1, "-1"),
    ),
    *mistakes(
        rehearsed,
        (SITE | {"responders": [{"name": "guard", "base": "post-9"}]}, "post-9"),
        ({"dispatch": {"policy": "oracle"}}, "after: return"),
    ),
    *mistakes(
        of_file(model_of_file, "shift.yaml"),
        (f"{SHIFT}demand:\n  - between: {{law: exponential, mean_s: -3}}\n", "yaml:4:33: above 0"),
        (f"{SHIFT}demand: [{{between: 3}}]\ndispatch:\n  policy: fastest\n", ":5:3: 'fastest'"),
    ),
]

HEAD = "time,kind,room\n"
TWO = "2026-03-01T08:00:00Z,fire,Workshop\n2026-03-01T08:01:00Z,flood,Kitchen\n"
MODELS = {
    "full": "model: full\nhorizon_s: 600\n",
    "timed": SHIFT + "site: {name: caparica}\nhorizon_s: 600\n",
}


def events(model, table, keys=""):
    """Build a scenario beside its table."""
    Path("alarms.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
    text = f"{MODELS[model]}events: {{table: alarms.csv{keys}}}\n"
    of_file(model_of_file, "desk.yaml")(text)


def berlin(model, time):
    events(model, f"{HEAD}{time},fire,Kitchen\n", ", time_zone: Europe/Berlin")


def event_keys(model, keys):
    events(model, HEAD + TWO, keys)


def no_table(model):
    of_file(model_of_file, "desk.yaml")(f"{MODELS[model]}events: alarms.csv\n")


def tables_for(model):
    return [
        *mistakes(
            partial(events, model),
            (HEAD + TWO + "2026-03-01T08:02:00Z,Brand,Kitchen\n", "csv:4: events.kinds: {Brand:"),
            (HEAD + TWO + "2026-03-01T08:02:00Z,fire,Kitchn\n", "alarms.csv:4: 'Kitchen'"),
            (HEAD + TWO + "2026-03-01T08:02:00Z,fire\n", "alarms.csv:4: 2 cells, 3"),
            (HEAD + TWO + "2026-03-01T08:02:00Z,fire,\n", "alarms.csv:4: no place"),
            (HEAD + TWO + "2026-03-01T08:02:00,fire,Kitchen\n", "csv:4: events.time_zone"),
            (HEAD + TWO + "01.03.2026 08:02,fire,Kitchen\n", "alarms.csv:4: ISO 8601"),
            (HEAD + TWO + "120,fire,Kitchen\n", "alarms.csv:4: one form"),
            (HEAD + TWO + "2026-03-01,fire,Kitchen\n", "alarms.csv:4: no time of day"),
            (HEAD + "1772352000000,fire,Kitchen\n", "alarms.csv:2: too large seconds"),
            (HEAD + "nan,fire,Kitchen\n", "alarms.csv:2: too large seconds"),
            (HEAD.replace(",", ";") + "0,5;fire;Kitchen\n1.060;fire;Kitchen\n", "csv:3: point"),
            (HEAD + '"1,060",fire,Kitchen\n', "alarms.csv:2: ISO 8601"),
            ("time,kind\n2026-03-01T08:00:00Z,fire\n", "alarms.csv:1: place"),
            (HEAD.replace("time", "when") + TWO, "alarms.csv:1: no column 'time'; when"),
            (HEAD.replace("room", "x") + TWO, "alarms.csv:1: no column 'y'"),
            ("time,kind,x,y,lat,lon\n0,fire,1,1,1,1\n", "alarms.csv:1: one pair"),
            ("time,timestamp,kind,room\n0,0,fire,Kitchen\n", "csv:1: 'time' 'timestamp'"),
            ("time,kind,x,y\n0,fire,500,5\n", "alarms.csv:2: outside site"),
            ("time,kind,x,y\n0,fire,0.01,0.01\n", "alarms.csv:2: open floor"),
            ("time,kind,x,y\n0,fire,a,5\n", "alarms.csv:2: x number metres"),
            ("time,kind,lat,lon\n0,fire,48.1,11.5\n", "alarms.csv:2: outside site"),
            ("time,kind,room,x,y\n0,fire,Kitchen,20,12\n", "csv:2: 'Main corridor', 'Kitchen'"),
            (HEAD[:-1] + ",severity\n0,fire,Kitchen,3\n", "alarms.csv:2: 0 to 1"),
            (HEAD[:-1] + ",false_alarm\n0,fire,Kitchen,maybe\n", "alarms.csv:2: true or false"),
            ((HEAD + "0,fire,Küche\n").encode("latin-1"), "alarms.csv:2: UTF-8"),
            ("", "alarms.csv:1: empty"),
        ),
        *mistakes(
            partial(berlin, model),
            ("2026-10-25 02:30", "alarms.csv:2: twice Europe/Berlin"),
            ("2026-03-29 02:30", "alarms.csv:2: not exist Europe/Berlin"),
        ),
        *mistakes(
            partial(event_keys, model),
            (", time_zone: Europe/Lisbonne", "desk.yaml: 'Europe/Lisbon'?"),
            (", start: tomorrow", "desk.yaml: start 'tomorrow' ISO 8601"),
            (", start: 2027-01-01T00:00:00Z", "desk.yaml: 2 before events.start"),
            (", starts: 5", "desk.yaml: events.starts"),
        ),
        *mistakes(no_table, (model, "alarms.csv' read")),
    ]


EVENTS = [
    *tables_for("full"),
    *tables_for("timed"),
    *mistakes(
        of_file(model_of_file, "desk.yaml"),
        (MODELS["full"] + "events: [{kind: fire, position: [500, 5]}]\n", "outside site"),
        (
            MODELS["full"] + "events: [{kind: fire, position: [20, 12], room: Kitchen}]\n",
            "'Kitchen'",
        ),
    ),
]

TILTED = "task: {{kind: pointing}}\ndevice: {{kind: tilt_velocity, {}}}"
TUNNEL = "task: {kind: tunnel, shape: circular, length_m: 0.1, width_m: 0.05}"
JITTER = "link: {up: {delay_s: 0.1, jitter_s: 0.2}}"


def task_of_text(text):
    of_file(lambda name: task.build(load_yaml(name)), "mine.yaml")(f"model: task\n{text}\n")


TASKS = mistakes(
    task_of_text,
    ("task: {kind: pointing, wide_m: 1}", "mine.yaml:2:24 'task.wide_m'"),
    ("task: {kind: juggling}", "mine.yaml:2: task"),
    ("task: {kind: pointing}\noperator: {strategy: pursit}", "yaml:3:12 operator 'pursit'"),
    ("task: {kind: pointing}\noperator: {traits: {nerve: 2}}", "yaml:3:12 traits 'nerve'"),
    ("task: {kind: pointing, width_m: -1}", "mine.yaml:2:24 task.width_m"),
    (TILTED.format("filter: magic"), "mine.yaml:3:31 filter 'magic'"),
    (TILTED.format("accelerometer: bma"), "mine.yaml:3:31 accelerometer 'bma'"),
    ("task: {kind: pointing, cursor_m: 0.02}", "mine.yaml:2:1 cursor_m 0.02 below"),
    (TUNNEL, "mine.yaml:2:1 width_m 0.05 length_m 0.1"),
    ("task: {kind: slalom, swing_m: 0.5}", "mine.yaml:2:1 cones stand in the way"),
    ("task: {kind: corner}", "mine.yaml:1:1 corner device.kind joystick 'mouse'"),
    ("task: {kind: corner}\ndevice: {kind: joystick}", "yaml:1:1 corner plant.speed_mps"),
    ("task: {kind: tracking}", "mine.yaml:1:1 horizon_s 30 130"),
    ("task: {kind: pointing}\n" + JITTER, "mine.yaml:3:8 jitter_s 0.2 delay_s 0.1"),
)

BARE = {"kind": "datagrams"}
SHORT = {"model": "middleware", "set_up_s": 1.5, "measure_s": 1.0, "attempts": 1}


def habit(key, value):
    build({}, {f"operator.habits.{key}": value})


def congested(changes):
    path = resources.find("congested-link", "experiments/scenarios")
    transports.build(load_yaml(path), changes)


def real_link(changed):
    middleware.build(SHORT | changed)


def journal(*lines):
    compute_recording(build(load("drive-to-event"), {}), 1, lines)


FIRE = {"site": {"name": "tiny.yaml"}, "events": [{"kind": "fire", "reported": True}]}
GUARD_ALONE = {"robot": {"count": 0}, "operator": {"count": 0}, "guard": {"count": 1}}
TWICE = {"mobilisation_s": 30.0, "traits": {"mobilisation_s": 60.0}}
PLACES = [
    feature("robot_base", "Point", [(1, 1)]),
    feature("guard_post", "Point", [(1, 3)]),
]


def placed(*teams):
    """Runs of a drill on a site of two small rooms, one after the other."""
    write_site(Path(), TWO_ROOMS + PLACES)
    for team in teams:
        Run(build(FIRE | team, {}), 1)


PLACED = mistakes(
    placed,
    (GUARD_ALONE | {"guard": {"count": 1, "way_m": 500.0}}, "'tiny' 500 m guard-1; 7 m"),
    ({"robot": {"count": 7}}, {"robot": {"count": 8}}, "'tiny' room 7 robots 8"),
    (GUARD_ALONE | {"bystander": {"count": 100}}, "'tiny' 23 bystanders"),
    ({"robot": {"count": 30, "way_m": 3.0}}, "'tiny' 3 m robot-3; 2 robot.way_m"),
    (GUARD_ALONE | {"guard": {"count": 1} | TWICE}, "mobilisation_s traits"),
)
OTHERS = [
    *mistakes(
        habit,
        ("waiting.shortest", 1.0, "shortest shortest_s"),
        ("shortest_s", 1.0, "shortest_s operator.habits.waiting.shortest_s"),
        ("waiting.shortest_s", 0.0, "shortest_s above 0"),
        ("waiting.shortest_s", "long", "shortest_s number"),
    ),
    *mistakes(
        congested,
        ({"transport": BARE}, "'transport.header_bytes'"),
        ({"transport": BARE | {"header_bytes": 12, "increase": 1.0}}, "increase decrease"),
        ({"transport": BARE | {"header_bytes": 12, "repeats_crucial": True}}, "increase"),
        ({"transport": {"kind": "rtnp"}}, "kind 'rtnp' datagrams"),
        ({"transport.king": "udp"}, "'transport.king'"),
        ({"drive.plant.speed_mps": None}, "course plant.speed_mps"),
        ({"drive.task.kind": "reach"}, "drive.task"),
        ({"operator.strategy": "nobody"}, "nobody"),
    ),
    *mistakes(
        real_link,
        ({"transport": {"name": "upd"}}, "udp"),
        ({"transport": {"name": "mqtt", "options": {"qos": 7}}}, "qos 7"),
        ({"pictures": {"rate_hz": 5, "bytes": 70_000}}, "bytes"),
        ({"set_up_s": 0}, "set_up_s"),
    ),
    *mistakes(
        journal,
        ("Error",),
        (("run", "{}"), "Error"),
        (("", '["track", 1]'), "Error"),
        error=ValueError,
    ),
]


@each_mistake([*TIMED, *EVENTS, *TASKS, *PLACED, *OTHERS])
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
