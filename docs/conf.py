"""Sphinx configuration: Markdown pages, generated reference, no address outside the site."""

import re
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

sys.path.insert(0, str(Path(__file__).parent))

import generators
from search_words import WORDS

project = "dva-sim"
author = "The dva-sim authors"
project_copyright = author
version = release = installed_version("dva-sim")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
]
napoleon_use_ivar = True
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
default_role = "code"  # docstrings write code between single backticks
myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "fieldlist"]
myst_heading_anchors = 3
copybutton_prompt_text = r"\$ |>>> |\.\.\. "
copybutton_prompt_is_regexp = True
include_patterns = ["index.md", "*/*.md", "*/*/*.md"]

html_theme = "furo"
html_title = f"dva-sim {version}"
html_copy_source = False
html_show_sphinx = False
html_search_scorer = str(Path(__file__).parent / "search_scorer.js")


def setup(app: Sphinx) -> None:
    """Write the generated pages before Sphinx looks for pages."""
    generators.write(Path(app.srcdir))
    app.connect("env-get-outdated", _outdated)
    app.connect("source-read", _lead_to_generated_pages)
    app.connect("source-read", _add_search_words)


def _outdated(
    _app: Sphinx, env: BuildEnvironment, added: set[str], changed: set[str], removed: set[str]
) -> set[str]:
    """Return all pages if the tree of pages has changed: each page shows it beside its text."""
    has_changed = added or removed or any(name.endswith("index") for name in changed)
    return set(env.found_docs) if has_changed else set()


# Links of pages as files lead to what is there without a build; a title names a place on the page.
_INDEX = re.compile(r'\]\(((?:\.\./reference/)?)index\.md#([\w-]+)(?: "([\w-]+)")?\)')
_STUDY = re.compile(r"\]\(\.\./\.\./experiments/([\w-]+)\.(?:yaml|md)\)")


def _lead_to_generated_pages(_app: Sphinx, _name: str, source: list[str]) -> None:
    """Let links to a section of the reference, or to a study, lead to the page of it."""

    def of_reference(link: re.Match[str]) -> str:
        folder, page, place = link.groups()
        known = f"reference/{page}.md" in generators.PAGES
        return f"]({folder}{page}.md{f'#{place}' if place else ''})" if known else link[0]

    def of_study(link: re.Match[str]) -> str:
        return f"](../results/{'index' if link[1] == 'README' else link[1]}.md)"

    source[0] = _STUDY.sub(of_study, _INDEX.sub(of_reference, source[0]))


def _add_search_words(_app: Sphinx, name: str, source: list[str]) -> None:
    """Let a page be found by words that it does not use."""
    if name in WORDS:
        source[0] = f"---\nmyst:\n  html_meta:\n    keywords: {WORDS[name]}\n---\n\n{source[0]}"
