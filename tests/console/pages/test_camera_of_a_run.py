"""Camera pictures of a run in real time, from the robot's lens to a player."""

import io
import json
import os
import signal
import subprocess
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.console.console_program import started
from helpers.processes.patience import PATIENCE_S, becomes
from helpers.processes.programs import all_gone_after
from PIL import Image

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, int]]:
    """The address of a console, and its process."""
    for programs in all_gone_after(tmp_path_factory.mktemp("console")):
        console, address = started(programs, "--no-token")
        yield address, console.process.pid


def picture(base: str, label: str = "robot-1", after: int = -1) -> bytes:
    """A picture that was taken after some time [ms], as soon as there is one."""
    found = list[bytes]()

    def look() -> bool:
        try:
            with urllib.request.urlopen(f"{base}camera/{label}.jpg", timeout=PATIENCE_S) as answer:
                if int(answer.headers["X-Frame-Time-Ms"]) > after:
                    found.append(answer.read())
        except urllib.error.HTTPError as error:
            error.close()  # there is none yet
        return bool(found)

    assert becomes(look)
    return found[-1]


def test_a_robot_shows_what_its_camera_sees(run):
    base, _ = run
    for label in ("robot-1", "robot-2"):
        image = Image.open(io.BytesIO(picture(base, label)))
        assert (image.format, image.size) == ("JPEG", (320, 240))
        assert len(image.getcolors(1 << 17)) > 100  # a view, and no empty field


def test_a_player_plays_the_stream_of_a_run(run, tmp_path):
    player = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    base, _ = run
    picture(base)
    words = [player, "-v", "error", "-i", f"{base}camera/robot-1.mjpg", "-frames:v", "10"]
    target = tmp_path / "frames"
    words += ["-f", "rawvideo", "-pix_fmt", "gray", str(target)]
    subprocess.run(words, check=True, timeout=PATIENCE_S)
    assert target.stat().st_size == 10 * 320 * 240


def drawing(pid: int) -> list[int]:
    """Processes that draw for a console."""
    folder = Path(f"/proc/{pid}/task/{pid}/children")
    if not folder.exists():
        pytest.skip("only Linux tells the children of a process")
    children = [int(word) for word in folder.read_text().split()]
    return [pid for pid in children if _draws(pid)]


def _draws(pid: int) -> bool:
    try:
        return b"console.pages.pictures" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def test_when_who_draws_is_killed_the_run_goes_on_and_another_draws(run):
    base, pid = run
    picture(base)
    (first,) = drawing(pid)
    os.kill(first, signal.SIGKILL)
    with urllib.request.urlopen(f"{base}api/state", timeout=PATIENCE_S) as answer:
        killed = round(1000 * json.load(answer)["time_s"])
    assert becomes(lambda: drawing(pid) not in ([], [first]))
    assert picture(base, after=killed)
