"""The background, the ice, and the robot's shadow and reflection on it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter

from .raster import LIGHT, Array, Solid, paint
from .view import TO_BOTTOM, TO_RIGHT, View

# Colours from 0 to 255: the wall from top to bottom; the ice from far to near.
_WALL = (np.array([214, 225, 236]), np.array([240, 245, 249]))
_ICE = (np.array([228, 239, 246]), np.array([172, 205, 228]))
_BOARD, _RAIL, _KICK = (np.array(c) for c in ((250, 252, 253), (86, 160, 210), (236, 214, 140)))
_LINE, _DUSK = np.array([92, 140, 178]), np.array([38, 72, 108])
# Distance of the boards behind the robot's plane, and heights of their edges above the ice [m].
_BEHIND, _BOARDS, _RAIL_EDGE, _KICK_EDGE = 2.4, 0.62, 0.59, 0.07
# Lines across the ice at every metre: half their width [m], and opacity.
_HALF_LINE, _CLEAR = 0.010, 0.5
# Distances of the ruler and its numbers in front of the robot's plane, length of its ticks [m].
_RULER, _TICK, NUMBERS = 0.55, 0.10, 0.93
# Entries per metre of the lookup table of the lines: 16-bit indices wrap around.
_FINE = 1 << 16
# Maximum height of reflected parts of the robot [m], and reflectance.
_MIRRORED, _MIRROR = 0.9, 0.36
# The shadow: reduction of its resolution, and opacity.
_COARSE, _SHADE = 2, 0.26


class Rink:
    """The background of the robot for pictures of one size."""

    def __init__(self, view: View) -> None:
        still = _still(view)
        self._horizon = min(max(round(_ice_edge(view)), 0), view.height)
        self._above = np.rint(still).astype(np.uint8)
        self._ice = still[self._horizon :]
        rows, columns = np.mgrid[self._horizon : view.height, : view.width] + 0.5
        # Position on the ice of each pixel [m], with the camera at y = 0.
        x = (rows - view.row) / (TO_BOTTOM * view.scale)
        y = (columns - view.column) / view.scale - TO_RIGHT * x
        self._place = np.rint((y % 1.0) * _FINE).astype(np.int64).astype(np.uint16)
        away = np.abs((np.arange(_FINE) / _FINE + 0.5) % 1.0 - 0.5)
        line = np.clip((_HALF_LINE - away) * view.scale + 0.5, 0.0, 1.0)
        self._line = (_CLEAR * line).astype(np.float32)
        # Ten ticks a metre, between two rows of the ice.
        ends = np.array([_RULER, _RULER + _TICK]) * TO_BOTTOM * view.scale + view.row
        self._ruler = slice(*(np.rint(ends).astype(int) - self._horizon))
        away = np.abs((10 * np.arange(_FINE) / _FINE + 0.5) % 1.0 - 0.5) / 10
        tick = np.clip((_HALF_LINE / 2 - away) * view.scale + 0.5, 0.0, 1.0)
        self._ticks = np.maximum(line, 0.8 * tick).astype(np.float32)
        # Distant lines are paler.
        pale = np.clip(0.35 + 0.65 * (x + _BEHIND) / (2 * _BEHIND), 0.0, 1.0)[..., None]
        self._tint = (pale * (_LINE - self._ice)).astype(np.float32)

    def draw(self, solids: list[Solid], view: View) -> NDArray[np.uint8]:
        """Draw boards and ice, with shadow and reflection of a robot (height, width, 3)."""
        camera = np.uint16(round((view.camera % 1.0) * _FINE) % _FINE)
        line = self._line[self._place + camera]
        line[self._ruler] = self._ticks[self._place[self._ruler] + camera]
        line[self._ruler.start : self._ruler.start + 2] = 0.9
        ice = line[..., None] * self._tint
        ice += self._ice
        _add_shadow(ice, self._horizon, solids, view)
        _add_reflection(ice, self._horizon, solids, view)
        picture = self._above.copy()
        picture[self._horizon :] = ice + np.float32(0.5)
        return picture


def _ice_edge(view: View) -> float:
    """Return the row of the ice's far edge [px]."""
    return view.row - view.scale * TO_BOTTOM * _BEHIND


