"""Logs of messages: bounded at each step from the network to a page, and only for who looks."""

import json

import pytest
from helpers.console.message_log_lines import DVA, PHONE, ROBOT, asks, batch, encoded, line
from helpers.console.served_console import HOSTILE, scene
from helpers.paths import ROOT
from lxml import etree

from dva_sim.console.views.logs import CUT, Logs
from dva_sim.console.web.feed import PageFeed
from dva_sim.console.web.log_entries import Entry
from dva_sim.console.web.logs import ENTRIES_PER_LINE, KEPT_BYTES, KEPT_ENTRIES, KeptLogs, Looks
from dva_sim.console.web.state import RunState
from dva_sim.console.wire.kinds import BadMessage
from dva_sim.console.wire.limits import LOG_BATCH, LOG_BYTES
from dva_sim.console.wire.lines import KINDS
from dva_sim.kernel.clock import Clock
from dva_sim.network.messaging import Request
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol import messages as m
from dva_sim.serving.pipes import MAX_WAITING, LineOutbox

SAMPLES = ROOT / "protocol" / "samples" / "valid"
HEADER = {"DestinationID", "MessageID", "SourceID", "Timestamp", "SessionID"}
GROUPS = {"Access", "Dispatch", "Event", "Mission", "Sensor", "TeleOp"}  # of several kinds

# --- in the world ----------------------------------------------------------------------------


class LoggedDva:
    """A DVA on a virtual network that answers each request at once."""

    def __init__(self) -> None:
        self.clock = Clock()
        self.network = VirtualNetwork(self.clock, lambda *_: ())  # type: ignore[arg-type]
        self.logs = Logs(self.network, {"dva": DVA, "robot-1": ROBOT}.get)

    def ask(self, data: bytes, node: str = DVA) -> None:
        tap = self.network.taps.get(node)
        if tap is not None:
            tap.serve(lambda request: request.answer(b"re"), Request(data, lambda _: None))


@pytest.fixture
def logged() -> LoggedDva:
    """One whose log is kept."""
    made = LoggedDva()
    made.logs.keep("dva")
    return made


def test_nothing_taps_a_device_that_nobody_looks_at(logged):
    assert list(logged.network.taps) == [DVA]
    logged.logs.look({"robot-1": True, "nobody": False})
    assert list(logged.network.taps) == [DVA, ROBOT]
    logged.logs.look({})
    assert list(logged.network.taps) == [DVA]


def test_a_batch_holds_what_came_since_the_last_one(logged):
    logged.ask(b"one")
    logged.ask(b"two")
    (reported,) = logged.logs.batches()
    found = [(one[0], one[2], one[3]) for one in reported["lines"]]
    assert found == [(1, "one", "re"), (2, "two", "re")]
    assert logged.logs.batches() == []


def test_of_a_flood_the_newest_are_told_and_numbers_say_how_many_are_not(logged):
    for n in range(1, 1405):
        logged.ask(b"%d" % n)
    (reported,) = logged.logs.batches()
    assert [one[0] for one in reported["lines"]] == list(range(1405 - LOG_BATCH, 1405))
    logs = KeptLogs()
    looks = looking(logs)
    logs.take(batch(*asks(1, 1)))
    assert looks.next()["missed"] == 0
    logs.take(reported | {"lines": [line(n, b"x", None) for n in range(1205, 1405)]})
    assert (line_ := looks.next())["missed"] == 1203
    assert len(line_["lines"]) == ENTRIES_PER_LINE


def test_large_messages_make_a_batch_short_and_are_cut(logged):
    for _ in range(60):
        logged.ask(b"x" * 60_000)
    (reported,) = logged.logs.batches()
    sizes = [len(one[2]) for one in reported["lines"]]
    assert set(sizes) == {CUT}
    assert sum(sizes) < LOG_BYTES + CUT


def test_who_listens_in_this_process_has_each_exchange():
    logged, heard = LoggedDva(), []
    logged.logs.listen("robot-1", heard.append)
    logged.ask(b"go", ROBOT)
    assert [(one.data, one.reply) for one in heard] == [(b"go", b"re")]


