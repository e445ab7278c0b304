"""Fetch what the console's pages stand on, check it, and write it as the files that are shipped.

    .venv/bin/python tests/console/vendoring.py

Needs node and npm, which neither the program nor its other tests do. `vendor.toml` says what;
a tarball or a written file that differs from its hash there is refused. After a change of version,
`--accept` notes the new hashes of the written files.
"""

import hashlib
import re
import subprocess
import sys
import tarfile
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
LIST = HERE / "vendor.toml"
SHIPPED = HERE.parents[1] / "dva_sim" / "console" / "static" / "vendor"
FOR_TESTS = HERE / "browser" / "vendor"
_NEWEST_SYNTAX = "es2022"


class Differs(Exception):
    """A file is not what the list says."""


def read_list() -> dict[str, Any]:
    """Read the list of vendored files."""
    return tomllib.loads(LIST.read_text())


def sha256(data: bytes) -> str:
    """Hash as the list notes it."""
    return hashlib.sha256(data).hexdigest()


def written_files() -> dict[str, bytes]:
    """Files now in the folders, by the names of the list."""
    places = {"shipped": SHIPPED, "tests": FOR_TESTS}
    files = [(place, file) for place, folder in places.items() for file in folder.iterdir()]
    own = ".d.ts"  # types of what the console uses of them: our words, not theirs
    return {f"{p}/{file.name}": file.read_bytes() for p, file in files if own not in file.name}


def fetch(package: dict[str, Any], folder: Path) -> Path:
    """Unpack a package into `node_modules` below a folder, once its tarball has been checked.

    Raises:
        Differs: the tarball is another one.
    """
    wanted = f"{package['name']}@{package['version']}"
    subprocess.run(["npm", "pack", "--silent", wanted], cwd=folder, check=True, capture_output=True)
    data = (folder / package["tarball"]).read_bytes()
    if sha256(data) != package["sha256"]:
        raise Differs(f"{package['tarball']}: sha256 is {sha256(data)}, not {package['sha256']}")
    home = folder / "node_modules" / package["name"]
    home.mkdir(parents=True)
    with tarfile.open(folder / package["tarball"]) as tar:
        tar.extractall(folder / "unpacked" / package["name"], filter="data")
    (folder / "unpacked" / package["name"] / "package").rename(home)
    return home


def sprite(folder: Path, names: list[str]) -> bytes:
    """All icons as symbols of one file."""
    symbols = [_symbol(name, (folder / f"{name}.svg").read_text()) for name in names]
    head = '<svg xmlns="http://www.w3.org/2000/svg">\n'
    return (head + "\n".join(symbols) + "\n</svg>\n").encode()


def _symbol(name: str, svg: str) -> str:
    inner = svg.partition("<svg")[2].partition(">")[2].partition("</svg>")[0]
    inner = re.sub(r"\s+", " ", inner).replace("> <", "><").strip()
    look = 'fill="none" stroke="currentColor" stroke-width="2" stroke-linecap="round"'
    return (
        f'<symbol id="{name}" viewBox="0 0 24 24"><g {look} stroke-linejoin="round">'
        f"{inner}</g></symbol>"
    )


def bundle(part: dict[str, Any], folder: Path) -> bytes:
    """One module without imports, minified."""
    entry, out = folder / "entry.js", folder / part["file"]
    entry.write_text(part["entry"])
    command = ["npx", "--no-install", "esbuild", str(entry), "--bundle", "--format=esm", "--minify"]
    more = [f"--target={_NEWEST_SYNTAX}", "--legal-comments=none", f"--outfile={out}"]
    subprocess.run(command + more, cwd=folder, check=True, capture_output=True)
    return out.read_bytes()


def licences(packages: list[dict[str, Any]], homes: dict[str, Path]) -> bytes:
    """Licences of the vendored files."""
    parts = []
    for package in packages:
        text = (homes[package["name"]] / "LICENSE").read_text().strip()
        title = f"{package['name']} {package['version']} ({package['licence']})"
        parts.append(f"{title}\n{'=' * len(title)}\n\n{text}\n")
    return "\n\n".join(parts).encode()


def made(folder: Path) -> Iterator[tuple[str, bytes]]:
    """All files, by `shipped/...` or `tests/...`."""
    listed = read_list()
    homes = {package["name"]: fetch(package, folder) for package in listed["package"]}
    bundler = f"esbuild@{listed['bundler']}"
    subprocess.run(["npm", "install", "--no-save", "--silent", bundler, "--prefix", "tools"],
                   cwd=folder, check=True, capture_output=True)  # fmt: skip
    (folder / "node_modules" / ".bin").symlink_to(folder / "tools" / "node_modules" / ".bin")
    for package in listed["package"]:
        where = "tests" if package.get("only_tests") else "shipped"
        for source, name in package.get("copies", {}).items():
            yield f"{where}/{name}", (homes[package["name"]] / source).read_bytes()
        if "icons" in package:
            yield "shipped/icons.svg", sprite(homes[package["name"]] / "icons", package["icons"])
    for part in listed["bundle"]:
        yield f"shipped/{part['file']}", bundle(part, folder)
    shipped = [package for package in listed["package"] if not package.get("only_tests")]
    yield "shipped/LICENSES.txt", licences(shipped, homes)


def write(files: dict[str, bytes], accept: bool) -> None:
    """Put the files where they belong.

    Raises:
        Differs: a file is not the one of the list.
    """
    hashes = {name: sha256(data) for name, data in files.items()}
    if accept:
        _note(hashes)
    elif hashes != (noted := read_list()["written"]):
        wrong = sorted({*hashes.items()} ^ {*noted.items()})
        raise Differs(f"not as in {LIST.name}: {', '.join({name: '' for name, _ in wrong})}")
    for name, data in files.items():
        place, _, file = name.partition("/")
        folder = SHIPPED if place == "shipped" else FOR_TESTS
        folder.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(data)


def _note(hashes: dict[str, str]) -> None:
    kept = LIST.read_text().partition("\n[written]\n")[0].rstrip("\n")
    lines = [f'"{name}" = "{value}"' for name, value in sorted(hashes.items())]
    LIST.write_text("\n".join([kept, "", "[written]", *lines, ""]))


def main() -> None:
    """Do all of it."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            write(dict(made(Path(folder))), "--accept" in sys.argv[1:])
        except (Differs, OSError, subprocess.CalledProcessError) as error:
            sys.exit(f"vendoring: {error}")


if __name__ == "__main__":
    main()
