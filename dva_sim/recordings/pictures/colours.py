"""Colours of people, robots and hazards on a picture from above; without drawing."""

from __future__ import annotations

ROBOT = "robot"
GUARD = "guard"
BYSTANDER = "bystander"

# What somebody is doing; what is not listed has the colour of its kind.
ROBOT_MODES = {"Idle": "#8b95a1", "Mission": "#2f7fd0", "Teleoperation": "#7d2fb8"}
ACTIVITIES = {
    "waiting": "#9cc49e",
    "getting ready": "#6fae74",
    "walking": "#2f7d32",
    "looking": "#c9a400",
    "containing": "#c2571a",
    "standing by": "#6b8f71",
    "withdrawing": "#e08a4a",
    "hurt": "#a03030",
    "working": "#b7aa9c",
    "alarmed": "#e3b100",
    "evacuating": "#d9641e",
    "incapacitated": "#1c1c1c",
}
KINDS = {ROBOT: "#2f7fd0", GUARD: "#2f7d32", BYSTANDER: "#8c6d5a"}

FIRE = "#d1332e"  # over the floor, as the next three
GAS = "#b59a00"
WATER = "#2a7fb8"
SMOKE = "#55585e"
