"""`dva-sim check` and `dva-sim schema` as users call them."""

import functools
import os
import re
import sqlite3
import tracemalloc
from contextlib import closing
from pathlib import Path

import pytest
from helpers.paths import ROOT
from helpers.processes.command_line import call
from helpers.wording import unnamed

from dva_sim.cli import checks
from dva_sim.experiments.study import cell_grid
from dva_sim.recordings.audit_log import BEGIN, END, AuditEntry, AuditLog
from dva_sim.testing import file_kinds

pytestmark = pytest.mark.system

SAMPLES = ROOT / "protocol" / "samples"
REGISTRATIONS = [*ROOT.glob("experiments/*.registration.yaml")]
GOOD = SAMPLES / "valid" / "set-teleop.xml"
FLOOD = "events: [{{kind: flood, hazard: {{{}}}}}]\n"
LEAK = "events: [{{kind: gas_leak, hazard: {{draught: 1, {}}}}}]\n"
BOMB = "a: &a [x, x]\n" + "".join(
    f"{new}: &{new} [*{old}, *{old}]\n"
    for old, new in zip("abcdefghijklmnopqrstu", "bcdefghijklmnopqrstuv", strict=True)
)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def check(here, capsys):
    """Writes texts into files, checks them, gives the exit code and the lines printed."""

    def run(*files, **texts):
        for name, text in texts.items():
            (here / name.replace("__", ".")).write_text(text)
        code = checks.check(files or [name.replace("__", ".") for name in texts])
        captured = capsys.readouterr()
        return code, [*captured.err.splitlines(), *captured.out.splitlines()]

    return run


def test_all_registrations_are_of_the_studies_beside_them(check):
    """In full: a registration names every cell."""
    assert REGISTRATIONS
    code, lines = check(*map(str, REGISTRATIONS))
    assert (code, {line.split(": ")[1] for line in lines[:-1]}) == (0, {"registration"})


@pytest.mark.parametrize("most", [1, pytest.param(None, marks=pytest.mark.soak)])
def test_all_that_is_shipped_is_valid(check, most, monkeypatch):
    """Builds the first cell of each part of a study, or every one of hundreds."""
    for name in ("levels_of_cells", "_repeats_of", "to_rehearse"):
        every = getattr(cell_grid, name)
        monkeypatch.setattr(cell_grid, name, lambda *of, every=every: [*every(*of)][:most])
    monkeypatch.setattr(file_kinds, "load_study", functools.cache(file_kinds.load_study))
    files = [file for file in ROOT.glob("experiments/**/*.yaml") if file not in REGISTRATIONS]
    files += ROOT.glob("agents/**/*.yaml")
    files += [*ROOT.glob("worlds/*.yaml"), *ROOT.glob("worlds/*.geojson")]
    files += [*SAMPLES.glob("valid/*.xml")]
    code, lines = check(*map(str, files))
    assert code == 0, [line for line in lines if not line.endswith(": valid")]
    assert lines[-1] == f"{len(files)} files: {len(files)} valid"
    kinds = {line.split(": ")[1] for line in lines[:-1] if ": warning: " not in line}
    agents = {"robot", "phone", "accelerometer", "guard", "bystanders", "operators"}
    agents |= {"robot of ROS"}
    agents |= {"bands of operators", "tuned values"}
    runs = {"study", "scenario", "timed scenario", "validation cases", "targets", "split", "task"}
    runs |= {"transports", "middleware", "measurements"}
    assert kinds == {"site", "plan", "message"} | runs | agents


def test_the_kind_is_told_by_the_keys_wherever_the_file_lies(check):
    code, lines = check(
        a__yaml=(ROOT / "agents/people/operators.yaml").read_text(),
        b__yaml=(ROOT / "agents/robots/servrobot.yaml").read_text(),
        c__yaml="horizon_s: 5\n",
        d__yaml=(
            "question: what?\nparts: {drive: {scenario: c.yaml}}\n"
            "factors: {pattern: [req-rep, pub-sub]}\n"
        ),
        e__txt=GOOD.read_text(),
    )
    assert code == 0, [line for line in lines if not line.endswith(": valid")]
    assert lines == [
        "a.yaml: operators: valid",
        "b.yaml: robot: valid",
        "c.yaml: scenario: valid",
        "d.yaml: study: valid",
        "e.txt: message: valid",
        "5 files: 5 valid",
    ]


