"""A console at a DVA that runs elsewhere: what messages tell, and nothing that they do not."""

import json
import signal
import urllib.request
from pathlib import Path

import pytest
from helpers.console.console_program import started
from helpers.network.free_ports import free_port
from helpers.processes.command_line import call
from helpers.processes.patience import becomes
from helpers.processes.programs import Program, Programs
from helpers.wording import unnamed

from dva_sim.console.dva.device_rows import listed_device_row
from dva_sim.console.events.robot_conditions import UNHEARD
from dva_sim.console.remote.options import check, own_ids
from dva_sim.console.system.system_state import DeviceState
from dva_sim.console.views.event_rows import event_row
from dva_sim.console.views.published_rows import positions, robot_row
from dva_sim.console.wire.rows import DeviceRow
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.keys import KeyRing, create_keys
from dva_sim.options.runs import ConsoleOptions
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.stage import DVA, id_of, team_of
from dva_sim.simulation.scenario import build, load
from dva_sim.worlds.geo import GeoFrame

pytestmark = pytest.mark.system

ROBOT, ROOM = id_of("robot", 1), id_of("control-room", 1)
HERE = GeoFrame(38.66, -9.2)


# --- what is told ------------------------------------------------------------------------------


def device_state(kind: str = "Robot", **more: object) -> DeviceState:
    return DeviceState(m.Device(ROBOT, "robot-1", kind, "10.0.0.1:5600"), 0.0, DVA, **more)


def row_of(state: DeviceState, is_lost: bool = False) -> DeviceRow:
    return listed_device_row(state, 5.0, {}, is_lost=is_lost, is_fake=False, may_revoke=True)


def test_of_a_robot_that_has_said_nothing_everything_is_unknown():
    row = robot_row(device_state(), 0, 5.0, {})
    assert (row["mode"], row["holder"], row["camera"]) == ("unknown", None, None)
    assert (row_of(device_state())["link"], row_of(device_state())["holder_known"]) == (None, False)
    assert positions({ROBOT: device_state()}, {ROBOT: 0}, HERE) == []


def test_a_robot_is_shown_as_it_says_itself():
    latitude, longitude = HERE.to_latlon(3.0, -4.0)
    status = m.RobotStatus("Teleoperation", m.Position(latitude, longitude), 1.0, 0.25, 0.0, 7)
    holder = m.RobotHolder(id_of("operator", 1), "ana", 10.0), 2.0
    robot = device_state(published=status, holder=holder, heard=4.0)
    row = robot_row(robot, 3, 5.0, {})
    shown = (row["mode"], row["holder_label"], row["session_age_s"])
    assert shown == ("Teleoperation", "ana", 13.0)
    assert (row["stop_reason"], robot_row(robot, 3, 15.0, {})["stop_reason"]) == ("", UNHEARD)
    assert positions({ROBOT: robot}, {ROBOT: 3}, HERE) == [[3, 300, -400, 1000, 250]]
    shown = row_of(robot)
    assert (shown["doing"], shown["heard_s"], shown["link"]) == ("Teleoperation", 1.0, "good")
    assert (shown["commands_hz"], shown["level"], shown["ends_s"]) == (None, None, None)


def test_the_link_of_a_device_that_the_dva_lists_no_longer_is_lost():
    assert row_of(device_state(heard=1.0), is_lost=True)["link"] == "lost"


def test_an_event_is_shown_as_the_dva_tells_it():
    latitude, longitude = HERE.to_latlon(1.0, 2.0)
    place, times = m.Position(latitude, longitude), {"age": 20.0, "state_for": 5.0}
    status = m.EventStatus(
        4, "fire", place, 0.8, 0.9, "on_scene", **times, decisions=1, responder=ROBOT
    )
    row = event_row(status, received_at=100.0, labels={ROBOT: "robot-1"}, site=None, frame=HERE)
    assert (row["state"], row["severity"], row["over"]) == ("on scene", "critical", False)
    assert (row["x_m"], row["y_m"], row["room"]) == (1.0, 2.0, "unknown room")
    assert (row["reported_ms"], row["since_ms"]) == (80_000, 95_000)
    assert row["assigned"] == ["robot-1"]


# --- how it is asked for -----------------------------------------------------------------------


