"""Sphinx configuration: Markdown pages, generated reference, no address outside the site."""

from importlib.metadata import version as installed_version

project = "dva-sim"
author = "The dva-sim authors"
project_copyright = author
version = release = installed_version("dva-sim")

extensions = ["myst_parser", "sphinx_copybutton", "sphinx_design"]
myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "fieldlist"]
myst_heading_anchors = 3
copybutton_prompt_text = r"\$ |>>> |\.\.\. "
copybutton_prompt_is_regexp = True
include_patterns = ["index.md", "*/*.md", "*/*/*.md"]

html_theme = "furo"
html_title = f"dva-sim {version}"
html_copy_source = False
html_show_sphinx = False
