"""Phones and guards of the fake world: they answer as the real ones do, roughly."""

from __future__ import annotations

import time
from typing import Any

DVA_ADDRESS = "127.0.0.1:5600"
OFFER = {
    "pipelines": {"default": {"filter": "median5"}, "dissertation": {"filter": "median20-copy"}},
    "filters": ["median5", "median20-copy", "one-pole"],
    "mappings": ["absolute", "differential", "leaky", "slew"],
    "speed_step_mps2": 0.35,
    "turn_step_mps2": 0.12,
    "max_delay_s": 0.5,
    "limits": {"step_mps2": [0.001, 100.0], "max_delay_s": [0.02, 5.0]},
}
FAST_DEG = 30.0


class FakePhone:
    """Identity and calibration of a phone."""

    def __init__(self, number: int, label: str, kind: str, registered: bool = True) -> None:
        self.registered = registered
        self.id, self.label, self.kind = f"02:00:00:03:00:{number:02X}", label, kind
        self.address = f"127.0.0.1:{5700 + number}"
        self.device: str | None = None
        self.level: str | None = None
        self.calibration: dict[str, Any] | None = None
        self.reading, self.samples, self.lost, self.next = [0.0, 0.0], 0, 0, 0
        self.heard: list[float] = []

    def read(self, asked: dict[str, Any]) -> tuple[float, float]:
        """Speed and turn as shares of their limits, of the newest sample."""
        self.lost += max(0, asked["n"] - self.next) if self.samples else 0
        self.next = asked["n"] + len(asked["at"])
        self.samples += len(asked["at"])
        self.heard = (self.heard + asked["at"])[-60:]
        about = self.calibration or OFFER
        x0, y0, _ = (self.calibration or {}).get("reference_mps2") or (0.0, 0.0, 0.0)
        x, y, _ = asked["xyz"][-1]
        self.reading = [(y0 - y) / about["speed_step_mps2"], (x - x0) / about["turn_step_mps2"]]
        level, turn = self.reading
        return max(0.0, min(1.0, level / 10)), max(-1.0, min(1.0, turn / FAST_DEG))

    def line(self, command: tuple[float, float]) -> dict[str, Any]:
        """Its part of the line `seat`."""
        span = self.heard[-1] - self.heard[0] if len(self.heard) > 1 else 0.0
        about = self.calibration or {"pipeline": "default", "filter": None, "mapping": "absolute"}
        return {
            "id": self.id,
            "label": self.label,
            "address": self.address,
            "registered": self.registered,
            "device": self.device,
            "level": self.level,
            "calibrated": self.calibration is not None,
            **{key: about[key] for key in ("pipeline", "filter", "mapping")},
            "radius_deg": int(command[1] * 57.29578),
            "speed_mps": command[0],
            "reading": self.reading,
            "sensor_hz": 1000 * (len(self.heard) - 1) / span if span else None,
            "samples": self.samples,
            "samples_lost": self.lost,
            "attempts": 0,
        }


