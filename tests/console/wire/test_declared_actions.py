"""One declaration for each action: what is checked, kept, waited for and shown follows from it."""

import inspect
import re
from importlib import import_module
from typing import Annotated, Literal, get_args, get_origin, get_type_hints

import pytest
from helpers.console.simulated_console import Page
from helpers.paths import ROOT

from dva_sim.console.asking.dispatcher import _KNOWN, ActionDispatcher
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.console.audit.audited import Audited
from dva_sim.console.pages.processes import ROLES
from dva_sim.console.simulator.robot_simulator import LoneRobotActions
from dva_sim.console.web.actions import check_role
from dva_sim.console.web.simulation import OutgoingLines
from dva_sim.console.wire import generated
from dva_sim.console.wire.actions import ACTIONS, Action, ActionPlace, Asked, Audit
from dva_sim.console.wire.arguments import FASTEST, LINK_LIMITS
from dva_sim.console.wire.kinds import BadMessage, Kind, hints_of
from dva_sim.console.wire.limits import ANSWER_WAIT_S, LONG
from dva_sim.console.wire.roles import Role
from dva_sim.network import realtime
from dva_sim.recordings.audit_log import read_rows

MODULES = [
    path for path in (ROOT / "dva_sim/console").rglob("*.py") if "    @does(" in path.read_text()
]
LABELS = {"robot-1": 0}
ASKED = [one for one in ACTIONS.values() if one.has_answer]
OWN = [one for one in ASKED if one.audit is Audit.OWN and ActionPlace.WORLD in one.at]


def example(hint):
    """Something that an annotation allows."""
    if get_origin(hint) is Literal:
        return get_args(hint)[0]
    if get_origin(hint) is not Annotated:
        inner = get_args(hint)
        return example(inner[0]) if inner else {bool: True, str: "x", int: 1}[hint]
    kind = next(one for one in hint.__metadata__ if isinstance(one, Kind))
    base, limits = get_args(hint)[0], kind._limits
    if "robots" in kind.words:
        return ["robot-1"]
    if "a robot" in kind.words:
        return "robot-1"
    if get_origin(base) is list:
        return [example(get_args(base)[0])] * limits["min_length"]
    return "x" * max(3, limits.get("min_length", 0)) if base is str else limits["ge"]


def arguments_of(action):
    hints = hints_of(action.arguments)
    return {name: example(hints[name]) for name in action.arguments.__required_keys__}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_what_does_an_action_has_its_arguments_by_their_declared_type(path):
    """Those that need more of a request, such as who asks, take it as it is."""
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    kinds = [one for one in vars(import_module(name)).values() if inspect.isclass(one)]
    methods = [one for kind in kinds for one in list(vars(kind).values()) if hasattr(one, "does")]
    assert methods
    for method in methods:
        given = get_type_hints(method).get("line", Asked)
        for does in method.does:
            assert given in (Asked, _KNOWN[does].arguments), (method, does)


@pytest.mark.parametrize("action", ACTIONS.values(), ids=lambda one: one.name)
def test_what_is_not_audited_says_why_and_what_is_takes_what_it_declares(action):
    assert isinstance(action.audit, Audit) or len(action.audit.split()) >= 3
    given = arguments_of(action)
    assert action.read(given, LABELS).keys() == given.keys()
    for name in given:
        left = {key: value for key, value in given.items() if key != name}
        with pytest.raises(BadMessage, match=f"{action.name}: {name} is missing"):
            action.read(left, LABELS)
        with pytest.raises(BadMessage, match=f"{action.name}: {name} should be"):
            action.read(given | {name: {}}, LABELS)
    with pytest.raises(BadMessage, match="no such argument"):
        action.read(given | {"other": 1}, LABELS)


@pytest.mark.parametrize("action", ASKED, ids=lambda one: one.name)
def test_optional_arguments_say_what_would_be_right(action):
    for name, hint in hints_of(action.arguments).items():
        good = action.read(arguments_of(action) | {name: example(hint)}, LABELS)
        assert name in good
        with pytest.raises(BadMessage, match=f"{name} should be") as error:
            action.read(arguments_of(action) | {name: object()}, LABELS)
        assert "object" not in str(error.value)


