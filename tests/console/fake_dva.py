"""An invented DVA: a log with good, refused and hostile requests, and a table of devices."""

from __future__ import annotations

from typing import Any

from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode

DVA, PHONE, ROBOT = "02:00:00:00:00:01", "02:00:00:06:00:01", "02:00:00:01:00:01"
HOSTILE = "<img src=x onerror=alert(1)>"
REQUESTS = (
    m.Registration(HOSTILE, "TeleOp", "192.168.6.2:5600"),
    m.GetDeviceList(),
    m.PermissionRequest(ROBOT, "teleoperation"),
)


class FakeDva:
    """Content of the pages Main and Devices."""

    def __init__(self) -> None:
        self.listens, self.port, self.count = True, 5555, 0
        self.fakes: list[dict[str, Any]] = []

    def server(self) -> dict[str, Any]:
        """Line about the DVA's server, as from `DvaPort.line`."""
        address = f"192.168.0.2:{self.port}"
        return {"listens": self.listens, "address": address, "port": self.port, "modelled": True}

    def log(self, now_ms: int, number: int) -> dict[str, Any]:
        """So many requests more, every third refused and every tenth no message at all."""
        lines = []
        for _ in range(number):
            self.count += 1
            body, code = REQUESTS[self.count % 3 - 1], m.BUSY if self.count % 3 == 0 else m.OK
            data = encode(m.Message(DVA, self.count, PHONE, "12:00:00", 0, body))
            if self.count % 10 == 0:
                data, code = data.replace(b"<MessageID>", b"<MessageID>x"), m.BAD_MESSAGE
            reply = m.Reply(self.count, code, "held by ana" if code == m.BUSY else "")
            answer = encode(m.Message(PHONE, self.count, DVA, "12:00:00", 0, reply))
            text = data.decode("latin-1"), answer.decode("latin-1")
            lines.append([self.count, now_ms, *text, 250, 0])
        return {"k": "log", "log": "dva", "lines": lines}

    def devices(self, robots: list[Any]) -> dict[str, Any]:
        """Rows of the table of devices, as from `DeviceRows`."""
        rows = [self.row(robot.label, ROBOT[:-2] + f"{n:02X}") for n, robot in enumerate(robots)]
        rows[0] |= {"holder": PHONE, "holder_label": HOSTILE, "level": "both", "ends_s": 90.0}
        return {"k": "devices", "devices": rows + self.fakes}

    @staticmethod
    def row(label: str, id_tag: str, **more: Any) -> dict[str, Any]:
        """One device."""
        row = {"id": id_tag, "label": label, "type": "Robot", "address": "192.168.1.2"}
        row |= {"doing": "Idle", "heard_s": 0.5, "silent": False, "beats_hz": 0.5, "link": "good"}
        row |= {"fake": False, "round_trip_s": 0.012, "commands_hz": 0.0, "refused": 0}
        nobody = dict.fromkeys(("picture_age_s", "holder", "holder_label", "level", "ends_s"))
        return row | nobody | more
