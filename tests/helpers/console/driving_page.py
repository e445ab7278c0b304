"""The page for driving: taking a robot, starting, and giving it back."""

from helpers.processes.patience import becomes
from playwright.sync_api import Page, expect

LOOK_MS = 300  # interval of checks whether a robot is driven [ms]


def take(page: Page) -> None:
    """Take control of the robots that are chosen."""
    page.get_by_role("button", name="Take control").click()
    expect(page.get_by_role("button", name="Release control")).to_be_enabled()


def start(page: Page, look_ms: float = LOOK_MS) -> None:
    """Begin to drive; on a machine that does much else, robots are held now and then."""
    mode = page.get_by_role("status", name="Mode")
    button = page.get_by_role("button", name="Start", exact=True)

    def is_driven() -> bool:
        if "Teleoperation" in mode.inner_text():
            return True
        if button.is_enabled():
            button.click()
        page.wait_for_timeout(look_ms)
        return False

    assert becomes(is_driven)


def release(page: Page) -> None:
    """Give all robots back."""
    page.get_by_role("button", name="Release control").click()
    expect(page.get_by_role("button", name="Take control")).to_be_enabled()


def free_all(page: Page) -> None:
    """Release all robots that an emergency holds."""
    page.get_by_role("button", name="Release robot").first.click()
    expect(page.locator(".emergency-bar")).to_have_count(0)
