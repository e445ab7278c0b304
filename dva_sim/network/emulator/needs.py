"""The requirements of an emulated link, and the error where one of them is missing."""

from dva_sim.kernel.errors import DvaSimError

NEEDS = (
    "needs Linux, /dev/net/tun open for reading and writing, and network namespaces "
    "(as root, or where unprivileged user namespaces are allowed)"
)


class EmulatorError(DvaSimError):
    """A run on the emulated link came to nothing; another one may succeed."""
