"""Occupancy grids: read from ROS maps, and measured for clearance."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.read_once import read_once
from dva_sim.kernel.suggestions import guess
from dva_sim.kernel.yaml_files import Document, beside, load_yaml, with_named_files
from dva_sim.worlds.geo import Pose

FREE = 0
OCCUPIED = 100
UNKNOWN = 255

# What map_saver writes for "never seen" in a trinary map.
UNKNOWN_SHADE = 205
NEAR_SHADE = 10  # difference of shades that may be one and the same
CHANCE_SHARE = 0.01  # share of a map's cells that may have a shade by chance
JPEG_BLUR = 12.0  # maximum error of shades in a JPEG: half a step to white
USUAL_CELLS = 0.005, 1.0  # usual range of cell sizes of a map [m]
MAX_CELLS = 40e6  # maximum cells of a grid: planning on it takes some gigabytes
MAX_PIECES = 300_000  # maximum straight pieces of walls; a scanned hall has some thousands
LARGEST = 5e3  # side of a map [m]
FARTHEST = 1e7  # maximum distance of a map from its origin; UTM coordinates are below [m]


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """State of each cell of a floor: free, occupied or unknown.

    Attributes:
        resolution: Side of a cell [m].
        origin: Pose of the lower left corner of cell (0, 0).
        cells: `FREE`, `OCCUPIED` or `UNKNOWN`, shape `(rows, columns)`; row 0 is the
            lowest in y, unlike in an image.
    """

    resolution: float
    origin: Pose
    cells: NDArray[np.uint8]

    def to_cell(self, x: float, y: float) -> tuple[int, int]:
        """Return the row and column of a point [m]; may lie outside of the grid."""
        dx = x - self.origin.x
        dy = y - self.origin.y
        cos = math.cos(self.origin.heading)
        sin = math.sin(self.origin.heading)
        column = (cos * dx + sin * dy) / self.resolution
        row = (cos * dy - sin * dx) / self.resolution
        return math.floor(row), math.floor(column)

    def to_xy(self, rows: Any, columns: Any) -> NDArray[np.float64]:
        """Return points `(n, 2)` [m] at fractional cell coordinates; a cell's middle is at +0.5."""
        u = np.asarray(columns, float) * self.resolution
        v = np.asarray(rows, float) * self.resolution
        cos = np.cos(self.origin.heading)
        sin = np.sin(self.origin.heading)
        x = self.origin.x + cos * u - sin * v
        y = self.origin.y + sin * u + cos * v
        return np.stack([x, y], axis=-1)

    def window(self, points: NDArray[np.float64]) -> tuple[slice, slice]:
        """Return rows and columns of the cells around some points `(n, 2)` [m]."""
        cells = np.array([self.to_cell(x, y) for x, y in points.tolist()])
        top, left = cells.min(axis=0)
        bottom, right = cells.max(axis=0) + 1
        return slice(max(0, top), max(0, bottom)), slice(max(0, left), max(0, right))

    def middles(self, window: tuple[slice, slice]) -> NDArray[np.float64]:
        """Return middles `(rows, columns, 2)` [m] of the cells in a window."""
        rows, columns = (
            np.arange(*part.indices(length)) + 0.5
            for part, length in zip(window, self.cells.shape, strict=True)
        )
        return self.to_xy(*np.meshgrid(rows, columns, indexing="ij"))

    def state_at(self, x: float, y: float) -> int:
        """Return `FREE`, `OCCUPIED` or `UNKNOWN`; outside of the grid nothing is known."""
        return int(self.look_up(self.cells, x, y, UNKNOWN))

    def look_up(self, values: NDArray[Any], x: float, y: float, outside: Any) -> Any:
        """Return the value of an array of the grid's shape at a point [m]; else `outside`."""
        row, column = self.to_cell(x, y)
        rows, columns = values.shape
        return values[row, column] if 0 <= row < rows and 0 <= column < columns else outside

    @cached_property
    def clearance(self) -> NDArray[np.float64]:
        """Room around each cell's middle [m]: distance to the nearest cell not known free.

        Outside of the grid counts as not free. Measured to the near edge of that cell,
        exactly so along the axes.
        """
        from scipy.ndimage import distance_transform_edt  # late: start-up

        free = np.pad(self.cells == FREE, 1)
        distance = distance_transform_edt(free)[1:-1, 1:-1] - 0.5
        room: NDArray[np.float64] = np.maximum(distance, 0) * self.resolution
        return room

    def clearance_at(self, x: float, y: float) -> float:
        """Return the room around a point [m], to within a cell; 0 where it is not known free."""
        return float(self.look_up(self.clearance, x, y, 0.0))

    def reachable(self, clearance: float) -> NDArray[np.bool_]:
        """Return the largest connected part of the cells with at least `clearance` [m] of room."""
        from scipy.ndimage import label  # late: start-up

        labels, count = label((self.clearance >= clearance) & (self.cells == FREE))
        if not count:
            return np.zeros(self.cells.shape, bool)
        sizes = np.bincount(labels.ravel())
        sizes[0] = 0
        largest: NDArray[np.bool_] = labels == int(np.argmax(sizes))
        return largest

    def floor(self, clearance: float) -> NDArray[np.bool_]:
        """Return the connected free cells around `reachable`, up to the walls."""
        from scipy.ndimage import label  # late: start-up

        labels, _ = label(self.cells == FREE)
        rows, columns = np.nonzero(self.reachable(clearance))
        if not len(rows):
            return np.zeros(self.cells.shape, bool)
        floor: NDArray[np.bool_] = labels == labels[rows[0], columns[0]]
        return floor


