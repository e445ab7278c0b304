"""Users who log in: their role, their name, the end of a login, and attempts that are slowed."""

import asyncio
import json
from urllib.parse import urlencode

import pytest
from helpers.console.served_console import serving
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from dva_sim.console.web.access import Tokens, rules
from dva_sim.console.web.actions import NotAllowed, check_role
from dva_sim.console.web.hub import LOGIN_OVER
from dva_sim.console.web.logins import FREE_TRIES, LASTS, MAX_WAIT, Logins, TooSoon
from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.roles import Role
from dva_sim.serving.users import ROLES, UserFile

PASSWORD = "correct horse"
FORM = "application/x-www-form-urlencoded"


@pytest.fixture(scope="module")
def users(tmp_path_factory):
    kept = UserFile(tmp_path_factory.mktemp("users") / "users.json")
    for role in ROLES:
        kept.add(f"{role}-er", role, PASSWORD)
    kept.add("gone", "supervise", PASSWORD)
    kept.change("gone", locked=True)
    return kept


class Watch:
    """A time that a test sets."""

    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def watch():
    return Watch()


@pytest.fixture
def logins(users, watch):
    return Logins(users.path, watch)


@pytest.fixture
def unhashed(monkeypatch):
    """Passwords that are compared as they are, at once: a hash takes its time on purpose."""
    compare = "dva_sim.console.web.logins.is_password_of"
    monkeypatch.setattr(compare, lambda _, password: password == PASSWORD)


def log_in(logins, name, password=PASSWORD, address="10.0.0.1"):
    return asyncio.run(logins.log_in(name, password, address))


# --- who is in ---------------------------------------------------------------------------------


@pytest.mark.parametrize("role", ROLES)
def test_a_user_may_do_what_the_token_of_the_role_may_and_no_more(logins, role):
    entrance = rules("127.0.0.1", 8123, tokens=Tokens.drawn(), logins=logins)
    token = log_in(logins, f"{role}-er")
    by_login = entrance.role({"cookie": f"{entrance.login_cookie}={token}"}, {})
    by_token = entrance.role({}, {"token": entrance.tokens.of(Role[role.upper()])})
    assert by_login is by_token is Role[role.upper()]
    for name, action in ACTIONS.items():
        if by_login < action.role:
            with pytest.raises(NotAllowed):
                check_role(by_login, name)
        else:
            check_role(by_login, name)


@pytest.mark.parametrize(
    ("name", "password"),
    [("drive-er", "Correct horse"), ("drive-er", ""), ("nobody", PASSWORD), ("gone", PASSWORD)],
)
def test_whose_name_and_password_do_not_fit_is_not_let_in(logins, name, password):
    assert log_in(logins, name, password) is None


def test_a_login_ends_by_itself_by_its_user_and_when_the_user_is_locked(
    unhashed, users, logins, watch
):
    tokens = [log_in(logins, name) for name in ("look-er", "drive-er", "dispatch-er")]
    assert len(set(tokens)) == 3
    logins.log_out(tokens[0])
    assert logins.user_of(tokens[0]) is None
    users.change("drive-er", locked=True)
    watch.now += 2.0
    assert logins.user_of(tokens[1]) is None
    users.change("drive-er", locked=False)
    assert logins.user_of(tokens[2]).name == "dispatch-er"
    watch.now += LASTS
    assert logins.user_of(tokens[2]) is None


def test_a_new_role_counts_at_once(unhashed, users, logins, watch):
    token = log_in(logins, "look-er")
    users.change("look-er", role="drive")
    watch.now += 2.0
    assert logins.user_of(token).role == "drive"
    users.change("look-er", role="look")


def test_attempts_that_fail_are_slowed_by_name_and_by_address(unhashed, logins, watch):
    for _ in range(FREE_TRIES + 1):
        assert log_in(logins, "drive-er", "wrong password") is None
    for name, address in (("drive-er", "10.0.0.2"), ("look-er", "10.0.0.1")):
        with pytest.raises(TooSoon):
            log_in(logins, name, address=address)
    assert log_in(logins, "look-er", address="10.0.0.2")  # neither of them
    watch.now += MAX_WAIT
    assert log_in(logins, "drive-er")


def test_a_wait_grows_and_has_an_end(unhashed, logins, watch):
    waits = []
    for _ in range(FREE_TRIES + 8):
        try:
            log_in(logins, "drive-er", "wrong password")
        except TooSoon as error:
            waits.append(error.wait_s)
            watch.now += error.wait_s
            log_in(logins, "drive-er", "wrong password")
    assert waits == sorted(waits)
    assert waits[0] < 5.0
    assert waits[-1] == pytest.approx(MAX_WAIT)


