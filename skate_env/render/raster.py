"""Rasteriser of shaded tapered capsules (spheres swept along a line) on a transparent background.

The distance of a pixel to a solid's outline has a closed form, which gives antialiased edges.
Normals and depths have closed forms as well, for shading and occlusion.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .view import View

Array = NDArray[np.float32]

# Direction of the light: right, up, towards the viewer; a unit vector.
LIGHT = np.array([-0.42, 0.70, 0.58]) / np.linalg.norm([-0.42, 0.70, 0.58])
_AMBIENT, _DIFFUSE, _GLOSS = 0.52, 0.56, 0.16
# Brightness at the outline of a solid.
_RIM = 0.72


@dataclass(frozen=True)
class Solid:
    """A tapered capsule from ``start`` to ``end`` (3,) [m] with the radii there [m]."""

    start: NDArray[np.float64]
    end: NDArray[np.float64]
    radii: tuple[float, float]
    colour: tuple[float, float, float]


@dataclass(frozen=True)
class Layer:
    """Premultiplied red, green and blue, and opacity (4, h, w), 0 to 1, with its corner."""

    planes: Array
    left: int
    top: int


def paint(solids: list[Solid], view: View) -> Layer | None:
    """Paint solids as seen in ``view``; None if they are outside of the picture."""
    ends = np.array([(solid.start, solid.end) for solid in solids])
    radii = np.array([solid.radii for solid in solids]) * view.scale
    centres = view.pixels(ends)
    reach = radii.max(axis=1)[:, None] + 1.0
    size = np.array([view.width, view.height])
    lows = np.clip(np.floor(centres.min(axis=1) - reach), 0, size).astype(int)
    highs = np.clip(np.ceil(centres.max(axis=1) + reach) + 1, 0, size).astype(int)
    low, high = lows.min(axis=0), highs.max(axis=0)
    if (high <= low).any():
        return None
    planes = np.zeros((4, high[1] - low[1], high[0] - low[0]), np.float32)
    nearest = np.full(planes.shape[1:], -np.inf, np.float32)
    depths = (ends[:, :, 0] * view.scale).astype(np.float32)
    # From far to near, so that antialiased edges blend with the solids behind them.
    for i in np.argsort(depths.mean(axis=1), kind="stable"):
        (left, top), (right, bottom) = lows[i] - low, highs[i] - low
        if right > left and bottom > top:
            columns = np.arange(lows[i, 0], highs[i, 0], dtype=np.float32) + np.float32(0.5)
            rows = np.arange(lows[i, 1], highs[i, 1], dtype=np.float32) + np.float32(0.5)
            _blend(
                planes[:, top:bottom, left:right],
                nearest[top:bottom, left:right],
                columns[None, :],
                rows[:, None],
                centres[i],
                depths[i],
                radii[i],
                solids[i].colour,
            )
    return Layer(planes, int(low[0]), int(low[1]))


def _blend(
    planes: Array,
    nearest: Array,
    columns: Array,
    rows: Array,
    centres: NDArray[np.float64],
    depths: Array,
    radii: NDArray[np.float64],
    colour: tuple[float, float, float],
) -> None:
    """Blend one solid into a window of the layer with the given columns and rows."""
    (ax, ay), (bx, by) = centres
    length = float(np.hypot(bx - ax, by - ay))
    first, last = radii
    ux, uy, taper = 1.0, 0.0, 0.0
    if length > abs(first - last) + 1e-3:
        ux, uy, taper = (bx - ax) / length, (by - ay) / length, (first - last) / length
    else:
        # Seen along its axis: the larger sphere hides the other.
        larger = int(last > first)
        (ax, ay), first, length = centres[larger], radii[larger], 0.0
        depths = depths[[larger, larger]]
    f = np.float32
    x, y = columns - f(ax), rows - f(ay)
    across = np.abs(f(uy) * x - f(ux) * y)
    # The sphere with the nearest outline: its position along the axis, and its radius.
    place = f(ux) * x + f(uy) * y
    place -= f(taper / np.sqrt(1.0 - taper**2)) * across
    np.maximum(place, f(0.0), out=place)
    np.minimum(place, f(length), out=place)
    radius = f(first) - f(taper) * place
    dx, dy = x - f(ux) * place, y - f(uy) * place
    distance = dx * dx
    distance += dy * dy
    np.sqrt(distance, out=distance)
    cover = radius - distance
    cover += f(0.5)
    # Components of the normal (right, down, to the viewer): dx, dy and `turned`, over the radius.
    np.minimum(distance, radius, out=distance)
    turned = np.sqrt(radius * radius - distance * distance)
    rise = f((depths[1] - depths[0]) / length) if length else f(0.0)
    depth = rise * place
    depth += turned
    depth += depths[0]
    # Intersecting solids are blended.
    before = depth - nearest
    before *= f(0.5)
    before += f(0.5)
    for share in (cover, before):
        np.maximum(share, f(0.0), out=share)
        np.minimum(share, f(1.0), out=share)
    cover *= before
    np.copyto(nearest, depth, where=cover > f(0.5))
    dx *= f(LIGHT[0])
    dy *= f(-LIGHT[1])
    dx += dy
    dx += f(LIGHT[2]) * turned
    dx /= radius
    lit = np.maximum(dx, f(0.0), out=dx)
    turned /= radius
    shade = np.sqrt(turned, out=turned)
    shade *= f(1.0 - _RIM)
    shade += f(_RIM)
    shade *= f(_AMBIENT) + f(_DIFFUSE) * lit
    shade *= cover
    lit **= 8
    lit *= cover
    lit *= f(_GLOSS)
    planes *= f(1.0) - cover
    for plane, part in zip(planes, colour, strict=False):
        plane += np.minimum(f(part) * shade + lit, cover)
    planes[3] += cover
