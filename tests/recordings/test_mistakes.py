"""Mistakes in what is recorded, drawn and read, told before anything runs."""

import math
import struct
from pathlib import Path

from helpers.mistakes import Refused, check_mistake, command, each_mistake, mistakes, of_file

from dva_sim.options.runs import PictureOptions
from dva_sim.recordings.motion import APP, COLUMNS, FIRST_LINE, UNITS, read_motion
from dva_sim.recordings.motion_figures import figures_of
from dva_sim.recordings.pictures import Wanted
from dva_sim.recordings.reading import read_recording
from dva_sim.recordings.sensor_log import read_sensor_log
from dva_sim.simulation import scenario as scenarios

MAGIC = b"\x89MCAP0\r\n"
LEAK = {"kind": "steam_leak.py:SteamLeak", "room": "Chemistry lab", "at_s": 5.0}


def event(changed):
    scenarios.build({"events": [LEAK | changed], "guard": {"count": 1}})


def drawn(options):
    Wanted.of(PictureOptions(**options))


def drawn_of_drill(options):
    drill = scenarios.build(scenarios.load("fire-drill"), {"horizon_s": 120, "robot.count": 2})
    Wanted(still=Path("a.png"), **options).check(drill)


def recording(name):
    read_recording(Path(name))


def log(rows, head="t,x,y,z", unit=None):
    Path("log.csv").write_text(f"{head}\n{rows}")
    read_sensor_log(Path("log.csv"), unit)


def motion(rows):
    Path("motion-1.csv").write_text("\n".join([FIRST_LINE, *UNITS, COLUMNS, rows]))
    figures_of(read_motion(Path("motion-1.csv")), Path("motion-1.csv"))


def turning(size, hertz):
    """Rows of a vector that turns about x, each 10 ms."""
    angles = [2 * math.pi * hertz * n / 100 for n in range(300)]
    rows = [f"{n / 100},0,{size * math.cos(a)},{size * math.sin(a)}" for n, a in enumerate(angles)]
    return "\n".join(rows)


def still(z=9.8, unit=1.0):
    return "".join(f"{n / 100 * unit},0,0,{z}\n" for n in range(100))


LINEAR = "time," + ",".join(f"Linear Acceleration {axis}" for axis in "xyz")
LOGS = mistakes(
    log,
    (turning(1.0, 1.8), "log.csv without gravity TotalAcceleration"),
    (turning(9.8, 1.8), "log.csv without gravity"),
    (turning(1.0, 1.8), "t,x,y,z", "m/s2", "log.csv 1 median, m/s2"),
    (turning(9.8, 0.1), "log.csv gravity alone TotalAcceleration"),
    (still(6.85), "log.csv --unit 6.85"),
    (still(6.85), "t,x,y,z", "g", "log.csv 6.85 g"),
    ("0,1,2", "t,x,y", "log.csv time x, y z"),
    ("0,1,2,3", "a,b,c,d", "log.csv a, b, c, d"),
    (still(), LINEAR, "log.csv gravity"),
    (still() + "0.99,q,0,0\n", "log.csv:102 'q'"),
    (still() + "0.2,0,0,9.8\n", "log.csv:102 time"),
    (still() + "nan,0,0,9.8\n", "log.csv:102"),
    (still(unit=1e15), "log.csv time (ms)"),
    (still() + "0.99,1e300,0,9.8\n", "log.csv:102 sensor"),
    (still() + "0," + "9" * 140_000, "log.csv:102 table"),
)
ONE_MOMENT = "0,0,0,0,0,9.8,0\n" * 30
MOTION = mistakes(
    motion,
    ("1e300,0,0,0,0,9.8,0\n", "motion-1.csv:5 sensor"),
    ("0,0,0,0,0,nan,0\n", "motion-1.csv:5 sensor"),
    (APP + '{"at_s": 1e300, "period_s": 0.1}\n', "motion-1.csv:5"),
    (ONE_MOMENT, "motion-1.csv moment"),
)
MISTAKES = [
    *mistakes(
        event,
        ({"kind": "quake"}, "hazard 'quake' fire, flood, gas_leak"),
        ({"kind": "steam_leak.py:Steam"}, "class 'Steam'"),
        ({"kind": "none.py:Mine"}, "'none.py' not found"),
        ({"hazard": {"hole": 20}}, "'hole'; 'hole_mm'?"),
        ({"hazard": {"hole_mm": 51}}, "hole_mm: 50, 51"),
    ),
    *mistakes(
        drawn,
        ({"video": "film.avi"}, "'film.avi' .gif .mp4"),
        ({"still": "a.gif"}, ".png, .pdf .svg"),
        ({"still": "a.pdf", "camera": "robot-1"}, ".png .jpg"),
        ({"still": "no/a.png"}, "folder 'no'"),
        ({"camera": "robot-1"}, "--camera --still"),
        ({"inset": True}, "--inset --video"),
        ({"at": 3.0}, "--at --still"),
        ({"still": "a.png", "at": "soon"}, "--at 'soon' seconds"),
        ({"still": "a.png", "at": "1,2"}, "--at '1,2' seconds"),
    ),
    *mistakes(
        drawn_of_drill,
        ({"camera": "robot-9"}, "'robot-9' robot-1, robot-2"),
        ({"at": 121.0}, "--at 121 120 s"),
        ({"at": -1.0}, "--at -1"),
        ({"at": math.nan}, "--at nan"),
    ),
    *mistakes(
        of_file(recording, "odd.mcap"),
        ("", "odd.mcap cut short"),
        ("<xml>not at all</xml>" * 10, "odd.mcap not a recording"),
        (MAGIC + struct.pack("<BQ", 0x0F, 2**63), "odd.mcap damaged"),
        (MAGIC + struct.pack("<BQI", 1, 40, 2**31), "odd.mcap cut short"),
        (MAGIC + struct.pack("<BQQQII", 9, 99, 0, 0, 0, 0) + b"\xff" * 8, "odd.mcap cut short"),
    ),
    *mistakes(recording, ("none.mcap", "none.mcap file")),
    *mistakes(
        command,
        ("replay none.mcap", "none.mcap:"),
        ("episode fire-drill --record run.bag", ".mcap"),
        ("episode fire-drill --record no/run.mcap", "folder 'no'"),
        ("episode fire-drill --record /proc/a.mcap", "/proc"),
        ("episode tasks/fitts-tilt --record a.mcap", "full"),
        ("episode fire-drill --record a.mcap --side-by-side req-rep,pub-sub", "--side-by-side"),
        (
            "episode fire-drill --still a.png --camera robot-1 --side-by-side req-rep,pub-sub",
            "--camera --side-by-side",
        ),
        error=Refused,
    ),
]


@each_mistake([*LOGS, *MOTION, *MISTAKES])
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
