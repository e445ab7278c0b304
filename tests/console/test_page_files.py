"""The files of the pages: what they are made of, how long they are, what they may not say."""

import hashlib
import re
import shutil
import sys
import tomllib
from pathlib import Path

import pytest
from helpers.paths import ROOT
from helpers.processes.patience import run

from dva_sim.console.pages import palette

HERE = Path(__file__).parent
STATIC = ROOT / "dva_sim" / "console" / "static"
OWN = sorted((STATIC / "js").rglob("*.js"))
TYPES = STATIC / "js" / "lines.js"  # written from the declarations
VENDORED = {"shipped": STATIC / "vendor", "tests": HERE / "browser" / "vendor"}
LIST = tomllib.loads((HERE / "vendor.toml").read_text())
IMPORT = re.compile(
    r"^(?:import|export)\b[^;]*?from '([^']+)';|^import '([^']+)';|\bimport\('([^']+)'\)",
    re.MULTILINE,
)


def test_vendored_files_are_those_of_the_list():
    found = {
        f"{place}/{file.name}": hashlib.sha256(file.read_bytes()).hexdigest()
        for place, folder in VENDORED.items()
        for file in folder.iterdir()
        if not file.name.endswith(".d.ts")
    }

    assert found == LIST["written"]


def test_every_vendored_package_that_is_shipped_has_its_licence():
    licences = (VENDORED["shipped"] / "LICENSES.txt").read_text()
    for package in LIST["package"]:
        title = f"{package['name']} {package['version']} ({package['licence']})"
        assert (title in licences) != package.get("only_tests", False)


def test_colours_are_those_that_the_palette_writes():
    """`python -m dva_sim.console.pages.palette` writes them again."""
    for name, text in palette.FILES.items():
        assert (STATIC / name).read_text(encoding="utf-8") == text(), name


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_what_is_to_be_read_stands_out(theme):
    colours = palette.palettes()[theme]
    for front, ground, least in palette.NEEDED:
        assert palette.contrast(colours[front], colours[ground]) >= least, (front, ground)


def test_contrast_is_that_of_the_standard():
    assert palette.contrast("#ffffff", "#000000") == pytest.approx(21)
    assert palette.contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


def test_colours_are_named_only_in_the_palette():
    """Black and white over pictures aside, which are the same in both themes."""
    allowed = {"#000", "#fff", "#8a0000"}
    for file in [*OWN, *(STATIC / "css").iterdir()]:
        if file.name != "palette.js":
            found = set(re.findall(r"#[0-9a-f]{3}(?:[0-9a-f]{3})?\b", file.read_text()))
            assert found <= allowed, file


UNSAFE = re.compile(r"innerHTML|outerHTML|AdjacentHTML|dangerouslySet|document\.write|https?://")


def test_modules_of_the_pages_say_what_they_are_for_and_write_no_html():
    for file in OWN:
        text = file.read_text(encoding="utf-8")
        assert text.startswith(("/**", "//")), file
        assert not UNSAFE.search(text), file
        assert file == TYPES or len(text.splitlines()) <= 300, file


CONDITIONAL_BUTTON = re.compile(r"(?:&&|\?|:) html`\s*<button[^>]*?>", re.DOTALL)


def test_a_button_that_comes_and_goes_never_becomes_another_one():
    # Preact turns a button without a key into its neighbour, under a finger or with the focus.
    buttons = [(file, tag) for file in OWN for tag in CONDITIONAL_BUTTON.findall(file.read_text())]
    assert len(buttons) > 15
    assert [(file.name, tag) for file, tag in buttons if "key=" not in tag] == []


def imports(file: Path) -> set[Path]:
    """Own modules that a module imports."""
    found = {"".join(names) for names in IMPORT.findall(file.read_text())}
    return {(file.parent / name).resolve() for name in found if "vendor" not in name}


def test_no_module_of_the_pages_is_part_of_a_circle():
    left = {file.resolve(): imports(file) for file in OWN}
    assert all(path in left for paths in left.values() for path in paths)

    while ends := [file for file, needs in left.items() if not needs & left.keys()]:
        for file in ends:
            del left[file]

    assert not left


def test_every_module_and_icon_of_the_pages_is_used():
    pages = "".join(file.read_text() for file in STATIC.glob("*.html"))
    begins = {(STATIC / name).resolve() for name in re.findall(r'src="/static/([^"]+)"', pages)}
    used = {path for file in OWN for path in imports(file)} | begins
    assert {file for file in OWN if file.resolve() not in used} == set()  # types by comments

    sprite = (STATIC / "vendor" / "icons.svg").read_text()
    names = set(re.findall(r'<symbol id="([^"]+)"', sprite))
    texts = "".join(file.read_text() for file in OWN)
    assert {name for name in names if f"'{name}'" in texts or f'"{name}"' in texts} == names


@pytest.mark.system
def test_types_of_the_pages_hold():
    own = Path(sys.prefix) / "node_modules" / ".bin"
    tsc = shutil.which("tsc", path=str(own)) or shutil.which("tsc")
    if tsc is None:
        pytest.skip("TypeScript is missing (make tools)")
    ended = run([tsc, "-p", str(HERE / "typing")], capture_output=True, text=True)

    assert ended.stdout == ""
    assert ended.returncode == 0
