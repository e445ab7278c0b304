"""The schemas that files follow: the XSD of messages, JSON Schemas of configurations."""

from __future__ import annotations

import json
import re
from typing import Any, Final

from dva_sim.checking.forms import schema_file
from dva_sim.errors import ConfigError
from dva_sim.guesses import hint

KINDS: Final = ("message", "study", "scenario", "cases", "site", "agent")
_KEYS: Final = "Attributes"  # the section of a model's description that tells its keys
_KEY: Final = re.compile(r"^ {4}(?P<key>\w+): (?P<text>.*(?:\n {5,}.*)*)", re.MULTILINE)
_DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"


def schema_text(kind: str) -> str:
    """The schema of a kind of file.

    Raises:
        ConfigError: no such kind.
    """
    if kind == "message":
        return schema_file().read_text(encoding="utf-8")
    if kind in KINDS:
        schema = {"$schema": _DIALECT} | _json_schema(kind)
        for model in (schema, *schema.get("$defs", {}).values()):
            _describe_keys(model)
        return json.dumps(schema, indent=2) + "\n"
    raise ConfigError(f"no schema {kind!r}; {hint(kind, KINDS, 'there are')}")


def _describe_keys(model: dict[str, Any]) -> None:
    """Give each key what its model's description says of it, so that editors can show it."""
    text, _, rest = model.get("description", "").partition(f"\n\n{_KEYS}:\n")
    if not rest:
        return
    model["description"] = text
    for match in _KEY.finditer(rest.partition("\n\n")[0]):
        if match["key"] in model.get("properties", {}):
            model["properties"][match["key"]]["description"] = " ".join(match["text"].split())


def _json_schema(kind: str) -> dict[str, Any]:
    """From the models that read the files; an agent may be of any of seven kinds."""
    from pydantic import TypeAdapter

    from dva_sim.agents.operator.person import Population
    from dva_sim.agents.people import BystanderProfile, GuardProfile
    from dva_sim.agents.profile import RobotProfile
    from dva_sim.agents.tilt import AccelerometerPart, PhoneProfile
    from dva_sim.experiments.repeats import Bands
    from dva_sim.experiments.study import Study
    from dva_sim.experiments.transports import TransportScenario
    from dva_sim.experiments.validation.dispatch.cases import CaseFile
    from dva_sim.scenario import Scenario
    from dva_sim.tasks import TaskScenario
    from dva_sim.timed.scenario import TimedScenario
    from dva_sim.worlds.site import SiteFile

    kinds: dict[str, Any] = {
        "study": Study,
        "scenario": Scenario | TimedScenario | TaskScenario | TransportScenario,
        "cases": CaseFile,
        "site": SiteFile,
        "agent": RobotProfile
        | PhoneProfile
        | AccelerometerPart
        | GuardProfile
        | BystanderProfile
        | Population
        | Bands,
    }
    return TypeAdapter(kinds[kind]).json_schema()
