"""The pages of keys: scenarios, studies and profiles, from the schemas that validate the files."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from dva_sim.kernel.units import unit_of
from dva_sim.testing.files import schema_text
from generators.markdown import code, prose, sentence, table
from generators.markdown import page as page_of

Schema = dict[str, Any]
_MODELS = {
    "Scenario": "Model `full`",
    "TimedScenario": "Model `timed`",
    "TaskScenario": "Model `task`",
    "TransportScenario": "Model `transports`",
    "MiddlewareScenario": "Model `middleware`",
}
_PROFILES = {
    "RobotProfile": "Robots: `agents/robots`",
    "RosProfile": "ROS robots: `agents/ros`",
    "PhoneProfile": "Phones: `agents/phones`",
    "AccelerometerPart": "Accelerometers: `agents/accelerometers`",
    "Population": "Operators: `agents/people`",
    "Bands": "Bands of operators: `agents/people`",
    "GuardProfile": "Guards: `agents/people`",
    "BystanderProfile": "Bystanders: `agents/people`",
}
_BOUNDS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
_PLAIN = {
    "at": "Place, or name of one",
    "at_s": "Time after the start of the run",
    "capacity_wh": "Energy of a full battery [Wh]",
    "count": "Number of them",
    "description": "One line for lists and reports",
    "every_s": "Period with which it repeats; left out: once",
    "field_of_view_deg": "Horizontal angle of view",
    "for_s": "Duration",
    "frame_bytes": "Size of a frame",
    "from_s": "Time at which it begins",
    "heading_deg": "Heading, counter-clockwise from east",
    "height_m": "Extent along y",
    "high": "Upper end",
    "high_s": "Upper end",
    "horizon_s": "Length of the run",
    "kind": "Selects this kind",
    "latitude": "Latitude [deg]",
    "law": "Selects this law",
    "least_s": "Shortest delay",
    "longitude": "Longitude [deg]",
    "low": "Lower end",
    "low_s": "Lower end",
    "map": "ROS map, by path",
    "mass_kg": "Mass [kg]",
    "max_acceleration_mps2": "Greatest acceleration of the motors",
    "max_age_s": "Age limit of a command, by the picture behind it",
    "max_attempts": "Orders given for one event before it is escalated",
    "max_deceleration_mps2": "Greatest deceleration of the brakes",
    "max_speed_mps": "Top speed",
    "max_tilt_deg": "Largest tilt of the phone",
    "max_tilt_speed_deg_s": "Fastest change of the tilt",
    "max_turn_acceleration_rad_s2": "Greatest angular acceleration [rad/s^2]",
    "max_turn_rate_rad_s": "Greatest turn rate",
    "mean_s": "Mean",
    "measure_s": "Time that is measured",
    "median": "Median over persons",
    "motor_time_constant_s": "Time constant of the motors",
    "name": "Name, as it is referred to",
    "phases": "Number of phases",
    "plan": "GeoJSON file of the plan, relative to this file",
    "population": "Population of persons, by name or path",
    "profile": "Profile, by name or path",
    "range_m": "Farthest distance at which something is seen",
    "rate_hz": "Rate",
    "reference_error_mps2": "Standard deviation of the calibrated reference over persons",
    "resolution_m": "Side of a cell of the occupancy grid",
    "rest": "Pause, as a number of seconds or a law",
    "after": "Time until then, as a number of seconds or a law",
    "sample_jitter": "Irregularity of samples, as a share of their period",
    "sd_s": "Standard deviation",
    "shape": "Shape parameter",
    "share": "Share of all cases",
    "speed_step_mps2": "Acceleration for one level of speed",
    "spread": "Standard deviation of the logarithm over persons",
    "squared_cv": "Squared coefficient of variation",
    "task": "The task",
    "transport": "The transport",
    "tremor_deg": "Amplitude of the tremor",
    "tremor_width_hz": "Bandwidth of the tremor",
    "turn_step_mps2": "Acceleration for one degree per second of turn rate",
    "walking_mean_mps": "Mean walking speed",
    "walking_sd_mps": "Standard deviation of the walking speed over persons",
    "warm_up_s": "Time before the measured part",
    "warming_k": "Warming of the accelerometer during a run [K]",
    "watchdog_s": "Time without a valid command after which the robot stops",
    "width_m": "Extent along x",
    "x_m": "Position, east",
    "y_m": "Position, north",
    "ceiling_m": "Height of rooms that do not state theirs",
    "level": "Storey of the plan to read, by the property `level` of its features",
    "correlation_s": "Time constant of the correlation; 0: independent",
}
"""Meanings of keys that their models leave to the name."""
_MANY = 4  # so many laws are named one by one
_BEYOND = 2**53  # bounds of integers that only keep numbers storable


def scenario_page() -> str:
    """Return the page of a scenario's keys, one section for each model and part."""
    head = (
        "A scenario is a YAML file. The key `model` selects the model that runs it; without it "
        "the model is `full`. A dotted key, such as `link.up.delay_s`, names a key within a part: "
        "`--set link.up.delay_s=0.25` changes it, and a study varies it under `factors`. "
        "`dva-sim schema scenario` prints the schema for an editor."
    )
    defs = json.loads(schema_text("scenario"))["$defs"]
    return page_of("Keys of scenarios", head, *Keys("scenario", defs, _MODELS).sections())


def study_page() -> str:
    """Return the page of a study's keys."""
    head = (
        "A study is a YAML file in `experiments/`, or your own. `dva-sim new` writes one to begin "
        "with. `dva-sim schema study` prints the schema for an editor."
    )
    schema = json.loads(schema_text("study"))
    defs = schema["$defs"] | {"Study": schema}
    return page_of("Keys of studies", head, *Keys("study", defs, {"Study": "A study"}).sections())