GRANTED = {  # what the docs say of each address: a phrase, and the actions that it means
    "Look only": {"sees everything": "event_details", "press the emergency stop": "emergency"},
    "Phone": {
        "drives a robot": "start stop input samples gone release confirm refute decline sense "
        "mission_order mission_cancel manual_release",
        "that the DVA gives it": "phone_register phone_devices phone_permission phone_calibrate",
        "reports events": "phone_report",
        "is a guard": "guard_join guard_leave guard_answer guard_go guard_say guard_place "
        "guard_report",
    },
    "Drive only": {
        "takes free robots": "take tour tour_time",
        "sets pattern, link and pace": "pattern link pace",
        "raises events": "event_raise event_proposal room_join",
        "moves and breaks robots by hand": "manual_take manual fault",
        "runs the DVA's server": "server_start server_stop fake_add fake_remove",
        "marks moments": "mark",
    },
    "Dispatch only": {
        "decides on events and alarms": "event_acknowledge event_assign event_take_off event_note "
        "event_false_alarm event_escalate alarm_acknowledge alarm_shelve alarm_unshelve",
        "sends robots": "mission mission_found",
        "hands work over": "hand_over hand_over_answer",
        "ticks instructions": "event_tick",
        "releases robots after an emergency": "release_emergency",
    },
    "Console": {
        "takes robots from others": "take_over revoke",
        "hands decisions to people or to the policy": "dispatch_mode",
        "gives regions back": "give_back",
    },
}
ADDRESSES = {"Console": "supervise", "Phone": "phone", **dict(ROLES)}
BULLET = re.compile(r"^- `([^`]+):` (.*?[;.]$)", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("address", ADDRESSES)
def test_the_docs_say_of_each_address_what_it_may_do_and_nothing_else(address):
    guide = (ROOT / "docs/how-to/control-room.md").read_text(encoding="utf-8")
    said = {name: " ".join(text.split()) for name, text in BULLET.findall(guide)}
    phrases, role = GRANTED[address], Role[ADDRESSES[address].upper()]
    assert said.keys() == ADDRESSES.keys()
    assert [phrase for phrase in phrases if phrase not in said[address]] == []
    at_a_run = ActionPlace.WORLD | ActionPlace.REMOTE
    own = {one.name for one in ACTIONS.values() if one.role is role and one.at & at_a_run}
    assert set(" ".join(phrases.values()).split()) == own
    for name in own:
        check_role(role, name)
        with pytest.raises(BadMessage):
            check_role(Role(role - 1), name)


@pytest.fixture(scope="module")
def audited(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        page = Page(patch)
        path = tmp_path_factory.mktemp("audit") / "audit.sqlite"
        keeper = AuditKeeper(path, lambda: page.world.clock.now, {})
        page.world.keep_audit(keeper)
        for action in OWN:
            head = {"do": action.name, "id": action.name, "client": f"c-{action.name}"}
            page.actions.take({**head, "role": "supervise", **arguments_of(action)})
        page.let(60.0)
        keeper.close()
        yield {row.action for row in read_rows(path)}


@pytest.mark.parametrize("action", OWN, ids=lambda one: one.name)
def test_each_action_of_people_has_a_row_done_or_refused(audited, action):
    assert action.name.replace("_", " ") in audited


def test_a_robot_alone_keeps_who_switched_it_off(tmp_path):
    from dva_sim.console.simulator.robot_simulator import scenario_of
    from dva_sim.console.simulator.robot_world import RobotWorld
    from dva_sim.options.runs import RobotOptions

    world = RobotWorld(scenario_of(RobotOptions()))
    keeper = AuditKeeper(tmp_path / "audit.sqlite", lambda: 1.0, {})
    world.keep_audit(keeper)
    for what in ("robot_listen", "robot_off", "fault"):
        about = arguments_of(ACTIONS[what])
        LoneRobotActions(world).take({"do": what, "id": what, "client": "c3-ab", **about})
    keeper.close()
    world.close()
    rows = {row.action: row for row in read_rows(tmp_path / "audit.sqlite")}
    assert (rows["robot off"].author, rows["robot off"].subject) == ("page c3", "robot-1")
    assert rows["robot listen"].outcome == "refused"
    assert rows["fault"].details["what"] == "processing"


def test_a_mark_stands_in_the_story_under_the_name_of_its_author(monkeypatch):
    page = Page(monkeypatch)
    assert page.do("take", robots=[0])[0]
    assert page.do("mark", text="the participant sighs")[0]
    page.let(0.2)
    shown = [(line["who"], line["what"], line["kind"]) for line in page.lines_of("story")]
    assert ("console-1", "marks: the participant sighs", "event") in shown
    assert not page.do("mark", text="two\nlines")[0]


def test_what_is_declared_for_a_place_has_to_be_done_there():
    with pytest.raises(TypeError, match="seek"):
        ActionDispatcher(ActionPlace.REPLAY, [], print, "nobody")


def test_an_audited_action_that_stops_nothing_waits_for_a_disk(monkeypatch):
    class Full:
        problem = "disk full"

    log = Audited(Full(), str, str)
    for action in ASKED:
        if isinstance(action.audit, str) or action.stops:
            assert log.answered(action.name, "c1", {}, print) is not None
        else:
            with pytest.raises(Exception, match="disk full"):
                log.answered(action.name, "c1", {}, print)


def test_pages_are_as_declared():
    """`python -m dva_sim.console.wire.generated` writes them again."""
    for name, text in generated.FILES.items():
        assert (generated.STATIC / name).read_text(encoding="utf-8") == text(), name


def test_pages_ask_for_nothing_that_is_not_declared():
    files = [*(generated.STATIC / "js").rglob("*.js")]
    found = {
        name
        for file in files
        for name in re.findall(r"\b(?:act|ask)\(\s*'(\w+)'", file.read_text(encoding="utf-8"))
    }
    assert len(found) > 30
    assert found <= ACTIONS.keys()


def test_limits_are_those_of_what_they_limit():
    assert realtime.FASTEST == FASTEST
    with pytest.raises(BadMessage, match="from 0 to 5"):
        ACTIONS["link"].read({"delay_s": LINK_LIMITS["delay_s"][1] + 0.1})
    assert [ACTIONS[name].patience for name in ("take", "link")] == [LONG, ANSWER_WAIT_S]


def test_a_hand_at_a_window_waits_as_one_at_the_stick_does():
    lines = OutgoingLines()
    for n in range(100):
        assert lines.put({"do": "manual", "client": "c1", "n": n})
    assert b'"n":99' in (lines.next() or b"")
    assert lines.next() is None
    lines.put({"do": "manual", "client": "c1", "n": 1})
    lines.put({"do": "gone", "client": "c1"})
    assert b"gone" in (lines.next() or b"")
    assert lines.next() is None


def test_a_new_action_needs_no_more_than_its_declaration():
    action = Action("wave", "waves")
    assert (action.audit, action.patience, action.read({})) == (Audit.OWN, ANSWER_WAIT_S, {})