def test_logs_give_way_to_all_other_lines():
    outbox = LineOutbox(KINDS)
    for n in range(MAX_WAITING):
        outbox.put({"k": "log", "n": n} if n % 2 else {"k": "story", "n": n})
    outbox.put({"k": "story", "n": MAX_WAITING})
    kept = [json.loads(outbox.next()) for _ in range(len(outbox))]
    assert [one["n"] for one in kept if one["k"] == "story"] == list(range(0, MAX_WAITING + 1, 2))
    assert [one["n"] for one in kept if one["k"] == "log"] == list(range(3, MAX_WAITING, 2))


# --- in the web process ------------------------------------------------------------------------


def looking(logs: KeptLogs, acts: bool = True, **wanted: object) -> Looks:
    looks = Looks(logs, acts)
    looks.look({"dva": wanted}, [])
    looks.next()
    return looks


def test_a_page_that_begins_to_look_gets_the_newest_and_then_what_comes():
    logs = KeptLogs()
    logs.take(batch(*asks(1, 300)))
    looks = Looks(logs, True)
    assert looks.next() is None
    looks.look({"dva": {}}, [])
    first = looks.next()
    assert (first["first"], first["missed"], first["total"]) == (True, 0, 300)
    assert [row["n"] for row in first["lines"]] == list(range(101, 301))
    assert looks.next() is None
    logs.take(batch(*asks(301, 302)))
    more = looks.next()
    assert (more["first"], [row["n"] for row in more["lines"]]) == (False, [301, 302])


def test_a_row_says_who_asked_what_and_what_came_of_it():
    logs = KeptLogs()
    logs.names[DVA] = "dva"
    register = m.Registration("BQ Curie 2", "TeleOp", "192.168.0.9:5600")
    wish = m.PermissionRequest(ROBOT, "teleoperation")
    looks = looking(logs)
    logs.take(batch(line(1, encoded(1, register)), line(2, encoded(2, wish, 7), m.BUSY)))
    registered, asked = looks.next()["lines"]
    assert (registered["kind"], registered["from_label"]) == ("RegMsg", "BQ Curie 2")
    assert asked == {
        "n": 2,
        "t": 2000,
        "kind": "PermissionRequest",
        "payload": f"device {ROBOT}, level teleoperation",
        "from": PHONE,
        "from_label": "BQ Curie 2",
        "to": DVA,
        "to_label": "dva",
        "session": "7",
        "code": m.BUSY,
        "word": "busy",
        "text": "so",
        "service_us": 250,
        "published": False,
    }


def test_an_answer_that_comes_later_changes_the_row_and_not_its_place():
    logs = KeptLogs()
    looks = looking(logs)
    logs.take(batch(line(1, encoded(1, m.GetDeviceList()), None), *asks(2, 3)))
    assert [row["code"] for row in looks.next()["lines"]] == [None, m.OK, m.OK]
    logs.take(batch(*asks(1, 1)))
    assert [(row["n"], row["code"]) for row in looks.next()["lines"]] == [(1, m.OK)]
    assert list(logs.of("dva").entries) == [1, 2, 3]


def test_registrations_that_repeat_the_one_before_are_left_out_until_they_are_wanted():
    logs = KeptLogs()
    same, other = (m.Registration(label, "TeleOp", "192.168.0.9") for label in ("one", "two"))
    asked = {1: (0, same), 2: (10, same), 3: (20, other), 4: (30, other), 5: (50, other)}
    for number, (seconds, body) in asked.items():
        exchange = line(number, encoded(number, body))
        exchange[1] = 1000 * seconds
        logs.take(batch(exchange))
    looks = Looks(logs, True)
    for renewals, numbers in ((False, [1, 3, 5]), (True, [1, 2, 3, 4, 5])):
        looks.look({"dva": {"renewals": renewals}}, [])
        assert [row["n"] for row in looks.next()["lines"]] == numbers


