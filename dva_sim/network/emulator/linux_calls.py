"""The few calls of Linux that Python does not offer: namespaces, parent's death, priority, devices.

Only the C library is needed; the numbers are part of the kernel's stable interface (unshare(2),
prctl(2), user_namespaces(7), sched(7)).

What the kernel sends to a TUN device can be read here, what is written here it receives. It is set
up by ioctl and one rtnetlink message, so that no program has to be installed. A route holds the
congestion control, because some kernels refuse the sysctl in a namespace (netdevice(7),
rtnetlink(7), RFC 3549).
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import signal
import socket
import struct
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

CLONE_NEWUSER = 0x10000000
CLONE_NEWNET = 0x40000000
_PR_SET_PDEATHSIG = 1
_PR_SET_TIMERSLACK = 29


def enter_network_namespace() -> None:
    """Leave the network of the parent for a new and empty one that dies with its processes.

    Raises:
        OSError: forbidden here.
    """
    _check(_libc().unshare(CLONE_NEWNET), "a network namespace")


def become_owner(rootless: bool) -> str:
    """Be allowed to make network namespaces: as root, or as root of a new user namespace.

    Args:
        rootless: The latter also where the former would do.

    Returns:
        `root` or `user namespace`.

    Raises:
        OSError: neither is allowed here.
    """
    if not rootless:
        with suppress(PermissionError):
            enter_network_namespace()
            return "root"
    become_root_of_a_user_namespace()
    return "user namespace"


def become_root_of_a_user_namespace() -> None:
    """Be root among namespaces of one's own, and nowhere else.

    Raises:
        OSError: forbidden here.
    """
    user, group = os.getuid(), os.getgid()
    _check(_libc().unshare(CLONE_NEWUSER | CLONE_NEWNET), "a user namespace")
    Path("/proc/self/setgroups").write_text("deny", encoding="ascii")
    Path("/proc/self/uid_map").write_text(f"0 {user} 1", encoding="ascii")
    Path("/proc/self/gid_map").write_text(f"0 {group} 1", encoding="ascii")


def die_with_parent(parent: int) -> None:
    """Be killed when the process that started this one ends, however it ends.

    Args:
        parent: Its id, as it knows it: if it is gone already, this process ends here.
    """
    _check(_libc().prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0), "to die with the parent")
    if os.getppid() != parent:
        os._exit(1)


def be_punctual(priority: int) -> bool:
    """Ask for exact timers and real-time priority; whether the latter was granted."""
    _libc().prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    return os.sched_getscheduler(0) == os.SCHED_FIFO


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def _check(result: int, what: str) -> None:
    if result != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{what} is refused: {os.strerror(number)}")


MTU = 1500
_NAME = b"link"
_TUNSETIFF = 0x400454CA
_IFF_TUN, _IFF_NO_PI = 0x0001, 0x1000
_IFF_UP, _IFF_RUNNING = 0x1, 0x40
_SIOCSIFFLAGS, _SIOCSIFADDR, _SIOCSIFNETMASK = 0x8914, 0x8916, 0x891C
_SIOCGIFINDEX = 0x8933
_RTM_NEWROUTE = 24
_NLM_F_REQUEST, _NLM_F_ACK, _NLM_F_REPLACE, _NLM_F_CREATE = 0x1, 0x4, 0x100, 0x400
_NLMSG_ERROR = 2
_RT_TABLE_MAIN, _RTPROT_BOOT, _RT_SCOPE_LINK, _RTN_UNICAST = 254, 3, 253, 1
_RTA_DST, _RTA_OIF, _RTA_METRICS, _RTAX_CC_ALGO = 1, 4, 8, 16


@dataclass(frozen=True)
class End:
    """One end of the link.

    Attributes:
        address: Of this end.
        peer: Of the other one.
    """

    address: str
    peer: str


NEAR_END = End("10.77.0.1", "10.77.0.2")
FAR_END = End("10.77.0.2", "10.77.0.1")


def open_tun(end: End, congestion: str) -> int:
    """A TUN device of this namespace, up, with a route to the other end.

    Args:
        end: Addresses.
        congestion: Congestion control of all TCP over it, such as `cubic`.

    Returns:
        File descriptor that reads and writes whole IP packets, without waiting.

    Raises:
        OSError: there is no such device, it is forbidden, or the kernel has no such control.
    """
    tun = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(tun, _TUNSETIFF, struct.pack("16sH22x", _NAME, _IFF_TUN | _IFF_NO_PI))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        fcntl.ioctl(control, _SIOCSIFADDR, _address(end.address))
        fcntl.ioctl(control, _SIOCSIFNETMASK, _address("255.255.255.255"))
        fcntl.ioctl(control, _SIOCSIFFLAGS, struct.pack("16sH22x", _NAME, _IFF_UP | _IFF_RUNNING))
        index = fcntl.ioctl(control, _SIOCGIFINDEX, struct.pack("16s24x", _NAME))
    _add_route(end.peer, struct.unpack_from("i", index, 16)[0], congestion)
    return tun


def _address(text: str) -> bytes:
    """An `ifreq` with an IPv4 address."""
    return struct.pack("16sHH4s16x", _NAME, socket.AF_INET, 0, socket.inet_aton(text))


def _add_route(peer: str, index: int, congestion: str) -> None:
    metrics = _attribute(_RTAX_CC_ALGO, congestion.encode() + b"\0")
    body = struct.pack(
        "BBBBBBBBI",
        *(socket.AF_INET, 32, 0, 0),
        *(_RT_TABLE_MAIN, _RTPROT_BOOT, _RT_SCOPE_LINK, _RTN_UNICAST),
        0,
    )
    body += _attribute(_RTA_DST, socket.inet_aton(peer))
    body += _attribute(_RTA_OIF, struct.pack("i", index))
    body += _attribute(_RTA_METRICS, metrics)
    _ask_kernel(body, f"a route with congestion control {congestion!r}")


def _attribute(kind: int, value: bytes) -> bytes:
    """A netlink attribute, padded to four bytes."""
    return struct.pack("HH", 4 + len(value), kind) + value + b"\0" * (-len(value) % 4)


def _ask_kernel(body: bytes, what: str) -> None:
    """Send a route message; the kernel answers with an error number, 0 where it did it."""
    flags = _NLM_F_REQUEST | _NLM_F_ACK | _NLM_F_REPLACE | _NLM_F_CREATE
    header = struct.pack("IHHII", 16 + len(body), _RTM_NEWROUTE, flags, 1, 0)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as netlink:
        netlink.sendall(header + body)
        answer = netlink.recv(4096)
    kind = struct.unpack_from("H", answer, 4)[0]
    number = -struct.unpack_from("i", answer, 16)[0]
    if kind != _NLMSG_ERROR or number != 0:
        raise OSError(number, f"{what} is refused: {os.strerror(number)}")
