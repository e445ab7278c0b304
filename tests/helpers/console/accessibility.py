"""Accessibility faults of a page, found by axe-core."""

import json

from helpers.paths import TESTS
from playwright.sync_api import Page

AXE = (TESTS / "console/browser/vendor/axe.min.js").read_text()
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]


def faults(page: Page) -> list[str]:
    """Faults that axe-core calls serious or worse."""
    page.evaluate(AXE)
    options = json.dumps(
        {"runOnly": {"type": "tag", "values": RULES}, "resultTypes": ["violations"]}
    )
    found = page.evaluate(f"axe.run(document, {options})")["violations"]
    grave = [fault for fault in found if fault["impact"] in {"serious", "critical"}]
    return [f"{fault['id']}: {node['html'][:160]}" for fault in grave for node in fault["nodes"]]