def outline(grid: OccupancyGrid, free: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the border of the cells `free` as few straight segments.

    Scanned walls are ragged by one cell; the segments are true to one cell.

    Args:
        grid: Grid of the cells.
        free: Cells on the inside, shape `(rows, columns)`.

    Returns:
        Segments x1, y1, x2, y2 `(n, 4)` [m].

    Raises:
        ConfigError: the border is as long as that of noise.
    """
    inside = np.pad(free, 1)
    rows, left, right = _runs(inside[1:, 1:-1] != inside[:-1, 1:-1])
    columns, low, high = _runs((inside[1:-1, 1:] != inside[1:-1, :-1]).T)
    pieces = len(rows) + len(columns)
    if pieces > MAX_PIECES:
        raise ConfigError(
            f"has walls of {pieces:,} straight pieces, like noise; at most {MAX_PIECES:,} are read"
        )
    starts = grid.to_xy(np.r_[rows, low], np.r_[left, columns])
    ends = grid.to_xy(np.r_[rows, high], np.r_[right, columns])
    edges = shapely.multilinestrings(np.round(np.stack([starts, ends], axis=1), 6))
    # Each line alone: together, the time grows with the square of their number.
    lines = shapely.get_parts(shapely.line_merge(edges))
    return segments(shapely.simplify(lines, 1.001 * grid.resolution))


def segments(geometry: Any) -> NDArray[np.float64]:
    """Return all straight pieces of shapely lines or of the rings of polygons, `(n, 4)` [m]."""
    polygons = shapely.get_parts(geometry)
    areas = shapely.get_type_id(polygons) == shapely.GeometryType.POLYGON
    lines = shapely.get_parts(np.where(areas, shapely.boundary(polygons), polygons))
    points, owner = shapely.get_coordinates(lines, return_index=True)
    joined = owner[1:] == owner[:-1]
    return np.hstack([points[:-1][joined], points[1:][joined]])


def side(a: NDArray[np.float64], b: NDArray[np.float64]) -> frozenset[tuple[float, ...]]:
    """Return a segment in either direction, to the millimetre."""
    return frozenset(tuple(np.round(end, 3).tolist()) for end in (a, b))


def _runs(
    marks: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the line, start and end of each run of true values along the rows of `marks`."""
    edges = np.diff(np.pad(marks, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    lines, starts = np.nonzero(edges == 1)
    _, ends = np.nonzero(edges == -1)
    return lines, starts, ends


_YES = "1", "true", "yes", "y", "on"
_NO = "0", "false", "no", "n", "off"


def _as_bool(value: Any) -> Any:
    text = str(value).lower()
    return True if text in _YES else False if text in _NO else value


def _in_small(value: Any) -> Any:
    return value.lower() if isinstance(value, str) else value


Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)]


class RosMap(Config):
    """The YAML file of a ROS map, as map_server reads it; keys of other tools are left alone.

    References:
        http://wiki.ros.org/map_server, section "Map format".
    """

    model_config = ConfigDict(extra="ignore")

    image: str
    resolution: Annotated[float, Field(ge=1e-3, le=5)]
    origin: tuple[Coordinate, Coordinate, Coordinate]
    negate: Annotated[bool, BeforeValidator(_as_bool)] = False
    occupied_thresh: Annotated[float, Field(ge=0, le=1)]
    free_thresh: Annotated[float, Field(ge=0, le=1)]
    mode: Annotated[Literal["trinary", "scale", "raw"], BeforeValidator(_in_small)] = "trinary"

    @property
    def unknown_shade(self) -> int:
        """Shade of cells never seen in a trinary map."""
        return 255 - UNKNOWN_SHADE if self.negate else UNKNOWN_SHADE

    @model_validator(mode="after")
    def _thresholds_in_order(self) -> RosMap:
        if self.free_thresh > self.occupied_thresh:
            raise ValueError(
                f"free_thresh {self.free_thresh:g} is above occupied_thresh "
                f"{self.occupied_thresh:g}"
            )
        return self


def load_ros_map(path: str | Path) -> OccupancyGrid:
    """Read a map in ROS map_server form (YAML beside PGM or PNG).

    Occupied is above `occupied_thresh`, free below `free_thresh`, all else unknown. The
    shade 205 of a trinary map, 50 if it is negated, is unknown whatever the thresholds:
    map_saver writes it for cells never seen, and with a `free_thresh` above 0.196 they would
    pass for free. An image that is not at its path is looked for beside the YAML file.

    Raises:
        ConfigError: a missing or unknown key, a bad value, an image that cannot be read.
    """
    document = load_yaml(path)
    config = validate(RosMap, document.data, document.error)
    shades, blur = _read_shades(document, config)
    cells = np.ascontiguousarray(_classify(shades, blur, config)[::-1])
    return OccupancyGrid(config.resolution, Pose(*config.origin), cells)


@read_once(lambda path: with_named_files(resources.find(str(path), "worlds")))
def doubts_of_map(path: str | Path) -> tuple[str, ...]:
    """Describe what in a valid map is probably a mistake, each in a sentence without full stop.

    Raises:
        ConfigError: see `load_ros_map`.
    """
    document = load_yaml(resources.find(str(path), "worlds"))
    config = validate(RosMap, document.data, document.error)
    doubts = []
    for key in document.data.keys() - RosMap.model_fields.keys():
        meant = guess(key, RosMap.model_fields)
        doubts.append(f"key {key!r} is ignored" + (f"; did you mean {meant!r}?" if meant else ""))
    yaw = config.origin[2]
    if abs(yaw) > math.tau:
        doubts.append(
            f"the yaw of its origin, {yaw:g} rad, is {abs(yaw) / math.tau:.1f} turns; "
            f"{yaw:g} degrees would be {math.radians(yaw):.4f}"
        )
    if not USUAL_CELLS[0] <= config.resolution <= USUAL_CELLS[1]:
        doubts.append(f"a cell of {config.resolution:g} m is unusual for a map of robots")
    shades, blur = _read_shades(document, config)
    if blur > 1:
        doubts.append(
            f"{config.image!r} is a JPEG, whose shades are blurred: those within {blur:g} of "
            f"{config.unknown_shade} count as never seen; save it as PGM or PNG"
        )
    is_scale = config.mode == "scale"  # other shades than that of the unknown are measured there
    near = np.abs(shades - config.unknown_shade) <= (0 if is_scale else NEAR_SHADE)
    share = float((near & (_classify(shades, blur, config) == FREE)).mean())
    if share > (CHANCE_SHARE if is_scale else 0):
        doubts.append(
            f"{share:.1%} of its cells have {'the shade' if is_scale else 'a shade near'} "
            f"{config.unknown_shade}, which cells never seen have in trinary maps, and count as "
            f"free (free_thresh {config.free_thresh:g})"
        )
    return tuple(sorted(doubts))


def _read_shades(document: Document, config: RosMap) -> tuple[NDArray[np.float64], float]:
    """Brightness of each pixel, 0 to 255, shape `(rows, columns)`, and by how much it may be off.

    NaN where it is transparent.
    """
    from PIL import Image

    file = document.file.parent / Path(config.image).expanduser()
    if not file.is_file():
        file = beside(document.file, config.image)
    try:
        with Image.open(file) as opened:
            _check_size(opened.size, document, config)
            blur = JPEG_BLUR if opened.format == "JPEG" else 0.0
            if opened.format == "PPM" and _most_shades(file) != 255:
                blur = 1.0  # shades are scaled, and rounded
            colours = "RGBA" if "transparency" in opened.info else "RGB"
            image = opened.convert(colours) if opened.mode == "P" else opened
            scale = 1 / 257 if image.mode.startswith("I") else 255 if image.mode == "1" else 1
            pixels = np.asarray(image, float) * scale
            bands = image.getbands()
    except FileNotFoundError:
        raise document.error(f"image {config.image!r} not found", ("image",)) from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        problem = f"image {config.image!r} cannot be read: {error}"
        raise document.error(problem, ("image",)) from error
    if pixels.ndim == 2:
        return pixels, blur
    if bands[-1] != "A" or config.mode == "trinary":
        # map_server averages all bands of a trinary map, opacity among them.
        return np.asarray(pixels.mean(axis=2)), blur
    return np.where(pixels[..., -1] > 0, pixels[..., :-1].mean(axis=2), np.nan), blur


def _check_size(size: tuple[int, int], document: Document, config: RosMap) -> None:
    """Refuse an image whose map would take gigabytes, or is larger than a building's."""
    columns, rows = size
    if columns * rows > MAX_CELLS:
        problem = (
            f"image {config.image!r} is {columns} by {rows}, at most {MAX_CELLS / 1e6:g} million"
        )
        raise document.error(f"{problem} pixels", ("image",))
    if (side := max(size) * config.resolution) > LARGEST:
        problem = f"cells of {config.resolution:g} m make a map {side:,.0f} m long"
        raise document.error(f"{problem}, at most {LARGEST:,.0f}", ("resolution",))


def _most_shades(file: Path) -> int:
    """Return the greatest shade that the head of a PGM file names."""
    with file.open("rb") as opened:
        head = re.sub(rb"#[^\n]*", b"", opened.read(1024)).split(maxsplit=4)
    return int(head[3]) if head[0] in (b"P2", b"P3", b"P5", b"P6") else 255


def _classify(shades: NDArray[np.float64], blur: float, config: RosMap) -> NDArray[np.uint8]:
    """Occupancy of each pixel; comparisons with NaN are false, so transparent is unknown."""
    if config.mode == "raw":
        percent = np.round(shades)
        occupancy = np.where(percent <= 100, percent / 100, np.nan)
    else:
        # Divided last: 1 - 204 / 255 would fall just below a threshold of 0.2.
        occupancy = (shades if config.negate else 255 - shades) / 255
    cells = np.full(shades.shape, UNKNOWN, np.uint8)
    cells[occupancy > config.occupied_thresh] = OCCUPIED
    cells[occupancy < config.free_thresh] = FREE
    if config.mode == "trinary":
        cells[np.abs(shades - config.unknown_shade) <= blur] = UNKNOWN
    return cells


def cells_inside(
    grid: OccupancyGrid,
    border: NDArray[np.float64],
    window: tuple[slice, slice] = np.s_[:, :],
) -> NDArray[np.bool_]:
    """Return which cells of an unrotated grid have their middle inside a border.

    A middle on the border counts where the area lies east or north of it, so that areas
    side by side share no cell and leave none out.

    Args:
        grid: Grid of the cells.
        border: Segments of closed rings `(n, 4)` [m], holes among them.
        window: Rows and columns to look at.
    """
    ys = grid.middles((window[0], slice(0, 1)))[:, 0, 1]
    xs = grid.middles((slice(0, 1), window[1]))[0, :, 0]
    x1, y1, x2, y2 = border.T
    first = np.searchsorted(ys, np.minimum(y1, y2))
    last = np.searchsorted(ys, np.maximum(y1, y2))
    edge = np.repeat(np.arange(len(border)), last - first)
    row = np.arange(len(edge)) - np.repeat(np.cumsum(last - first) - last, last - first)
    x = x1[edge] + (ys[row] - y1[edge]) * (x2 - x1)[edge] / (y2 - y1)[edge]
    crossings = np.zeros((len(ys), len(xs) + 1), np.int16)
    np.add.at(crossings, (row, np.searchsorted(xs, x)), 1)
    odd: NDArray[np.bool_] = np.cumsum(crossings, axis=1, dtype=np.int16)[:, :-1] % 2 == 1
    return odd


def rasterise(floor: Any, walls: NDArray[np.float64], resolution: float) -> OccupancyGrid:
    """Return the grid of a drawn plan.

    Args:
        floor: Shapely area that people and robots may stand on; all else is unknown.
        walls: Segments `(n, 4)` [m]; cells that they pass through are occupied.
        resolution: Side of a cell [m].
    """
    box = np.array(floor.bounds)
    low = np.floor(box[:2] / resolution) - 1
    columns, rows = (np.ceil(box[2:] / resolution) + 1 - low).astype(int)
    # Half a cell aside, so that walls at round coordinates run through the middle of cells.
    corner = (low - 0.5) * resolution
    grid = OccupancyGrid(
        resolution,
        Pose(float(corner[0]), float(corner[1]), 0.0),
        np.full((rows + 1, columns + 1), UNKNOWN, np.uint8),
    )
    grid.cells[cells_inside(grid, segments(floor))] = FREE
    for x1, y1, x2, y2 in walls:
        steps = int(np.hypot(x2 - x1, y2 - y1) / (resolution / 4)) + 2
        along = np.linspace((x1, y1), (x2, y2), steps)
        column, row = ((along - corner) / resolution).astype(int).T
        inside = (row >= 0) & (row <= rows) & (column >= 0) & (column <= columns)
        grid.cells[row[inside], column[inside]] = OCCUPIED
    return grid