def _still(view: View) -> Array:
    """Return wall, boards and ice (height, width, 3), 0 to 255."""
    rows = np.arange(view.height)[:, None] + 0.5
    foot = _ice_edge(view)
    top = foot - view.scale * _BOARDS
    column = _WALL[0] + np.clip(rows / max(top, 1.0), 0.0, 1.0) * (_WALL[1] - _WALL[0])
    down = np.clip((rows - foot) / (view.height - foot), 0.0, 1.0)
    bands = [
        (top, _RAIL),
        (foot - _RAIL_EDGE * view.scale, _BOARD),
        (foot - _KICK_EDGE * view.scale, _KICK),
        (foot, _ICE[0] + down**0.8 * (_ICE[1] - _ICE[0])),
    ]
    for begin, colour in bands:
        column = column + np.clip(rows - begin + 0.5, 0.0, 1.0) * (colour - column)
    # Reflection of the boards, which decreases with the distance.
    glow = np.where(rows > foot, np.exp(-(rows - foot) / (0.25 * view.scale)), 0.0)
    column += 0.5 * glow * (_BOARD - column)
    return np.repeat(column[:, None, :], view.width, axis=1).astype(np.float32)


def _add_shadow(ice: Array, horizon: int, solids: list[Solid], view: View) -> None:
    """Darken the ice in the shadow of the robot."""
    # The light comes from the upper left and from the viewer's side.
    slope = np.array([-LIGHT[2], -LIGHT[0], -LIGHT[1]]) / LIGHT[1]
    ends = np.array([(solid.start, solid.end) for solid in solids])
    cast = view.pixels(ends + np.maximum(ends[:, :, 2:], 0.0) * slope) / _COARSE
    cast[..., 1] -= horizon / _COARSE
    radii = np.array([solid.radii for solid in solids]) * view.scale / _COARSE
    mask = Image.new("L", (-(-ice.shape[1] // _COARSE), -(-ice.shape[0] // _COARSE)))
    draw = ImageDraw.Draw(mask)
    for line, both in zip(cast.tolist(), radii.tolist(), strict=True):
        draw.line([tuple(end) for end in line], 255, round(sum(both)))
        for end, radius in zip(line, both, strict=True):
            draw.circle(end, radius, 255)
    box = mask.getbbox()
    if box is None:
        return
    soft = 0.018 * view.scale / _COARSE
    low = np.clip(np.array(box[:2]) - int(3 * soft) - 1, 0, None)
    high = np.minimum(np.array(box[2:]) + int(3 * soft) + 1, mask.size)
    part = mask.crop((*low, *high)).filter(ImageFilter.GaussianBlur(soft))
    part = part.resize(tuple(_COARSE * (high - low)), Image.Resampling.BILINEAR)
    left, top = _COARSE * low
    window = ice[top : top + part.height, left : left + part.width]
    share = np.asarray(part, np.float32)[: window.shape[0], : window.shape[1], None]
    window += share * np.float32(_SHADE / 255.0) * (_DUSK.astype(np.float32) - window)


def _add_reflection(ice: Array, horizon: int, solids: list[Solid], view: View) -> None:
    """Add a reflection of the robot's lower parts, which fades with the height."""
    down = np.array([1.0, 1.0, -1.0])
    mirrored = [
        replace(solid, start=solid.start * down, end=solid.end * down)
        for solid in solids
        if min(solid.start[2], solid.end[2]) < _MIRRORED
    ]
    layer = paint(mirrored, view) if mirrored else None
    if layer is None:
        return
    # The part of the layer on the ice.
    top = max(layer.top, horizon)
    planes = layer.planes[:, top - layer.top :]
    window = ice[top - horizon :, layer.left :][: planes.shape[1], : planes.shape[2]]
    deep = (np.arange(top, top + len(window)) + 0.5 - view.row) / view.scale
    share = _MIRROR * np.clip(1.0 - deep / _MIRRORED, 0.0, 1.0).astype(np.float32)[:, None, None]
    colour, cover = np.moveaxis(planes[:3], 0, -1), planes[3][..., None]
    window += share * (np.float32(255.0) * colour - cover * window)