def test_the_place_tells_the_kind_where_the_keys_do_not(check, here):
    folder = here / "experiments" / "scenarios"
    folder.mkdir(parents=True)
    (folder / "plain.yaml").write_text("description: As it comes.\n")
    code, lines = check("experiments/scenarios/plain.yaml")
    assert (code, lines[0]) == (0, "experiments/scenarios/plain.yaml: scenario: valid")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("horizon_s: 5\nrobots: {}\n", "2:1: unknown key 'robots'; did you mean 'robot'?"),
        ("link:\n  delay_s: 0.1\n  los: 0.1\n", "3:3: unknown key 'link.los'; did you mean 'loss'"),
        ("link:\n  loss: much\n", "2:3: link.loss: should be a number"),
        ("events:\n  - kind: fire\n  - {kind: gas_leak, at_s: soon}\n", "3:22: events.1.at_s: "),
        ("robot: {count: 1}\nrobot: {count: 2}\n", "2:1: "),
        ("robot: {count: 1\n", "1:8: "),
        ("robot:\n  count: 1\n  profile: tank\n", "3:3: robot.profile 'tank' is unknown; known:"),
        ("horizon_s: 5\noperator:\n  population: crowd\n", "3:3: operator.population 'crowd'"),
        ("events:\n- {kind: fire, room: Attic}\n", "2:16: site 'caparica' has no room 'Attic'"),
        ("horizon_s: 5\nrobot: {count: 900}\n", "2:9: site 'caparica' "),
        ("link:\n  trace_up: no.up\n", "2:3: 'no.up': trace cannot be read"),
        ("site:\n  map: no.yaml\n", "2:3: file 'no.yaml' not found"),
        ("horizon_s: 5\nsite: {name: campus, map: m.yaml}\n", "2:1: site: site.map"),
        ("horizon_s: 5\nsite: {map: m.yaml, options: {seed: 2}}\n", "2:1: site: site.options are"),
        ("robot: {profile: [servrobot, pibot]}\n", "1:1: robot: robot.profile names 2 "),
        ("robot: {sensors: [{name: gas, low: 1}]}\n", "1:19: robot.sensors.0: low 1 of gas"),
        (FLOOD.format("inflow: 11"), "1:10: events.0: hazard 'flood': inflow: should be at most 1"),
        (FLOOD.format("inflow: 1e400"), "1:10: events.0: hazard 'flood': inflow: should be a fi"),
        (LEAK.format("supply_x: 900"), "1:27: supply of a draught (900, 0)"),
        (LEAK.format("exhaust_y: -9"), "1:27: exhaust of a draught (0, -9)"),
        ("dispatch: {policy: dice}\n", "1:12: policy 'dice' is unknown"),
        ("question: what?\nparts:\n  a:\n    scenario: lost\n", "4:5: scenario 'lost' not found"),
        ("question: what?\nparts: {a: {scenario: fire-drill, x: 1}}\n", "2:35: unknown key 'parts"),
        ("name: x\nplan: no.geojson\norigin: {latitude: 1, longitude: 1}\n", "2:1: plan 'no.geo"),
        ("mass_kg: 60\nradius_m: wide\n", "2:1: radius_m: should be a number"),
        ("tremor_deg: 1\nfilter: mean\n", "2:1: filter 'mean' is unknown; known: median, "),
        ("mapping: leaky\nmapping_options: {leak: 1}\n", "1:1: mapping 'leaky' has no option 'l"),
        ("noise_mg: 1\nrange_g: 0.5\n", "2:1: range_g: should be at least"),
        ("image: no.pgm\nresolution: 1\norigin: [0, 0, 0]\noccupied_thresh: 0.6\n", "1:1: missing"),
        ("colour: blue\n", "1:1: "),
        ("- 1\n", "1:1: should be a mapping"),
        ("", "1:1: is empty"),
        ("horizon_s: 2001-13-32\n", "1:12: "),
        ("horizon_s: " + "[" * 1000, "1:1: "),
        ("horizon_s: &a [*a]\n", "1:1: horizon_s: should be a number"),
        (BOMB, "1:1: has more than 20000"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_in_one_line_at_its_place(check, text, expected):
    code, lines = check(f__yaml=text)
    assert code == 1
    assert lines[0].startswith(f"f.yaml:{expected}")
    assert len(lines) == 3
    assert lines[1].endswith(": invalid, 1 problem")
    assert lines[2] == "1 file: 1 invalid"


def test_a_study_is_checked_with_its_scenarios(check):
    study = "question: what?\nfactors:\n  robot.count: [1, 900]\nparts: {a: {scenario: s.yaml}}\n"
    code, lines = check("study.yaml", study__yaml=study, s__yaml="horizon_s: 5\n")
    assert code == 1
    assert not unnamed(lines[0], "study.yaml:3:3: ", "'caparica'", " 2")
    code, lines = check("study.yaml", s__yaml="horizon_s: 5\nlink: {los: 1}\n")
    assert code == 1
    assert lines[0].startswith("s.yaml:2:8: unknown key 'link.los'")
    assert lines[1].startswith("study.yaml: study: invalid, 1")


def test_a_plan_is_checked_alone_and_with_its_site(check):
    plan = '{"type": "FeatureCollection", "features": [\n{"properties": {"kind": "moat"}}]}'
    site = "name: x\nplan: p.geojson\norigin: {latitude: 1, longitude: 1}\n"
    code, lines = check(p__geojson=plan, x__yaml=site, q__geojson="{", r__geojson="[" * 200_000)
    assert code == 1
    assert [line[:13] for line in lines[:8:2]] == [
        "p.geojson:2:1",
        "p.geojson:2:1",
        "q.geojson:1:2",
        "r.geojson:1:1",
    ]


def test_a_ros_map_is_checked_with_its_image(check, here):
    keys = "resolution: 0.2\norigin: [0, 0, 0]\noccupied_thresh: 0.6\nfree_thresh: 0.2\n"
    (here / "free.pgm").write_bytes(b"P5\n40 40\n255\n" + b"\xfe" * 1600)
    (here / "wall.pgm").write_bytes(b"P5\n40 40\n255\n" + b"\x00" * 1600)
    (here / "huge.pgm").write_bytes(b"P5\n100000 100000\n255\n")
    images = ("free", "wall", "huge", "none")
    code, lines = check(**{f"{image}__yaml": f"image: {image}.pgm\n{keys}" for image in images})
    assert code == 1
    assert lines[0] == "free.yaml: ROS map: valid"
    assert lines[1].startswith("wall.yaml:1:1: ")
    assert not unnamed(lines[3], "huge.yaml:1:1: ", "'huge.pgm'")
    assert lines[5].startswith("none.yaml:1:1: image 'none.pgm'")


def test_binary_files_are_refused(check, here):
    for name in ("a.xml", "a.yaml", "a.geojson", "a.pgm", "a"):
        (here / name).write_bytes(bytes(range(256)) * 100)
    code, lines = check("a.xml", "a.yaml", "a.geojson", "a.pgm", "a")
    assert code == 1
    assert lines[-1] == "5 files: 5 invalid"


def test_a_huge_file_is_not_read(check, here):
    files = ("huge.xml", "huge.yaml", "huge.geojson", "huge")
    for name in files:
        with (here / name).open("wb") as file:
            file.write(b"<")
            file.truncate(100_000_000)
    tracemalloc.start()
    code, lines = check(*files)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6
    assert code == 1
    reports = [line for line in lines if line.startswith("huge.") and ":1:" in line]
    assert not unnamed(reports[0], "huge.xml:1:8193: ", "8192 bytes")
    assert reports[1].startswith("huge.yaml:1:1: ")
    assert reports[2].startswith("huge.geojson:1:1: ")


def test_what_is_no_file_gives_exit_code_2_and_the_rest_is_still_checked(check, here):
    (here / "folder.xml").mkdir()
    os.mkfifo(here / "pipe.xml")
    code, lines = check("lost.yaml", "folder.xml", "pipe.xml", str(GOOD), "x" * 5000)
    assert code == 2
    wrong = "lost.yaml: ", "folder.xml: ", "pipe.xml: "
    assert all(line.startswith(f"error: {name}") for line, name in zip(lines, wrong, strict=False))
    assert lines[4] == f"{GOOD}: message: valid"
    assert unnamed(lines[5], "5 files", "1 valid", "4 not read") == []


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="needs a file that gives an error")
def test_an_unreadable_file_is_told(check):
    assert check("/proc/self/mem")[1][0].startswith("error: /proc/self/mem: ")


