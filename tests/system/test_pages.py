"""What the pages show as code does what they say."""

import pytest
from helpers.paths import ROOT

from dva_sim.agents.operator.strategies import load_strategy
from dva_sim.testing.operators import check_operator
from dva_sim.testing.promises import tried

pytestmark = pytest.mark.system

PAGES = ROOT


def test_the_operator_on_the_page_of_agents_keeps_its_promises(tmp_path):
    page = (PAGES / "agents/README.md").read_text(encoding="utf-8")
    blocks = [part.partition("```")[0] for part in page.split("```python\n")[1:]]
    (code,) = [block for block in blocks if "class Cautious" in block]
    (tmp_path / "mine.py").write_text(code, encoding="utf-8")
    outcome = tried(check_operator, load_strategy("mine.py:Cautious", base=tmp_path), slow=60.0)
    assert outcome.broken == ()
