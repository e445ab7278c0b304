"""Parts that do not change while something is shown, and parts of several lines."""

from typing import Any, Literal, NotRequired, TypeAlias

from typing_extensions import TypedDict

# Number of who it is, place [cm], heading [mrad], speed [mm/s].
Place: TypeAlias = list[int]
Point: TypeAlias = list[float]


class LabelledMoment(TypedDict):
    """Somebody, and when."""

    label: str
    at_ms: int


class LinkShown(TypedDict):
    """Settings of the link; more of a modelled one."""

    kind: Literal["modelled", "real", "attached"]
    processing_s: float | None
    delay_s: NotRequired[float]
    jitter_s: NotRequired[float]
    jitter_wanted_s: NotRequired[float]
    loss: NotRequired[float]
    rate_bps: NotRequired[float | None]
    trace: NotRequired[str | None]
    rate_trace: NotRequired[str | None]


class OrderShown(TypedDict):
    """An order for an operator."""

    event: int
    kind: str
    robot: int | None
    x_m: float
    y_m: float
    room: str | None


class RoomShown(TypedDict):
    """A room of a site."""

    name: str
    polygon_m: list[Point]
    holes_m: list[list[Point]]
    floor: str
    outdoor: bool
    place_m: Point | None


class RasterShown(TypedDict):
    """A grid whose row 0 lies to the south; its cells as base64."""

    cell_m: float
    x0_m: float
    y0_m: float
    columns: int
    rows: int
    cells: str
    heading_rad: NotRequired[float]


class RegionPlanShown(TypedDict):
    """A region of a site: its borders within that, and its corner in the north-west."""

    name: str
    borders_m: list[list[Point]]
    place_m: Point


class OriginShown(TypedDict):
    """Geographic origin of a site."""

    latitude_deg: float
    longitude_deg: float


class SiteShown(TypedDict):
    """The plan of a site."""

    name: str
    extent_m: Point
    origin: OriginShown
    features: dict[str, Any]
    rooms: list[RoomShown]
    walls_m: list[Point]
    solids_m: list[list[Point]]
    doors_m: list[Point]
    exits_m: list[Point]
    regions: list[RegionPlanShown]
    raster: NotRequired[RasterShown]


class CameraShown(TypedDict):
    """A robot's camera."""

    field_of_view_deg: float
    range_m: float
    rate_hz: float
    frame_bytes: int


class ThingBody(TypedDict, total=False):
    """More of those with a place; `person`: a guard whom somebody may play."""

    radius_m: float
    max_speed_mps: float
    max_turn_rate_radps: float
    camera: CameraShown
    person: bool
    wheel_radius_m: float
    corners_m: list[Point]
    steering: str
    sensors: list[str]


class ThingShown(ThingBody):
    """Somebody, with the number that other lines use."""

    i: int
    id: str
    label: str
    kind: str


class PatternShown(TypedDict):
    """A messaging pattern that may be chosen."""

    name: str
    title: str
    label: str
    when_slow: str
    answered: bool


class LegendEntry(TypedDict):
    """A colour or mark of a map."""

    kind: str
    colour: str
    mode: NotRequired[str]
    title: NotRequired[str]
    mark: NotRequired[str]
    field: NotRequired[bool]


class PhoneLimits(TypedDict):
    """Between which numbers a calibration lies."""

    step_mps2: Point
    max_delay_s: Point


class PhoneOffer(TypedDict):
    """Choices of a phone."""

    pipelines: dict[str, dict[str, Any]]
    pipeline: str
    filters: list[str]
    mappings: list[str]
    speed_step_mps2: float
    turn_step_mps2: float
    max_delay_s: float
    limits: PhoneLimits


class Happened(TypedDict):
    """Something that happened."""

    t: int
    who: str
    what: str
    kind: str


class ReplayAbout(TypedDict):
    """A recording that is played."""

    name: str
    duration_ms: int
    whole: bool
    marks: list[Happened]
    audit: bool


class SceneShown(TypedDict):
    """Scene, which does not change while something is shown; `begins_at` is the first page."""

    scenario: str
    title: str
    seed: int | None
    site: SiteShown
    things: list[ThingShown]
    patterns: list[PatternShown]
    link_limits: dict[str, Point]
    pace_limits: Point
    watchdog_s: float | None
    stale_s: float | None
    lag_limit_s: float
    rules: dict[str, str]
    legend: list[LegendEntry]
    link: LinkShown
    attached: NotRequired[bool]
    dva_address: NotRequired[str]
    begins_at: NotRequired[str]
    pages: NotRequired[list[str]]
    phone: NotRequired[PhoneOffer]
    replay: NotRequired[ReplayAbout]


class SceneLine(SceneShown):
    """The first line."""

    k: Literal["scene"]
    t: int


class EmptySceneLine(TypedDict):
    """The first line of a player to which no recording was given yet."""

    k: Literal["scene"]
    t: int
    things: list[ThingShown]
    replay: None
    shelf: bool
