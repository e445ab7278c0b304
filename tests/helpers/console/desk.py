"""The page Events, and the actions of a person who decides there."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from helpers.processes.patience import becomes
from playwright.sync_api import Locator, Page, expect

ASKS = "--set", "dispatch.mode=ask_first"
"""Arguments for a console whose policy sends nobody by itself."""
NOTHING_YET = "--set", "events=[{kind: fire, at_s: 5000, latest_s: 5000}]"
"""Arguments for a console with only the events that a test raises."""
NUMBERS = "rows => rows.map(row => row.dataset.event)"


def row_of(page: Page, number: int) -> Locator:
    """Row of an event, which selects it."""
    return page.get_by_role("button", name=re.compile(f"^Event {number} "))


def sends(page: Page, label: str = "") -> Locator:
    """Button that sends a unit, with its time to arrival."""
    return page.get_by_role("button", name=re.compile(rf"^Send {label}.* (s|min)$"))


def choose(page: Page, number: int) -> None:
    """Select an event, and wait for the policy's proposal, which moves all buttons down."""
    row_of(page, number).click()
    panel = page.get_by_role("region", name="Event in hand")
    expect(panel.get_by_role("heading", level=2)).to_contain_text(f"{number} ")
    expect(panel.get_by_role("region", name="Proposal")).to_contain_text("The policy proposes")
    expect(sends(page)).to_be_enabled()


def another(page: Page) -> str:
    """Choose a free guard whom the policy does not propose; return the label."""
    guard = page.locator(".candidate").filter(has_text=re.compile("guard-.*free")).last
    guard.get_by_role("radio").check()
    return guard.locator("span").first.inner_text()


def raised(page: Page, kind: str = "fire", room: str = "") -> int:
    """Raise an event for this test alone; return its number."""
    page.get_by_role("button", name="Raise an event").click()
    page.get_by_label("Kind").select_option(label=kind)
    if room:
        page.get_by_label("Room").select_option(label=room)
    with new_in_hand(page) as number:
        page.get_by_role("button", name="Raise event").click()
    return number()


@contextmanager
def new_in_hand(page: Page) -> Iterator[Callable[[], int]]:
    """The number of the event that the block raises, once it is in hand.

    Until the answer is here, another event may be in hand, even one of the same kind.
    """
    before = page.locator("[data-event]").evaluate_all(NUMBERS)
    heading = page.get_by_role("region", name="Event in hand").get_by_role("heading", level=2)
    number = 0
    yield lambda: number
    expect(heading).to_be_visible()
    assert becomes(
        lambda: (first := heading.inner_text().split()[0]).isdigit() and first not in before
    )
    number = int(heading.inner_text().split()[0])
    expect(sends(page)).to_be_enabled()  # with the proposal all buttons move down
