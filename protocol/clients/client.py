"""Operator that uses nothing but ZeroMQ: registers, drives the first robot for two seconds, stops.

Run it with the address of the DVA, and with a folder of keys if the DVA has keys:
`python client.py 127.0.0.1:5600 keys`.
"""

import re
import sys
import time
from pathlib import Path

import zmq

ME, DVA, sent = "56:2B:04:E4:56:D8", "02:00:00:00:00:01", 0


def field(name, xml):
    """Return the text of the first element of that name."""
    return re.search(f"<{name}>(.*?)</{name}>", xml)[1]


def key(file, name):
    """Return a key from a certificate of ZeroMQ."""
    certificate = Path(file).read_text(encoding="utf-8")
    return re.search(f'{name} = "(.*?)"', certificate)[1].encode()


def lock(socket, folder, server):
    """Give a socket the keys of this device and of the server to which it will connect."""
    mine = f"{folder}/secret/{ME.replace(':', '-')}.key_secret"
    socket.curve_publickey = key(mine, "public-key")
    socket.curve_secretkey = key(mine, "secret-key")
    socket.curve_serverkey = key(f"{folder}/public/{server.replace(':', '-')}.key", "public-key")


def message(to, content, session=0, kind="SimpleMsg"):
    """Return a message; decimals of the time make two starts of this program differ."""
    global sent
    sent, clock = sent + 1, time.strftime("%H:%M:%S") + f"{time.time() % 1:.6f}"[1:]
    of_session = "" if kind == "HBMsg" else f"<SessionID>{session}</SessionID>"
    return (
        f"<msg><{kind}><DestinationID>{to}</DestinationID><MessageID>{sent}</MessageID>"
        f"<SourceID>{ME}</SourceID><Timestamp>{clock}</Timestamp>{of_session}{content}</{kind}></msg>"
    )


def ask(socket, to, content, session=0, kind="SimpleMsg"):
    """Send a request and return the reply."""
    socket.send_string(message(to, content, session, kind))
    return socket.recv_string()


def register(socket, label, kind, address="127.0.0.1"):
    """Register with the DVA and return its reply."""
    named = f"<DeviceLabel>{label}</DeviceLabel><DeviceType>{kind}</DeviceType>"
    return ask(socket, DVA, f"{named}<IpAddr>{address}</IpAddr>", kind="RegMsg")


def registered(socket, kind):
    """Return the ids of all devices of a type."""
    devices = ask(socket, DVA, "<Access><GetDeviceList/></Access>").split("<Device>")[1:]
    return [field("IdTag", device) for device in devices if field("DeviceType", device) == kind]


def tele_op(socket, robot, content, session):
    """Send a command of a drive and return the code of the reply."""
    return field("Code", ask(socket, robot, f"<TeleOp>{content}</TeleOp>", session))


if __name__ == "__main__":
    dva, robot = (zmq.Context.instance().socket(zmq.REQ) for _ in range(2))
    for folder in sys.argv[2:]:
        lock(dva, folder, DVA)
    dva.connect(f"tcp://{sys.argv[1]}")
    register(dva, "client", "TeleOp")
    while not (robots := registered(dva, "Robot")):
        time.sleep(0.5)
    it = robots[0]
    wish = f"<DeviceID>{it}</DeviceID><Level>teleoperation</Level>"
    wish = f"<Access><PermissionRequest>{wish}</PermissionRequest></Access>"
    permission = ask(dva, DVA, wish)
    session = field("Session", permission)
    for folder in sys.argv[2:]:
        lock(robot, folder, it)
    robot.connect(f"tcp://{field('IpAddr', permission)}")
    while tele_op(robot, it, "<StartTeleOp/>", session) != "0":
        time.sleep(0.5)
    drive = "<SetTeleOp><Speed>0.3</Speed><TurnRate>0.2</TurnRate></SetTeleOp>"
    for _ in range(20):
        code = tele_op(robot, it, drive, session)
        time.sleep(0.1)
    tele_op(robot, it, "<StopTeleOp/>", session)
    print("the last command was answered with code", code)
