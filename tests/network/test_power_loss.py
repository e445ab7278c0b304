"""A peer that lost its power, without closing a connection, is heard and asked once it is back."""

import json
import os
import shutil
import subprocess
import sys

import pytest
from helpers.network import power_loss
from helpers.processes.patience import run

pytestmark = pytest.mark.system

# Whoever is not root is root of a namespace of users, where the system lets them.
SEPARATE = ["unshare", "--net", *([] if os.geteuid() == 0 else ["--user", "--map-root-user"])]


def may_separate() -> bool:
    """True if this machine lets a program have a network of its own."""
    if not all(map(shutil.which, ("unshare", "nsenter", "ip"))):
        return False
    bridge = [*SEPARATE, "ip", "link", "add", "bridge", "type", "bridge"]
    return subprocess.run(bridge, capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(not may_separate(), reason="needs network namespaces: unshare, nsenter and ip")
def test_it_is_heard_again_and_the_first_request_reaches_it():
    program = [*SEPARATE, sys.executable, power_loss.__file__]
    done = run(program, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": "tests"})
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == [True] * 5
