"""Pages for contributors: lengths, versions, forms, and the workflow of a public CI."""

import importlib.util
import re
import subprocess
import tomllib

import pytest
from helpers import page_runs
from helpers.paths import ROOT
from ruamel.yaml import YAML

FORMS = sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml"))
TEXT = {path.name: path.read_text(encoding="utf-8") for path in ROOT.glob("*.md")}


def read_yaml(path):
    return YAML(typ="safe").load(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("page", "most"), [("CONTRIBUTING.md", 700), ("RELEASING.md", 250), ("SECURITY.md", 650)]
)
def test_a_page_has_a_readable_length(page, most):
    assert len(TEXT[page].split()) <= most


def test_the_changelog_has_every_version_once_newest_first_and_sections_of_the_usual_kinds():
    versions = re.findall(r"^## \[(.+?)\]", TEXT["CHANGELOG.md"], re.MULTILINE)
    numbers = [tuple(map(int, version.split("."))) for version in versions[1:]]
    assert versions[0] == "Unreleased"
    assert numbers == sorted(set(numbers), reverse=True)
    kinds = set(re.findall(r"^### (.+)$", TEXT["CHANGELOG.md"], re.MULTILINE))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
    sections = TEXT["CHANGELOG.md"].split("\n## ")
    assert max(len(section.split()) for section in sections) <= 600


def release_check():
    path = ROOT / "tests/release_check.py"
    spec = importlib.util.spec_from_file_location("release_check", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_version_is_the_same_in_all_places_and_another_one_is_found(tmp_path):
    assert release_check().version_faults(ROOT) == []
    (tmp_path / "dva_sim").mkdir()
    for name in ("pyproject.toml", "CITATION.cff", "CHANGELOG.md", "dva_sim/__init__.py"):
        (tmp_path / name).write_text((ROOT / name).read_text(encoding="utf-8"))
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    project = (tmp_path / "pyproject.toml").read_text()
    (tmp_path / "pyproject.toml").write_text(project.replace(f'"{version}"', '"9.9.9"', 1))
    faults = release_check().version_faults(tmp_path)
    named = [fault.split()[0] for fault in faults]
    assert named == ["dva_sim/__init__.py", "CITATION.cff", "CHANGELOG.md"]


def test_what_a_release_is_tried_with_are_commands_of_the_program():
    for words in release_check().TRIED:
        page_runs.parse(list(words))


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "RELEASING.md", "SECURITY.md"])
def test_make_and_this_program_know_what_a_page_names(page):
    named = " ".join(re.findall(r"`([^`]+)`|^ *(?:make .*)$", TEXT[page].replace("\n", " ")))
    for target in set(re.findall(r"\bmake ([a-z-]+)", named)):
        tried = subprocess.run(["make", "-n", target], cwd=ROOT, capture_output=True, check=False)
        assert tried.returncode == 0, target
    files = re.findall(r"`((?:tests|dva_sim|docs|experiments)/[\w./-]+)`", TEXT[page])
    assert [file for file in files if not (ROOT / file).exists()] == []


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.stem)
def test_a_form_is_one_that_the_repository_page_can_show(path):
    form = read_yaml(path)
    if path.stem == "config":
        assert form == {"blank_issues_enabled": False}
        return
    assert {"name", "description", "body"} <= form.keys()
    assert all(field["attributes"].get("label") for field in form["body"] if "id" in field)
    kinds = {field["type"] for field in form["body"]}
    assert kinds <= {"markdown", "input", "textarea", "dropdown", "checkboxes"}


def test_the_public_ci_runs_what_everybody_can_run():
    workflow = read_yaml(ROOT / ".github/workflows/ci.yml")
    (job,) = workflow["jobs"].values()
    assert ".ci/run" in [step.get("run") for step in job["steps"]]
    assert (ROOT / ".ci/run").stat().st_mode & 0o100


def test_the_citation_names_the_licence_of_the_project():
    citation = read_yaml(ROOT / "CITATION.cff")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert citation["license"] == project["license"]
    assert citation["title"].startswith(project["name"])
