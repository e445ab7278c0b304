"""Profile of a scripted dispatcher: its reaction times, and when it overrules the policy."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from dva_sim.agents.population import Trait
from dva_sim.kernel.assumed import Assumed
from dva_sim.kernel.config import Config, Key
from dva_sim.protocol.event_kinds import EventKind

RoleName = Literal["look", "drive", "dispatch", "supervise"]
Share = Annotated[float, Field(ge=0, le=1)]


class Overrule(Config):
    """Condition under which a person overrules the policy; omitted keys match anything.

    Attributes:
        kind: Kind of the event.
        severity_from: Lowest reported severity of the event, 0 to 1.
        confidence_below: Upper bound of the confidence that the event is real, 0 to 1.
        advised: Kind of responder advised by the policy: a `robot` or a `guard`.
        sends: The earliest there of this kind instead, if any can go; `nobody`: it is a false
            alarm; `others`: it is escalated.
        share: Share of such cases in which the person overrules.
    """

    kind: EventKind | None = None
    severity_from: Share = 0.0
    confidence_below: Share | None = None
    advised: Literal["robot", "guard"] | None = None
    sends: Literal["robot", "guard", "nobody", "others"]
    share: Share = 1.0


class DispatcherProfile(Config):
    """A person at a control room who acknowledges events and decides on them, one at a time.

    Attributes:
        role: Role: `look`, `drive`, `dispatch` or `supervise`.
        acknowledge_s: Time from turning to an event until acknowledging it.
        decide_s: Time from then, or from the DVA's question, until the decision.
        overrules: Conditions for overruling the policy: the first that holds counts.
    """

    role: RoleName = "dispatch"
    acknowledge_s: Annotated[
        Trait,
        Key(inner={"median": Key("time to acknowledge")}),
        Assumed(3.0, 30.0, "of the order of what call-takers need"),
    ] = Trait(median=8.0, spread=0.5)
    decide_s: Annotated[
        Trait,
        Key(inner={"median": Key("time to decide")}),
        Assumed(5.0, 60.0, "of the order of what call-takers need"),
    ] = Trait(median=12.0, spread=0.5)
    overrules: tuple[Overrule, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _spreads_stay(cls, data: Any) -> Any:
        """Return the usual spread around a median that is given alone."""
        if not isinstance(data, dict):
            return data
        usual = {name: cls.model_fields[name].default for name in ("acknowledge_s", "decide_s")}
        alone = {
            name: {"spread": trait.spread, **data[name]}
            for name, trait in usual.items()
            if isinstance(data.get(name), dict)
        }
        return {**data, **alone}
