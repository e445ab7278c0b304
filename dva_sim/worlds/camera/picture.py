"""A robot's-eye picture: one ray for each column, and the floor and ceiling row by row."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.camera.floors import HORIZON, OPEN_AIR, Floors
from dva_sim.worlds.camera.room_colours import RoomGrid
from dva_sim.worlds.camera.sprites import Figure, Sprite, choose_sprite
from dva_sim.worlds.camera.surfaces import Floats, Hits, Surfaces
from dva_sim.worlds.camera.textures import TEXELS, Uprights
from dva_sim.worlds.camera.visibility import (
    Rays,
    SmokeView,
    add_firelight,
    add_smoke,
    add_water,
    look_up,
)
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.hazards import Hazard, Raster
from dva_sim.worlds.site import Site

Picture = NDArray[np.uint8]

EYE_HEIGHT = 1.1  # height of the lens above the floor [m]; assumed
FIELD_OF_VIEW = math.radians(70.0)
DUSK = 28.0  # distance over which light falls to a half [m]
GLOWING = 1.7  # brightness of flames relative to paint, seen through some smoke; assumed
CLOSEST = 0.25  # nearer objects are not drawn [m]
LIGHT_REACH = 9.0  # reach of the light of a fire [m]; assumed
MIRROR = 0.85  # share of light that water mirrors at a grazing angle; assumed


class Camera:
    """A camera for all poses on one site: build it once, then ask for pictures.

    The lens is a pinhole with square pixels that looks along the heading, level.

    Args:
        width: Pixels across.
        height: Pixels down.
        field_of_view: Across [rad].
    """

    def __init__(
        self,
        site: Site,
        width: int = 320,
        height: int = 240,
        field_of_view: float = FIELD_OF_VIEW,
    ) -> None:
        self.width = width
        self.height = height
        self.focal_length = width / 2 / math.tan(field_of_view / 2)  # [pixels]
        self._ceiling = site.ceiling
        self._surfaces = Surfaces(site)
        self._rooms = RoomGrid(site)
        self._uprights = Uprights(site, self._surfaces, self._rooms)
        column = np.arange(width, dtype=np.float32) + 0.5 - width / 2
        self._slopes: Floats = (column / self.focal_length).astype(np.float32)
        # How far below the axis each row looks, per metre ahead.
        row = np.arange(height, dtype=np.float32) + 0.5 - height / 2
        self._fall: Floats = (row / self.focal_length).astype(np.float32)
        self._floors = Floors(site, self._rooms, self._fall, EYE_HEIGHT)
        self._open_air = any(room.outdoor for room in site.rooms)
        self._texels_per_metre = TEXELS / site.ceiling

    def picture(
        self,
        pose: Pose,
        figures: Sequence[Figure] = (),
        hazards: Sequence[Hazard] = (),
        smoke: SmokeView | None = None,
        water: Raster | None = None,
        time: float = 0.0,
    ) -> Picture:
        """Return the picture of the camera, `(height, width, 3)`, red, green and blue.

        Args:
            pose: Pose of the lens [m, rad].
            figures: Robots and people around; not the one that carries the camera.
            hazards: Active hazards.
            smoke: Smoke on the site, if any.
            water: Its depth on the floor [m], if there is any.
            time: Lets flames flicker and water ripple [s].
        """
        colours = self._floors.seen(pose, self._slopes)
        depth = np.repeat(self._floors.depth, self.width, axis=1)
        light = _dim(depth)
        if self._open_air:
            np.copyto(light, self._floors.daylight, where=colours >= OPEN_AIR)
        walls, before = self._surfaces.hits(pose, self._slopes)
        self._draw_walls(walls, pose, colours, depth, light)
        self._draw_others(before, pose, colours, depth, light)
        scene = _develop(colours, light)
        rays = self._rays(pose)
        for hazard in hazards:
            if firelight := hazard.light(time):
                self._light_up(scene, depth, rays, hazard.position, firelight)
        if water is not None:
            self._flood(scene, depth, rays, water, walls.depth, time)
        self._add_things(scene, depth, pose, (*hazards, *figures), time)
        if smoke is not None:
            heights = EYE_HEIGHT, self._ceiling
            add_smoke(scene, depth, rays, self._fall, smoke, heights)
        np.clip(scene, 0, 255, out=scene)
        picture = np.empty((self.height, self.width, 3), dtype=np.uint8)
        for channel, plane in enumerate(scene.astype(np.uint8)):
            picture[:, :, channel] = plane
        return picture

    def _rays(self, pose: Pose) -> Rays:
        """Return the directions of the columns."""
        cos = math.cos(pose.heading)
        sin = math.sin(pose.heading)
        slopes = self._slopes
        length = np.sqrt(1 + slopes * slopes)
        return Rays(cos + slopes * sin, sin - slopes * cos, length, (pose.x, pose.y))

    # --- what stands still -------------------------------------------------------------

    def _draw_walls(self, walls: Hits, pose: Pose, *canvases: Any) -> None:
        """Draw the nearest wall of each column over the picture."""
        top, bottom = self._edges(walls)
        first = max(0, math.floor(top.min()))
        last = min(self.height, math.ceil(bottom.max()))
        if first >= last:
            return
        row = np.arange(first, last, dtype=np.float32)[:, None] + 0.5
        inside = (row > top) & (row < bottom)
        texel = self._texels(self._fall[first:last, None] * walls.depth)
        texel += self._first_texels(walls, pose)
        paint = self._uprights.colours.take(texel, mode="clip")
        for canvas, values in zip(canvases, (paint, *self._looks(walls)), strict=True):
            np.copyto(canvas[first:last], values, where=inside)

    def _draw_others(self, hits: Hits, pose: Pose, *canvases: Any) -> None:
        """Draw lintels, frames and solids pixel by pixel, the nearest last."""
        edges = np.clip(np.round(self._edges(hits)), 0, self.height).astype(np.int32)
        count = np.maximum(edges[1] - edges[0], 0)
        which = np.repeat(np.arange(len(count)), count)
        row = np.arange(len(which)) - np.repeat(np.cumsum(count) - count - edges[0], count)
        texel = self._texels(self._fall[row] * hits.depth[which])
        texel += self._first_texels(hits, pose)[which]
        pixel = row * self.width + hits.column[which]
        paint = self._uprights.colours.take(texel, mode="clip")
        depth, light = self._looks(hits)
        for canvas, values in zip(canvases, (paint, depth[which], light[which]), strict=True):
            canvas.reshape(-1)[pixel] = values

    def _edges(self, hits: Hits) -> Floats:
        """Return rows of the upper and lower edge of each hit `(2, n)` [pixels]."""
        heights = np.stack([self._surfaces.high[hits.surface], self._surfaces.low[hits.surface]])
        rows = self.height / 2 + (EYE_HEIGHT - heights) * (self.focal_length / hits.depth)
        return np.asarray(rows, dtype=np.float32)

    def _looks(self, hits: Hits) -> tuple[Floats, Floats]:
        """Return the depth and light of each hit."""
        surfaces = self._surfaces
        # Darker towards the corners of a room, so that they show.
        gap = np.abs(hits.along[:, None] - surfaces.dark_ends[hits.surface]).min(axis=1)
        corners = np.asarray(1.0 - 0.22 * np.exp(gap * -3.5), dtype=np.float32)
        light = surfaces.light[hits.surface] * corners
        return hits.depth, light * _dim(hits.depth)

    def _texels(self, fall: Floats) -> Any:
        """Return the height above the floor, in texels, of a point this far below the lens [m]."""
        texel = ((EYE_HEIGHT - fall) * self._texels_per_metre).astype(np.int32)
        return np.clip(texel, 0, TEXELS - 1, out=texel)

    def _first_texels(self, hits: Hits, pose: Pose) -> Any:
        """Return where the painted column of each hit begins."""
        rays = self._rays(pose)
        x = pose.x + hits.depth * rays.x[hits.column]
        y = pose.y + hits.depth * rays.y[hits.column]
        return self._uprights.texels(hits, (pose.x, pose.y), (x, y)).astype(np.int32)

    # --- what moves, burns and floods --------------------------------------------------

    def _light_up(
        self, scene: Floats, depth: Floats, rays: Rays, fire: tuple[float, float], light: float
    ) -> None:
        """Draw firelight in the room of the fire."""
        x = depth[::2] * rays.x
        y = depth[::2] * rays.y
        x += np.float32(rays.origin[0] - fire[0])
        y += np.float32(rays.origin[1] - fire[1])
        gap2 = x * x
        gap2 += y * y
        if float(gap2.min()) > LIGHT_REACH**2:
            return
        # A wall belongs to the room on this side of it.
        x += np.float32(fire[0]) - np.float32(0.1) * rays.x
        y += np.float32(fire[1]) - np.float32(0.1) * rays.y
        place = np.array([[fire[0]], [fire[1]]], dtype=np.float32)
        lit = self._rooms.at(x, y) == self._rooms.at(*place)
        add_firelight(scene, gap2, lit, light)

    def _flood(
        self, scene: Floats, depth: Floats, rays: Rays, water: Raster, far: Floats, time: float
    ) -> None:
        """Draw wet floors as mirrors."""
        first = self.height // 2
        x = rays.origin[0] + depth[first:] * rays.x
        y = rays.origin[1] + depth[first:] * rays.y
        deep = np.zeros_like(depth)
        deep[first:] = look_up(x, y, water)[0] * (depth[first:] == self._floors.depth[first:])
        base = self.height / 2 + EYE_HEIGHT * self.focal_length / far
        steep = EYE_HEIGHT / np.hypot(self._floors.depth[:, 0], EYE_HEIGHT)
        grazing = np.asarray(MIRROR * (1 - steep) ** 2, dtype=np.float32)
        add_water(scene, deep, base, grazing, time)

    def _add_things(
        self,
        scene: Floats,
        depth: Floats,
        pose: Pose,
        things: Sequence[Figure | Hazard],
        time: float,
    ) -> None:
        """Draw people, robots, flames and bottles, the farthest first."""
        cos = math.cos(pose.heading)
        sin = math.sin(pose.heading)
        gaps = [(x - pose.x, y - pose.y) for x, y in map(_place_of, things)]
        ahead = [dx * cos + dy * sin for dx, dy in gaps]
        for number in sorted(range(len(things)), key=lambda n: -ahead[n]):
            if not CLOSEST < ahead[number] < HORIZON:
                continue
            thing = things[number]
            dx, dy = gaps[number]
            if isinstance(thing, Figure):
                sprite: Sprite | None = choose_sprite(thing, math.atan2(dy, dx))
            else:
                sprite = thing.sprite(time, self._ceiling)
            if sprite is not None:
                self._add_sprite(scene, depth, sprite, ahead[number], dx * sin - dy * cos)

    def _add_sprite(
        self, scene: Floats, depth: Floats, sprite: Sprite, ahead: float, right: float
    ) -> None:
        """Add one picture in the picture, where nothing nearer hides it."""
        scale = self.focal_length / ahead
        left = self.width / 2 + right * scale - sprite.size[0] / 2 * scale
        top = self.height / 2 + (EYE_HEIGHT - sprite.size[1]) * scale
        texels = sprite.cover.shape
        rows, source_rows = _pixels(top, sprite.size[1] * scale, self.height, texels[0])
        columns, source_columns = _pixels(left, sprite.size[0] * scale, self.width, texels[1])
        source = source_rows[:, None] * texels[1] + source_columns
        cover = sprite.cover.take(source)
        cover *= depth[rows, columns] > ahead
        light = np.float32(GLOWING if sprite.glows else 1.0 / (1.0 + ahead / DUSK))
        for plane, colours in zip(scene, sprite.colours, strict=True):
            block = plane[rows, columns]
            paint = colours.take(source)
            paint *= light
            paint -= block
            paint *= cover
            block += paint
        np.copyto(depth[rows, columns], np.float32(ahead), where=cover > 0.5)


def _place_of(thing: Figure | Hazard) -> tuple[float, float]:
    return (thing.x, thing.y) if isinstance(thing, Figure) else thing.position


def _develop(colours: Any, light: Floats) -> Floats:
    """Return the packed colours in their light, as red, green and blue `(3, h, w)`."""
    scene = np.empty((3, *colours.shape), dtype=np.float32)
    channels = colours.astype("<u4", copy=False).view(np.uint8).reshape(*colours.shape, 4)
    for channel, plane in enumerate(scene):
        np.multiply(channels[..., channel], light, out=plane)
    return scene


def _pixels(start: float, size: float, count: int, texels: int) -> tuple[slice, Any]:
    """Return the pixels, of `count`, that a length covers, and the texel that each shows."""
    first = min(count, max(0, round(start)))
    last = max(0, min(count, round(start + size)))
    last = max(first, last)
    source = (np.arange(first, last) + 0.5 - start) * (texels / size)
    return slice(first, last), np.clip(source.astype(np.intp), 0, texels - 1)


def _dim(depth: Floats) -> Floats:
    """Return the light that is left at a depth."""
    return np.asarray(1.0 / (1.0 + depth * (1.0 / DUSK)), dtype=np.float32)
