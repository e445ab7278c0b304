"""A short search, and proof that the search finds what is wrong."""

import importlib.util
import os
import re
import shutil
import sys

import pytest
from helpers.paths import ROOT
from helpers.processes import patience

pytestmark = [
    pytest.mark.soak,
    pytest.mark.skipif(
        importlib.util.find_spec("atheris") is None,
        reason="atheris guides the search; it is not to be had for this platform",
    ),
]


def search(root, folder, *options):
    """Run the search on the program that lies in a root; what it leaves goes to the folder."""
    script = root / "tests" / "fuzz" / "fuzz_decode.py"
    return patience.run(
        [sys.executable, str(script), *options],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        check=False,
    )


def coverage(output):
    return [int(number) for number in re.findall(r"\bcov: (\d+)", output)]


def test_a_short_search_finds_nothing_wrong(tmp_path):
    done = search(ROOT, tmp_path, "-runs=20000", "-seed=1")
    assert done.returncode == 0, done.stderr[-3000:]
    assert "Done 20000 runs" in done.stderr
    assert coverage(done.stderr)[-1] > 100  # else the program is not instrumented
    assert not list(tmp_path.iterdir())


def test_bytes_that_take_new_branches_are_kept_in_the_folder_given(tmp_path):
    corpus = tmp_path / "corpus"
    corpus.mkdir()
    done = search(ROOT, tmp_path, "-runs=3000", "-seed=1", str(corpus))
    assert done.returncode == 0, done.stderr[-3000:]
    assert list(corpus.iterdir())  # branches beyond those of the samples


@pytest.mark.parametrize(
    ("file", "right", "wrong"),
    [
        ("codec.py", '_real("[0-9]{1,2}")', '_real("[0-9]{1,3}")'),
        ("schema.py", 'len(tags) != rest.count(b"<")', "False"),
        ("elements.py", "destination, number, source,", "source, number, destination,"),
    ],
    ids=["bound", "markup", "fields"],
)
def test_the_search_finds_a_fault_put_into_the_decoder(tmp_path, file, right, wrong):
    broken = tmp_path / "broken"
    for folder in ("dva_sim", "protocol", "tests/fuzz", "tests/helpers"):
        shutil.copytree(ROOT / folder, broken / folder)
    shutil.copy(ROOT / "pyproject.toml", broken)
    path = broken / "dva_sim" / "protocol" / file
    assert right in path.read_text()
    path.write_text(path.read_text().replace(right, wrong))
    done = search(broken, tmp_path, "-runs=200000", "-seed=1")
    assert done.returncode != 0
    assert "Uncaught Python exception" in done.stdout + done.stderr
    assert list(tmp_path.glob("crash-*"))
