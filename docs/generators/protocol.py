"""The page of the protocol: the specification beside the schema, with its links as the site's."""

from __future__ import annotations

import os
import re

from generators.markdown import ROOT

SPECIFICATION = ROOT / "protocol/README.md"
_LINK = re.compile(r"\[([^\]]*)\]\((?!https?://|#)([^)#\s]+)(#[^)\s]*)?\)")


def page() -> str:
    """Return the specification, with links relative to `docs/reference`."""
    return _LINK.sub(_moved, SPECIFICATION.read_text(encoding="utf-8"))


def _moved(link: re.Match[str]) -> str:
    """Return a link as the site has it; only the text for pages outside the site."""
    target = (SPECIFICATION.parent / link[2]).resolve()
    if target.suffix == ".md" and not target.is_relative_to(ROOT / "docs"):
        return link[1]
    return f"[{link[1]}]({os.path.relpath(target, ROOT / 'docs/reference')}{link[3] or ''})"