def test_one_line_stays_one_line_whatever_the_file_holds(check, here):
    name = "two\nlines\udcff.xml"
    (here / name).write_text(GOOD.read_text().replace("0.56", "0&#10;5\u2028é"))
    code, lines = check(name)
    assert (code, len(lines)) == (1, 3)
    assert lines[0].startswith("two\\nlines\\udcff.xml:12:9: TurnRate '0\\n5\\u2028é'")


def test_many_problems_do_not_flood_the_terminal(check):
    _, lines = check(many__xml="<msg>" + "<!-- -->" * 200 + "</msg>")
    assert len(lines) == 52
    assert unnamed(lines[50], "invalid", "200 problems", "first 50") == []


def test_the_commands_end_with_the_exit_code(here):
    good = GOOD.read_text()
    assert call("check", GOOD).returncode == 0
    assert call("check", "lost.xml").returncode == 2
    assert call("check").returncode == 2
    refused = call("check", "-", stdin=good.replace("0.56", "fast"))
    assert refused.returncode == 1
    assert refused.stdout.startswith("-:12:9: TurnRate 'fast'")
    assert refused.stderr == ""
    assert call("check", "-", stdin=good).stdout.startswith("-: message: valid")


def test_the_printed_schema_can_be_written_to_a_file(here):
    printed = call("schema", "message")
    assert printed.stdout.encode() == (ROOT / "protocol" / "dva.xsd").read_bytes()
    assert call("schema", "site").stdout.startswith('{\n  "$schema"')
    wrong = call("schema", "sites")
    assert wrong.returncode == 2
    assert re.fullmatch("error: .*'sites'.*'site'.*\n", wrong.stderr)


