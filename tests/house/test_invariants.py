"""The rules that are written down are those that tests guard."""

import re

from helpers.paths import ROOT


def test_each_invariant_is_cited_by_a_test_and_each_citation_is_one():
    page = (ROOT / "docs/explanation/safety-rules.md").read_text(encoding="utf-8")
    written = set(re.findall(r"^- \*\*(S\d+)\*\*", page, re.MULTILINE))
    assert len(written) == 15
    tests = [path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py")]
    cited = {name for text in tests for name in re.findall(r'mark\.invariant\("(\w+)"\)', text)}
    assert cited == written