def test_under_https_the_cookie_goes_nowhere_else(logins):
    phones = rules("127.0.0.1", 8766, tokens=Tokens.drawn(), secure=True, logins=logins)
    assert "Secure" in phones.cookie_of_login("token").split("; ")


# --- over http ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def console(users):
    with serving("--users", str(users.path)) as served:
        yield served


def post(console, path, origin="own", cookie="", **fields):
    own = f"http://127.0.0.1:{console.port}"
    headers = {"Content_Type": FORM, "Origin": own if origin == "own" else origin}
    if cookie:
        headers["Cookie"] = cookie
    return console.ask(path, "POST", urlencode(fields).encode(), **headers)


def cookie_of(answer):
    return answer.headers["set-cookie"].partition(";")[0]


def logged_in(console, name):
    answer = post(console, "/login", name=name, password=PASSWORD)
    assert (answer.status, answer.headers["location"]) == (303, "/")
    return cookie_of(answer)


def state_socket(console, cookie):
    return connect(
        f"ws://127.0.0.1:{console.port}/ws/state",
        origin=f"http://127.0.0.1:{console.port}",
        additional_headers={"Cookie": cookie},
        compression=None,
    )


def reason_of_end(page):
    """Read until the server closes a socket, and return its reason."""
    try:
        while True:
            page.recv(30)
    except ConnectionClosed as closed:
        return closed.rcvd.reason


def test_a_page_without_a_login_leads_to_the_form_and_from_there_back(console):
    answer = console.ask("/guard")
    assert (answer.status, answer.headers["location"]) == (303, "/login?next=/guard")
    form = console.ask("/login?next=/guard")
    assert b'action="/login?next=/guard"' in form.body
    assert "form-action 'self'" in form.headers["content-security-policy"]
    back = post(console, "/login?next=/guard", name="phone-er", password=PASSWORD)
    assert (back.status, back.headers["location"]) == (303, "/guard")
    elsewhere = post(console, "/login?next=//evil.example", name="look-er", password=PASSWORD)
    assert elsewhere.headers["location"] == "/"


def test_the_cookie_is_kept_from_scripts_and_other_sites(console):
    answer = post(console, "/login", name="look-er", password=PASSWORD)
    parts = answer.headers["set-cookie"].split("; ")
    assert {"HttpOnly", "SameSite=Strict", "Path=/", f"Max-Age={round(LASTS)}"} <= set(parts)
    assert "Secure" not in parts  # this port is no https


def test_a_form_of_another_site_is_refused(console):
    strange = post(console, "/login", "http://evil.example", name="look-er", password=PASSWORD)
    assert strange.status == 403
    cookie = logged_in(console, "drive-er")
    assert post(console, "/logout", "http://evil.example", cookie).status == 403
    assert console.ask("/api/state", Cookie=cookie).status == 200


@pytest.mark.parametrize(
    ("body", "kind", "status"),
    [
        (b"name=a&password=" + b"x" * 5000, FORM, 413),
        (b"{}", "application/json", 415),
        (b"\xff\xfe", FORM, 400),
        (b"", FORM, 403),
    ],
)
def test_what_is_no_form_is_refused(console, body, kind, status):
    own = f"http://127.0.0.1:{console.port}"
    answer = console.ask("/login", "POST", body, Content_Type=kind, Origin=own)
    assert answer.status == status


def test_a_wrong_password_shows_the_form_again_with_nothing_that_acts(console):
    answer = post(console, "/login", name='"><script>', password="wrong password")
    assert answer.status == 403
    assert b"<script" not in answer.body
    assert b"do not fit" in answer.body


def test_a_page_has_the_name_of_its_user_and_closes_when_the_login_is_over(console):
    cookie = logged_in(console, "dispatch-er")
    console.asked_so_far()
    with state_socket(console, cookie) as page:
        you = json.loads(page.recv(30))
        assert (you["user"], you["role"]) == ("dispatch-er", "dispatch")
        assert console.next_asked("here")["users"] == {you["client"]: "dispatch-er"}
        assert post(console, "/logout", cookie=cookie).headers["location"] == "/login"
        assert reason_of_end(page) == LOGIN_OVER
    assert console.ask("/api/state", Cookie=cookie).status == 401


def test_a_token_still_opens_the_console_for_programs(console):
    assert console.ask("/api/state", token=console.drive).status == 200
    assert console.ask("/api/state", Cookie=f"dva_sim_{console.port}_login=guessed").status == 401


def test_who_fails_again_and_again_waits_and_is_told_how_long(console):
    answers = [post(console, "/login", name="x", password="wrong password") for _ in range(5)]
    assert answers[-1].status == 429
    assert int(answers[-1].headers["retry-after"]) >= 1