class FakePhones:
    """Requests of phones and guards in the fake world; `FakeWorld` has the rest."""

    def do_phone_register(self: Any, asked: dict[str, Any]) -> str:
        address = f"{asked['server']}:{asked['port']}"
        if address != DVA_ADDRESS:
            raise ValueError(f"no answer from {address} after 3 attempts")
        seat = self.own_seat(asked["client"])
        self.phones += 1
        seat.phone = FakePhone(self.phones, asked["label"], asked["type"])
        seat.phase = "held" if seat.robots else "free"
        self.tell(seat)
        about = seat.phone
        self.more = {"phone": {"id": about.id, "label": about.label, "address": about.address}}
        return f"{about.label} is registered"

    def do_phone_devices(self: Any, asked: dict[str, Any]) -> str:
        self.more = {
            "devices": [
                {
                    "id": self.scene.id_of(walker),
                    "label": walker.label,
                    "type": "Robot" if walker.kind == "robot" else "Guard",
                    "address": f"127.0.0.1:{5601 + walker.index}",
                }
                for walker in reversed(self.scene.all)
                if walker.kind != "bystander"
            ]
        }
        return "listed"

    def do_phone_permission(self: Any, asked: dict[str, Any]) -> str:
        seat = self.own_seat(asked["client"])
        if seat.phone.kind == "Robot":
            raise ValueError("NOT_PERMITTED: a Robot may not drive")
        ids = {self.scene.id_of(walker): walker for walker in self.scene.robots}
        robot = ids.get(asked["device"])
        if robot is None:
            raise ValueError("NOT_PERMITTED: only robots are driven")
        for other in self.seats.values():
            if other is not seat and robot in other.robots:
                who = other.phone.label if other.phone else other.name
                raise ValueError(f"BUSY: {robot.label} is held by {who}")
        seat.robots, seat.phase, seat.alert = [robot], "held", ""
        seat.phone.device, seat.phone.level = asked["device"], asked["level"]
        robot.wanted = (0.0, 0.0)
        self.tell(seat)
        return f"{robot.label} is yours"

    def do_phone_calibrate(self: Any, asked: dict[str, Any]) -> str:
        seat = self.own_seat(asked["client"])
        seat.phone = seat.phone or FakePhone(0, "", "", registered=False)
        seat.phone.calibration = asked
        self.tell(seat)
        return "counts from the next drive on"

    def do_samples(self: Any, asked: dict[str, Any]) -> None:
        seat = self.own_seat(asked["client"])
        seat.heard = time.monotonic()
        seat.phone = seat.phone or FakePhone(0, "", "", registered=False)
        speed, turn = seat.phone.read(asked)
        if seat.phase == "driving":
            seat.wanted = (speed * 0.5, turn * 0.5236) if asked["hand"] else (0.0, 0.0)
            due = time.monotonic() + self.link["delay_s"]
            seat.late.append((due, asked["n"], *seat.wanted))

    # --- guards --------------------------------------------------------------------------

    def do_guard_join(self: Any, asked: dict[str, Any]) -> str:
        if any(guard["label"] == asked["guard"] for guard in self.guards.values()):
            raise ValueError(f"{asked['guard']} is taken")
        walker = next(w for w in self.scene.people if w.label == asked["guard"])
        x, y = self.scene.spots()[1]
        x, y = round(x, 2), round(y, 2)
        way = [[walker.x, walker.y], [walker.x, y], [x, y]]
        order = {"event": 2, "kind": "gas_leak", "task": "confirm", "x_m": x, "y_m": y}
        order |= {"room": "somewhere", "distance_m": 41.7, "way_m": way, "answered": False}
        self.guards[asked["client"]] = {
            "guard": walker.index,
            "label": walker.label,
            "doing": "waits",
            "order": order,
            "alert": "",
        }
        self.tell_guard(asked["client"])
        return f"you are {walker.label}"

    def do_guard_leave(self: Any, asked: dict[str, Any]) -> None:
        self.guards.pop(asked["client"], None)
        nobody = {"guard": None, "label": "", "doing": "", "order": None, "alert": ""}
        self.say({"k": "guard", "seat": asked["client"], **nobody})

    def do_guard_answer(self: Any, asked: dict[str, Any]) -> str:
        guard = self.guards[asked["client"]]
        if asked["accept"]:
            guard["order"]["answered"], guard["doing"] = True, "goes there"
        else:
            guard["order"], guard["doing"] = None, f"declined: {asked['reason']}"
        self.tell_guard(asked["client"])
        return "reported"

    def do_guard_say(self: Any, asked: dict[str, Any]) -> str:
        guard = self.guards[asked["client"]]
        guard["doing"] = asked["what"]
        if asked["what"] in ("refuted", "contained"):
            guard["order"] = None
        self.tell_guard(asked["client"])
        return "reported"

    def do_guard_place(self: Any, asked: dict[str, Any]) -> str:
        walker = self.scene.all[self.guards[asked["client"]]["guard"]]
        walker.x, walker.y = asked["x_m"], asked["y_m"]
        return "reported"

    def do_guard_report(self: Any, asked: dict[str, Any]) -> str:
        return f"{asked['kind']} reported"

    def tell_guard(self: Any, client: str) -> None:
        self.say({"k": "guard", "seat": client, **self.guards[client]})