def test_a_file_named_link_is_asked_for_by_its_path(check):
    code, lines = check("./link")
    assert (code, lines[-1][-11:]) == (2, " 1 not read")


def test_an_audit_log_is_followed_to_the_first_row_that_is_wrong(check, here):
    log = AuditLog(here / "audit.sqlite")
    log.append([AuditEntry(time_s=1.0, at_utc="", author="ana", action=a) for a in (BEGIN, "note")])
    code, (doubt, valid, _) = check("audit.sqlite")
    assert code == 0
    assert doubt.startswith("audit.sqlite: warning: ")
    assert valid.startswith("audit.sqlite: audit log: valid")
    assert not unnamed(valid, "2 rows", log.head)
    log.append([AuditEntry(time_s=2.0, at_utc="", author="ana", action=END)])
    log.close()

    with closing(sqlite3.connect(here / "audit.sqlite", isolation_level=None)) as file:
        file.execute("DROP TRIGGER audit_is_not_changed")
        file.execute("UPDATE audit SET author = 'bob' WHERE number = 2")
    code, (wrong, *_) = check("audit.sqlite")
    assert code == 1
    assert wrong.startswith("audit.sqlite:2:1: ")


def test_another_file_of_sqlite_is_no_audit_log(check, here):
    with closing(sqlite3.connect(here / "memory")) as file:
        file.execute("CREATE TABLE about (name, value)")
    code, (wrong, *_) = check("memory")

    assert code == 1
    assert wrong.startswith("memory:1:1: ")