@pytest.mark.parametrize(
    ("wanted", "numbers"),
    [
        ({}, [1, 2, 3]),
        ({"publications": True}, [1, 2, 3, 4]),
        ({"kind": "RegMsg"}, [1]),
        ({"device": "curie"}, [1, 2]),
        ({"device": ROBOT.lower()}, [3]),
        ({"code": "refused"}, [2]),
        ({"code": "none"}, [3]),
        ({"code": str(m.BUSY)}, [2]),
        ({"text": "Missions"}, []),
        ({"text": "missions"}, [2]),
        ({"since": 1}, [2, 3]),
    ],
)
def test_a_page_sees_what_its_filter_takes(wanted, numbers):
    logs = KeptLogs()
    register = m.Registration("BQ Curie 2", "TeleOp", "192.168.0.9")
    logs.take(
        batch(
            line(1, encoded(1, register)),
            line(2, encoded(2, m.PermissionRequest(PHONE, "missions")), m.BUSY),
            line(3, encoded(3, m.GetDeviceList(), source=ROBOT), None),
            line(4, encoded(4, m.Heartbeat(), None), None, published=True),
        )
    )
    looks = Looks(logs, True)
    looks.look({"dva": wanted}, [])
    assert [row["n"] for row in looks.next()["lines"]] == numbers


def test_a_log_keeps_the_newest_messages_and_so_many_bytes():
    logs = KeptLogs()
    for first in range(1, KEPT_ENTRIES + 1001, 200):
        logs.take(batch(*(line(n, b"x", None) for n in range(first, first + 200))))
    kept = logs.of("dva")
    assert (len(kept.entries), next(iter(kept.entries)), kept.newest) == (
        KEPT_ENTRIES,
        1001,
        KEPT_ENTRIES + 1000,
    )
    for n in range(KEPT_ENTRIES + 1001, KEPT_ENTRIES + 6001):
        logs.take(batch(line(n, b"x" * CUT, None)))
    assert kept.bytes <= KEPT_BYTES
    assert kept.bytes == sum(entry.size for entry in kept.entries.values())


def test_who_may_not_act_learns_of_no_session():
    logs = KeptLogs()
    looks = looking(logs, acts=False, text="4711")
    grant = m.PermissionRevocation(ROBOT, PHONE, 4711)
    logs.take(batch(line(1, encoded(1, grant, 4711))))
    (row,) = looks.next()["lines"]
    assert "4711" not in json.dumps(row)


def test_what_is_no_message_has_a_row_as_well():
    for data in (b"", b"\xff\xfe<msg>", b"<msg><SimpleMsg><DestinationID>" * 400, HOSTILE.encode()):
        entry = Entry.of(line(1, data, m.BAD_MESSAGE))
        assert (entry.code, entry.header) == (m.BAD_MESSAGE, {})
        assert entry.payload
    broken = encoded(5, m.GetDeviceList()).replace(b"<MessageID>5", b"<MessageID>five")
    entry = Entry.of(line(1, broken))
    assert (entry.kind, entry.header["MessageID"]) == ("GetDeviceList", "five")


def test_only_pages_that_look_get_logs_and_tables():
    state = RunState()
    state.take(scene())
    feeds = [PageFeed(state, "c1"), PageFeed(state, "c2")]
    for feed in feeds:
        assert json.loads(feed.next())["k"] == "snap"
    feeds[0].looks.look({"dva": {}}, ["devices"])
    state.take(batch(*asks(1, 2)))
    state.take({"k": "devices", "t": 1, "devices": []})
    kinds = [{json.loads(text)["k"] for text in iter(feed.next, None)} for feed in feeds]
    assert kinds == [{"log", "devices"}, set()]


@pytest.mark.parametrize(
    "given",
    [
        ([], []),
        ({"dva": 1}, []),
        ({"dva": {"device": "x" * 201}}, []),
        ({"dva": {"since": "1"}}, []),
        ({f"robot-{n}": {} for n in range(9)}, []),
        ({}, ["seats"]),
        ({}, "devices"),
    ],
)
def test_nonsense_is_refused(given):
    with pytest.raises(BadMessage):
        Looks(KeptLogs(), True).look(*given)


@pytest.mark.parametrize("file", sorted(SAMPLES.glob("*.xml")), ids=lambda file: file.stem)
def test_every_kind_of_message_is_called_as_its_element(file):
    message = etree.fromstring(file.read_bytes())[0]
    payload = [child for child in message if child.tag not in HEADER]
    name = message.tag
    if name == "SimpleMsg":
        group = payload[0]
        name = group[0].tag if group.tag in GROUPS else group.tag
    assert Entry.of(line(1, file.read_bytes())).kind == name