@pytest.mark.parametrize("dva", ["here", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:70000", ":5600"])
def test_what_is_no_address_is_refused(dva):
    with pytest.raises(ConfigError, match=r"127\.0\.0\.1:5600|65534"):
        check(ConsoleOptions(dva=dva))


def test_an_audit_log_that_cannot_be_kept_is_told_before_anything_starts():
    with pytest.raises(ConfigError, match=r"\.sqlite"):
        check(ConsoleOptions(dva="127.0.0.1:5600", audit=Path("log.txt")))


def test_without_a_key_each_console_has_an_id_of_its_own():
    assert own_ids(None) != own_ids(None)
    assert len(set(own_ids(None, 3))) == 3


def test_with_keys_it_is_the_control_room_whose_secret_is_here(tmp_path):
    create_keys(tmp_path, [id_of("dva", 1), ROOM])
    assert own_ids(KeyRing(tmp_path)) == [ROOM]


def test_keys_without_one_of_a_control_room_are_not_enough(tmp_path):
    create_keys(tmp_path, [id_of("dva", 1)])
    with pytest.raises(ConfigError, match="control-room-1"):
        own_ids(KeyRing(tmp_path))


# --- the programs ------------------------------------------------------------------------------


class Attached:
    """A console at a DVA, and what it knows."""

    def __init__(self, programs: Programs, dva: str, *words: str) -> None:
        self.program, self.address = started(programs, "--dva", dva, *words)
        self.program.wait_to_say("Attached to:")
        self.seat: dict[str, str] = {}

    def _ask(self, path: str, body: object = None) -> dict:
        base, _, token = self.address.partition("?token=")
        headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(base.rstrip("/") + path, data, headers)
        with urllib.request.urlopen(request, timeout=30) as answer:
            return json.load(answer)

    def state(self) -> dict:
        return self._ask("/api/state")

    def story(self) -> list[str]:
        return [f"{one['who']} {one['what']}" for one in self._ask("/api/story")["lines"]]

    def act(self, action: str, **arguments: object) -> dict:
        self.count = getattr(self, "count", 0) + 1
        body = {"id": f"a-{self.count}", "action": action, "arguments": arguments} | self.seat
        answer = self._ask("/api/actions", body)
        self.seat = {"key": answer["key"]} if "key" in answer else self.seat
        return answer


def live(programs: Programs, dva: str, part: str, *words: str) -> Program:
    more = ("--for", "1000", *(("--no-page",) if part == "dva" else ()), *words)
    return programs.start("live", "hands-on", "--only", part, "--dva", dva, *more)


def test_it_shows_what_runs_there_and_outlives_the_dva(programs):
    dva = f"127.0.0.1:{free_port()}"
    first = live(programs, dva, "dva")
    live(programs, dva, "world")
    console = Attached(programs, dva, "hands-on")

    def robots() -> list[tuple[str, str]]:
        return sorted(
            (one["label"], one.get("mode")) for one in console.state()["robots"] if "x_m" in one
        )

    assert becomes(lambda: robots() == [("robot-1", "Idle"), ("robot-2", "Idle")])
    people = {one["label"]: one.get("doing") for one in console.state()["people"]}
    assert people.keys() == {"guard-1", "guard-2"}
    assert becomes(lambda: any(e["kind"] == "fire" for e in console.state()["events"]))
    assert "runs elsewhere" in console.act("link", delay_s=1.0)["text"]
    assert console.act("take", robots=["robot-1"])["ok"]
    assert console.act("start")["ok"]
    assert becomes(lambda: ("robot-1", "Teleoperation") in robots())
    stopped = console._ask("/api/emergency", {"robots": "all"})
    assert unnamed(stopped["text"], "robot-1", "robot-2") == []
    assert console.act("release")["ok"]

    fire = next(e["number"] for e in console.state()["events"] if e["kind"] == "fire")
    assert console.act("event_proposal", event=fire)["ok"]
    noted = console.act("event_note", event=fire, text="seen from outside")
    assert all(word in noted["text"] for word in ("look", "note", "dispatch"))
    assert becomes(lambda: console.act("fake_add", label="ghost", type="Robot")["ok"])
    assert becomes(lambda: "ghost" in [one["label"] for one in console.state()["robots"]])
    assert console.act("fake_remove", device=id_of("fake", 1))["ok"]

    first.process.send_signal(signal.SIGKILL)
    assert becomes(lambda: any("dva is silent" in line for line in console.story()))
    assert robots()  # what was told last stays
    live(programs, dva, "dva")
    assert becomes(lambda: console.story().count("dva answers") == 2)
    assert becomes(lambda: robots() == [("robot-1", "Emergency"), ("robot-2", "Emergency")])


def test_with_keys_it_attaches_as_the_control_room_of_its_key_and_decides(programs, tmp_path):
    dva, keys = f"127.0.0.1:{free_port()}", tmp_path / "keys"
    create_keys(keys, [*team_of(build(load("hands-on"))), ROOM])
    role = "dva.control_rooms={control-room-1: dispatch}"
    live(programs, dva, "dva", "--keys", str(keys), "--set", role)
    live(programs, dva, "world", "--keys", str(keys))
    console = Attached(programs, dva, "--keys", str(keys))

    assert becomes(lambda: len([r for r in console.state()["robots"] if "x_m" in r]) == 2)
    assert becomes(lambda: console.act("room_join", name="")["text"].endswith("may dispatch"))
    assert becomes(lambda: console.state()["events"] != [])
    number = console.state()["events"][0]["number"]
    assert console.act("event_note", event=number, text="seen from elsewhere")["ok"]
    assert "key of its own" in console.act("fake_add", label="ghost", type="Robot")["text"]
    assert "console-1" in console.act("take", robots=["robot-1"])["text"]
    create_keys(keys, [id_of("console", 1)])
    assert becomes(lambda: any(e["kind"] == "fire" for e in console.state()["events"]))
    assert console.act("event_acknowledge", event=1)["ok"]
    done = console.act("event_assign", event=1, device="guard-1", reason="is near")
    assert done["ok"]
    assert becomes(lambda: "guard-1" in console.state()["events"][0]["assigned"])
    refused = console.act("dispatch_mode", mode="ask_first")
    assert "supervise" in refused["text"]


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (("--dva", "nowhere"), "HOST:PORT"),
        (("--dva", "127.0.0.1:5600", "--links", "real"), "--links"),
        (("--dva", "127.0.0.1:5600", "--keys", "none"), "none"),
        (("--keys", "keys"), "--dva"),
    ],
)
def test_what_cannot_be_is_told_in_a_line(words, names):
    ended = call("console", "--no-open", "--port", "0", *words)
    assert ended.returncode == 2
    (line,) = ended.stderr.splitlines()
    assert names in line
