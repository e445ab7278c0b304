"""Logs by plain requests of a running web process: who may read them, whole, and as a file."""

import io
import json
import zipfile
from urllib.parse import quote

import pytest
from helpers.console.message_log_lines import DVA, PHONE, ROBOT, asks, batch, encoded, line
from helpers.console.served_console import serving
from helpers.processes.command_line import call
from helpers.processes.patience import becomes
from helpers.wording import unnamed
from websockets.exceptions import ConnectionClosed

from dva_sim.console.web.logs import KeptLogs, Looks
from dva_sim.console.wire.kinds import BadMessage
from dva_sim.protocol import messages as m
from dva_sim.protocol.mistakes import check_message

BROKEN = encoded(3, m.GetDeviceList()).replace(b"<MessageID>3<", b"<MessageID>three<")


@pytest.fixture(scope="module")
def console():
    with serving("--phones-port", "0", "--phones-host", "127.0.0.1") as served:
        served.say(
            batch(
                line(1, encoded(1, m.Registration("BQ <Curie> 2", "TeleOp", "10.0.0.1"))),
                line(2, encoded(2, m.PermissionRequest(ROBOT, "missions"), 77), m.BUSY),
                line(3, BROKEN, m.BAD_MESSAGE),
                line(4, b"\xff\x00 no message", m.BAD_MESSAGE),
                line(5, encoded(5, m.GetDeviceList()), None),
            )
        )
        assert becomes(lambda: get(served, "/api/logs/dva/2").status == 200)
        yield served


def get(console, path, token=None):
    return console.ask(path, token=token or console.drive)


def test_an_exchange_is_told_whole_with_its_header(console):
    shown = get(console, "/api/logs/dva/2").json
    assert shown["header"] == {
        "DestinationID": DVA,
        "MessageID": "2",
        "SourceID": PHONE,
        "Timestamp": "12:00:00",
        "SessionID": "77",
    }
    assert shown["labels"]["SourceID"] == "BQ <Curie> 2"
    assert (shown["kind"], shown["code"], shown["word"]) == ("PermissionRequest", m.BUSY, "busy")
    assert "        <Level>missions</Level>" in shown["request"].split("\n")
    assert check_message(shown["request"].encode()) == []
    assert check_message(shown["reply"].encode()) == []


def test_what_is_wrong_has_a_line_and_a_column_of_what_is_shown(console):
    shown = get(console, "/api/logs/dva/3").json
    (problem,) = shown["problems"]
    wrong = shown["request"].split("\n")[problem["line"] - 1]
    assert wrong[problem["column"] - 1 :].startswith("<MessageID>three<")
    assert unnamed(problem["text"], "MessageID", "'three'") == []


def test_what_is_no_xml_at_all_is_told_as_it_came(console):
    shown = get(console, "/api/logs/dva/4").json
    assert (shown["kind"], shown["header"]) == ("?", {})
    assert shown["request"] == "\\xff\x00 no message"
    assert shown["problems"]


def test_older_lines_and_filters(console):
    assert [row["n"] for row in get(console, "/api/logs/dva?before=3").json["lines"]] == [1, 2]
    found = get(console, "/api/logs/dva?code=refused&device=curie").json
    assert ([row["n"] for row in found["lines"]], found["total"]) == ([2, 3], 5)


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/api/logs/nobody", 404),
        ("/api/logs/dva/99", 404),
        ("/api/logs/dva/x", 404),
        ("/api/logs/dva?before=-1", 400),
        ("/api/logs/dva?since=x", 400),
        (f"/api/logs/{quote('../state', safe='')}", 404),
    ],
)
def test_what_is_not_there_is_refused(console, path, status):
    assert get(console, path).status == status


def test_who_may_not_drive_sees_lines_without_sessions_and_nothing_whole(console):
    for token in (console.look, console.phone):
        lines = get(console, "/api/logs/dva?text=77", token).json["lines"]
        assert len(lines) == 5  # searching would tell sessions, too
        assert "77" not in json.dumps(lines)
        assert get(console, "/api/logs/dva/2", token).status == 403
        assert get(console, "/api/logs/dva/export", token).status == 403


def test_the_file_of_a_log_holds_messages_that_pass_the_check(console, tmp_path):
    answer = get(console, "/api/logs/dva/export")
    assert answer.headers["content-disposition"] == 'attachment; filename="dva-log.zip"'
    with zipfile.ZipFile(io.BytesIO(answer.body)) as files:
        files.extractall(tmp_path)
    good = sorted((tmp_path / "messages").iterdir())
    assert [file.name for file in good if "request" in file.name] == [
        "000001-RegMsg-request.xml",
        "000002-PermissionRequest-request.xml",
        "000005-GetDeviceList-request.xml",
    ]
    ended = call("check", *good)
    assert (ended.returncode, ended.stdout.splitlines()[-1]) == (0, "7 files: 7 valid")
    assert (tmp_path / "refused" / "000003-GetDeviceList-request.xml").read_bytes() == BROKEN
    assert len((tmp_path / "log.csv").read_text().splitlines()) == 6


def test_a_page_that_looks_is_told_and_the_world_hears_what_is_looked_at(console):
    page = console.page()
    page.ws.send(json.dumps({"do": "look", "logs": {"dva": {"publications": True}}}))
    assert console.next_asked("look")["logs"] == {"dva": True}
    first = page.next("log")
    assert (first["first"], first["total"]) == (True, 5)
    console.say(batch(*asks(6, 6)))
    assert [row["n"] for row in page.next("log")["lines"]] == [6]
    page.close()
    assert console.next_asked("look")["logs"] == {}


@pytest.mark.system
def test_a_phone_may_not_look_at_logs(console):
    page = console.page(console.phone)
    page.ws.send(json.dumps({"do": "look", "logs": {"dva": {}}}))
    with pytest.raises(ConnectionClosed, match="no such message"):
        page.next("log")


@pytest.mark.parametrize("tables", ["devices", [{}], [["devices"]], ["robots"]])
def test_tables_that_there_are_not_are_not_looked_at(tables):
    with pytest.raises(BadMessage, match="tables"):
        Looks(KeptLogs(), False).look({}, tables)