def profile_page() -> str:
    """Return the page of the keys of sites and of profiles of robots, phones and people."""
    head = (
        "A profile is a YAML file that a scenario names. Copy a shipped one and change it. "
        "`dva-sim schema agent` and `dva-sim schema site` print the schemas."
    )
    agents, site = json.loads(schema_text("agent")), json.loads(schema_text("site"))
    defs = agents["$defs"] | site["$defs"] | {"Site": site}
    tops = _PROFILES | {"Site": "Sites: `worlds`"}
    return page_of("Keys of profiles and sites", head, *Keys("profile", defs, tops).sections())


class Keys:
    """Tables of the keys of some models and of all parts that they refer to.

    Args:
        page: Name of the page, the first word of its anchors.
        defs: Schemas of all models, by name.
        tops: Models that come first, with their titles.
    """

    def __init__(self, page: str, defs: dict[str, Schema], tops: dict[str, str]) -> None:
        self._page, self._defs, self._titles = page, defs, dict(tops)
        for name in (shown := list(tops)):
            for key, value in defs[name].get("properties", {}).items():
                above = "" if name in tops else f"{self._titles[name].strip('`')}."
                for each in _referred(value):
                    if each not in self._titles and each in defs:
                        self._titles[each] = code(above + key)
                        shown.append(each)

    def sections(self) -> Iterator[str]:
        """Yield the blocks of the page; a part is titled by the key that leads to it first."""
        for name, title in self._titles.items():
            model = self._defs[name]
            if "properties" not in model:
                continue
            yield f"({self._page}-{name.lower()})=\n## {title}{self._kind(name)}"
            yield prose(model.get("description", "").partition("\n\n")[0])
            yield table(
                ["key", "unit", "type", "default", "meaning"],
                (self._row(key, value, model) for key, value in model["properties"].items()),
            )

    def _kind(self, name: str) -> str:
        """Return the name of a model where several parts share a key, such as laws of delay."""
        twins = [each for each, title in self._titles.items() if title == self._titles[name]]
        return f": {name}" if len(twins) > 1 else ""

    def _row(self, key: str, value: Schema, model: Schema) -> list[str]:
        default = "required" if key in model.get("required", ()) else _default(value)
        meaning = sentence(self._meaning(key, value))
        return [code(key), unit_of(key), self.type_of(value), default, meaning]

    def _meaning(self, key: str, value: Schema) -> str:
        """Return what a key says of itself, else what its part is, else what its name means."""
        names = list(_referred(value))
        part = self._defs.get(names[0], {}) if len(names) == 1 else {}
        summary = str(part.get("description", "")).partition("\n\n")[0]
        of_link = self._defs.get("LinkConfig", {}).get("properties", {}).get(key, {})
        return str(
            value.get("description") or summary or _PLAIN.get(key) or of_link.get("description", "")
        )

    def _keys_of(self, value: Schema) -> Schema:
        """Return the keys of the part that a schema refers to."""
        part = self._defs.get(str(value.get("$ref", "")).rpartition("/")[2], {})
        return dict(part.get("properties", {}))

    def type_of(self, value: Schema) -> str:
        """Return the type with its bounds; a part as a link to its table."""
        if "$ref" in value:
            name = value["$ref"].rpartition("/")[2]
            if "properties" not in self._defs[name]:
                return self.type_of(self._defs[name])
            return f"[{name}](#{self._page}-{name.lower()})"
        if "enum" in value:
            return ", ".join(code(each) for each in value["enum"])
        if "const" in value:
            return code(value["const"])
        if options := value.get("anyOf") or value.get("oneOf") or value.get("allOf"):
            options = [each for each in options if each.get("type") != "null"]
            laws = [each for each in options if "law" in self._keys_of(each)]
            if len(laws) > _MANY:
                rest = [self.type_of(each) for each in options if each not in laws]
                first = laws[0]["$ref"].rpartition("/")[2].lower()
                return " or ".join([*rest, f"a [law](#{self._page}-{first})"])
            kinds = [self.type_of(each) for each in options]
            return " or ".join(dict.fromkeys(kind for kind in kinds if kind))
        kind = value.get("type", "")
        if kind == "array":
            items: Schema = value.get("items") or next(iter(value.get("prefixItems", [])), {})
            return f"list of {self.type_of(items)}" if items else "list"
        if kind == "object":
            inner = value.get("additionalProperties")
            return f"map to {self.type_of(inner)}" if isinstance(inner, dict) and inner else "map"
        return " ".join([kind, _bounds(value)]).strip()


def _default(value: Schema) -> str:
    if value.get("default") in (None, "", [], {}) or isinstance(value["default"], dict):
        return ""
    return code(json.dumps(value["default"], ensure_ascii=False))


def _bounds(value: Schema) -> str:
    bounds = [
        f"{sign} {value[name]:g}".replace("<", "\\<")
        for name, sign in _BOUNDS.items()
        if name in value and abs(value[name]) < _BEYOND
    ]
    return ", ".join(bounds)


def _referred(value: Any) -> Iterator[str]:
    """Yield the names of all models that a schema refers to."""
    if isinstance(value, dict):
        if isinstance(value.get("$ref"), str):
            yield value["$ref"].rpartition("/")[2]
        for each in value.values():
            yield from _referred(each)
    elif isinstance(value, list):
        for each in value:
            yield from _referred(each)
